//! Triangles that interfere, found by testing all of one body against all of another: what the effects start from.

use collided_kernel::affine::world_vertex;
use collided_kernel::effects::contacts::TrianglePair;
use collided_kernel::{Object, Rows, polygon_test};
use glam::DVec3;

/// An object and where it stands.
pub type Placed<'o> = (&'o Object, &'o Rows);

/// The triangles at their world positions.
pub fn world_triangles((object, rows): Placed<'_>) -> Vec<[DVec3; 3]> {
    let corner = |vertex: u32| world_vertex(rows, object.vertices()[vertex as usize]);
    object.triangles().iter().map(|triangle| triangle.map(corner)).collect()
}

/// All pairs of triangles that interfere, ordered.
pub fn triangle_pairs(a: Placed<'_>, b: Placed<'_>) -> Vec<TrianglePair> {
    let (first, second) = (world_triangles(a), world_triangles(b));
    let mut found = Vec::new();
    for (i, p) in first.iter().enumerate() {
        for (j, q) in second.iter().enumerate().filter(|(_, q)| boxes_meet(p, q)) {
            if let Some(relation) = polygon_test::triangles(p, q) {
                found.push(TrianglePair { a: i as u32, b: j as u32, relation });
            }
        }
    }
    found
}

fn boxes_meet(p: &[DVec3; 3], q: &[DVec3; 3]) -> bool {
    let bounds = |t: &[DVec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let ((p_min, p_max), (q_min, q_max)) = (bounds(p), bounds(q));
    p_min.cmple(q_max).all() && q_min.cmple(p_max).all()
}
