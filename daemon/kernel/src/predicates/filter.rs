//! The floating-point filter: signs that plain f64 proves by an error bound, for tame coordinates.

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::Sign;
use super::stage::{self, Stage};

/// Signs that are proven for tame positions. Zero is never proven.
#[derive(Debug, Clone, Copy)]
pub struct Filter;

/// A sign that the filter cannot prove.
#[derive(Debug, Clone, Copy)]
pub struct TooClose;

/// A determinant as f64 gives it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub determinant: f64,
    /// The sum of the magnitudes of its products.
    pub permanent: f64,
    /// The largest error per permanent.
    bound: f64,
}

impl Estimate {
    #[inline]
    pub fn is_certain(&self) -> bool {
        self.determinant.abs() > self.bound * self.permanent + UNDERFLOW_SLACK
    }

    /// The sign where it is certain.
    #[inline]
    pub fn sign(&self) -> Sign {
        if self.determinant > 0.0 { 1 } else { -1 }
    }
}

/// Three points, and their plane as far as f64 gives it.
#[derive(Debug, Clone, Copy)]
pub struct Plane {
    pub(super) points: [DVec3; 3],
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

impl Plane {
    #[inline]
    pub(super) fn through(&[o, a, b]: &[DVec3; 3]) -> Plane {
        let (u, v) = (a - o, b - o);
        let (left, right) = (u.yzx() * v.zxy(), u.zxy() * v.yzx());
        Plane { points: [o, a, b], normal: left - right, magnitude: left.abs() + right.abs() }
    }

    #[inline]
    pub(super) fn orient3d(&self, p: DVec3) -> Estimate {
        let w = p - self.points[0];
        let (determinant, permanent) = (self.normal.dot(w), self.magnitude.dot(w.abs()));
        Estimate { determinant, permanent, bound: ORIENT3D_BOUND }
    }
}

#[inline]
pub(super) fn orient2d([o, a, p]: [DVec2; 3]) -> Estimate {
    let (u, v) = (a - o, p - o);
    let (left, right) = (u.x * v.y, u.y * v.x);
    Estimate { determinant: left - right, permanent: left.abs() + right.abs(), bound: ORIENT2D_BOUND }
}

impl Filter {
    #[inline]
    fn judge(estimate: Estimate) -> Result<Sign, TooClose> {
        if estimate.is_certain() { Ok(estimate.sign()) } else { Err(TooClose) }
    }
}

impl Stage for Filter {
    type Point = DVec3;
    type Flat = DVec2;
    type Plane = Plane;
    type Doubt = TooClose;

    #[inline]
    fn handedness(self, [o, a, b, p]: [DVec3; 4]) -> Result<Sign, TooClose> {
        Self::judge(Plane::through(&[o, a, b]).orient3d(p))
    }

    #[inline]
    fn turn(self, corners: [DVec2; 3]) -> Result<Sign, TooClose> {
        Self::judge(orient2d(corners))
    }

    #[inline]
    fn plane_through(self, corners: &[DVec3; 3]) -> Plane {
        Plane::through(corners)
    }

    /// All three are asked about at once: one branch for their doubts. Random pairs took a seventh longer with a call here.
    #[inline(always)]
    fn sides_of(self, plane: &Plane, corners: &[DVec3; 3]) -> Result<[Sign; 3], TooClose> {
        let estimates = corners.map(|corner| plane.orient3d(corner));
        let certain = estimates[0].is_certain() & estimates[1].is_certain() & estimates[2].is_certain();
        if certain { Ok(estimates.map(|estimate| estimate.sign())) } else { Err(TooClose) }
    }

    #[inline]
    fn side_of(self, plane: &Plane, corner: DVec3) -> Result<Sign, TooClose> {
        Self::judge(plane.orient3d(corner))
    }

    #[inline]
    fn steepest(self, corners: &[DVec3; 3]) -> usize {
        stage::steepest(corners)
    }
}
