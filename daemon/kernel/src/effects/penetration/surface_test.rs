//! Whether the surfaces of two placed objects have a point in common: stages 2 to 8 for one pair, without a scene.

use crate::affine::{Rows, magnitude};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::polygon_pairs::Candidates;
use crate::polygon_test::triangles_in;
use crate::predicates::{AnyRange, Arithmetic, TAME_LIMIT, Tame};
use crate::report::StageCounts;
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, Open, VoxelPair};

/// The most voxel pairs in a batch.
const BATCH: usize = 64;

/// Memory of the test, which serves one pair after the other.
#[derive(Debug, Default)]
pub struct SurfaceTest {
    frame: PairFrame,
    open: Open,
    leaves: Vec<VoxelPair>,
    candidates: Candidates,
}

impl SurfaceTest {
    /// Whether the surfaces have a point in common: the exact truth about the rounded world vertices, which must be finite.
    pub fn interferes(&mut self, a: (&Object, &Rows), b: (&Object, &Rows)) -> bool {
        let (Some(container_a), Some(container_b)) = (a.0.container(), b.0.container()) else { return false };
        if !GlobalBox::of(&container_a, a.1).overlaps(&GlobalBox::of(&container_b, b.1)) {
            return false;
        }
        let (first, second) = (placed(a), placed(b));
        if !self.frame.start(first, second, None) {
            return false;
        }
        let tame = first.magnitude.max(second.magnitude).max_element() < TAME_LIMIT;
        if tame { self.descend(Tame, a, b) } else { self.descend(AnyRange, a, b) }
    }

    fn descend<A: Arithmetic>(&mut self, arithmetic: A, a: (&Object, &Rows), b: (&Object, &Rows)) -> bool {
        let objects = [a.0, b.0];
        self.open.start([VoxelPair::containers(objects)]);
        self.candidates.start_pair([a.1, b.1], self.frame.boxes());
        let mut descent = Descent { frame: &mut self.frame, objects, deepest_first: true };
        let mut batch = 1;
        while !self.open.is_empty() {
            self.leaves.clear();
            self.candidates.clear();
            let (mut budget, mut counts) = (i64::MAX, StageCounts::default());
            descent.advance(&mut self.open, &mut self.leaves, batch, &mut budget, &mut counts);
            self.candidates.add_all(&self.leaves, objects, descent.frame, &mut 0.0);
            for at in 0..self.candidates.pairs().len() {
                let [p, q] = self.candidates.corners(self.candidates.pairs()[at], objects);
                if triangles_in(arithmetic, p, q).is_some() {
                    return true;
                }
            }
            batch = (2 * batch).min(BATCH);
        }
        false
    }
}

fn placed<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    Placed { object, rows, magnitude: magnitude(rows, object.reach()) }
}
