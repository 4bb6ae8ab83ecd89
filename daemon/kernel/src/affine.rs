//! Affine transforms and the rounding contract of world vertices.

use glam::DVec3;

/// An affine transform, row-major: three rows of (rotation, scale, shear | translation). Any finite map, singular included.
pub type Rows = [[f64; 4]; 3];

/// The transform that changes nothing.
pub const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// The world position of a vertex: `((m0*x + m1*y) + m2*z) + m3` per row, in f64, rounded to nearest, no FMA.
///
/// Every answer of this crate is the exact truth about the positions this function returns. It has the same bits in every
/// process and on every machine.
///
/// ```
/// use collided_kernel::affine::{IDENTITY, world_vertex};
/// assert_eq!(world_vertex(&IDENTITY, [1.0, 2.0, 3.0]).to_array(), [1.0, 2.0, 3.0]);
/// ```
#[inline(always)]
pub fn world_vertex(rows: &Rows, [x, y, z]: [f64; 3]) -> DVec3 {
    let coordinate = |[m0, m1, m2, m3]: [f64; 4]| ((m0 * x + m1 * y) + m2 * z) + m3;
    DVec3::new(coordinate(rows[0]), coordinate(rows[1]), coordinate(rows[2]))
}

/// Upper bounds of `|coordinate|`, per world axis, over all vertices with `|x|, |y|, |z|` at most `reach` (object frame).
///
/// Rounding is monotone, and this is the formula of [`world_vertex`] with every term made positive: no partial sum of any
/// vertex exceeds it. Where it is finite, no vertex overflows.
pub fn magnitude(rows: &Rows, reach: [f64; 3]) -> DVec3 {
    world_vertex(&rows.map(|row| row.map(f64::abs)), reach)
}

/// A bound, per world axis, of the distance between a rounded world vertex and the exact affine image of its vertex.
///
/// Three products and three sums: each term passes at most four roundings, so the relative error of the sum of magnitudes is
/// below 4·2^-53/(1 − 4·2^-53); the factor 5 also covers the rounding of `magnitude` and of this product. Each product may
/// lose 2^-1075 to underflow.
pub fn rounding_bound(magnitude: DVec3) -> DVec3 {
    const RELATIVE: f64 = 5.0 * f64::EPSILON / 2.0;
    /// 2^-1070.
    const UNDERFLOW: f64 = 8e-323;
    magnitude * RELATIVE + DVec3::splat(UNDERFLOW)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn world_vertices_are_rounded_after_every_operation() {
        // A fused multiply-add would give 2^-60 instead of 0 here.
        let epsilon = 2f64.powi(-30);
        let rows = [[1.0 + epsilon, 0.0, 0.0, -(1.0 + 2.0 * epsilon)], IDENTITY[1], IDENTITY[2]];
        assert_eq!(world_vertex(&rows, [1.0 + epsilon, 0.0, 0.0]).x, 0.0);
    }

    #[test]
    fn magnitude_bounds_every_vertex_and_says_when_one_may_overflow() {
        let rows = [[3.0, -4.0, 0.5, -7.0], [0.0, -1e200, 0.0, 1e200], [1e300, 0.0, 0.0, 0.0]];
        let bound = magnitude(&rows, [2.0, 3.0, 5.0]);
        for vertex in [[2.0, 3.0, 5.0], [-2.0, 3.0, -5.0], [2.0, -3.0, 0.0]] {
            assert!(world_vertex(&rows, vertex).abs().cmple(bound).all());
        }
        assert!(!magnitude(&rows, [1e10, 0.0, 0.0]).is_finite());
    }
}
