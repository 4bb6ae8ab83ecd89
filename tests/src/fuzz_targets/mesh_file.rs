//! Mesh files of every format.

use collided::mesh_file::{self, Format};

use super::build_or_refuse;

const FORMATS: [Format; 4] = [Format::Obj, Format::Stl, Format::Ply, Format::Off];

/// Reads the bytes as a mesh file of each format in turn. A format refuses them with a reason, or gives polygons that the
/// kernel can judge; progress never passes its total.
///
/// # Panics
/// When one of these does not hold.
pub fn mesh_file(bytes: &[u8]) {
    for format in FORMATS {
        let mut progress = |done, total| assert!(done <= total && total == bytes.len() as u64, "{done} of {total}");
        match mesh_file::parse(bytes, format, &mut progress) {
            Ok(mesh) => drop(build_or_refuse(mesh, None)),
            Err(malformed) => assert!(!malformed.to_string().is_empty()),
        }
    }
}
