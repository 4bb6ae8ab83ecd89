//! The meshes that are shipped with the project.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use collided_kernel::{Object, PolygonMesh};

/// Names of the shipped meshes, the smallest first.
pub const SHIPPED: [&str; 4] = ["rob", "low_poly_bunny", "env", "spot"];

/// Where a shipped mesh is.
pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../daemon/meshes").join(name).with_extension("obj")
}

/// The polygons of a mesh file of any format the daemon reads.
///
/// # Panics
/// When the file cannot be read; the message says why.
pub fn read(path: &Path) -> PolygonMesh {
    collided::mesh_file::read(path, &mut |_, _| {}).unwrap_or_else(|error| panic!("{error}"))
}

/// A mesh as the kernel holds it; `order` `None` lets the kernel choose.
///
/// # Panics
/// When the kernel refuses the mesh; the message says why.
pub fn build(mesh: PolygonMesh, order: Option<u32>) -> Arc<Object> {
    Arc::new(Object::build(mesh, order, &()).unwrap_or_else(|error| panic!("{error}")))
}

/// A shipped mesh as the kernel holds it.
///
/// # Panics
/// When there is no such mesh.
pub fn shipped(name: &str, order: Option<u32>) -> Arc<Object> {
    build(read(&path(name)), order)
}

/// The longest side of an object's container, in its own length unit.
///
/// # Panics
/// When the object has no polygon.
pub fn longest_side(object: &Object) -> f64 {
    let container = object.container().expect("the object has polygons");
    (0..3).fold(0.0, |longest, axis| f64::max(longest, container.max[axis] - container.min[axis]))
}
