//! Scene files, TOML and JSON.

use std::path::Path;

use collided::scene_file::{Format, SceneFile, Source};

use super::build_or_refuse;

/// Reads the bytes, when they are text, as a scene file: JSON when they begin with a brace, which no TOML does. They are refused
/// with a reason that names the file, or give a scene whose numbers of objects and bodies are those of objects and bodies it
/// has.
///
/// # Panics
/// When this does not hold.
pub fn scene_file(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let format = if text.trim_start().starts_with('{') { Format::Json } else { Format::Toml };
    match SceneFile::parse(text, format, Path::new("cell/scene")) {
        Ok(scene) => check(scene),
        Err(error) => assert!(error.to_string().contains("cell/scene"), "{error}"),
    }
}

fn check(scene: SceneFile) {
    let (objects, bodies) = (scene.objects.len(), scene.bodies.len());
    assert!(scene.bodies.iter().all(|body| body.object < objects));
    assert!(scene.interest.iter().all(|rule| rule.a < bodies && rule.b < bodies && rule.a != rule.b));
    assert!(scene.steps.iter().flat_map(|step| &step.poses).all(|pose| pose.body < bodies));
    assert!(scene.steps.iter().flat_map(|step| &step.motions).all(|&(body, _)| body < bodies));
    assert!(scene.dynamics.iter().all(|&(body, _)| body < bodies));
    for object in scene.objects {
        if let Source::Inline(mesh) = object.source {
            build_or_refuse(mesh, None);
        }
    }
}
