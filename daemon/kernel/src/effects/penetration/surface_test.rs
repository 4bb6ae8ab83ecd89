//! Whether the surfaces of two placed objects have a point in common: stages 2 to 8 for one pair, without a scene.

use crate::affine::{Rows, magnitude};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::polygon_pairs::Candidates;
use crate::polygon_test::triangles_in;
use crate::predicates::{AnyRange, Arithmetic, TAME_LIMIT, Tame};
use crate::report::StageCounts;
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, VoxelPair};

/// The most voxel pairs in a batch.
const BATCH: usize = 64;

/// Memory of the test, which serves one pair after the other.
#[derive(Debug, Default)]
pub struct SurfaceTest {
    stack: Vec<VoxelPair>,
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
        let Some(frame) = PairFrame::new(first, second, None) else { return false };
        let tame = first.magnitude.max(second.magnitude).max_element() < TAME_LIMIT;
        let descent = Descent { frame: &frame, a: a.0, b: b.0 };
        if tame { self.descend(Tame, a, b, &descent) } else { self.descend(AnyRange, a, b, &descent) }
    }

    fn descend<A: Arithmetic>(
        &mut self,
        arithmetic: A,
        a: (&Object, &Rows),
        b: (&Object, &Rows),
        descent: &Descent<'_>,
    ) -> bool {
        self.stack.clear();
        self.stack.push(VoxelPair::CONTAINERS);
        self.candidates.start_pair();
        let mut batch = 1;
        while !self.stack.is_empty() {
            self.leaves.clear();
            self.candidates.clear();
            let (mut budget, mut counts) = (i64::MAX, StageCounts::default());
            descent.advance(&mut self.stack, &mut self.leaves, batch, &mut budget, &mut counts);
            for voxels in &self.leaves {
                self.candidates.add(voxels, a, b, &mut 0.0);
            }
            if self.candidates.iter().any(|(p, q)| triangles_in(arithmetic, &p.corners, &q.corners).is_some()) {
                return true;
            }
            batch = (2 * batch).min(BATCH);
        }
        false
    }
}

fn placed<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    Placed { object, rows, magnitude: magnitude(rows, object.reach()) }
}
