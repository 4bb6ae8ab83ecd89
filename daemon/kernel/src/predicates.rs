//! Signs of determinants: on which side of a plane, or of a line in a plane, a point lies.
//!
//! Each sign is exact. Of a pair of triangles, a floating-point filter decides almost every one. Where it doubts one sign,
//! the pair begins anew in integers of fixed length, for corners that lie on a common grid of 61 bits an axis: nearly all do,
//! wherever they are, since an f64 has 53 bits. What is left is decided sign by sign. There the exact zeros of points on each
//! other, in a plane along the axes, or on a small grid are told by looking at the coordinates. The adaptive predicates of the
//! `robust` crate (Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", DCG 1997)
//! decide the rest while nothing can overflow or underflow in them; integers of any length decide what remains.

mod adaptive;
pub(crate) mod any_range;
mod filter;
mod fixed_point;
mod stage;

use glam::{DVec2, DVec3};

pub use filter::{Filter, Plane, TooClose};
pub(crate) use fixed_point::{FixedPoint, on_common_grid};
pub use stage::Stage;

pub(crate) use any_range::integers;

/// −1, 0 or +1.
pub type Sign = i32;

/// Positions whose coordinates all stay below this in magnitude are **tame**: no product of three differences overflows.
pub const TAME_LIMIT: f64 = f64::from_bits((1023 + 300) << 52); // 2^300

/// Whether [`Tame`] arithmetic is exact on these positions.
pub fn is_tame<'a>(positions: impl IntoIterator<Item = &'a DVec3>) -> bool {
    positions.into_iter().all(|position| position.abs().max_element() < TAME_LIMIT)
}

/// The arithmetic that a polygon test is done in.
pub trait Arithmetic: Copy {
    /// A plane through three points, ready for many questions.
    type Plane;
    /// The stage that tests a pair of triangles first.
    type First: Stage<Point = DVec3>;

    /// See [`First`](Self::First).
    fn first(self) -> Self::First;

    /// The sign of `(p − o) · ((a − o) × (b − o))`: positive where `p` sees `o, a, b` run counterclockwise.
    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign;

    /// The sign of `(a − o) × (p − o)`: positive where `o, a, p` run counterclockwise.
    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign;

    /// The plane through three points.
    fn plane(self, points: &[DVec3; 3]) -> Self::Plane;

    /// [`orient3d`](Self::orient3d) of the plane's points and `p`.
    fn side(self, plane: &Self::Plane, p: DVec3) -> Sign;
}

/// Exact for tame positions; fast.
#[derive(Debug, Clone, Copy)]
pub struct Tame;

/// Exact for every finite position; slow, by integers of any length alone.
#[derive(Debug, Clone, Copy)]
pub struct AnyRange;

impl Arithmetic for Tame {
    type Plane = Plane;
    type First = Filter;

    fn first(self) -> Filter {
        Filter
    }

    #[inline]
    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        self.side(&self.plane(&[o, a, b]), p)
    }

    #[inline]
    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        let estimate = filter::orient2d([o, a, p]);
        if estimate.is_certain() { estimate.sign() } else { adaptive::orient2d([o, a, p], estimate.determinant) }
    }

    #[inline]
    fn plane(self, points: &[DVec3; 3]) -> Plane {
        Plane::through(points)
    }

    #[inline]
    fn side(self, plane: &Plane, p: DVec3) -> Sign {
        let estimate = plane.orient3d(p);
        if estimate.is_certain() {
            return estimate.sign();
        }
        adaptive::orient3d(plane.points, p, estimate.determinant, estimate.permanent)
    }
}

impl Arithmetic for AnyRange {
    type Plane = [DVec3; 3];
    type First = Self;

    fn first(self) -> Self {
        self
    }

    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        any_range::orient3d(o, a, b, p)
    }

    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        any_range::orient2d(o, a, p)
    }

    fn plane(self, &points: &[DVec3; 3]) -> [DVec3; 3] {
        points
    }

    fn side(self, &[o, a, b]: &[DVec3; 3], p: DVec3) -> Sign {
        any_range::orient3d(o, a, b, p)
    }
}

fn sign(value: f64) -> Sign {
    Sign::from(value > 0.0) - Sign::from(value < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const O: DVec3 = DVec3::ZERO;

    fn both(o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        let exact = AnyRange.orient3d(o, a, b, p);
        assert_eq!(Tame.orient3d(o, a, b, p), exact);
        exact
    }

    #[test]
    fn a_point_above_a_counterclockwise_triangle_is_positive() {
        assert_eq!(both(O, DVec3::X, DVec3::Y, DVec3::Z), 1);
        assert_eq!(both(O, DVec3::X, DVec3::Y, -DVec3::Z), -1);
        assert_eq!(both(O, DVec3::X, DVec3::Y, DVec3::ONE.with_z(0.0)), 0);
        assert_eq!(Tame.orient2d(DVec2::ZERO, DVec2::X, DVec2::Y), 1);
        assert_eq!(AnyRange.orient2d(DVec2::ZERO, DVec2::X, DVec2::Y), 1);
    }

    #[test]
    fn one_ulp_beside_a_slanted_plane_is_told() {
        let (a, b) = (DVec3::new(1.0, 0.0, 0.1), DVec3::new(0.0, 1.0, 0.7));
        let on = DVec3::new(1.0, 1.0, 0.1 + 0.7);
        let sides = [-1.0f64, 1.0].map(|ulp| both(O, a, b, on.with_z(on.z + ulp * f64::EPSILON)));
        assert_eq!(sides, [-1, 1]);
    }

    #[test]
    fn grids_of_any_pitch_are_told_from_what_lies_beside_them() {
        for pitch in [1.0, 2f64.powi(-90), 2f64.powi(80), 0.1] {
            let at = |x: i32, y: i32, z: i32| DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * pitch;
            let (o, a, b, p) = (at(7, -3, 2), at(9000, 1, 5), at(-2, 8000, 3), at(8991, 8001, 4));
            let on = p.with_z(o.z + (a.z - o.z) + (b.z - o.z));
            for ulps in -2i64..=2 {
                let moved = on.with_z(f64::from_bits((on.z.to_bits() as i64 + ulps) as u64));
                both(o, a, b, moved);
                both(moved, o, a, b);
            }
        }
    }

    #[test]
    fn a_grid_with_one_tiny_coordinate_is_no_grid() {
        for tiny in [f64::from_bits(1), 1e-300, 1e-60] {
            assert_eq!(both(O, DVec3::X, DVec3::Y, DVec3::new(0.25, 0.25, tiny)), 1);
            assert_eq!(Tame.orient2d(DVec2::ZERO, DVec2::X, DVec2::new(0.5, -tiny)), -1);
        }
    }

    #[test]
    fn underflow_and_mixed_scales_are_exact() {
        let tiny = f64::from_bits(1);
        assert_eq!(both(O, DVec3::X * tiny, DVec3::Y * tiny, DVec3::Z * tiny), 1);
        assert_eq!(both(O, DVec3::X * 1e80, DVec3::Y * 1e-200, DVec3::Z * 1e-200), 1);
        assert_eq!(AnyRange.orient3d(O, DVec3::X * 1e300, DVec3::Y * 1e300, DVec3::Z * 1e-300), 1);
        assert_eq!(Tame.orient2d(DVec2::ZERO, DVec2::X * tiny, DVec2::Y * tiny), 1);
    }
}
