//! What the fuzzers run: functions of any bytes that panic when something does not hold.
//!
//! `tests/fuzz` gives them to libFuzzer; `tests/tests/fuzz_corpus.rs` runs them on the corpus and on mutations of it, so that
//! every target is part of the ordinary test suite. Targets keep no state between calls.

mod effects;
mod mesh_file;
mod meshes_and_transforms;
mod report_payloads;
mod scene_file;
mod source;
mod step_payloads;
mod upload;
mod wire_messages;

use std::sync::Arc;

use collided_kernel::{Object, PolygonMesh};
use collided_protocol::step::Rows;

use crate::oracle;

pub use mesh_file::mesh_file;
pub use meshes_and_transforms::meshes_and_transforms;
pub use report_payloads::report_payloads;
pub use scene_file::scene_file;
pub use step_payloads::step_payloads;
pub use wire_messages::wire_messages;

/// A function of any bytes; it panics when something does not hold.
pub type Target = fn(&[u8]);

/// Every target, by the name of its corpus and of its program.
pub const TARGETS: [(&str, Target); 6] = [
    ("mesh_file", mesh_file),
    ("meshes_and_transforms", meshes_and_transforms),
    ("report_payloads", report_payloads),
    ("scene_file", scene_file),
    ("step_payloads", step_payloads),
    ("wire_messages", wire_messages),
];

/// Builds an object of a mesh that may be invalid: it must be refused exactly when it is, and keep what it was given.
fn build_or_refuse(mesh: PolygonMesh, order: Option<u32>) -> Option<Arc<Object>> {
    match Object::build(mesh.clone(), order, &()) {
        Ok(object) => {
            assert!(is_valid(&mesh), "an invalid mesh was built: {mesh:?}");
            check_built(&mesh, &object);
            Some(Arc::new(object))
        }
        Err(error) => {
            assert!(!is_valid(&mesh), "a valid mesh was refused ({error}): {mesh:?}");
            None
        }
    }
}

fn is_valid(mesh: &PolygonMesh) -> bool {
    let corners: u64 = mesh.corner_counts.iter().map(|&count| u64::from(count)).sum();
    corners == mesh.corners.len() as u64
        && mesh.vertices.as_flattened().iter().all(|coordinate| coordinate.is_finite())
        && mesh.corner_counts.iter().all(|&count| count >= 3)
        && mesh.corners.iter().all(|&corner| (corner as usize) < mesh.vertices.len())
}

fn check_built(mesh: &PolygonMesh, object: &Object) {
    assert_eq!(object.vertices(), mesh.vertices);
    assert_eq!(object.polygon_count(), mesh.polygon_count());
    // A polygon of n corners is cut into n − 2 triangles, whatever its shape.
    let expected = mesh.corner_counts.iter().enumerate();
    let expected = expected.flat_map(|(polygon, &count)| std::iter::repeat_n(polygon as u32, count as usize - 2));
    assert!((0..object.triangle_count()).map(|triangle| object.polygon_of(triangle)).eq(expected));
    let used = mesh.corners.iter().map(|&corner| mesh.vertices[corner as usize]);
    let container = object.container().map(|container| (container.min, container.max));
    assert_eq!(container, used.map(|vertex| (vertex, vertex)).reduce(joined));
}

/// Whether the map and all vertices that it places are finite.
fn is_finite(object: &Object, rows: &Rows) -> bool {
    let world = oracle::world_vertices(rows, object.vertices());
    rows.as_flattened().iter().chain(world.as_flattened()).all(|number| number.is_finite())
}

type Extent = ([f64; 3], [f64; 3]);

fn joined((min, max): Extent, (low, high): Extent) -> Extent {
    ([0, 1, 2].map(|axis| min[axis].min(low[axis])), [0, 1, 2].map(|axis| max[axis].max(high[axis])))
}
