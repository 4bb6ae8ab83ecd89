//! The corners of triangles as a [`NearFrame`](super::near_triangles::NearFrame) sees them, and directions that prove two triangles apart.
//!
//! For any vector f, two triangles are at least `(min f·q − max f·p) / |f|` apart, and exactly so far when f goes from one nearest point to
//! the other. The search for such an f starts between the middles and steps towards the corners that are nearest along it: Gilbert, "An
//! Iterative Procedure for Computing the Minimum of a Quadratic Form on a Convex Set", SIAM J. Control 4, 1966. Whatever f it has
//! come to, the bound holds.
//!
//! # Why it is a bound
//! u = 2^-24; `sides` is no less than the length of any position in the frame. Coordinates are within u of themselves (what f64 rounds is
//! far below that). A product f·q passes
//! three roundings, their difference one: with the coordinates in all less than 10u·|f|·sides. The squares, their root and the limit
//! pass less than 8 roundings of what is at most 2·sides·|f|. [`limit_of`] adds more than twice that. What underflows is less than
//! 2^-146, and nothing beside it where f is no shorter than [`SHORTEST`]; a shorter f counts as so long.

use glam::{Mat4, Vec4, Vec4Swizzles};

/// Far above what underflows when it is squared.
const SHORTEST: f32 = 1e-15;

/// The distance that [`NearCorners::are_apart`] is to be given for triangles that are no farther apart than `limit`. `sides` is the sum of the
/// sides of the world box of both bodies. Scaled.
pub(super) fn limit_of(limit: f64, sides: f64) -> f32 {
    /// 2^-18.
    const ROUNDING: f64 = 1.0 / (1 << 18) as f64;
    (limit * (1.0 + ROUNDING) + sides * ROUNDING) as f32
}

/// The corners of a triangle in the frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearCorners(pub [Vec4; 3]);

impl NearCorners {
    /// Whether a direction is found that proves the triangles farther apart than what [`limit_of`] made of a limit.
    #[inline(always)]
    pub fn are_apart(&self, other: &NearCorners, limit: f32) -> bool {
        /// More of them cost more than they spare.
        const ROUNDS: usize = 3;
        let ([p, q], square_limit) = ([self, other].map(NearCorners::by_axis), limit * limit);
        let mut between = (other.sum() - self.sum()) * (1.0 / 3.0);
        for _ in 0..ROUNDS {
            let (x, y, z) = (between.xxxx(), between.yyyy(), between.zzzz());
            let (p, q) = (p[0] * x + p[1] * y + p[2] * z, q[0] * x + q[1] * y + q[2] * z);
            let (highest, lowest) = (over_lanes(p, Vec4::max), over_lanes(q, Vec4::min));
            let (gap, square) = ((lowest - highest).x, between.dot(between));
            if gap > 0.0 && gap * gap > square_limit * square.max(SHORTEST * SHORTEST) {
                return true;
            }
            // It goes from a point of the one to a point of the other.
            if square <= square_limit {
                return false;
            }
            let corner = |at: Vec4, best: Vec4| at.cmpeq(best).bitmask().trailing_zeros() as usize % 3;
            let to_corners = between - (other.0[corner(q, lowest)] - self.0[corner(p, highest)]);
            let share = between.dot(to_corners) / to_corners.dot(to_corners);
            between -= to_corners * share.clamp(0.0, 1.0);
        }
        false
    }

    #[inline(always)]
    fn sum(&self) -> Vec4 {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// A corner in each lane, the first one twice.
    #[inline(always)]
    fn by_axis(&self) -> [Vec4; 3] {
        let [p, q, r] = self.0;
        let by_axis = Mat4::from_cols(p, q, r, p).transpose();
        [by_axis.x_axis, by_axis.y_axis, by_axis.z_axis]
    }
}

/// The largest, or smallest, of the lanes in each of them.
#[inline(always)]
fn over_lanes(lanes: Vec4, of: impl Fn(Vec4, Vec4) -> Vec4) -> Vec4 {
    let two = of(lanes, lanes.zwxy());
    of(two, two.yxwz())
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::triangles::nearest;
    use super::*;

    /// Numbers from −1 to 1, by the multiplier of Knuth, "The Art of Computer Programming" 2, section 3.3.4.
    fn next(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Triangles of this size around a point.
    fn triangle(state: &mut u64, at: DVec3, size: f64) -> [DVec3; 3] {
        [(); 3].map(|()| at + DVec3::new(next(state), next(state), next(state)) * size)
    }

    /// How many of the pairs are proven farther apart than this share of their distance.
    fn proven(size: f64, share: f64) -> usize {
        let (mut state, mut count) = (7, 0);
        let seen = |corners: &[DVec3; 3]| NearCorners(corners.map(|corner| corner.as_vec3().extend(0.0)));
        for round in 0..2000 {
            let p = triangle(&mut state, DVec3::ZERO, size);
            let away = DVec3::new(next(&mut state), next(&mut state), next(&mut state)).normalize();
            let mut q = triangle(&mut state, away * 1.5, size);
            // Needles and points too.
            q[2] = if round % 3 == 0 { q[1] } else { q[2] };
            let limit = limit_of(nearest(&p, &q).value * share, 12.0);
            count += usize::from(seen(&p).are_apart(&seen(&q), limit));
        }
        count
    }

    #[test]
    fn nothing_is_proven_farther_apart_than_it_is() {
        for size in [1e-6, 1e-3, 0.1, 0.5, 1.0] {
            assert_eq!(proven(size, 1.0), 0, "{size}");
        }
        let point = NearCorners([Vec4::ONE; 3]);
        assert!(!point.are_apart(&point, 0.0) && !point.are_apart(&point, f32::INFINITY));
    }

    #[test]
    fn most_of_what_is_farther_apart_is_proven_to_be() {
        assert_eq!(proven(0.1, 0.95), 2000);
        assert!(proven(0.5, 0.8) > 1500, "{}", proven(0.5, 0.8));
    }
}
