//! What the case analysis of a polygon test asks of the arithmetic that it is done in.

use std::convert::Infallible;
use std::ops::Index;

use glam::{DVec2, DVec3, Vec3Swizzles};

use super::{Arithmetic, Sign};

/// Arithmetic for one run of the case analysis. It may doubt a sign: the run ends there, and another stage begins anew.
///
/// Every [`Arithmetic`] is one that never doubts.
pub trait Stage: Copy {
    /// A corner.
    type Point: Vec3Swizzles<Vec2 = Self::Flat> + Index<usize, Output: Copy + PartialOrd>;
    /// A corner without one of its coordinates.
    type Flat: Copy;
    /// A plane through three corners.
    type Plane;
    /// Why a sign is not known.
    type Doubt;

    /// As [`Arithmetic::orient3d`].
    fn handedness(self, corners: [Self::Point; 4]) -> Result<Sign, Self::Doubt>;

    /// As [`Arithmetic::orient2d`].
    fn turn(self, corners: [Self::Flat; 3]) -> Result<Sign, Self::Doubt>;

    /// As [`Arithmetic::plane`].
    fn plane_through(self, corners: &[Self::Point; 3]) -> Self::Plane;

    /// As [`Arithmetic::side`].
    fn side_of(self, plane: &Self::Plane, corner: Self::Point) -> Result<Sign, Self::Doubt>;

    /// [`side_of`](Self::side_of) for three corners.
    #[inline(always)]
    fn sides_of(self, plane: &Self::Plane, &[p, q, r]: &[Self::Point; 3]) -> Result<[Sign; 3], Self::Doubt> {
        Ok([self.side_of(plane, p)?, self.side_of(plane, q)?, self.side_of(plane, r)?])
    }

    /// The axis along which the normal of a plane is likely to be longest.
    fn steepest(self, corners: &[Self::Point; 3]) -> usize;
}

impl<A: Arithmetic> Stage for A {
    type Point = DVec3;
    type Flat = DVec2;
    type Plane = A::Plane;
    type Doubt = Infallible;

    #[inline]
    fn handedness(self, [o, a, b, p]: [DVec3; 4]) -> Result<Sign, Infallible> {
        Ok(self.orient3d(o, a, b, p))
    }

    #[inline]
    fn turn(self, [o, a, p]: [DVec2; 3]) -> Result<Sign, Infallible> {
        Ok(self.orient2d(o, a, p))
    }

    #[inline]
    fn plane_through(self, corners: &[DVec3; 3]) -> A::Plane {
        self.plane(corners)
    }

    #[inline]
    fn side_of(self, plane: &A::Plane, corner: DVec3) -> Result<Sign, Infallible> {
        Ok(self.side(plane, corner))
    }

    #[inline]
    fn steepest(self, corners: &[DVec3; 3]) -> usize {
        steepest(corners)
    }
}

/// [`Stage::steepest`] by plain f64.
#[inline]
pub(super) fn steepest(&[o, a, b]: &[DVec3; 3]) -> usize {
    let normal = (a - o).cross(b - o).abs();
    if normal.z >= normal.x.max(normal.y) {
        2
    } else if normal.y >= normal.x {
        1
    } else {
        0
    }
}
