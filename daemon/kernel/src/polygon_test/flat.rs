//! Pairs in one plane, and pieces without area: exact tests in two dimensions.
//!
//! Two convex sets in a plane are apart exactly when a line along an edge of one of them has the other strictly beyond it
//! (the difference of the two sets is convex, and its edges come from theirs); their interiors are apart when the line only
//! leaves the other not inside.

use glam::Vec3Swizzles;

use crate::predicates::{Sign, Stage};
use crate::report::Relation;

/// Two triangles of which one lies in the other's plane or has no area.
#[inline(never)]
pub(super) fn interference<S: Stage>(
    stage: S,
    a: &[S::Point; 3],
    b: &[S::Point; 3],
) -> Result<Option<Relation>, S::Doubt> {
    let (plane_a, plane_b) = (projection(stage, a)?, projection(stage, b)?);
    let meet = match (plane_a, plane_b) {
        (Some(plane), Some(_)) => {
            return triangles_in_plane(stage, &a.map(|p| plane.of(p)), &b.map(|p| plane.of(p)));
        }
        (Some(plane), None) => segment_and_triangle(stage, &ends::<S>(b), a, plane)?,
        (None, Some(plane)) => segment_and_triangle(stage, &ends::<S>(a), b, plane)?,
        (None, None) => segments(stage, &ends::<S>(a), &ends::<S>(b))?,
    };
    Ok(meet.then_some(Relation::Touch))
}

/// The coordinate that is dropped to see a plane in two dimensions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Dropped {
    X,
    Y,
    Z,
}

impl Dropped {
    #[inline]
    fn of<P: Vec3Swizzles>(self, point: P) -> P::Vec2 {
        match self {
            Dropped::X => point.yz(),
            Dropped::Y => point.xz(),
            Dropped::Z => point.xy(),
        }
    }
}

/// A projection in which the three points keep their area; `None` when they have none.
fn projection<S: Stage>(stage: S, points: &[S::Point; 3]) -> Result<Option<Dropped>, S::Doubt> {
    // The largest component of the normal is the likeliest; which one is taken does not change the answer.
    let likeliest = match stage.steepest(points) {
        2 => [Dropped::Z, Dropped::Y, Dropped::X],
        1 => [Dropped::Y, Dropped::Z, Dropped::X],
        _ => [Dropped::X, Dropped::Y, Dropped::Z],
    };
    for dropped in likeliest {
        if stage.turn(points.map(|point| dropped.of(point)))? != 0 {
            return Ok(Some(dropped));
        }
    }
    Ok(None)
}

/// Two triangles with area, in one plane.
fn triangles_in_plane<S: Stage>(stage: S, a: &[S::Flat; 3], b: &[S::Flat; 3]) -> Result<Option<Relation>, S::Doubt> {
    let (a, b) = (counterclockwise(stage, a)?, counterclockwise(stage, b)?);
    let mut relation = Relation::Coplanar;
    for (edges, points) in [(&a, &b), (&b, &a)] {
        for i in 0..3 {
            match innermost(stage, edges[i], edges[(i + 1) % 3], points)? {
                -1 => return Ok(None),
                0 => relation = Relation::Touch,
                _ => {}
            }
        }
    }
    Ok(Some(relation))
}

fn counterclockwise<S: Stage>(stage: S, &[o, a, b]: &[S::Flat; 3]) -> Result<[S::Flat; 3], S::Doubt> {
    Ok(if stage.turn([o, a, b])? > 0 { [o, a, b] } else { [o, b, a] })
}

/// The side of the line from `start` to `end` that the leftmost of the points lies on.
fn innermost<S: Stage>(stage: S, start: S::Flat, end: S::Flat, points: &[S::Flat]) -> Result<Sign, S::Doubt> {
    let mut innermost = -1;
    for &point in points {
        innermost = innermost.max(stage.turn([start, end, point])?);
        if innermost == 1 {
            break;
        }
    }
    Ok(innermost)
}

/// The ends of the segment (or point) that three points in a line span. The order of the coordinates, first by x, is the order
/// along the line.
fn ends<S: Stage>(&[o, a, b]: &[S::Point; 3]) -> [S::Point; 2] {
    let key = |p: S::Point| (p[0], p[1], p[2]);
    let less = |p, q| key(p) < key(q);
    let lowest = if less(a, o) { a } else { o };
    let highest = if less(o, a) { a } else { o };
    [if less(b, lowest) { b } else { lowest }, if less(highest, b) { b } else { highest }]
}

/// A segment (or point) and a triangle with area.
fn segment_and_triangle<S: Stage>(
    stage: S,
    &[p, q]: &[S::Point; 2],
    triangle: &[S::Point; 3],
    plane: Dropped,
) -> Result<bool, S::Doubt> {
    let own_plane = stage.plane_through(triangle);
    let sides = [stage.side_of(&own_plane, p)?, stage.side_of(&own_plane, q)?];
    if sides == [0, 0] {
        let (ends, triangle) = ([p, q].map(|end| plane.of(end)), triangle.map(|corner| plane.of(corner)));
        return segment_and_triangle_in_plane(stage, &ends, &triangle);
    }
    if sides[0] == sides[1] {
        return Ok(false);
    }
    // The line meets the plane in one point: it is inside where the line passes all edges on the same side.
    let mut turns = [0; 3];
    for i in 0..3 {
        turns[i] = stage.handedness([p, q, triangle[i], triangle[(i + 1) % 3]])?;
    }
    Ok(!(turns.contains(&1) && turns.contains(&-1)))
}

fn segment_and_triangle_in_plane<S: Stage>(
    stage: S,
    segment: &[S::Flat; 2],
    triangle: &[S::Flat; 3],
) -> Result<bool, S::Doubt> {
    let triangle = counterclockwise(stage, triangle)?;
    for i in 0..3 {
        if innermost(stage, triangle[i], triangle[(i + 1) % 3], segment)? < 0 {
            return Ok(false);
        }
    }
    Ok(!beside(stage, segment, &triangle)?)
}

/// Whether all points lie strictly on one side of a segment's line.
fn beside<S: Stage>(stage: S, &[p, q]: &[S::Flat; 2], points: &[S::Flat]) -> Result<bool, S::Doubt> {
    Ok(innermost(stage, p, q, points)? < 0 || innermost(stage, q, p, points)? < 0)
}

/// Two segments (or points).
fn segments<S: Stage>(stage: S, a: &[S::Point; 2], b: &[S::Point; 2]) -> Result<bool, S::Doubt> {
    if !boxes_meet::<S>(a, b) || stage.handedness([a[0], a[1], b[0], b[1]])? != 0 {
        return Ok(false);
    }
    for triple in [[a[0], a[1], b[0]], [a[0], a[1], b[1]], [b[0], b[1], a[0]], [b[0], b[1], a[1]]] {
        if let Some(plane) = projection(stage, &triple)? {
            let (a, b) = (a.map(|end| plane.of(end)), b.map(|end| plane.of(end)));
            return Ok(!beside(stage, &a, &b)? && !beside(stage, &b, &a)?);
        }
    }
    // All in one line: there, boxes that meet are segments that meet.
    Ok(true)
}

/// Whether the boxes of two segments have a point in common.
fn boxes_meet<S: Stage>(a: &[S::Point; 2], b: &[S::Point; 2]) -> bool {
    let reaches = |p: &[S::Point; 2], q: &[S::Point; 2], axis| {
        p[0][axis] <= q[0][axis] || p[0][axis] <= q[1][axis] || p[1][axis] <= q[0][axis] || p[1][axis] <= q[1][axis]
    };
    (0..3).all(|axis| reaches(a, b, axis) && reaches(b, a, axis))
}
