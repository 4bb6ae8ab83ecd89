//! Stage 6: pairs of voxels that reach each other.
//!
//! The two pyramids are descended together, [cell](crate::cells) by cell. Of a pair of cells the larger one is cut: its occupied
//! parts that the axes do not prove apart from the other cell, or from the box within it, are the interference submatrix of
//! that cell, and go on.
//!
//! Nothing is lost, by induction: where a pair of cells holds a common point of two listed triangles, the parts of the one that
//! is cut cover it ([`Lattice::plane`](crate::container::Lattice)), the part with the point lists the triangle
//! (`polygon_box`) and has the point in its box (`cell_boxes`), and that part is not proven apart (`submatrix`). Ending the
//! descent anywhere discards nothing: the lists of the cells are then compared as they are.

use crate::cells::Cell;
use crate::instructions::{Work, dispatch};
use crate::object::Object;
use crate::report::StageCounts;
use crate::submatrix::{Lanes, PairFrame, Which};

/// Pairs of triangles that are compared as they are: about what it costs to split a voxel.
const FEW: u64 = 4;

/// A cell is not cut when its parts, those that the other cell reaches, hold so many times its triangles or more: polygons that
/// are large for the cells would only be met again and again.
const MOST_REPEATED: u32 = 4;

/// Expansions after which the place of a cell is computed anew in f64: see [`submatrix`](crate::submatrix).
pub(crate) const STALE: u8 = 3;

/// Two cells, one of each body, not proven apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VoxelPair {
    /// From the second centre to the first, along the separating axes.
    between: Lanes,
    pub cells: [Cell; 2],
    /// Expansions since `between` was computed from the cells alone.
    age: u8,
    /// Whether the first, or the second, is not worth cutting.
    whole: [bool; 2],
}

impl VoxelPair {
    /// The two containers.
    pub fn containers([a, b]: [&Object; 2]) -> VoxelPair {
        VoxelPair::of([Cell::container(a), Cell::container(b)])
    }

    pub fn of(cells: [Cell; 2]) -> VoxelPair {
        VoxelPair { between: Lanes::default(), cells, age: STALE, whole: [false; 2] }
    }
}

/// Pairs that are still to be looked at.
///
/// Those whose cells lie deep in each other come first, since they are the likeliest to hold polygons that meet; of these the
/// latest, so that few are open at a time.
#[derive(Debug, Default)]
pub(crate) struct Open {
    stacks: [Vec<VoxelPair>; SHALLOW.len() + 1],
}

/// Cells whose centres are farther apart along some axis than this share of what they reach are less deep in each other.
const SHALLOW: [f32; 3] = [0.4, 0.6, 0.8];

impl Open {
    /// Forgets all pairs but these, of which the last one comes first.
    pub fn start(&mut self, pairs: impl IntoIterator<Item = VoxelPair>) {
        self.stacks.iter_mut().for_each(Vec::clear);
        self.stacks[0].extend(pairs);
        self.measure_anew();
    }

    /// The places of the cells are to be computed anew, for another frame.
    pub fn measure_anew(&mut self) {
        self.stacks.iter_mut().flatten().for_each(|pair| pair.age = STALE);
    }

    /// A pair that is looked at before all others.
    pub fn put_first(&mut self, pair: VoxelPair) {
        self.stacks[0].push(pair);
    }

    pub fn is_empty(&self) -> bool {
        self.stacks.iter().all(Vec::is_empty)
    }

    /// The latest pairs of each depth.
    pub fn latest(&self, count: usize) -> impl Iterator<Item = &VoxelPair> {
        self.stacks.iter().flat_map(move |stack| stack.iter().rev().take(count))
    }

    /// Takes all of them out.
    pub fn drain(&mut self) -> impl Iterator<Item = VoxelPair> {
        self.stacks.iter_mut().flat_map(|stack| stack.drain(..))
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<VoxelPair> {
        self.stacks.iter_mut().find_map(Vec::pop)
    }
}

/// The descent through one pair of pyramids.
pub(crate) struct Descent<'s> {
    pub frame: &'s mut PairFrame,
    pub objects: [&'s Object; 2],
    /// Whether it may end early, so that the order matters.
    pub deepest_first: bool,
}

/// [`Descent::advance`], for the instructions of the processor.
struct Advance<'a, 's> {
    descent: &'a mut Descent<'s>,
    open: &'a mut Open,
    leaves: &'a mut Vec<VoxelPair>,
    wanted: usize,
    budget: &'a mut i64,
    counts: &'a mut StageCounts,
}

impl Work for Advance<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Advance { descent, open, leaves, wanted, budget, counts } = self;
        while leaves.len() < wanted && *budget > 0 {
            let Some(pair) = open.pop() else { return };
            match descent.split(&pair) {
                None => {
                    counts.voxel_pairs += 1;
                    leaves.push(pair);
                }
                Some(split) => {
                    let visited = descent.expand(pair, split, open, true);
                    counts.voxels_visited += visited;
                    *budget -= visited as i64 + 1;
                }
            }
        }
    }
}

impl Descent<'_> {
    /// Goes on until `leaves` has `wanted` pairs of cells that are not cut further, or nothing is `open`, or `budget`
    /// comparisons have been made.
    pub fn advance(
        &mut self,
        open: &mut Open,
        leaves: &mut Vec<VoxelPair>,
        wanted: usize,
        budget: &mut i64,
        counts: &mut StageCounts,
    ) {
        dispatch(Advance { descent: self, open, leaves, wanted, budget, counts });
    }

    /// Goes down to the cells at which the frame ends, whatever their lists hold, until a pair of them is found of which `reaches` says
    /// that they reach each other, or nothing is `open`, or `budget` comparisons have been made.
    pub fn find(
        &mut self,
        open: &mut Open,
        reaches: impl Fn(&PairFrame, &VoxelPair) -> bool,
        budget: &mut i64,
        counts: &mut StageCounts,
    ) -> Option<VoxelPair> {
        while *budget > 0 {
            let pair = open.pop()?;
            let Some(split) = self.larger_to_split(&pair) else {
                counts.voxel_pairs += 1;
                *budget -= 1;
                if reaches(self.frame, &pair) {
                    return Some(pair);
                }
                continue;
            };
            let visited = self.expand(pair, split, open, false);
            counts.voxels_visited += visited;
            *budget -= visited as i64 + 1;
        }
        None
    }

    /// Which cell to cut; `None` when neither can be, or need be.
    #[inline(always)]
    fn split(&self, pair: &VoxelPair) -> Option<Which> {
        let [a, b] = &pair.cells;
        if u64::from(a.triangles) * u64::from(b.triangles) <= FEW {
            return None;
        }
        self.larger_to_split(pair)
    }

    /// The larger cell of those that can be cut.
    #[inline(always)]
    fn larger_to_split(&self, pair: &VoxelPair) -> Option<Which> {
        let last = |which: Which| pair.whole[which as usize] || self.frame.is_last(which, &pair.cells[which as usize]);
        match (last(Which::First), last(Which::Second)) {
            (true, true) => None,
            (true, false) => Some(Which::Second),
            (false, true) => Some(Which::First),
            (false, false) => Some(self.frame.larger(&pair.cells)),
        }
    }

    /// Opens the pairs of the cut cell's parts with the other cell; says how many parts were compared. `sparing`: a cell whose
    /// polygons are large for its parts is left whole.
    #[inline(always)]
    fn expand(&mut self, mut pair: VoxelPair, split: Which, open: &mut Open, sparing: bool) -> u64 {
        let matrix = self.objects[split as usize].matrix();
        let parent = pair.cells[split as usize];
        let mut cut = &matrix.lattice().cuts()[parent.rank as usize];
        let mut parts = matrix.parts(&parent);
        let last_cut;
        if let Some(last) = self.frame.last_cut(split, parent.rank) {
            parts.merge(&parent, cut, last.axes().len());
            last_cut = last.clone();
            cut = &last_cut;
        }
        if pair.age == STALE {
            (pair.between, pair.age) = (self.frame.between(&pair.cells), 0);
        }
        let (base, before) = (pair.between, open.stacks.each_ref().map(Vec::len));
        let other = pair.cells[split.other() as usize];
        let along = self.frame.parts(split, parent.rank, parts.rank, cut, &other, &base);
        let (age, whole) = (pair.age + 1, pair.whole);
        let (mut repeated, mut occupied) = (0, parts.occupied);
        while occupied != 0 {
            let part = occupied.trailing_zeros() as usize;
            occupied &= occupied - 1;
            if let Some(between) = along.part(part) {
                let bounds = matrix.bounds_of_part(&parent, &parts);
                if let Some((apart, reach)) = along.bounds(&between, parts.rank, &bounds) {
                    let cell = matrix.part(&parent, &parts, cut, part, bounds);
                    repeated += cell.triangles;
                    let between = base.plus(&along.centres[part]);
                    let cells = if split == Which::First { [cell, other] } else { [other, cell] };
                    let depth = if self.deepest_first { depth(&apart, &reach) } else { 0 };
                    open.stacks[depth].push(VoxelPair { between, cells, age, whole });
                }
            }
            parts.pass();
        }
        if sparing && parent.rank % 2 == 1 && repeated / MOST_REPEATED >= parent.triangles {
            open.stacks.iter_mut().zip(before).for_each(|(stack, before)| stack.truncate(before));
            pair.whole[split as usize] = true;
            open.stacks[0].push(pair);
        }
        u64::from(parts.occupied.count_ones())
    }
}

/// Which stack a pair belongs on.
#[inline(always)]
fn depth(between: &Lanes, reach: &Lanes) -> usize {
    let [first, second, third] = SHALLOW;
    if between.any_beyond(&reach.times(second)) {
        2 + usize::from(between.any_beyond(&reach.times(third)))
    } else {
        usize::from(between.any_beyond(&reach.times(first)))
    }
}
