//! Stages 2, 5 and 6, for pairs that are not refined further: how far apart, or how deep in each other, they can still be.
//!
//! An occupied voxel holds a point of the surface, so two of them bound the distance of the surfaces by that of their centres and
//! their half diagonals. Containers that are moved apart take everything in them along, so their overlap along any axis bounds the
//! depth. Both are rounded up, and widened by what rounding may move a world vertex by.

use glam::DVec3;

use crate::affine::world_vertex;
use crate::cells::Cell;
use crate::container::MAX_ORDER;
use crate::global_boxes::GlobalBox;
use crate::report::OpenBound;
use crate::submatrix::{PairFrame, Placed, Which, columns};
use crate::voxel_pairs::VoxelPair;

/// Some 20 roundings and square roots, 2^-53 each.
const ROUNDED_UP: f64 = 1.0 + 64.0 * f64::EPSILON;

/// Length of a vector, however short or long.
fn length(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    if largest == 0.0 { 0.0 } else { (vector / largest).length() * largest }
}

/// Of two bodies whose global bounding boxes overlap.
pub(crate) fn of_boxes(a: &GlobalBox, b: &GlobalBox) -> OpenBound {
    let (forth, back) = (a.max - b.min, b.max - a.min);
    let deep = forth.min(back).min_element();
    OpenBound { orders: [0; 2], apart_at_most: up(length(forth.max(back))), deep_at_most: up(deep) }
}

/// A pair of bodies whose containers reach each other.
pub(crate) struct Bounds<'f> {
    pub frame: &'f PairFrame,
    pub a: Placed<'f>,
    pub b: Placed<'f>,
}

impl Bounds<'_> {
    /// What is known of the pair when two of its voxels reach each other.
    pub fn of(&self, voxels: &VoxelPair) -> OpenBound {
        let (distance, reach) = self.spheres(voxels);
        self.bound(voxels, distance + reach)
    }

    /// Whether the spheres around two voxels reach each other.
    pub fn reach_each_other(&self, voxels: &VoxelPair) -> bool {
        let (distance, reach) = self.spheres(voxels);
        // What is beyond f64 is not proven apart, and kept.
        distance <= reach || !distance.is_finite() || reach.is_nan()
    }

    /// What is known when *some* voxels of the levels of these reach each other, and so do the spheres around them.
    pub fn of_any_like(&self, voxels: &VoxelPair) -> OpenBound {
        let (_, reach) = self.spheres(voxels);
        self.bound(voxels, 2.0 * reach)
    }

    fn bound(&self, voxels: &VoxelPair, apart_at_most: f64) -> OpenBound {
        let order = |which: Which| {
            let shares = self.frame.shares(which, &voxels.cells[which as usize]);
            shares.iter().map(|share| share.recip().log2() as u32).sum()
        };
        let deep_at_most = up(self.frame.overlap_of_containers(self.a, self.b));
        OpenBound { orders: [Which::First, Which::Second].map(order), apart_at_most: up(apart_at_most), deep_at_most }
    }

    /// Distance of the centres of two voxels, and the sum of their half diagonals, rounded up; in the world.
    fn spheres(&self, voxels: &VoxelPair) -> (f64, f64) {
        let [a, b] = [Which::First, Which::Second].map(|which| self.sphere(which, &voxels.cells[which as usize]));
        (up(length(a.0 - b.0)), up(a.1 + b.1) + self.frame.noise(self.a, self.b))
    }

    /// Centre and half diagonal of a voxel, in the world.
    fn sphere(&self, which: Which, cell: &Cell) -> (DVec3, f64) {
        /// 2^-30.
        const UNIT: f64 = 1.0 / (1u64 << MAX_ORDER) as f64;
        let Placed { object, rows, .. } = if which == Which::First { self.a } else { self.b };
        let (lattice, [x, y, z]) = (object.matrix().lattice(), columns(rows));
        let half = lattice.half_sides();
        let centre =
            lattice.middle() + DVec3::from([0, 1, 2].map(|axis| half[axis] * (f64::from(cell.centre[axis]) * UNIT)));
        let [i, j, k] = self.frame.shares(which, cell).map(f64::from);
        let (x, y, z) = (x * (half[0] * i), y * (half[1] * j), z * (half[2] * k));
        let diagonals: [DVec3; 4] = [x + y + z, x + y - z, x - y + z, x - y - z];
        let half_diagonal = diagonals.into_iter().map(length).fold(0.0, f64::max);
        (world_vertex(rows, centre.to_array()), half_diagonal)
    }
}

fn up(length: f64) -> f64 {
    if length.is_nan() { f64::INFINITY } else { (length * ROUNDED_UP).next_up() }
}
