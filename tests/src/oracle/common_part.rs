//! The corners of the common part of two triangles, as exact points that rounded ones are compared with.

use num_bigint::BigInt;

use super::Triangle;
use super::convex::{ConvexHull, Point};
use super::integers::on_common_scale;

/// Whether `found` are the corners of the common part of two triangles, each coordinate the f64 nearest to the exact one, and
/// no corner is left out.
///
/// # Panics
/// When a coordinate is NaN or infinite, or `found` holds a largest number.
pub fn are_corners_of_common_part(found: &[[f64; 3]], a: &Triangle, b: &Triangle) -> bool {
    let neighbours = found.iter().flat_map(|point| [*point, point.map(f64::next_down), point.map(f64::next_up)]);
    let all: Vec<[f64; 3]> = a.iter().chain(b).copied().chain(neighbours).collect();
    let integers = on_common_scale(all.iter());
    let exact = ConvexHull::new(&integers[..3]).clipped_by(&ConvexHull::new(&integers[3..6]));
    let is_rounded = |point: &Point, [at, below, above]: &[[BigInt; 3]; 3]| {
        (0..3).all(|axis| {
            let twice = &point.numerators()[axis] * 2;
            let bound = |neighbour: &BigInt| (&at[axis] + neighbour) * point.denominator();
            bound(&below[axis]) <= twice && twice <= bound(&above[axis])
        })
    };
    let (found, _) = integers[6..].as_chunks::<3>();
    found.iter().all(|found| exact.iter().any(|point| is_rounded(point, found)))
        && exact.iter().all(|point| found.iter().any(|found| is_rounded(point, found)))
}
