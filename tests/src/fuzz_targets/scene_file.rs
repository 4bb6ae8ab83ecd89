//! Scene files, TOML and JSON.

use std::fs;

use collided::scene_file::{SceneFile, Source};

use super::build_or_refuse;
use crate::daemon_process::RuntimeDirectory;

/// Reads the bytes as a scene file: JSON when they begin with a brace, which no TOML does. They are refused with a reason that
/// names the file, or give a scene whose numbers of objects and bodies are those of objects and bodies it has.
///
/// # Panics
/// When this does not hold, or no file can be written.
pub fn scene_file(bytes: &[u8]) {
    let folder = RuntimeDirectory::new();
    let is_json = bytes.trim_ascii_start().starts_with(b"{");
    let path = folder.path().join(if is_json { "scene.json" } else { "scene.toml" });
    fs::write(&path, bytes).expect("a scene file can be written");
    match SceneFile::read(&path) {
        Ok(scene) => check(scene),
        Err(error) => assert!(error.to_string().contains(&*path.to_string_lossy()), "{error}"),
    }
}

fn check(scene: SceneFile) {
    let (objects, bodies) = (scene.objects.len(), scene.bodies.len());
    assert!(scene.bodies.iter().all(|body| body.object < objects));
    assert!(scene.interest.iter().all(|rule| rule.a < bodies && rule.b < bodies && rule.a != rule.b));
    assert!(scene.steps.iter().flatten().all(|pose| pose.body < bodies));
    for object in scene.objects {
        if let Source::Inline(mesh) = object.source {
            build_or_refuse(mesh, None);
        }
    }
}
