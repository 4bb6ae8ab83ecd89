//! The shortest way from one triangle to another, as far as f64 gives it.
//!
//! It chooses an axis and estimates a distance; nothing is proven by it. Ericson, "Real-Time Collision Detection",
//! 2005, sections 5.1.9 (segments) and 5.1.10 (triangles).

use glam::DVec3;

/// The vector from the nearest point of `a` to that of `b`. Triangles that cross give some short vector.
pub(super) fn vector_between(a: &[DVec3; 3], b: &[DVec3; 3]) -> DVec3 {
    let mut nearest = b[0] - a[0];
    let mut keep = |vector: DVec3| {
        if vector.length_squared() < nearest.length_squared() {
            nearest = vector;
        }
    };
    for i in 0..3 {
        for j in 0..3 {
            keep(between_segments([a[i], a[(i + 1) % 3]], [b[j], b[(j + 1) % 3]]));
        }
    }
    b.iter().filter_map(|&point| from_face(a, point)).for_each(&mut keep);
    a.iter().filter_map(|&point| from_face(b, point)).for_each(|vector| keep(-vector));
    nearest
}

fn between_segments([p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> DVec3 {
    let (u, v, w) = (q - p, s - r, p - r);
    let (uu, vv, uv, uw, vw) = (u.dot(u), v.dot(v), u.dot(v), u.dot(w), v.dot(w));
    let along = |numerator: f64, squared: f64| if squared > 0.0 { (numerator / squared).clamp(0.0, 1.0) } else { 0.0 };
    let determinant = uu * vv - uv * uv;
    let mut at_u = along(uv * vw - uw * vv, determinant);
    let mut at_v = if vv > 0.0 { (uv * at_u + vw) / vv } else { 0.0 };
    if !(0.0..=1.0).contains(&at_v) {
        at_v = at_v.clamp(0.0, 1.0);
        at_u = along(uv * at_v - uw, uu);
    } else if vv == 0.0 {
        at_u = along(-uw, uu);
    }
    v * at_v - w - u * at_u
}

/// From the foot of the perpendicular to the point, where the foot is inside the triangle.
fn from_face(&[o, a, b]: &[DVec3; 3], point: DVec3) -> Option<DVec3> {
    let normal = (a - o).cross(b - o);
    let squared = normal.length_squared();
    let inside = [(o, a), (a, b), (b, o)].iter().all(|&(p, q)| (q - p).cross(point - p).dot(normal) >= 0.0);
    (inside && squared > 0.0).then(|| normal * ((point - o).dot(normal) / squared))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(a: [[f64; 3]; 3], b: [[f64; 3]; 3], expected: [f64; 3]) {
        let (a, b) = (a.map(DVec3::from), b.map(DVec3::from));
        let found = vector_between(&a, &b);
        assert!((found - DVec3::from(expected)).length() < 1e-12, "{found}");
        assert!((vector_between(&b, &a) + found).length() < 1e-12);
    }

    #[test]
    fn corners_edges_faces_and_what_they_degenerate_to() {
        let flat = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        let point = |p| [p, p, p];
        check(flat, point([1.0, 1.0, 2.0]), [0.0, 0.0, 2.0]);
        check(flat, point([-3.0, -4.0, 0.0]), [-3.0, -4.0, 0.0]);
        check(flat, [[2.0, -1.0, -3.0], [2.0, -1.0, 5.0], [2.0, -9.0, 1.0]], [0.0, -1.0, 0.0]);
        check(point([1.0; 3]), point([1.0, 5.0, 1.0]), [0.0, 4.0, 0.0]);
        check(point([1.0, 2.0, 0.0]), [[0.0; 3], [9.0, 0.0, 0.0], [9.0, 0.0, 0.0]], [0.0, -2.0, 0.0]);
    }
}
