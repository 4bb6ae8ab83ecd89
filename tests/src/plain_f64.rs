//! Signs as plain f64 gives them: what exactness is compared with. Wrong near zero; never used by the kernel.

use collided_kernel::glam::{DVec2, DVec3};
use collided_kernel::predicates::{Arithmetic, Sign};

/// Plain f64, no filter, no exact fallback.
#[derive(Debug, Clone, Copy)]
pub struct PlainF64;

/// A point of a plane, and its normal.
#[derive(Debug, Clone, Copy)]
pub struct PlainPlane {
    point: DVec3,
    normal: DVec3,
}

fn sign(value: f64) -> Sign {
    Sign::from(value > 0.0) - Sign::from(value < 0.0)
}

impl Arithmetic for PlainF64 {
    type Plane = PlainPlane;

    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        self.side(&self.plane(&[o, a, b]), p)
    }

    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        sign((a - o).perp_dot(p - o))
    }

    fn plane(self, &[o, a, b]: &[DVec3; 3]) -> PlainPlane {
        PlainPlane { point: o, normal: (a - o).cross(b - o) }
    }

    fn side(self, plane: &PlainPlane, p: DVec3) -> Sign {
        sign(plane.normal.dot(p - plane.point))
    }
}
