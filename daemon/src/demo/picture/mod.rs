//! The picture: both scenes side by side, with their interfering polygons in red.

mod faces;
mod svg;

use std::collections::BTreeSet;

use collided_kernel::PolygonMesh;

use super::camera::View;
use super::event::Best;
use super::scenes::Scene;
use crate::mesh_file::Malformed;
use faces::Drawn;
use svg::Panel;

/// Size of one scene's panel, in pixels.
const PANEL: [f64; 2] = [760.0, 640.0];

/// An SVG picture of the scenes, each at its best step of `steps`.
///
/// # Errors
/// None, unless the program was built with a file that is no mesh.
pub fn draw<'a>(scenes: impl IntoIterator<Item = (&'a Scene, &'a Best)>, steps: u64) -> Result<String, Malformed> {
    let panels = scenes.into_iter().map(|(scene, best)| panel(scene, best, steps)).collect::<Result<Vec<_>, _>>()?;
    Ok(svg::write(&panels, PANEL))
}

fn panel(scene: &Scene, best: &Best, steps: u64) -> Result<Panel, Malformed> {
    let meshes: Vec<PolygonMesh> = scene.bodies.iter().map(|body| body.mesh.polygons()).collect::<Result<_, _>>()?;
    let transforms = scene.transforms(best.step, steps);
    let shown = scene.bodies.iter().zip(&meshes).zip(transforms).zip(&best.interfering);
    let bodies: Vec<Drawn<'_>> = shown
        .map(|(((body, mesh), rows), interfering)| Drawn { mesh, rows, colour: body.colour, interfering })
        .collect();
    let text = format!(
        "step {} of {steps}: {} of {} polygons interfere; polygon pairs: {}, body pairs: {}",
        best.step,
        best.interfering.iter().map(BTreeSet::len).sum::<usize>(),
        meshes.iter().map(PolygonMesh::polygon_count).sum::<usize>(),
        best.polygon_pairs,
        best.pairs,
    );
    let view = View::new(&scene.camera, PANEL);
    Ok(Panel { title: scene.caption, text, faces: faces::faces(&bodies, &view, scene.visible) })
}
