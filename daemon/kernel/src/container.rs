//! Containers, and how they are halved.

use std::ops::Range;

use glam::DVec3;

use crate::cells::Cut;

/// The largest order M: the container halved 30 times, 2^30 voxels.
pub const MAX_ORDER: u32 = 30;

/// Halvings taken together as one step of the pyramid: 2^6 children, one bit each of a 64-bit word.
pub(crate) const HALVINGS_PER_LEVEL: u32 = 6;

/// An object's bounding box, sides parallel to its own axes. Both corners belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Container {
    /// Smallest coordinates, in the object's frame.
    pub min: [f64; 3],
    /// Largest coordinates, in the object's frame.
    pub max: [f64; 3],
}

impl Container {
    /// The smallest container of some positions; `None` when there are none.
    pub fn of(positions: impl IntoIterator<Item = [f64; 3]>) -> Option<Container> {
        let mut positions = positions.into_iter().map(DVec3::from);
        let first = positions.next()?;
        let (min, max) = positions.fold((first, first), |(min, max), point| (min.min(point), max.max(point)));
        Some(Container { min: min.into(), max: max.into() })
    }

    /// The largest magnitude of each coordinate.
    pub fn reach(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.min[axis].abs().max(self.max[axis].abs()))
    }

    /// Half of each side. Unlike the side, it cannot overflow.
    fn half_sides(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| 0.5 * self.max[axis] - 0.5 * self.min[axis])
    }
}

/// The container halved M times, each time across the then longest side of the voxel (ties: the lowest axis), and the planes
/// between the voxels of every order.
///
/// A side of length zero, or too short to split in f64, is never halved; halving ends when none is left.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    container: Container,
    half_sides: [f64; 3],
    /// The axis of each halving.
    axes: Vec<u8>,
    levels: Vec<LatticeLevel>,
    /// Two for each level.
    cuts: Vec<Cut>,
    /// Per rank of cells and axis: 2^-halvings.
    shares: Vec<[f32; 3]>,
}

/// One step of the pyramid: up to six halvings, which cut a voxel of this level into its children.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LatticeLevel {
    /// Halvings of each axis before this level.
    pub bits_before: [u32; 3],
    /// Halvings of each axis at this level.
    pub bits: [u32; 3],
    /// Place of each child among its siblings, per axis.
    pub place: Vec<[u8; 3]>,
    /// Per axis and place: the children at that place or before it.
    up_to: [Vec<u64>; 3],
}

impl LatticeLevel {
    fn new(axes: &[u8], bits_before: [u32; 3]) -> LatticeLevel {
        let mut bits = [0; 3];
        axes.iter().for_each(|&axis| bits[axis as usize] += 1);
        let place: Vec<[u8; 3]> = (0..1usize << axes.len()).map(|child| place_of(axes, child)).collect();
        let up_to = [0, 1, 2].map(|axis| {
            let children = |last: u8| {
                let within = place.iter().enumerate().filter(|(_, place)| place[axis] <= last);
                within.fold(0u64, |mask, (child, _)| mask | 1 << child)
            };
            (0..1u8 << bits[axis]).map(children).collect()
        });
        LatticeLevel { bits_before, bits, place, up_to }
    }

    /// The children whose place along `axis` is in `places`; the block of the matrix between two planes.
    #[inline]
    pub fn children_between(&self, axis: usize, places: Range<usize>) -> u64 {
        if places.is_empty() {
            return 0;
        }
        let before = if places.start == 0 { 0 } else { self.up_to[axis][places.start - 1] };
        self.up_to[axis][places.end - 1] & !before
    }
}

/// The first halving of a level is the highest bit of the child's number, so the children of a coarser order are runs.
fn place_of(axes: &[u8], child: usize) -> [u8; 3] {
    let mut place = [0; 3];
    for (halving, &axis) in axes.iter().enumerate() {
        let upper = (child >> (axes.len() - 1 - halving)) as u8 & 1;
        place[axis as usize] = place[axis as usize] << 1 | upper;
    }
    place
}

impl Lattice {
    /// The container halved `order` times, or as often as f64 can.
    pub fn new(container: Container, order: u32) -> Lattice {
        let half_sides = container.half_sides();
        let mut bits = [0u32; 3];
        let mut axes = Vec::new();
        while (axes.len() as u32) < order {
            let Some(axis) = next_halving(&container, &half_sides, &bits) else { break };
            bits[axis] += 1;
            axes.push(axis as u8);
        }
        let mut bits_before = [0; 3];
        let levels = axes.chunks(HALVINGS_PER_LEVEL as usize).map(|axes| {
            let level = LatticeLevel::new(axes, bits_before);
            (0..3).for_each(|axis| bits_before[axis] += level.bits[axis]);
            level
        });
        let levels: Vec<LatticeLevel> = levels.collect();
        let parts = axes.chunks(HALVINGS_PER_LEVEL as usize).zip(&levels);
        let cuts: Vec<Cut> = parts.flat_map(|(axes, level)| Cut::pair(axes, level.bits_before)).collect();
        let bits = cuts.iter().map(|cut| cut.bits).chain([bits]);
        let shares = bits.map(|bits| bits.map(|bits| half_to_the(bits) as f32)).collect();
        Lattice { container, half_sides, axes, levels, cuts, shares }
    }

    /// Halvings made, M.
    pub fn order(&self) -> u32 {
        self.axes.len() as u32
    }

    /// The container.
    pub fn container(&self) -> &Container {
        &self.container
    }

    /// The axis (0, 1, 2) of each halving.
    pub fn axes(&self) -> &[u8] {
        &self.axes
    }

    pub(crate) fn levels(&self) -> &[LatticeLevel] {
        &self.levels
    }

    pub(crate) fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// Of the cells of each rank, per axis: half a side over half the container's.
    pub(crate) fn shares(&self) -> &[[f32; 3]] {
        &self.shares
    }

    /// The middle of the container, in the object's frame.
    #[inline]
    pub(crate) fn middle(&self) -> DVec3 {
        0.5 * DVec3::from(self.container.min) + 0.5 * DVec3::from(self.container.max)
    }

    /// Half the container's sides, in the object's frame.
    pub(crate) fn half_sides(&self) -> [f64; 3] {
        self.half_sides
    }

    /// Halvings of each axis before `level`; for `level` equal to the number of levels, of the voxels themselves.
    pub(crate) fn bits_at(&self, level: usize) -> [u32; 3] {
        match self.levels.get(level) {
            Some(level) => level.bits_before,
            None => {
                self.levels.last().map_or([0; 3], |last| [0, 1, 2].map(|axis| last.bits_before[axis] + last.bits[axis]))
            }
        }
    }

    /// Half the sides of a voxel of `level`, in the object's frame.
    pub(crate) fn half_sides_at(&self, level: usize) -> DVec3 {
        self.half_sides_after(self.bits_at(level))
    }

    /// Half the sides of a voxel after so many halvings of each axis, in the object's frame.
    pub(crate) fn half_sides_after(&self, bits: [u32; 3]) -> DVec3 {
        DVec3::from([0, 1, 2].map(|axis| self.half_sides[axis] * half_to_the(bits[axis])))
    }

    /// Halvings of each axis among the first `order`.
    pub(crate) fn bits_at_order(&self, order: u32) -> [u32; 3] {
        let mut bits = [0; 3];
        self.axes.iter().take(order as usize).for_each(|&axis| bits[axis as usize] += 1);
        bits
    }

    /// The plane before voxel `index` of `2^bits` along `axis`.
    ///
    /// Planes of a coarser order are, to the bit, planes of every finer one: `index` and `step` scale by powers of two, which
    /// leaves their product as it is, because no step is subnormal. So the children of a voxel cover it, and no point falls
    /// between them. Measured from the nearer end, so that nothing overflows.
    ///
    /// A plane is within 3·2^-53 of the largest coordinate from where exact halving of the rounded side has it: one rounding
    /// each in the side, the product and the sum. Steps are at least 16·2^-53 of it, so planes ascend.
    #[inline]
    pub(crate) fn plane(&self, axis: usize, bits: u32, index: u32) -> f64 {
        let count = 1u32 << bits;
        let step = self.step(axis, bits);
        if index <= count / 2 {
            self.container.min[axis] + f64::from(index) * step
        } else {
            self.container.max[axis] - f64::from(count - index) * step
        }
    }

    /// Of the `2^level_bits` voxels from `first` on, those whose closed extent along `axis` reaches `[min, max]`; `bits` are
    /// the halvings of the axis so far. What cannot be compared (NaN) counts as reached.
    ///
    /// No margin here: planes are compared as they are, both ends closed, and a voxel is by definition what lies between its
    /// planes. Whoever computed `min` and `max` has widened them.
    #[inline]
    pub(crate) fn places_reached(
        &self,
        axis: usize,
        bits: u32,
        first: u32,
        level_bits: u32,
        min: f64,
        max: f64,
    ) -> Range<usize> {
        let count = 1usize << level_bits;
        if bits == 0 {
            let beside = self.container.max[axis] < min || self.container.min[axis] > max;
            return 0..usize::from(!beside);
        }
        let plane = |place: usize| self.plane(axis, bits, first + place as u32);
        let mut start = 0;
        while start < count && plane(start + 1) < min {
            start += 1;
        }
        let mut end = count;
        while end > start && plane(end - 1) > max {
            end -= 1;
        }
        start..end
    }

    /// Length of a voxel's side after `bits` halvings of `axis`.
    #[inline]
    fn step(&self, axis: usize, bits: u32) -> f64 {
        self.half_sides[axis] * half_to_the(bits) * 2.0
    }

    /// The voxel's closed box: `index` per axis among `2^bits` per axis.
    pub(crate) fn voxel(&self, bits: [u32; 3], index: [u32; 3]) -> Container {
        let plane = |axis: usize, offset: u32| {
            if bits[axis] == 0 {
                [self.container.min, self.container.max][offset as usize][axis]
            } else {
                self.plane(axis, bits[axis], index[axis] + offset)
            }
        };
        Container { min: [0, 1, 2].map(|axis| plane(axis, 0)), max: [0, 1, 2].map(|axis| plane(axis, 1)) }
    }
}

/// 2^-bits.
#[inline]
fn half_to_the(bits: u32) -> f64 {
    f64::from_bits(u64::from(1023 - bits) << 52)
}

/// The axis of the longest side that can still be split; the lowest of equals.
fn next_halving(container: &Container, half_sides: &[f64; 3], bits: &[u32; 3]) -> Option<usize> {
    /// A side shorter than this share of the largest coordinate has too few numbers between its ends.
    const SHORTEST: f64 = 8.0 * f64::EPSILON;
    /// Half of this is still normal, so that halving is exact: see [`Lattice::plane`].
    const SMALLEST: f64 = 2.0 * f64::MIN_POSITIVE;
    let reach = container.reach();
    let mut longest: Option<(usize, f64)> = None;
    for axis in 0..3 {
        let half = half_sides[axis] * half_to_the(bits[axis]);
        let can_split = half >= reach[axis] * SHORTEST && half >= SMALLEST;
        if can_split && longest.is_none_or(|(_, length)| half > length) {
            longest = Some((axis, half));
        }
    }
    longest.map(|(axis, _)| axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(sides: [f64; 3], order: u32) -> Lattice {
        Lattice::new(Container { min: [0.0; 3], max: sides }, order)
    }

    #[test]
    fn the_longest_side_is_halved_and_ties_go_to_the_lowest_axis() {
        assert_eq!(lattice([4.0, 2.0, 1.0], 5).axes(), [0, 0, 1, 0, 1]);
        assert_eq!(lattice([1.0, 1.0, 1.0], 4).axes(), [0, 1, 2, 0]);
        assert_eq!(lattice([1.0, 0.0, 0.0], 4).axes(), [0, 0, 0, 0]);
        assert_eq!(lattice([0.0, 0.0, 0.0], 4).order(), 0);
    }

    #[test]
    fn a_side_too_short_to_split_is_not_halved() {
        let far = Container { min: [1e16, 0.0, 0.0], max: [1e16 + 4.0, 0.0, 0.0] };
        assert!(Lattice::new(far, 30).order() < 3);
        let tiny = Container { min: [0.0; 3], max: [1e-310; 3] };
        assert_eq!(Lattice::new(tiny, 30).order(), 0);
    }

    /// Containers that are hard on rounding: sides on no grid, far from the origin, thin, huge, near underflow.
    fn hard_containers() -> Vec<Container> {
        let sides =
            [[-0.3, 12.9], [0.1, 0.7], [1e9 + 0.1, 1e9 + 0.3], [-1e-9, 7.0], [-f64::MAX, f64::MAX], [-1e308, 1.7e308]];
        let mut ends: Vec<[f64; 2]> = sides.to_vec();
        for exponent in [-1021, -1020, -1018, -1010, -1000, -300, 300, 1000] {
            let unit = 2f64.powi(exponent);
            ends.extend([[-unit, unit], [-0.3 * unit, 0.7 * unit], [unit.next_down(), 9.0 * unit.next_up()]]);
            // An odd number of the smallest units.
            ends.push([(-unit).next_down(), unit.next_up()]);
        }
        ends.into_iter().map(|[low, high]| Container { min: [low, 0.0, 0.0], max: [high, 0.0, 0.0] }).collect()
    }

    #[test]
    fn planes_ascend_and_are_planes_of_every_finer_order() {
        for container in hard_containers() {
            let lattice = Lattice::new(container, 14);
            for bits in 1..=lattice.order() {
                let planes: Vec<f64> = (0..=1 << bits).map(|index| lattice.plane(0, bits, index)).collect();
                assert!(planes.windows(2).all(|pair| pair[0] < pair[1]), "{container:?} at {bits}");
                assert_eq!((planes[0], planes[1 << bits]), (container.min[0], container.max[0]));
                if bits < lattice.order() {
                    let finer = |index: usize| lattice.plane(0, bits + 1, 2 * index as u32);
                    assert!(planes.iter().enumerate().all(|(i, &plane)| plane == finer(i)), "{container:?} at {bits}");
                }
            }
        }
    }

    #[test]
    fn the_places_reached_are_those_between_whose_planes_it_lies() {
        for container in hard_containers() {
            let lattice = Lattice::new(container, 8);
            let (mut bits, mut parent) = (0, 0u32);
            for level in lattice.levels() {
                let level_bits = level.bits[0];
                bits += level_bits;
                let first = parent << level_bits;
                parent = first + (1 << level_bits) / 2;
                let planes: Vec<f64> = (first..=first + (1 << level_bits)).map(|i| lattice.plane(0, bits, i)).collect();
                for plane in &planes {
                    let at = [plane.next_down().next_down(), plane.next_down(), *plane, plane.next_up()];
                    for (min, max) in at.into_iter().flat_map(|min| at.map(|max| (min, max))) {
                        let reached = lattice.places_reached(0, bits, first, level_bits, min, max);
                        let expected = planes.windows(2).map(|ends| ends[0] <= max && ends[1] >= min);
                        let expected: Vec<bool> = expected.collect();
                        let found: Vec<bool> = (0..expected.len()).map(|place| reached.contains(&place)).collect();
                        // What ends before it begins, and between two planes, is a matter of no point.
                        assert!(min > max || found == expected, "{container:?} at {bits}: {min:e}..{max:e}");
                    }
                }
                let all = lattice.places_reached(0, bits, first, level_bits, f64::NAN, f64::NAN);
                assert_eq!(all, 0..1 << level_bits);
            }
        }
    }

    #[test]
    fn children_between_planes_are_those_whose_place_is_there() {
        let lattice = lattice([4.0, 2.0, 1.0], 6);
        let level = &lattice.levels()[0];
        for axis in 0..3 {
            for start in 0..1usize << level.bits[axis] {
                for end in start..=1usize << level.bits[axis] {
                    let expected = (0..64).filter(|&child| (start..end).contains(&(level.place[child][axis] as usize)));
                    let expected = expected.fold(0u64, |mask, child| mask | 1 << child);
                    assert_eq!(level.children_between(axis, start..end), expected);
                }
            }
        }
    }
}
