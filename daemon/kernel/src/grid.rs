//! The container measured in voxels of the full order: each is a cube of side 1 between whole numbers.
//!
//! Also the numbers of these voxels: one bit for each halving, the first one highest, so that the voxels of every coarser order are
//! runs of numbers.

use glam::DVec3;

use crate::container::{HALVINGS_PER_LEVEL, Lattice};

/// Halvings of an axis that one table of bits serves.
const TABLE_BITS: u32 = 10;
/// Tables that serve all halvings of an axis.
const TABLES: usize = 3;

/// Coordinates in voxels of the full order, and numbers of voxels.
pub(crate) struct Grid<'l> {
    pub lattice: &'l Lattice,
    middle: DVec3,
    /// Voxels per unit of length; 0 along an axis without extent, or hardly any.
    per_length: DVec3,
    /// Half the number of voxels of each axis.
    half_count: DVec3,
    /// Halvings of each axis.
    pub bits: [u32; 3],
    /// What rounding may move a point by, seen from the planes between voxels.
    pub margin: DVec3,
    /// Per axis, for ten bits each of a place: where they stand in a voxel's number.
    spread: [[Vec<u32>; TABLES]; 3],
}

impl<'l> Grid<'l> {
    /// # The margin
    /// Roundings, each of 2^-53. A corner passes 5, of h, which is half the number of voxels: half the side, voxels per length, the
    /// difference from the middle, their product, the place where it is measured from. The middle is off by 2 of the largest
    /// coordinate, and the planes of voxels by 3 ([`Lattice::plane`]) to 6 (`submatrix`). The margin is 128 of both, which leaves
    /// more than a hundred of each for what is computed with it. Halving subnormal coordinates loses four times 2^-1075.
    ///
    /// Nothing overflows: half the side of a voxel is at least 2^-1021 along an axis that is halved.
    pub fn new(lattice: &'l Lattice) -> Grid<'l> {
        const ROUNDING: f64 = 128.0 * (f64::EPSILON / 2.0);
        /// 2^-1070.
        const HALVING: f64 = f64::from_bits(1 << 4);
        let bits = lattice.bits_at(lattice.levels().len());
        let (half, reach) = (lattice.half_sides(), lattice.container().reach());
        let half_count = bits.map(|bits| 0.5 * f64::from(1u32 << bits));
        let per_length = [0, 1, 2].map(|axis| {
            let per_length = half_count[axis] / half[axis];
            if per_length.is_finite() { per_length } else { 0.0 }
        });
        // Without extent every point counts as in the middle of its voxel, give or take the whole side.
        let margin = [0, 1, 2].map(|axis| match per_length[axis] {
            0.0 => 1.0,
            per_length => half_count[axis] * ROUNDING + (reach[axis] * ROUNDING + HALVING) * per_length,
        });
        Grid {
            lattice,
            middle: lattice.middle(),
            per_length: per_length.into(),
            half_count: half_count.into(),
            bits,
            margin: margin.into(),
            spread: spread_tables(lattice.axes(), bits),
        }
    }

    /// A point, measured from the low corner of the voxel at this place.
    #[inline(always)]
    pub fn seen_from(&self, place: DVec3, point: DVec3) -> DVec3 {
        (point - self.middle) * self.per_length - (place - self.half_count)
    }

    /// The first and the last voxel whose closed extents along `axis` reach `[min, max]`, as [`Lattice::places_reached`] has them,
    /// for what lies in the container. `at` is the same extent, measured in voxels.
    #[inline(always)]
    pub fn places_reached(&self, axis: usize, [min, max]: [f64; 2], at: [f64; 2]) -> [u32; 2] {
        let margin = self.margin[axis];
        let places = at.map(|at| at as u32);
        let is_between = |end: usize| {
            let share = at[end] - f64::from(places[end]);
            share > margin && share < 1.0 - margin
        };
        if self.bits[axis] == 0 {
            [0, 0]
        } else if is_between(0) && is_between(1) {
            places
        } else {
            self.places_between_planes(axis, [min, max], places)
        }
    }

    /// The same by the planes alone, from a guess.
    #[cold]
    fn places_between_planes(&self, axis: usize, [min, max]: [f64; 2], guess: [u32; 2]) -> [u32; 2] {
        let plane = |index: u32| self.lattice.plane(axis, self.bits[axis], index);
        let end = (1u32 << self.bits[axis]) - 1;
        let [mut first, mut last] = guess.map(|place| place.min(end));
        while first > 0 && plane(first) >= min {
            first -= 1;
        }
        while first < end && plane(first + 1) < min {
            first += 1;
        }
        while last < end && plane(last + 1) <= max {
            last += 1;
        }
        while last > 0 && plane(last) > max {
            last -= 1;
        }
        [first, last]
    }

    /// The bits of a voxel's number that say its place along one axis.
    #[inline(always)]
    pub fn number_along(&self, axis: usize, place: u32) -> u32 {
        let tables = &self.spread[axis];
        let bits_of = |table: usize| {
            let part = place >> (TABLE_BITS * table as u32) & ((1 << TABLE_BITS) - 1);
            tables[table].get(part as usize).map_or(0, |bits| *bits)
        };
        if place >> TABLE_BITS == 0 { bits_of(0) } else { bits_of(0) | bits_of(1) | bits_of(2) }
    }

    /// Where the voxel of this number is, per axis.
    #[inline]
    pub fn place(&self, number: u32) -> [u32; 3] {
        let (mut place, mut rest) = ([0; 3], self.lattice.order());
        for level in self.lattice.levels() {
            rest -= rest.min(HALVINGS_PER_LEVEL);
            let child = (number >> rest) as usize & (level.place.len() - 1);
            place = [0, 1, 2].map(|axis| place[axis] << level.bits[axis] | u32::from(level.place[child][axis]));
        }
        place
    }
}

fn spread_tables(axes: &[u8], bits: [u32; 3]) -> [[Vec<u32>; TABLES]; 3] {
    [0, 1, 2].map(|axis| {
        // Where in a number the bits of a place stand, the lowest first.
        let halvings = axes.iter().rev().enumerate().filter(|(_, halved)| usize::from(**halved) == axis);
        let stand: Vec<u32> = halvings.map(|(bit, _)| bit as u32).collect();
        [0, 1, 2].map(|table| {
            let first = (TABLE_BITS * table as u32).min(bits[axis]);
            let count = (bits[axis] - first).min(TABLE_BITS);
            let stand = &stand[first as usize..(first + count) as usize];
            let spread = |part: u32| stand.iter().enumerate().fold(0, |all, (bit, at)| all | (part >> bit & 1) << at);
            (0..1 << count).map(spread).collect()
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::Container;

    fn lattices() -> Vec<Lattice> {
        let sides = [[4.0, 2.0, 1.0], [1.0, 1.0, 1.0], [1e6, 1.0, 0.0], [1.0, 0.0, 0.0], [-0.3, 1e-9, 7.0]];
        let containers = sides.map(|side| Container { min: side.map(|side| f64::min(side, 0.1)), max: side });
        let far = Container { min: [1e9 + 0.1, -1e-300, 7.0], max: [1e9 + 0.3, 3e-300, 8.0] };
        let containers = containers.into_iter().chain([far]).map(|mut container| {
            (0..3).for_each(|axis| container.max[axis] = container.max[axis].max(container.min[axis]));
            container
        });
        containers.flat_map(|container| [0, 1, 5, 6, 13, 30].map(|order| Lattice::new(container, order))).collect()
    }

    #[test]
    fn numbers_and_places_belong_together_and_follow_the_levels() {
        for lattice in lattices() {
            let grid = Grid::new(&lattice);
            let last = ((1u64 << lattice.order()) - 1) as u32;
            for number in [0, 1, 2, 3, 77, 0x2AAA_AAAA, 0x1234_5678, 0x3FFF_FFFF].map(|number| number & last) {
                let place = grid.place(number);
                let numbers = [0, 1, 2].map(|axis| grid.number_along(axis, place[axis]));
                assert_eq!(numbers[0] | numbers[1] | numbers[2], number, "{lattice:?}");
                assert!((0..3).all(|axis| place[axis] >> grid.bits[axis] == 0));
            }
        }
    }

    #[test]
    fn places_are_those_of_the_lattice() {
        for lattice in lattices() {
            let (grid, container) = (Grid::new(&lattice), *lattice.container());
            for axis in 0..3 {
                let bits = grid.bits[axis];
                let planes = [0, 1, 2, 3, 5, 31, 32].map(|index| lattice.plane(axis, bits, index.min((1 << bits) - 1)));
                let near = planes.into_iter().flat_map(|plane| {
                    [plane.next_down(), plane, plane.next_up(), 0.3 * plane + 0.7 * container.max[axis]]
                });
                let near: Vec<f64> = near.map(|point| point.clamp(container.min[axis], container.max[axis])).collect();
                for (&min, &max) in near.iter().flat_map(|min| near.iter().map(move |max| (min, max))) {
                    if min > max {
                        continue;
                    }
                    let at = [min, max].map(|end| grid.seen_from(DVec3::ZERO, DVec3::splat(end))[axis]);
                    let [first, last] = grid.places_reached(axis, [min, max], at);
                    // One level of the lattice at a time, by the planes.
                    let reached = |place: u32| {
                        let level_bits = bits.min(6);
                        let block = place >> level_bits << level_bits;
                        let places = lattice.places_reached(axis, bits, block, level_bits, min, max);
                        places.contains(&((place - block) as usize))
                    };
                    assert!(reached(first) && reached(last) && first <= last, "{lattice:?} {axis}: {min:e}..{max:e}");
                    assert!(first == 0 || !reached(first - 1), "{lattice:?} {axis}: {min:e}..{max:e}");
                    assert!(last + 1 == 1 << bits || !reached(last + 1), "{lattice:?} {axis}: {min:e}..{max:e}");
                }
            }
        }
    }
}
