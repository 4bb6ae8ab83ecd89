//! Stage 6: pairs of voxels that reach each other.
//!
//! The two pyramids are descended together, depth first. Of a pair of voxels the larger one is split: the block of its
//! children that the other's extent reaches, ANDed with the occupancy word, is the interference submatrix of that node, and
//! what the remaining axes do not prove apart goes on.
//!
//! Nothing is lost, by induction: where a pair of voxels holds a common point of two listed triangles, the children of the
//! split one cover it ([`Lattice::plane`](crate::container::Lattice)), the child with the point lists the triangle
//! (`polygon_box`), and that child is not proven apart (`submatrix`). Ending the descent anywhere discards nothing: the lists
//! of the voxels are then compared as they are.

use crate::object::Object;
use crate::polygon_box::bits_of;
use crate::report::StageCounts;
use crate::submatrix::{PairFrame, Seen, Voxel, Which};

/// Pairs of triangles that are compared as they are: about what it costs to split a voxel.
const FEW: u64 = 4;

/// A voxel is not split when its children, those that the other voxel reaches, hold so many times its triangles or more:
/// polygons that are large for the voxels would only be met again and again.
const MOST_REPEATED: u32 = 4;

/// Two voxels, one of each body, not proven apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VoxelPair {
    pub a: Voxel,
    pub b: Voxel,
    /// Whether the first, or the second, is not worth splitting.
    whole: [bool; 2],
}

impl VoxelPair {
    /// The two containers.
    pub const CONTAINERS: VoxelPair = VoxelPair::of(Voxel::CONTAINER, Voxel::CONTAINER);

    pub const fn of(a: Voxel, b: Voxel) -> VoxelPair {
        VoxelPair { a, b, whole: [false; 2] }
    }

    /// The pair with another voxel in place of one of its own.
    fn with(&self, which: Which, voxel: Voxel) -> VoxelPair {
        match which {
            Which::First => VoxelPair { a: voxel, ..*self },
            Which::Second => VoxelPair { b: voxel, ..*self },
        }
    }
}

/// The descent through one pair of pyramids.
pub(crate) struct Descent<'s> {
    pub frame: &'s PairFrame,
    pub a: &'s Object,
    pub b: &'s Object,
}

impl Descent<'_> {
    /// Goes on until `leaves` has `wanted` pairs of voxels that are not split further, or `stack` is empty, or `budget`
    /// comparisons have been made.
    pub fn advance(
        &self,
        stack: &mut Vec<VoxelPair>,
        leaves: &mut Vec<VoxelPair>,
        wanted: usize,
        budget: &mut i64,
        counts: &mut StageCounts,
    ) {
        while leaves.len() < wanted && *budget > 0 {
            let Some(pair) = stack.pop() else { return };
            match self.split(&pair) {
                None => {
                    counts.voxel_pairs += 1;
                    leaves.push(pair);
                }
                Some(split) => {
                    let visited = self.expand(&pair, split, stack, true);
                    counts.voxels_visited += visited;
                    *budget -= visited as i64 + 1;
                }
            }
        }
    }

    /// Goes down to the voxels at which the frame ends, whatever their lists hold, until a pair of them is found of which `reaches` says
    /// that they reach each other, or `stack` is empty, or `budget` comparisons have been made.
    pub fn find(
        &self,
        stack: &mut Vec<VoxelPair>,
        reaches: impl Fn(&VoxelPair) -> bool,
        budget: &mut i64,
        counts: &mut StageCounts,
    ) -> Option<VoxelPair> {
        while *budget > 0 {
            let pair = stack.pop()?;
            let Some(split) = self.larger_to_split(&pair) else {
                counts.voxel_pairs += 1;
                *budget -= 1;
                if reaches(&pair) {
                    return Some(pair);
                }
                continue;
            };
            let visited = match self.frame.run_of(split, split_level(&pair, split)) {
                Some(run) => self.expand_runs(&pair, split, run, stack),
                None => self.expand(&pair, split, stack, false),
            };
            counts.voxels_visited += visited;
            *budget -= visited as i64 + 1;
        }
        None
    }

    /// Which voxel to split; `None` when neither can be, or need be.
    fn split(&self, pair: &VoxelPair) -> Option<Which> {
        let triangles = |object: &Object, voxel: Voxel| {
            u64::from(object.matrix().triangle_count(usize::from(voxel.level), voxel.number))
        };
        if triangles(self.a, pair.a) * triangles(self.b, pair.b) <= FEW {
            return None;
        }
        self.larger_to_split(pair)
    }

    /// The larger voxel of those that can be split.
    fn larger_to_split(&self, pair: &VoxelPair) -> Option<Which> {
        let last = |which: Which, voxel: Voxel| pair.whole[which as usize] || self.frame.is_last(which, voxel);
        match (last(Which::First, pair.a), last(Which::Second, pair.b)) {
            (true, true) => None,
            (true, false) => Some(Which::Second),
            (false, true) => Some(Which::First),
            (false, false) => Some(self.frame.larger(pair.a, pair.b)),
        }
    }

    /// Pushes the pairs of the split voxel's children with the other voxel; says how many children were compared.
    /// `sparing`: a voxel whose polygons are large for its children is left whole.
    fn expand(&self, pair: &VoxelPair, split: Which, stack: &mut Vec<VoxelPair>, sparing: bool) -> u64 {
        let (object, parent, other) = self.sides(pair, split);
        let (matrix, level) = (object.matrix(), parent.level as usize);
        let node = matrix.node(level, parent.number);
        let halved = &matrix.lattice().levels()[level];
        let seen = self.frame.seen_from(split, other);
        let submatrix = self.submatrix(object, parent, split, &seen);
        let axes = PairFrame::other_axes(split);
        let (first_new, mut repeated) = (stack.len(), 0);
        for child in bits_of(submatrix) {
            let place = halved.place[child as usize];
            let index = [0, 1, 2].map(|axis| parent.index[axis] << halved.bits[axis] | u32::from(place[axis]));
            if axes.iter().any(|axes| self.frame.apart(split, &seen, level + 1, index, axes.clone())) {
                continue;
            }
            let voxel = Voxel { level: parent.level + 1, number: node.child(child), index };
            repeated += matrix.triangle_count(level + 1, voxel.number);
            stack.push(pair.with(split, voxel));
        }
        if sparing && repeated / MOST_REPEATED >= node.triangles {
            stack.truncate(first_new);
            let mut whole = *pair;
            whole.whole[split as usize] = true;
            stack.push(whole);
        }
        u64::from(submatrix.count_ones())
    }

    /// As [`expand`](Self::expand), the children taken together `run` at a time: they are voxels of the order at which the frame ends.
    fn expand_runs(&self, pair: &VoxelPair, split: Which, run: u32, stack: &mut Vec<VoxelPair>) -> u64 {
        let (object, parent, other) = self.sides(pair, split);
        let level = parent.level as usize;
        let halved = &object.matrix().lattice().levels()[level];
        let seen = self.frame.seen_from(split, other);
        let submatrix = self.submatrix(object, parent, split, &seen);
        let (bits, axes) = (self.frame.bits(split, level + 1), PairFrame::other_axes(split));
        let mut visited = 0;
        for first in (0..halved.place.len() as u32).step_by(run as usize) {
            // `run` is at most half of 64: the shift cannot overflow.
            if submatrix >> first & ((1 << run) - 1) == 0 {
                continue;
            }
            visited += 1;
            let place = halved.place[first as usize];
            let index = [0, 1, 2].map(|axis| {
                let fine = parent.index[axis] << halved.bits[axis] | u32::from(place[axis]);
                fine >> (halved.bits_before[axis] + halved.bits[axis] - bits[axis])
            });
            if !axes.iter().any(|axes| self.frame.apart(split, &seen, level + 1, index, axes.clone())) {
                // It has no list, and no number: the descent ends here.
                stack.push(pair.with(split, Voxel { level: parent.level + 1, number: u32::MAX, index }));
            }
        }
        visited
    }

    /// The object, and the voxel of it, that is split; and the other's voxel.
    fn sides(&self, pair: &VoxelPair, split: Which) -> (&Object, Voxel, Voxel) {
        match split {
            Which::First => (self.a, pair.a, pair.b),
            Which::Second => (self.b, pair.b, pair.a),
        }
    }

    /// The occupied children within the block that the other's extent reaches.
    #[inline(always)]
    fn submatrix(&self, object: &Object, parent: Voxel, split: Which, seen: &Seen) -> u64 {
        let (matrix, level) = (object.matrix(), parent.level as usize);
        let lattice = matrix.lattice();
        let halved = &lattice.levels()[level];
        let bits = lattice.bits_at(level + 1);
        let mut submatrix = matrix.node(level, parent.number).occupied;
        for axis in 0..3 {
            let (min, max) = self.frame.reached(split, seen, axis);
            let first = parent.index[axis] << halved.bits[axis];
            let places = lattice.places_reached(axis, bits[axis], first, halved.bits[axis], min, max);
            submatrix &= halved.children_between(axis, places);
        }
        submatrix
    }
}

fn split_level(pair: &VoxelPair, split: Which) -> usize {
    usize::from(if split == Which::First { pair.a.level } else { pair.b.level })
}
