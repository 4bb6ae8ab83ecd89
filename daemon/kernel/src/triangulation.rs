//! How a polygon of more than three corners is cut into triangles: once, in the object's own frame.
//!
//! The rule: a fan from the first corner where no triangle of the fan runs against the polygon, else ear clipping, which
//! takes the first corner that is an ear again and again. Judged in the coordinate plane that the polygon covers most of
//! (largest component of Newell's normal in f64; ties: z, then y), with exact signs. A polygon that covers none is a fan.

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::predicates::{AnyRange, Arithmetic, Sign, Tame, is_tame};

/// Appends the triangles of a polygon, as vertex indices, `polygon.len() - 2` of them.
pub(crate) fn triangulate(vertices: &[[f64; 3]], polygon: &[u32], triangles: &mut Vec<[u32; 3]>) {
    if let [a, b, c] = *polygon {
        triangles.push([a, b, c]);
        return;
    }
    let positions: Vec<DVec3> = polygon.iter().map(|&vertex| DVec3::from(vertices[vertex as usize])).collect();
    let corners = if is_tame(&positions) { cut(Tame, &positions) } else { cut(AnyRange, &positions) };
    triangles.extend(corners.into_iter().map(|triangle| triangle.map(|corner| polygon[corner])));
}

fn cut<A: Arithmetic>(arithmetic: A, positions: &[DVec3]) -> Vec<[usize; 3]> {
    match orientation(positions) {
        Some((flat, turn)) if !fan_follows(arithmetic, &flat, turn) => clip_ears(arithmetic, &flat, turn),
        _ => (1..positions.len() - 1).map(|corner| [0, corner, corner + 1]).collect(),
    }
}

/// The polygon in the coordinate plane it covers most of, and which way it runs there; `None` when it covers none.
fn orientation(positions: &[DVec3]) -> Option<(Vec<DVec2>, Sign)> {
    // Scaled to about 1, so that nothing overflows and little underflows.
    let largest = positions.iter().fold(f64::MIN_POSITIVE, |largest, p| largest.max(p.abs().max_element()));
    let scale = 1.0 / largest;
    let origin = positions[0] * scale;
    let next = positions.iter().cycle().skip(1);
    let normal = positions
        .iter()
        .zip(next)
        .fold(DVec3::ZERO, |sum, (&p, &q)| sum + (p * scale - origin).cross(q * scale - origin));
    let size = normal.abs();
    let (flat, area): (Vec<DVec2>, f64) = if size.z >= size.x.max(size.y) {
        (positions.iter().map(|p| p.xy()).collect(), normal.z)
    } else if size.y >= size.x {
        (positions.iter().map(|p| p.zx()).collect(), normal.y)
    } else {
        (positions.iter().map(|p| p.yz()).collect(), normal.x)
    };
    let turn = (area > 0.0) as Sign - (area < 0.0) as Sign;
    (turn != 0).then_some((flat, turn))
}

fn fan_follows<A: Arithmetic>(arithmetic: A, flat: &[DVec2], turn: Sign) -> bool {
    flat[1..].windows(2).all(|edge| arithmetic.orient2d(flat[0], edge[0], edge[1]) != -turn)
}

fn clip_ears<A: Arithmetic>(arithmetic: A, flat: &[DVec2], turn: Sign) -> Vec<[usize; 3]> {
    let mut rest: Vec<usize> = (0..flat.len()).collect();
    let mut triangles = Vec::with_capacity(flat.len() - 2);
    while rest.len() > 3 {
        // A polygon that crosses itself may have no ear left; its first corner is then cut off.
        let ear = (0..rest.len()).find(|&at| is_ear(arithmetic, flat, &rest, at, turn)).unwrap_or(0);
        triangles.push(around(&rest, ear));
        rest.remove(ear);
    }
    triangles.push([rest[0], rest[1], rest[2]]);
    triangles
}

/// The corner before, the corner, the corner after.
fn around(rest: &[usize], at: usize) -> [usize; 3] {
    [rest[(at + rest.len() - 1) % rest.len()], rest[at], rest[(at + 1) % rest.len()]]
}

/// Whether the corner runs with the polygon and no other corner lies in its triangle. A corner in a straight line is an ear
/// when no other corner lies on it.
fn is_ear<A: Arithmetic>(arithmetic: A, flat: &[DVec2], rest: &[usize], at: usize, turn: Sign) -> bool {
    let [before, corner, after] = around(rest, at).map(|corner| flat[corner]);
    if arithmetic.orient2d(before, corner, after) == -turn {
        return false;
    }
    let inside = |p: DVec2| {
        let edges = [(before, corner), (corner, after), (after, before)];
        edges.iter().all(|&(start, end)| arithmetic.orient2d(start, end, p) != -turn)
            && p.cmpge(before.min(corner).min(after)).all()
            && p.cmple(before.max(corner).max(after)).all()
    };
    let corners = [before, corner, after];
    !rest.iter().map(|&other| flat[other]).any(|p| !corners.contains(&p) && inside(p))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(vertices: &[[f64; 3]], polygon: &[u32], expected: &[[u32; 3]]) {
        let mut triangles = Vec::new();
        triangulate(vertices, polygon, &mut triangles);
        assert_eq!(triangles, expected);
    }

    const L: [[f64; 3]; 6] =
        [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 4.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn a_fan_where_it_follows_the_polygon() {
        check(&L, &[0, 1, 2, 3, 4, 5], &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]);
        let straight = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
        check(&straight, &[0, 1, 2, 3], &[[0, 1, 2], [0, 2, 3]]);
        let saddle = [[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [4.0, 4.0, 0.0], [0.0, 4.0, 1.0]];
        check(&saddle, &[0, 1, 2, 3], &[[0, 1, 2], [0, 2, 3]]);
        check(&saddle, &[3, 2, 1, 0], &[[3, 2, 1], [3, 1, 0]]);
        check(&[[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3]], &[0, 1, 2, 3], &[[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn ears_where_a_fan_would_cover_a_notch() {
        check(&L, &[4, 5, 0, 1, 2, 3], &[[3, 4, 5], [3, 5, 0], [3, 0, 1], [1, 2, 3]]);
    }

    #[test]
    fn triangles_of_a_concave_polygon_cover_its_area_in_every_frame() {
        let u = [[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [4.0, 4.0], [4.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
        let frames: [fn([f64; 2]) -> [f64; 3]; 4] =
            [|[x, y]| [x, y, 7.0], |[x, y]| [y, x, x], |[x, y]| [3.0, x, y], |[x, y]| [x * 1e300, 0.0, y * 1e300]];
        for frame in frames {
            let vertices = u.map(frame);
            for start in 0..8u32 {
                let polygon: Vec<u32> = (0..8).map(|corner| (start + corner) % 8).collect();
                let mut triangles = Vec::new();
                triangulate(&vertices, &polygon, &mut triangles);
                let area = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|corner| DVec2::from(u[corner as usize]));
                    (b - a).perp_dot(c - a) / 2.0
                };
                assert!(triangles.iter().all(|triangle| area(triangle) >= 0.0), "{triangles:?}");
                assert_eq!(triangles.iter().map(area).sum::<f64>(), 11.0);
            }
        }
    }
}
