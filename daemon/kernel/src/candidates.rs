//! What stages 5 to 7 leave for the exact test: for studies that do the test in another arithmetic.

use crate::affine::{Rows, magnitude};
use crate::object::Object;
use crate::polygon_pairs::Candidates;
use crate::report::StageCounts;
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, Open, VoxelPair};

/// Voxel pairs whose triangles are carried into the world together.
const BATCH: usize = 64;

/// The pairs of triangles of two placed objects that the exact test would have to decide if it never stopped early, ascending,
/// each once. Every interfering pair of triangles is among them; which others are depends on the orders of the voxel matrices.
///
/// ```
/// use collided_kernel::{Object, PolygonMesh, affine::IDENTITY, candidates::candidates};
/// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let triangle = Object::build(PolygonMesh::from_polygons(corners, [[0, 1, 2]]), None, &())?;
/// assert_eq!(candidates((&triangle, &IDENTITY), (&triangle, &IDENTITY)), [[0, 0]]);
/// # Ok::<(), collided_kernel::ObjectError>(())
/// ```
pub fn candidates(a: (&Object, &Rows), b: (&Object, &Rows)) -> Vec<[u32; 2]> {
    let mut found = Vec::new();
    if a.0.container().is_none() || b.0.container().is_none() {
        return found;
    }
    let (mut frame, objects) = (PairFrame::default(), [a.0, b.0]);
    if !frame.start(placed(a), placed(b), None) {
        return found;
    }
    let (mut open, mut leaves, mut batch) = (Open::default(), Vec::new(), Candidates::default());
    open.start([VoxelPair::containers(objects)]);
    batch.start_pair([a.1, b.1], frame.boxes());
    let mut descent = Descent { frame: &mut frame, objects, deepest_first: true };
    let mut unlimited = i64::MAX;
    // Nothing is nearer than this: the distance of what is no candidate does not matter here.
    let mut nowhere_near = 0.0;
    while !open.is_empty() {
        leaves.clear();
        batch.clear();
        descent.advance(&mut open, &mut leaves, BATCH, &mut unlimited, &mut StageCounts::default());
        batch.add_all(&leaves, objects, descent.frame, &mut nowhere_near);
        found.extend_from_slice(batch.pairs());
    }
    found.sort_unstable();
    found.dedup();
    found
}

fn placed<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    Placed { object, rows, magnitude: magnitude(rows, object.reach()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::affine::IDENTITY;
    use crate::brute_force;
    use crate::mesh::PolygonMesh;

    /// A strip of unit squares along x: only neighbours have overlapping boxes.
    fn strip(order: u32) -> Object {
        let corner = |at: u32| [f64::from(at / 2), f64::from(at % 2), 0.0];
        let polygons = (0..16u32).map(|square| [0, 2, 3, 1].map(|corner| 2 * square + corner));
        let mesh = PolygonMesh::from_polygons((0..34).map(corner).collect(), polygons);
        Object::build(mesh, Some(order), &()).expect("a good mesh")
    }

    #[test]
    fn every_interfering_pair_is_a_candidate_and_not_all_pairs_are() {
        let mut moved = IDENTITY;
        moved[0][3] = 2.5;
        for order in [0, 4, 9] {
            let object = strip(order);
            let (a, b) = ((&object, &IDENTITY), (&object, &moved));
            let found = candidates(a, b);
            let polygons: Vec<[u32; 2]> =
                found.iter().map(|pair| pair.map(|t| object.polygon_of(t as usize))).collect();
            let interfering = brute_force::polygon_pairs(a.0, a.1, b.0, b.1);
            assert!(!interfering.is_empty());
            assert!(interfering.iter().all(|pair| polygons.contains(&[pair.a, pair.b])), "order {order}");
            assert!(found.len() < object.triangle_count().pow(2) / 2, "order {order}");
        }
    }

    #[test]
    fn objects_that_are_apart_or_empty_have_none() {
        let (object, empty) = (strip(6), Object::build(PolygonMesh::default(), None, &()).expect("empty is allowed"));
        let mut far = IDENTITY;
        far[2][3] = 100.0;
        assert!(candidates((&object, &IDENTITY), (&object, &far)).is_empty());
        assert!(candidates((&object, &IDENTITY), (&empty, &IDENTITY)).is_empty());
    }
}
