//! The twins of the accelerated stages: the same answers by testing everything. The reference that tests compare with.

use glam::DVec3;

use crate::affine::{Rows, world_vertex};
use crate::effects::{Found, distance, order};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::polygon_test;
use crate::report::PolygonPair;

/// Appends the pairs `(i, j)`, `i < j`, of boxes that overlap, ascending. Twin of
/// [`BroadPhase::overlapping_boxes`](crate::broad_phase::BroadPhase::overlapping_boxes).
pub fn overlapping_boxes(boxes: &[GlobalBox], pairs: &mut Vec<(u32, u32)>) {
    for (j, second) in boxes.iter().enumerate() {
        let overlapping = boxes[..j].iter().enumerate().filter(|(_, first)| first.overlaps(second));
        pairs.extend(overlapping.map(|(i, _)| (i as u32, j as u32)));
    }
    pairs.sort_unstable();
}

/// Every interfering polygon pair of two placed objects, ordered by `(a, b)`, each once with its strongest relation: all
/// triangles of one against all of the other. Twin of stages 5 to 8.
pub fn polygon_pairs(a: &Object, rows_a: &Rows, b: &Object, rows_b: &Rows) -> Vec<PolygonPair> {
    let (first, second) = (world_triangles(a, rows_a), world_triangles(b, rows_b));
    let mut found = Vec::new();
    for (i, p) in first.iter().enumerate() {
        for (j, q) in second.iter().enumerate() {
            if let Some(relation) = polygon_test::triangles(p, q) {
                found.push(Found { pair: 0, a: a.polygon_of(i), b: b.polygon_of(j), relation });
            }
        }
    }
    order(&mut found, &());
    found.iter().map(PolygonPair::from).collect()
}

/// The minimum distance of two placed objects and the pair of polygons that has it, of equally near ones the pair of the smallest
/// numbers: all triangles of one against all of the other. `None` when an object is empty. Twin of
/// [`distance`](crate::effects::distance::distance).
pub fn distance(a: &Object, rows_a: &Rows, b: &Object, rows_b: &Rows) -> Option<(f64, [u32; 2])> {
    let (first, second) = (world_triangles(a, rows_a), world_triangles(b, rows_b));
    let pairs = first.iter().enumerate().flat_map(|p| second.iter().enumerate().map(move |q| (p, q)));
    let distances = pairs.map(|((i, p), (j, q))| (distance::of_triangles(p, q), [a.polygon_of(i), b.polygon_of(j)]));
    distances.min_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)))
}

fn world_triangles(object: &Object, rows: &Rows) -> Vec<[DVec3; 3]> {
    let corner = |vertex: u32| world_vertex(rows, object.vertices()[vertex as usize]);
    object.triangles().iter().map(|triangle| triangle.map(corner)).collect()
}
