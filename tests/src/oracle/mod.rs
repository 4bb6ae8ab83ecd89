//! An exact oracle of interference, independent of the kernel: nothing of it is fast, everything of it is plain.
//!
//! Every f64 is a whole number times a power of two, so all corners are scaled to integers, and one triangle is clipped by
//! the half-spaces whose intersection the other one is. What remains is their common part, exactly: a list of rational
//! points, empty when the triangles are apart. There is no case analysis by signs of orientations: degenerate triangles
//! (segments, points) are intersections of half-spaces too.

mod common_part;
mod convex;
mod integers;
mod surface;
mod winding;

pub use collided_protocol::report::Relation;
pub use common_part::are_corners_of_common_part;
pub use surface::{Surface, polygon_pairs, strongest, world_vertices};
pub use winding::winding_number;

use convex::ConvexHull;

/// Corners of a triangle, of any area and of any finite size.
pub type Triangle = [[f64; 3]; 3];

/// How two closed triangles meet; [`Relation::None`] when they have no point in common.
///
/// # Panics
/// When a coordinate is NaN or infinite.
pub fn triangles(a: &Triangle, b: &Triangle) -> Relation {
    if boxes_apart(a, b) {
        return Relation::None;
    }
    let corners = integers::on_common_scale(a.iter().chain(b));
    relation(&ConvexHull::new(&corners[..3]), &ConvexHull::new(&corners[3..]))
}

fn relation(a: &ConvexHull, b: &ConvexHull) -> Relation {
    let common = a.clipped_by(b);
    if common.is_empty() {
        return Relation::None;
    }
    let areas = a.dimension() == 2 && b.dimension() == 2;
    // The relative interiors meet exactly when the middle of the common part is in both, for it is in either when it is
    // in any: then the sides of both leave it strictly inside.
    if !(areas && a.sides_hold_inside(&common) && b.sides_hold_inside(&common)) {
        return Relation::Touch;
    }
    if a.lies_in_plane_of(b) { Relation::Coplanar } else { Relation::Cross }
}

/// Comparing f64 is exact, so boxes that are apart prove that the triangles are.
fn boxes_apart(a: &Triangle, b: &Triangle) -> bool {
    (0..3).any(|axis| {
        let range = |t: &Triangle| {
            let [p, q, r] = t.map(|corner| corner[axis]);
            (p.min(q).min(r), p.max(q).max(r))
        };
        let ((a_min, a_max), (b_min, b_max)) = (range(a), range(b));
        a_max < b_min || b_max < a_min
    })
}

#[cfg(test)]
mod tests;
