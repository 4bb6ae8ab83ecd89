//! Pairs in one plane, and pieces without area: exact tests in two dimensions.
//!
//! Two convex sets in a plane are apart exactly when a line along an edge of one of them has the other strictly beyond it
//! (the difference of the two sets is convex, and its edges come from theirs); their interiors are apart when the line only
//! leaves the other not inside.

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::predicates::{Arithmetic, Sign};
use crate::report::Relation;

/// Two triangles of which one lies in the other's plane or has no area.
#[inline(never)]
pub(super) fn interference<A: Arithmetic>(arithmetic: A, a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<Relation> {
    let (plane_a, plane_b) = (projection(arithmetic, a), projection(arithmetic, b));
    let meet = match (plane_a, plane_b) {
        (Some(plane), Some(_)) => return triangles_in_plane(arithmetic, &a.map(plane.of()), &b.map(plane.of())),
        (Some(plane), None) => segment_and_triangle(arithmetic, &ends(b), a, plane),
        (None, Some(plane)) => segment_and_triangle(arithmetic, &ends(a), b, plane),
        (None, None) => segments(arithmetic, &ends(a), &ends(b)),
    };
    meet.then_some(Relation::Touch)
}

/// The coordinate that is dropped to see a plane in two dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dropped {
    X,
    Y,
    Z,
}

impl Dropped {
    fn of(self) -> fn(DVec3) -> DVec2 {
        match self {
            Dropped::X => |p| p.yz(),
            Dropped::Y => |p| p.xz(),
            Dropped::Z => |p| p.xy(),
        }
    }
}

/// A projection in which the three points keep their area; `None` when they have none.
fn projection<A: Arithmetic>(arithmetic: A, &[o, a, b]: &[DVec3; 3]) -> Option<Dropped> {
    // The largest component of the normal is the likeliest; which one is taken does not change the answer.
    let normal = (a - o).cross(b - o).abs();
    let first = if normal.z >= normal.x.max(normal.y) {
        [Dropped::Z, Dropped::Y, Dropped::X]
    } else if normal.y >= normal.x {
        [Dropped::Y, Dropped::Z, Dropped::X]
    } else {
        [Dropped::X, Dropped::Y, Dropped::Z]
    };
    let keeps_area = |dropped: &Dropped| {
        let of = dropped.of();
        arithmetic.orient2d(of(o), of(a), of(b)) != 0
    };
    first.into_iter().find(keeps_area)
}

/// Two triangles with area, in one plane.
fn triangles_in_plane<A: Arithmetic>(arithmetic: A, a: &[DVec2; 3], b: &[DVec2; 3]) -> Option<Relation> {
    let (a, b) = (counterclockwise(arithmetic, a), counterclockwise(arithmetic, b));
    let mut relation = Relation::Coplanar;
    for (edges, points) in [(&a, &b), (&b, &a)] {
        for i in 0..3 {
            match innermost(arithmetic, edges[i], edges[(i + 1) % 3], points) {
                -1 => return None,
                0 => relation = Relation::Touch,
                _ => {}
            }
        }
    }
    Some(relation)
}

fn counterclockwise<A: Arithmetic>(arithmetic: A, &[o, a, b]: &[DVec2; 3]) -> [DVec2; 3] {
    if arithmetic.orient2d(o, a, b) > 0 { [o, a, b] } else { [o, b, a] }
}

/// The side of the line from `start` to `end` that the leftmost of the points lies on.
fn innermost<A: Arithmetic>(arithmetic: A, start: DVec2, end: DVec2, points: &[DVec2]) -> Sign {
    let mut innermost = -1;
    for &point in points {
        innermost = innermost.max(arithmetic.orient2d(start, end, point));
        if innermost == 1 {
            break;
        }
    }
    innermost
}

/// The ends of the segment (or point) that three points in a line span. The order of the coordinates, first by x, is the order
/// along the line.
fn ends(&[o, a, b]: &[DVec3; 3]) -> [DVec3; 2] {
    let key = |p: &DVec3| (p.x, p.y, p.z);
    let less = |p: DVec3, q: DVec3| key(&p) < key(&q);
    let lowest = if less(a, o) { a } else { o };
    let highest = if less(o, a) { a } else { o };
    [if less(b, lowest) { b } else { lowest }, if less(highest, b) { b } else { highest }]
}

/// A segment (or point) and a triangle with area.
fn segment_and_triangle<A: Arithmetic>(
    arithmetic: A,
    &[p, q]: &[DVec3; 2],
    triangle: &[DVec3; 3],
    plane: Dropped,
) -> bool {
    let own_plane = arithmetic.plane(triangle);
    let sides = [p, q].map(|end| arithmetic.side(&own_plane, end));
    if sides == [0, 0] {
        return segment_and_triangle_in_plane(arithmetic, &[p, q].map(plane.of()), &triangle.map(plane.of()));
    }
    if sides[0] == sides[1] {
        return false;
    }
    // The line meets the plane in one point: it is inside where the line passes all edges on the same side.
    let turns = [0, 1, 2].map(|i| arithmetic.orient3d(p, q, triangle[i], triangle[(i + 1) % 3]));
    !(turns.contains(&1) && turns.contains(&-1))
}

fn segment_and_triangle_in_plane<A: Arithmetic>(arithmetic: A, &[p, q]: &[DVec2; 2], triangle: &[DVec2; 3]) -> bool {
    let triangle = counterclockwise(arithmetic, triangle);
    let beyond_an_edge = (0..3).any(|i| innermost(arithmetic, triangle[i], triangle[(i + 1) % 3], &[p, q]) < 0);
    let beside_the_segment = innermost(arithmetic, p, q, &triangle) < 0 || innermost(arithmetic, q, p, &triangle) < 0;
    !beyond_an_edge && !beside_the_segment
}

/// Two segments (or points).
fn segments<A: Arithmetic>(arithmetic: A, a: &[DVec3; 2], b: &[DVec3; 2]) -> bool {
    let boxes_meet = a[0].min(a[1]).cmple(b[0].max(b[1])).all() && b[0].min(b[1]).cmple(a[0].max(a[1])).all();
    if !boxes_meet || arithmetic.orient3d(a[0], a[1], b[0], b[1]) != 0 {
        return false;
    }
    let triples = [[a[0], a[1], b[0]], [a[0], a[1], b[1]], [b[0], b[1], a[0]], [b[0], b[1], a[1]]];
    let Some(plane) = triples.iter().find_map(|triple| projection(arithmetic, triple)) else {
        // All in one line: there, boxes that meet are segments that meet.
        return true;
    };
    let ([p, q], [r, s]) = (a.map(plane.of()), b.map(plane.of()));
    let apart =
        |p, q, points: [DVec2; 2]| innermost(arithmetic, p, q, &points) < 0 || innermost(arithmetic, q, p, &points) < 0;
    !apart(p, q, [r, s]) && !apart(r, s, [p, q])
}
