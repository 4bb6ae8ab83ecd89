//! Which voxels a triangle occupies: a conservative separating-axis test in the object's own frame.
//!
//! Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", JGT 2001: a triangle and a box are apart when an axis of the box,
//! the triangle's normal, or a product of an edge of each separates them. Here the box's own axes are compared exactly, and
//! the other ten with a bound on all rounding, so that no voxel that the exact triangle touches is ever left out.

use glam::DVec3;

use crate::container::{Container, Lattice, LatticeLevel};

/// An axis along which a triangle's extent is known.
#[derive(Debug, Clone, Copy)]
struct Axis {
    direction: DVec3,
    /// The triangle's extent, widened by every rounding that the comparison with a box can suffer.
    min: f64,
    max: f64,
}

/// A triangle, ready to be compared with many boxes inside one container.
pub(crate) struct TriangleExtents {
    corners: [DVec3; 3],
    axes: [Axis; 10],
}

impl TriangleExtents {
    /// `reach` bounds the magnitude of each coordinate of the triangle and of all boxes.
    pub fn new(corners: [DVec3; 3], reach: DVec3) -> TriangleExtents {
        let [a, b, c] = corners;
        let edges = [unit_scale(b - a), unit_scale(c - b), unit_scale(a - c)];
        let mut axes = [Axis::new(edges[0].cross(edges[1]), &corners, reach); 10];
        for (edge, direction) in edges.into_iter().enumerate() {
            for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                axes[1 + 3 * edge + axis] = Axis::new(unit.cross(direction), &corners, reach);
            }
        }
        TriangleExtents { corners, axes }
    }

    /// Whether no point of the triangle lies in the box, proven by one of the ten axes. The caller compares the boxes.
    fn misses(&self, voxel: &Container) -> bool {
        let (min, max) = (DVec3::from(voxel.min), DVec3::from(voxel.max));
        let (centre, half) = (0.5 * min + 0.5 * max, 0.5 * max - 0.5 * min);
        self.axes.iter().any(|axis| {
            let at = axis.direction.dot(centre);
            let radius = axis.direction.abs().dot(half);
            // False for NaN: what is not proven to miss is kept.
            at - radius > axis.max || at + radius < axis.min
        })
    }

    /// The children of the voxel `index` of `level` that the triangle occupies, one bit each. Never empty for a triangle that
    /// occupies the voxel.
    pub fn children(&self, lattice: &Lattice, level: &LatticeLevel, index: [u32; 3]) -> u64 {
        let bits = [0, 1, 2].map(|axis| level.bits_before[axis] + level.bits[axis]);
        let mut children = !0;
        for axis in 0..3 {
            let min = self.corners[0][axis].min(self.corners[1][axis]).min(self.corners[2][axis]);
            let max = self.corners[0][axis].max(self.corners[1][axis]).max(self.corners[2][axis]);
            let first = index[axis] << level.bits[axis];
            let between = lattice.places_reached(axis, bits[axis], first, level.bits[axis], min, max);
            children &= level.children_between(axis, between);
        }
        // A box of one child holds all of the triangle that the parent has.
        if children.count_ones() <= 1 {
            return children;
        }
        let mut occupied = children;
        for child in bits_of(children) {
            let place = level.place[child as usize];
            let at = [0, 1, 2].map(|axis| (index[axis] << level.bits[axis]) + u32::from(place[axis]));
            if self.misses(&lattice.voxel(bits, at)) {
                occupied &= !(1 << child);
            }
        }
        occupied
    }
}

impl Axis {
    fn new(direction: DVec3, corners: &[DVec3; 3], reach: DVec3) -> Axis {
        let at = corners.map(|corner| direction.dot(corner));
        // Whatever vector the direction is after its own rounding, a common point has one coordinate along it. Roundings of
        // 2^-53 of the sum of magnitudes: 3 in each corner; 1 in the box's centre and half sides each and 3 in each product; 2
        // in their sum or difference, which may be twice the sum of magnitudes; 1 in the widened extent. That is 14; the slack
        // is 32. Components of the direction are at most 2, so that products underflow by 2^-1072 and halved coordinates by
        // 2^-1070. Where a product overflows, so does the slack, and then nothing is discarded.
        let slack = direction.abs().dot(reach) * (16.0 * f64::EPSILON) + UNDERFLOW;
        Axis { direction, min: at[0].min(at[1]).min(at[2]) - slack, max: at[0].max(at[1]).max(at[2]) + slack }
    }
}

/// 2^-1060.
const UNDERFLOW: f64 = f64::from_bits(1 << 14);

/// The vector with its largest component scaled to 1, so that products of two of them neither overflow nor vanish.
pub(crate) fn unit_scale(vector: DVec3) -> DVec3 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { vector / largest } else { DVec3::ZERO }
}

/// The positions of the bits that are set, lowest first.
pub(crate) fn bits_of(mut mask: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let bit = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (bit < u64::BITS).then_some(bit)
    })
}
