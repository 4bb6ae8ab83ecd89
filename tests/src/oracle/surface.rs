//! From triangles to polygons and whole surfaces.

use std::collections::BTreeMap;

use collided_protocol::report::Relation;
use collided_protocol::step::Rows;

use super::triangles;

/// A triangulated surface in the world.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// World vertices.
    pub vertices: &'a [[f64; 3]],
    /// Vertex numbers of the corners of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// The polygon that each triangle is a part of.
    pub polygon_of: &'a [u32],
}

/// World vertices: `((m0*x + m1*y) + m2*z) + m3` per row, in f64, rounded to nearest at every operation.
pub fn world_vertices(rows: &Rows, vertices: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let world = |[x, y, z]: &[f64; 3]| rows.map(|[m0, m1, m2, m3]| ((m0 * x + m1 * y) + m2 * z) + m3);
    vertices.iter().map(world).collect()
}

/// The interfering polygon pairs of two surfaces, ordered, each with the strongest relation of its triangles.
pub fn polygon_pairs(a: Surface<'_>, b: Surface<'_>) -> Vec<(u32, u32, Relation)> {
    let corners = |surface: &Surface<'_>, t: &[u32; 3]| t.map(|v| surface.vertices[v as usize]);
    let mut strongest = BTreeMap::new();
    for (triangle_a, &polygon_a) in a.triangles.iter().zip(a.polygon_of) {
        let corners_a = corners(&a, triangle_a);
        for (triangle_b, &polygon_b) in b.triangles.iter().zip(b.polygon_of) {
            let found = triangles(&corners_a, &corners(&b, triangle_b));
            if found != Relation::None {
                let relation = strongest.entry((polygon_a, polygon_b)).or_insert(found);
                *relation = found.max(*relation);
            }
        }
    }
    strongest.into_iter().map(|((a, b), relation)| (a, b, relation)).collect()
}

/// The strongest relation of some polygon pairs; [`Relation::None`] when there are none.
pub fn strongest(pairs: &[(u32, u32, Relation)]) -> Relation {
    pairs.iter().map(|&(_, _, relation)| relation).max().unwrap_or(Relation::None)
}
