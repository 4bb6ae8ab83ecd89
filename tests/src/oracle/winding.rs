//! How many times a closed surface winds around a point, by a ray in general position.

use num_bigint::{BigInt, Sign};

use super::integers::{self, IntegerPoint};
use super::surface::Surface;

/// Directions of rays, no two of their coordinates alike; the first one that meets no edge is taken.
const DIRECTIONS: [[i64; 3]; 6] = [
    [1_000_003, 700_027, 31_337],
    [-271_829, 1_618_034, 577_217],
    [141_421, -173_207, 2_236_069],
    [-999_983, -314_159, -161_803],
    [65_537, 8_191, -1_299_709],
    [-7, 104_729, -1_000_000_007],
];

/// Winding number of a closed surface around a point that is not on it.
///
/// # Panics
/// When every direction meets an edge, or a coordinate is not finite.
pub fn winding_number(surface: Surface<'_>, point: [f64; 3]) -> i64 {
    let mut points = integers::on_common_scale(surface.vertices.iter().chain([&point]));
    let origin = points.pop().unwrap_or_default();
    let vertices: Vec<IntegerPoint> = points.iter().map(|vertex| minus(vertex, &origin)).collect();
    let count = |direction: [i64; 3]| winding_along(&vertices, surface.triangles, &direction.map(BigInt::from));
    DIRECTIONS.into_iter().find_map(count).expect("some ray meets no edge")
}

/// `None` when the line of the ray meets an edge.
fn winding_along(vertices: &[IntegerPoint], triangles: &[[u32; 3]], direction: &IntegerPoint) -> Option<i64> {
    let mut winding = 0;
    for triangle in triangles {
        let [u, v, w] = triangle.map(|vertex| &vertices[vertex as usize]);
        let normal = cross(&minus(v, u), &minus(w, u));
        let has_area = normal.iter().any(|coordinate| *coordinate != BigInt::ZERO);
        if has_area && dot(direction, &normal) == BigInt::ZERO {
            return None;
        }
        // A point in the plane of the triangle, and not on it: the ray leaves the plane at once.
        let ahead = dot(u, &cross(v, w)).sign();
        if !has_area || ahead == Sign::NoSign {
            continue;
        }
        let volumes = [(u, v), (v, w), (w, u)].map(|(from, to)| dot(direction, &cross(from, to)));
        let signs = [&volumes[0], &volumes[1], &volumes[2]].map(BigInt::sign);
        if signs.contains(&Sign::NoSign) {
            return None;
        }
        if signs == [ahead; 3] {
            winding += if ahead == Sign::Plus { 1 } else { -1 };
        }
    }
    Some(winding)
}

fn minus(a: &IntegerPoint, b: &IntegerPoint) -> IntegerPoint {
    [0, 1, 2].map(|axis| &a[axis] - &b[axis])
}

fn cross(a: &IntegerPoint, b: &IntegerPoint) -> IntegerPoint {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &a[i] * &b[j] - &a[j] * &b[i])
}

fn dot(a: &IntegerPoint, b: &IntegerPoint) -> BigInt {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}
