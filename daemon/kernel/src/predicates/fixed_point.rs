//! Signs in integers of fixed length, for the pairs of triangles whose corners lie on a common grid.
//!
//! A determinant keeps its sign when an axis is scaled by a positive factor. So each axis has a pitch of its own, a power of
//! two: the largest of the axis's coordinates takes 61 bits. An f64 has 53 bits, so every coordinate is a multiple of its pitch
//! that is at least 2^-8 of the largest on its axis, and so is a smaller one whose last bits are zero. Pairs that have
//! another coordinate are not for this stage. On the grid there is no rounding, and no need to know how near zero a sign is.
//!
//! Lengths: |coordinate| < 2^61, |difference| < 2^62, |component of a normal| < 2·2^124 = 2^125: `i64` and `i128` hold them.

use std::convert::Infallible;

use glam::{DVec3, I64Vec2, I64Vec3};

use super::Sign;
use super::stage::Stage;

/// Exact for corners on a grid, see [`on_common_grid`].
#[derive(Debug, Clone, Copy)]
pub struct FixedPoint;

/// A point of a plane, and its normal. The normal is cut in two: `high`·2^63 + `low`, with 0 ≤ `low` < 2^63.
#[derive(Debug, Clone, Copy)]
pub struct GridPlane {
    point: I64Vec3,
    high: I64Vec3,
    low: I64Vec3,
}

/// The bits of a coordinate's magnitude on the grid.
const BITS: u64 = 61;

/// The corners in units of the pitch of each axis; `None` when some coordinate is not a multiple of it.
#[inline]
pub fn on_common_grid(a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<[[I64Vec3; 3]; 2]> {
    let [x, y, z] = [
        axis_on_grid([a[0].x, a[1].x, a[2].x, b[0].x, b[1].x, b[2].x])?,
        axis_on_grid([a[0].y, a[1].y, a[2].y, b[0].y, b[1].y, b[2].y])?,
        axis_on_grid([a[0].z, a[1].z, a[2].z, b[0].z, b[1].z, b[2].z])?,
    ];
    let corner = |i: usize| I64Vec3::new(x[i], y[i], z[i]);
    Some([[corner(0), corner(1), corner(2)], [corner(3), corner(4), corner(5)]])
}

#[inline]
fn axis_on_grid(coordinates: [f64; 6]) -> Option<[i64; 6]> {
    // Finite numbers, for which this is one instruction and `f64::max` is not.
    let largest = coordinates.map(f64::abs).into_iter().fold(0.0, |most, next| if next > most { next } else { most });
    // Never below the smallest normal number; then neither the pitch nor 1 over it is beyond the ends of f64.
    let exponent = (largest.to_bits() >> 52).max(BITS) - (BITS - 1);
    let (pitch, per_pitch) = (f64::from_bits(exponent << 52), f64::from_bits((2 * 1023 - exponent) << 52));
    let integers = coordinates.map(|coordinate| (coordinate * per_pitch) as i64);
    // Compared at the coordinate's own scale: scaled, a tiny one would vanish and pass for 0. An integer that was cut off
    // from 53 bits has no more of them, so this makes no rounding.
    let is_multiple = |i: usize| integers[i] as f64 * pitch == coordinates[i];
    (0..6).fold(true, |all, i| all & is_multiple(i)).then_some(integers)
}

#[inline]
fn product(a: i64, b: i64) -> i128 {
    i128::from(a) * i128::from(b)
}

#[inline]
fn normal([o, a, b]: [I64Vec3; 3]) -> [i128; 3] {
    let (u, v) = (a - o, b - o);
    [
        product(u.y, v.z) - product(u.z, v.y),
        product(u.z, v.x) - product(u.x, v.z),
        product(u.x, v.y) - product(u.y, v.x),
    ]
}

impl Stage for FixedPoint {
    type Point = I64Vec3;
    type Flat = I64Vec2;
    type Plane = GridPlane;
    type Doubt = Infallible;

    #[inline]
    fn handedness(self, [o, a, b, p]: [I64Vec3; 4]) -> Result<Sign, Infallible> {
        self.side_of(&self.plane_through(&[o, a, b]), p)
    }

    #[inline]
    fn turn(self, [o, a, p]: [I64Vec2; 3]) -> Result<Sign, Infallible> {
        let (u, v) = (a - o, p - o);
        Ok(product(u.x, v.y).cmp(&product(u.y, v.x)) as Sign)
    }

    #[inline]
    fn plane_through(self, &corners: &[I64Vec3; 3]) -> GridPlane {
        let normal = normal(corners);
        let high = normal.map(|component| (component >> 63) as i64);
        let low = normal.map(|component| component as i64 & i64::MAX);
        GridPlane { point: corners[0], high: I64Vec3::from(high), low: I64Vec3::from(low) }
    }

    /// `high` is below 2^62 in magnitude, so both sums of three products are below 3·2^125 and fit.
    #[inline]
    fn side_of(self, plane: &GridPlane, p: I64Vec3) -> Result<Sign, Infallible> {
        let w = p - plane.point;
        let dot = |n: I64Vec3| product(n.x, w.x) + product(n.y, w.y) + product(n.z, w.z);
        // The determinant is whole·2^63 + rest, with 0 ≤ rest < 2^63.
        let low = dot(plane.low);
        let whole = dot(plane.high) + (low >> 63);
        let rest = low as i64 & i64::MAX;
        Ok(if whole == 0 { Sign::from(rest != 0) } else { whole.signum() as Sign })
    }

    #[inline]
    fn steepest(self, &corners: &[I64Vec3; 3]) -> usize {
        let [x, y, z] = normal(corners).map(i128::unsigned_abs);
        if z >= x.max(y) {
            2
        } else if y >= x {
            1
        } else {
            0
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3Swizzles;
    use proptest::array::{uniform3, uniform6};
    use proptest::prelude::*;

    use super::*;
    use crate::predicates::{AnyRange, Arithmetic};

    /// The signs of six corners are those of integers of any length, in space and in each projection.
    fn check(corners: [DVec3; 6]) -> Result<bool, TestCaseError> {
        let [o, a, b, p, q, r] = corners;
        let Some(grid) = on_common_grid(&[o, a, b], &[p, q, r]) else { return Ok(false) };
        let grid = [grid[0][0], grid[0][1], grid[0][2], grid[1][0], grid[1][1], grid[1][2]];
        for [i, j, k, l] in [[0, 1, 2, 3], [0, 1, 2, 4], [3, 4, 5, 0], [3, 4, 0, 1], [5, 2, 1, 4]] {
            let exact = AnyRange.orient3d(corners[i], corners[j], corners[k], corners[l]);
            prop_assert_eq!(FixedPoint.handedness([grid[i], grid[j], grid[k], grid[l]]), Ok(exact));
            let (flat, flat_grid) = ([i, j, k].map(|at| corners[at]), [i, j, k].map(|at| grid[at]));
            let turn = |[o, a, p]: [glam::DVec2; 3]| AnyRange.orient2d(o, a, p);
            prop_assert_eq!(FixedPoint.turn(flat_grid.map(|c| c.xy())), Ok(turn(flat.map(|c| c.xy()))));
            prop_assert_eq!(FixedPoint.turn(flat_grid.map(|c| c.xz())), Ok(turn(flat.map(|c| c.xz()))));
            prop_assert_eq!(FixedPoint.turn(flat_grid.map(|c| c.yz())), Ok(turn(flat.map(|c| c.yz()))));
        }
        Ok(true)
    }

    fn scaled(corners: [[f64; 3]; 6], exponents: [i32; 3]) -> [DVec3; 6] {
        // In two steps: a power below 2^-1022 would lose bits on its own.
        let scale = |x: f64, exponent: i32| x * 2f64.powi(exponent / 2) * 2f64.powi(exponent - exponent / 2);
        corners.map(|corner| DVec3::from([0, 1, 2].map(|axis| scale(corner[axis], exponents[axis]))))
    }

    fn exponents() -> impl Strategy<Value = [i32; 3]> {
        uniform3(prop_oneof![Just(0), -252..=-248i32, 248..=252i32, -1074..=-950i32, 950..=1020i32])
    }

    /// Between 1 and 2 in magnitude: all 53 bits are used, and every one of them is on the grid.
    fn full_length() -> impl Strategy<Value = f64> {
        (0..1u64 << 52, any::<bool>()).prop_map(|(bits, negative)| {
            let magnitude = f64::from_bits(1023 << 52 | bits);
            if negative { -magnitude } else { magnitude }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 4_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn small_grids_of_any_pitch(
            corners in uniform6(uniform3((-3..=3i32).prop_map(f64::from))), exponents in exponents(),
        ) {
            check(scaled(corners, exponents))?;
        }

        #[test]
        fn coordinates_of_full_length_are_on_the_grid(
            corners in uniform6(uniform3(full_length())), exponents in uniform3(-900..=900i32),
        ) {
            prop_assert!(check(scaled(corners, exponents))?);
        }

        #[test]
        fn a_few_ulps_off_a_slanted_plane(
            places in uniform6((0.0..1.0f64, 0.0..1.0f64, -3..=3i64)), shift in -1.0..1.0f64, exponents in exponents(),
        ) {
            let corners = places.map(|(x, y, ulps)| {
                let on = 0.3 * x + 0.7 * y + shift;
                [x, y, f64::from_bits(on.to_bits().wrapping_add_signed(ulps))]
            });
            check(scaled(corners, exponents))?;
        }

        #[test]
        fn mixed_magnitudes_are_refused_or_right(
            corners in uniform6(uniform3((full_length(), -70..=0i32))), exponents in exponents(),
        ) {
            check(scaled(corners.map(|corner| corner.map(|(x, exponent)| x * 2f64.powi(exponent))), exponents))?;
        }
    }

    #[test]
    fn the_longest_differences_fit() {
        let most = 1.0f64.next_down();
        for bits in 0..1u32 << 12 {
            let at = |i: u32| if bits >> i & 1 == 1 { most } else { -most };
            let corner = |i: u32| DVec3::new(at(3 * i), at(3 * i + 1), at(3 * i + 2));
            let corners = [corner(0), corner(1), corner(2), corner(3), corner(1), corner(2)];
            assert!(check(corners).is_ok_and(|on_grid| on_grid));
        }
    }

    #[test]
    fn one_bit_beyond_the_pitch_is_refused() {
        let with = |tiny: f64| on_common_grid(&[DVec3::ONE; 3], &[DVec3::ONE, DVec3::ONE, DVec3::new(tiny, 1.0, 1.0)]);
        assert!(with(2f64.powi(-60)).is_some());
        for tiny in [2f64.powi(-61), -2f64.powi(-61), 1e-300, f64::from_bits(1)] {
            assert!(with(tiny).is_none(), "{tiny}");
        }
        let large =
            |tiny: f64| on_common_grid(&[DVec3::MAX; 3], &[DVec3::MIN, DVec3::MAX, DVec3::new(tiny, 1e300, 0.0)]);
        assert!(large(1e-300).is_none());
        let subnormal = f64::from_bits(1);
        assert!(on_common_grid(&[DVec3::splat(subnormal); 3], &[DVec3::ZERO; 3]).is_none());
    }
}
