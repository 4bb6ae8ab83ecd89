//! Signs of determinants: on which side of a plane, or of a line in a plane, a point lies.
//!
//! Each sign is exact. A floating-point filter decides almost every one; the adaptive predicates of the `robust` crate
//! (Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates", DCG 1997) decide the rest
//! while nothing can overflow or underflow in them; integers of any length decide what is left.

mod any_range;

use glam::{DVec2, DVec3, Vec3Swizzles};

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
    /// The sign of `(p − o) · ((a − o) × (b − o))`: positive where `p` sees `o, a, b` run counterclockwise.
    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign;

    /// The sign of `(a − o) × (p − o)`: positive where `o, a, p` run counterclockwise.
    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign;

    /// A plane through three points, ready for many questions.
    fn plane(self, triangle: &[DVec3; 3]) -> Plane;

    /// [`orient3d`](Self::orient3d) of the plane's points and `p`.
    fn side(self, plane: &Plane, p: DVec3) -> Sign;
}

/// Exact for tame positions; fast.
#[derive(Debug, Clone, Copy)]
pub struct Tame;

/// Exact for every finite position; slow, by integers of any length alone.
#[derive(Debug, Clone, Copy)]
pub struct AnyRange;

/// Three points, and their plane as far as f64 gives it.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    points: [DVec3; 3],
    normal: DVec3,
    /// Sum of the magnitudes of the products that make up `normal`.
    magnitude: DVec3,
}

/// (7 + 56·2^-53)·2^-53: Shewchuk's bound A for a 3×3 determinant of differences.
const ORIENT3D_BOUND: f64 = (7.0 + 56.0 * (f64::EPSILON / 2.0)) * (f64::EPSILON / 2.0);
/// (3 + 16·2^-53)·2^-53: Shewchuk's bound A for a 2×2 determinant of differences.
const ORIENT2D_BOUND: f64 = (3.0 + 16.0 * (f64::EPSILON / 2.0)) * (f64::EPSILON / 2.0);
/// 2^-700. A product may lose 2^-1075 to underflow and then be multiplied by a tame difference, below 2^301.
const UNDERFLOW_SLACK: f64 = f64::from_bits((1023 - 700) << 52);
/// 2^-250. All bits of coordinates not below this are multiples of 2^-302, so all terms of `robust`'s expansions are
/// multiples of 2^-906 and none underflows.
const ADAPTIVE_LIMIT: f64 = f64::from_bits((1023 - 250) << 52);

impl Arithmetic for Tame {
    #[inline]
    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        self.side(&self.plane(&[o, a, b]), p)
    }

    #[inline]
    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        let (u, v) = (a - o, p - o);
        let (left, right) = (u.x * v.y, u.y * v.x);
        let determinant = left - right;
        if determinant.abs() > ORIENT2D_BOUND * (left.abs() + right.abs()) + UNDERFLOW_SLACK {
            return if determinant > 0.0 { 1 } else { -1 };
        }
        adaptive_orient2d(o, a, p)
    }

    #[inline]
    fn plane(self, &[o, a, b]: &[DVec3; 3]) -> Plane {
        let (u, v) = (a - o, b - o);
        let (left, right) = (u.yzx() * v.zxy(), u.zxy() * v.yzx());
        Plane { points: [o, a, b], normal: left - right, magnitude: left.abs() + right.abs() }
    }

    #[inline]
    fn side(self, plane: &Plane, p: DVec3) -> Sign {
        let w = p - plane.points[0];
        let determinant = plane.normal.dot(w);
        if determinant.abs() > ORIENT3D_BOUND * plane.magnitude.dot(w.abs()) + UNDERFLOW_SLACK {
            return if determinant > 0.0 { 1 } else { -1 };
        }
        adaptive_orient3d(plane.points, p)
    }
}

impl Arithmetic for AnyRange {
    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        any_range::orient3d(o, a, b, p)
    }

    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        any_range::orient2d(o, a, p)
    }

    fn plane(self, &points: &[DVec3; 3]) -> Plane {
        Plane { points, normal: DVec3::ZERO, magnitude: DVec3::ZERO }
    }

    fn side(self, &Plane { points: [o, a, b], .. }: &Plane, p: DVec3) -> Sign {
        any_range::orient3d(o, a, b, p)
    }
}

/// Whether `robust` is exact on a tame coordinate.
fn adaptive_can(coordinate: f64) -> bool {
    coordinate == 0.0 || coordinate.abs() >= ADAPTIVE_LIMIT
}

fn sign(value: f64) -> Sign {
    (value > 0.0) as Sign - (value < 0.0) as Sign
}

#[cold]
#[inline(never)]
fn adaptive_orient3d([o, a, b]: [DVec3; 3], p: DVec3) -> Sign {
    if ![o, a, b, p].iter().all(|point| point.to_array().into_iter().all(adaptive_can)) {
        return any_range::orient3d(o, a, b, p);
    }
    let coord = |point: DVec3| robust::Coord3D { x: point.x, y: point.y, z: point.z };
    // `robust` is positive where `p` lies on the other side.
    -sign(robust::orient3d(coord(o), coord(a), coord(b), coord(p)))
}

#[cold]
#[inline(never)]
fn adaptive_orient2d(o: DVec2, a: DVec2, p: DVec2) -> Sign {
    if ![o, a, p].iter().all(|point| point.to_array().into_iter().all(adaptive_can)) {
        return any_range::orient2d(o, a, p);
    }
    let coord = |point: DVec2| robust::Coord { x: point.x, y: point.y };
    sign(robust::orient2d(coord(o), coord(a), coord(p)))
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
    fn underflow_and_mixed_scales_are_exact() {
        let tiny = f64::from_bits(1);
        assert_eq!(both(O, DVec3::X * tiny, DVec3::Y * tiny, DVec3::Z * tiny), 1);
        assert_eq!(both(O, DVec3::X * 1e80, DVec3::Y * 1e-200, DVec3::Z * 1e-200), 1);
        assert_eq!(AnyRange.orient3d(O, DVec3::X * 1e300, DVec3::Y * 1e300, DVec3::Z * 1e-300), 1);
        assert_eq!(Tame.orient2d(DVec2::ZERO, DVec2::X * tiny, DVec2::Y * tiny), 1);
    }
}
