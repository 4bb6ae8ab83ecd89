//! Signs as plain f64 and plain f32 give them: what exactness is compared with. Wrong near zero; never used by the kernel.

use std::convert::Infallible;

use collided_kernel::glam::{DVec2, DVec3, Vec2, Vec3};
use collided_kernel::predicates::{Arithmetic, Sign, Stage};

/// Plain f64, no filter, no exact fallback.
#[derive(Debug, Clone, Copy)]
pub struct PlainF64;

/// Plain f32, for corners that were rounded to it.
#[derive(Debug, Clone, Copy)]
pub struct PlainF32;

/// A point of a plane, and its normal.
#[derive(Debug, Clone, Copy)]
pub struct PlainPlane<V> {
    point: V,
    normal: V,
}

fn sign<T: PartialOrd + Default>(value: T) -> Sign {
    Sign::from(value > T::default()) - Sign::from(value < T::default())
}

impl Arithmetic for PlainF64 {
    type Plane = PlainPlane<DVec3>;
    type First = Self;

    fn first(self) -> Self {
        self
    }

    fn orient3d(self, o: DVec3, a: DVec3, b: DVec3, p: DVec3) -> Sign {
        self.side(&self.plane(&[o, a, b]), p)
    }

    fn orient2d(self, o: DVec2, a: DVec2, p: DVec2) -> Sign {
        sign((a - o).perp_dot(p - o))
    }

    fn plane(self, &[o, a, b]: &[DVec3; 3]) -> PlainPlane<DVec3> {
        PlainPlane { point: o, normal: (a - o).cross(b - o) }
    }

    fn side(self, plane: &PlainPlane<DVec3>, p: DVec3) -> Sign {
        sign(plane.normal.dot(p - plane.point))
    }
}

impl Stage for PlainF32 {
    type Point = Vec3;
    type Flat = Vec2;
    type Plane = PlainPlane<Vec3>;
    type Doubt = Infallible;

    fn handedness(self, [o, a, b, p]: [Vec3; 4]) -> Result<Sign, Infallible> {
        self.side_of(&self.plane_through(&[o, a, b]), p)
    }

    fn turn(self, [o, a, p]: [Vec2; 3]) -> Result<Sign, Infallible> {
        Ok(sign((a - o).perp_dot(p - o)))
    }

    fn plane_through(self, &[o, a, b]: &[Vec3; 3]) -> PlainPlane<Vec3> {
        PlainPlane { point: o, normal: (a - o).cross(b - o) }
    }

    fn side_of(self, plane: &PlainPlane<Vec3>, corner: Vec3) -> Result<Sign, Infallible> {
        Ok(sign(plane.normal.dot(corner - plane.point)))
    }

    fn steepest(self, &[o, a, b]: &[Vec3; 3]) -> usize {
        (a - o).cross(b - o).abs().max_position()
    }
}

#[cfg(test)]
mod tests {
    use collided_kernel::polygon_test::{interference, triangles, triangles_in};

    use super::*;

    fn found(a: [DVec3; 3], b: [DVec3; 3]) -> [bool; 3] {
        let [a32, b32] = [a, b].map(|corners| corners.map(|corner| corner.as_vec3()));
        let Ok(in_f32) = interference(PlainF32, &a32, &b32);
        [triangles(&a, &b).is_some(), triangles_in(PlainF64, &a, &b).is_some(), in_f32.is_some()]
    }

    fn upright(bottom: f64) -> [DVec3; 3] {
        [DVec3::new(0.2, 0.2, bottom), DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.3, 0.2, 1.0)]
    }

    const FLAT: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn far_from_zero_all_agree() {
        assert_eq!(found(FLAT, upright(-1.0)), [true; 3]);
        assert_eq!(found(FLAT, upright(0.5)), [false; 3]);
        assert_eq!(found(FLAT, FLAT), [true; 3]);
    }

    #[test]
    fn near_zero_each_arithmetic_errs_in_its_turn() {
        let slanted = [DVec3::ZERO, DVec3::new(1.0, 0.0, 0.1), DVec3::new(0.0, 1.0, 0.7)];
        let wrong = |gap: f64| {
            let above = slanted.map(|corner| corner + DVec3::new(0.013, 0.017, 0.0));
            let above = above.map(|corner| corner.with_z(0.1 * corner.x + 0.7 * corner.y + gap));
            let [exact, plain, single] = found(slanted, above);
            [plain != exact, single != exact]
        };
        assert_eq!(wrong(1e-3), [false, false]);
        assert_eq!(wrong(1e-10), [false, true]);
    }
}
