//! What one body contributes to the separating axes: the cells of its pyramid along them.

use glam::{DVec3, Vec4};

use super::lanes::{LANES, Lanes};
use super::{WIDEN, Which};
use crate::cell_boxes::{CellBox, GRAINS};
use crate::cells::{Cut, MAX_RANKS};
use crate::object::Object;

/// Half a grain over half a cell.
pub(super) const HALF_GRAIN: f32 = 1.0 / GRAINS as f32;

/// What one body contributes.
#[derive(Debug, Default)]
pub(super) struct Side {
    /// Per axis of its container and separating axis: half a side's extent times 2^-30, over the reach of the containers.
    pub along: [[f64; LANES]; 3],
    /// The same in f32, without the 2^-30.
    pub edges: [Lanes; 3],
    /// Per rank and axis: 2^-halvings.
    pub shares: [[f32; 3]; MAX_RANKS],
    /// Per rank and axis: half a grain of a cell, see [`CellBox`].
    pub grains: [[Lanes; 3]; MAX_RANKS],
    /// Per rank: half the extent of a cell, widened.
    pub reach: [Lanes; MAX_RANKS],
    /// Per rank: the longest side of a cell in the world, roughly; decides which cell is cut.
    pub size: [f64; MAX_RANKS],
    /// Per rank: where the centres of the parts of a cell are, seen from its own; of the second body, the other way round.
    pub parts: [[Lanes; 8]; MAX_RANKS],
    /// The ranks whose parts are known, a bit each.
    pub known: u32,
    /// The rank at which the descent ends. Where a cell is no larger than what rounding may move things by, its parts cannot
    /// be told apart, and comparing them all would cost the square of their number for nothing.
    pub depth: usize,
    /// The cut that takes the place of the matrix's own of that rank, when the descent ends between two of them.
    pub last_cut: Option<(usize, Cut)>,
    /// Middle of the container in the world, as world boxes are measured.
    pub middle: Vec4,
    /// Half the sides of the container in the world, likewise.
    pub columns: [Vec4; 3],
}

/// The parts of a cell as the separating axes see them, from the box within the other cell.
pub(crate) struct PartsAlong<'f> {
    pub(super) side: &'f Side,
    pub(super) split: Which,
    /// Their centres, from that of the cell.
    pub centres: &'f [Lanes; 8],
    /// From the box within the other cell to the cell.
    pub(super) base: Lanes,
    /// How far apart the centres of a part and of that box may be.
    pub(super) reach: Lanes,
    /// The same for a part that is a point.
    pub(super) beside: Lanes,
}

impl PartsAlong<'_> {
    /// From the box within the other cell to a part; `None` when the axes prove them apart.
    #[inline(always)]
    pub fn part(&self, part: usize) -> Option<Lanes> {
        let between = self.base.plus(&self.centres[part]);
        (!between.any_beyond(&self.reach)).then_some(between)
    }

    /// The same for the box within the part, and how far apart the centres may be.
    #[inline(always)]
    pub fn bounds(&self, between: &Lanes, rank: u8, bounds: &CellBox) -> Option<(Lanes, Lanes)> {
        let bounds = self.side.bounds(self.split, rank, bounds);
        let (between, reach) = (between.plus(&bounds.centre), bounds.reach.plus(&self.beside));
        (!between.any_beyond(&reach)).then_some((between, reach))
    }
}

/// A box within a cell, along the axes.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    /// From the centre of the cell; of the second body, the other way round.
    pub centre: Lanes,
    /// Half its extent, widened.
    pub reach: Lanes,
}

/// The same in half grains, per axis of the cell.
pub(super) struct GrainShare {
    centre: [f32; 3],
    /// Widened.
    extent: [f32; 3],
}

impl GrainShare {
    #[inline(always)]
    pub fn of(which: Which, bounds: &CellBox) -> GrainShare {
        let (min, max) = (bounds.min.map(f32::from), bounds.max.map(f32::from));
        let all = (GRAINS - 1) as f32;
        let centre = |axis: usize| {
            let from_middle = min[axis] + max[axis] - all;
            if which == Which::First { from_middle } else { -from_middle }
        };
        let extent = |axis: usize| (max[axis] - min[axis] + 1.0) * WIDEN;
        GrainShare { centre: [centre(0), centre(1), centre(2)], extent: [extent(0), extent(1), extent(2)] }
    }
}

impl Side {
    #[inline(always)]
    pub fn start(&mut self, object: &Object, columns: &[DVec3; 3], halves: &[f64; 3]) {
        let lattice = object.matrix().lattice();
        let (longest, extents) = (longest(columns, halves), self.extents());
        for (rank, shares) in lattice.shares().iter().enumerate() {
            self.set_rank(rank, *shares, &longest, &extents);
        }
        self.known = 0;
        self.last_cut = None;
    }

    #[inline(always)]
    fn set_rank(&mut self, rank: usize, shares: [f32; 3], longest: &[f64; 3], extents: &[Lanes; 3]) {
        let [x, y, z] = [0, 1, 2].map(|axis| extents[axis].times(shares[axis]));
        let [i, j, k] = [0, 1, 2].map(|axis| longest[axis] * f64::from(shares[axis]));
        self.shares[rank] = shares;
        self.grains[rank] = [0, 1, 2].map(|axis| self.edges[axis].times(shares[axis] * HALF_GRAIN));
        self.reach[rank] = x.plus(&y).plus(&z);
        self.size[rank] = i.max(j).max(k);
    }

    /// The box within a cell.
    #[inline(always)]
    pub fn bounds(&self, which: Which, rank: u8, bounds: &CellBox) -> Bounds {
        self.bounds_of(rank, &GrainShare::of(which, bounds))
    }

    #[inline(always)]
    pub fn bounds_of(&self, rank: u8, share: &GrainShare) -> Bounds {
        let [x, y, z] = &self.grains[rank as usize];
        let ([i, j, k], [l, m, n]) = (share.centre, share.extent);
        Bounds {
            centre: x.times(i).plus(&y.times(j)).plus(&z.times(k)),
            reach: x.abs().times(l).plus(&y.abs().times(m)).plus(&z.abs().times(n)),
        }
    }

    /// Ends the descent at the voxels of `order`; says at which rank. Where the order lies between two ranks, the cells of the next one
    /// are from now on the voxels of the order.
    pub fn end_at(&mut self, order: u32, object: &Object, columns: &[DVec3; 3], halves: &[f64; 3]) -> usize {
        let mut left = order as usize;
        for (rank, cut) in object.matrix().lattice().cuts().iter().enumerate() {
            if left == 0 {
                return rank;
            }
            let halvings = cut.axes().len();
            if left < halvings {
                let cut = cut.first_halvings(left);
                let shares = cut.bits_after().map(half_to_the);
                self.set_rank(rank + 1, shares, &longest(columns, halves), &self.extents());
                self.last_cut = Some((rank, cut));
                return rank + 1;
            }
            left -= halvings;
        }
        object.matrix().lattice().cuts().len()
    }

    /// The first rank whose cells are within `noise` of a point, or as large in the world as those of the last one (which they
    /// are when the body is flattened across the side that is halved), or the last one.
    #[inline(always)]
    pub fn depth(&self, last: usize, noise: f64) -> usize {
        let small = noise.max(self.size[last]);
        (0..last).find(|&rank| self.size[rank] <= small).unwrap_or(last)
    }

    /// Half the extents of the container, widened.
    #[inline(always)]
    fn extents(&self) -> [Lanes; 3] {
        [0, 1, 2].map(|axis| self.edges[axis].abs().times(WIDEN))
    }

    /// The parts of cells of a rank.
    #[inline(always)]
    pub fn learn(&mut self, which: Which, rank: u8, cut: &Cut) {
        let mut bits = cut.bits;
        let parts = &mut self.parts[rank as usize];
        parts[0] = Lanes::default();
        for (halving, &axis) in cut.axes().iter().enumerate() {
            let axis = axis as usize;
            bits[axis] += 1;
            let step = half_to_the(bits[axis]);
            let step = self.edges[axis].times(if which == Which::First { step } else { -step });
            for part in (0..1 << halving).rev() {
                let centre = parts[part];
                parts[2 * part] = centre.minus(&step);
                parts[2 * part + 1] = centre.plus(&step);
            }
        }
        self.known |= 1 << rank;
    }
}

/// The longest extent, along a world axis, of half of each side of a container.
#[inline(always)]
fn longest(columns: &[DVec3; 3], halves: &[f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|axis| columns[axis].abs().max_element() * halves[axis])
}

/// 2^-bits.
#[inline(always)]
fn half_to_the(bits: u32) -> f32 {
    f32::from_bits((127 - bits) << 23)
}
