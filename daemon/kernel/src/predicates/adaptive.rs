//! Signs that the filter cannot decide.
//!
//! Everything here is about tame coordinates. A sign that plain f64 computes without any rounding is the sign: `determinant`
//! is what the filter has computed.

use glam::{DVec2, DVec3};

use super::{Sign, any_range, sign};

/// 2^-250. All bits of coordinates not below this are multiples of 2^-302, so products of three differences are multiples of
/// 2^-906: nothing underflows, neither in the filter nor in `robust`'s expansions.
const SMALLEST: f64 = f64::from_bits((1023 - 250) << 52);

/// 2^-200. The pitch of a grid whose largest coordinate is not below this is far above [`SMALLEST`].
const SMALLEST_GRID: f64 = f64::from_bits((1023 - 200) << 52);

/// 1.5·2^52. Adding it to a number below 2^51 rounds that to an integer.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// Coordinates of so many bits make a 3×3 determinant of differences without rounding: 3·(15 + 1) bits and 5 for the sums.
const ORIENT3D_BITS: u64 = 15;
/// Coordinates of so many bits make a 2×2 determinant of differences without rounding: 2·(25 + 1) bits and 1 for the sum.
const ORIENT2D_BITS: u64 = 25;

#[cold]
#[inline(never)]
pub(super) fn orient3d(plane: [DVec3; 3], p: DVec3, determinant: f64, permanent: f64) -> Sign {
    let [o, a, b] = plane;
    if p == o || p == a || p == b {
        return 0;
    }
    let coordinates = [o.x, o.y, o.z, a.x, a.y, a.z, b.x, b.y, b.z, p.x, p.y, p.z];
    if permanent != 0.0 && on_a_grid(&coordinates, ORIENT3D_BITS) {
        return sign(determinant);
    }
    if !coordinates.iter().all(cannot_underflow) {
        return any_range::orient3d(o, a, b, p);
    }
    // Every product has a factor that is zero: the points share a plane along the axes.
    if permanent == 0.0 {
        return 0;
    }
    let coord = |point: DVec3| robust::Coord3D { x: point.x, y: point.y, z: point.z };
    // `robust` is positive where `p` lies on the other side.
    -sign(robust::orient3d(coord(o), coord(a), coord(b), coord(p)))
}

#[cold]
#[inline(never)]
pub(super) fn orient2d([o, a, p]: [DVec2; 3], determinant: f64) -> Sign {
    if o == a || a == p || p == o {
        return 0;
    }
    let coordinates = [o.x, o.y, a.x, a.y, p.x, p.y];
    if on_a_grid(&coordinates, ORIENT2D_BITS) {
        return sign(determinant);
    }
    if !coordinates.iter().all(cannot_underflow) {
        return any_range::orient2d(o, a, p);
    }
    let coord = |point: DVec2| robust::Coord { x: point.x, y: point.y };
    sign(robust::orient2d(coord(o), coord(a), coord(p)))
}

#[inline]
fn cannot_underflow(coordinate: &f64) -> bool {
    *coordinate == 0.0 || coordinate.abs() >= SMALLEST
}

/// Whether all coordinates are multiples, of at most `bits` bits, of one power of two, and far from underflow.
#[inline]
fn on_a_grid<const N: usize>(coordinates: &[f64; N], bits: u64) -> bool {
    // The bits of positive numbers are ordered as the numbers are.
    let largest = coordinates.iter().fold(0, |largest, coordinate| largest.max(coordinate.abs().to_bits()));
    if largest < SMALLEST_GRID.to_bits() {
        return false;
    }
    // The pitch with which the largest coordinate takes `bits` bits. Neither it nor 1 over it is near the ends of f64.
    let exponent = (largest >> 52) + 1 - bits;
    let (pitch, per_pitch) = (f64::from_bits(exponent << 52), f64::from_bits((2 * 1023 - exponent) << 52));
    // Compared at the coordinate's own scale: scaled, a tiny one would vanish and pass for 0.
    let is_multiple = |coordinate: &f64| ((coordinate * per_pitch + ROUNDER) - ROUNDER) * pitch == *coordinate;
    coordinates.iter().fold(true, |all, coordinate| all & is_multiple(coordinate))
}
