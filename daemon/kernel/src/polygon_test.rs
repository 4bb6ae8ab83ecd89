//! Stage 8: the exact test of two polygon pieces (triangles) at rounded world positions.
//!
//! Triangles in general position follow Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using
//! Orientation Predicates", JGT 2003, section 3: each triangle meets the other's plane in an interval of the line that the
//! planes share, and two signs order the intervals. What lies in one plane, and pieces without area, go to `flat.rs`.

mod flat;

use glam::DVec3;

use crate::predicates::{AnyRange, Arithmetic, FixedPoint, Sign, Stage, Tame, is_tame, on_common_grid};
use crate::report::Relation;

/// How two closed triangles meet; `None` when they have no point in common. Exact for every finite position.
///
/// Triangles without area are the segments and points they degenerate to.
///
/// ```
/// use collided_kernel::{Relation, glam::DVec3, polygon_test::triangles};
/// let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
/// let upright = [DVec3::new(0.2, 0.2, -1.0), DVec3::new(0.2, 0.2, 1.0), DVec3::new(0.3, 0.2, 1.0)];
/// assert_eq!(triangles(&flat, &upright), Some(Relation::Cross));
/// ```
pub fn triangles(a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<Relation> {
    if is_tame(a.iter().chain(b)) { triangles_in(Tame, a, b) } else { triangles_in(AnyRange, a, b) }
}

/// [`triangles`] in a given arithmetic: as true as its signs are.
#[inline]
pub fn triangles_in<A: Arithmetic>(arithmetic: A, a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<Relation> {
    interference(arithmetic.first(), a, b).unwrap_or_else(|_| in_doubt(arithmetic, a, b))
}

/// A pair that the first stage leaves open.
#[cold]
#[inline(never)]
fn in_doubt<A: Arithmetic>(arithmetic: A, a: &[DVec3; 3], b: &[DVec3; 3]) -> Option<Relation> {
    let Ok(relation) = match on_common_grid(a, b) {
        Some([a, b]) => interference(FixedPoint, &a, &b),
        None => interference(arithmetic, a, b),
    };
    relation
}

/// The case analysis, in one stage, whose corners need not be f64: as true as its signs are.
///
/// # Errors
/// The doubt of a stage that leaves a sign open.
#[inline]
pub fn interference<S: Stage>(stage: S, a: &[S::Point; 3], b: &[S::Point; 3]) -> Result<Option<Relation>, S::Doubt> {
    let plane_a = stage.plane_through(a);
    let sides_b = stage.sides_of(&plane_a, b)?;
    if one_side(sides_b) {
        return Ok(None);
    }
    // A triangle without area has no plane: every point gets 0 there.
    if sides_b == [0; 3] {
        return flat::interference(stage, a, b);
    }
    let plane_b = stage.plane_through(b);
    let sides_a = stage.sides_of(&plane_b, a)?;
    if one_side(sides_a) {
        return Ok(None);
    }
    if sides_a == [0; 3] {
        return flat::interference(stage, a, b);
    }
    intervals(stage, a, sides_a, b, sides_b)
}

fn one_side(sides: [Sign; 3]) -> bool {
    sides == [1; 3] || sides == [-1; 3]
}

/// Two triangles with area whose planes meet in a line, each reaching the other's plane.
// Not inlined: random pairs took a third longer when this and `interference` were forced into their callers.
#[inline(never)]
fn intervals<S: Stage>(
    stage: S,
    a: &[S::Point; 3],
    sides_a: [Sign; 3],
    b: &[S::Point; 3],
    sides_b: [Sign; 3],
) -> Result<Option<Relation>, S::Doubt> {
    let (apex_a, above_a) = apex(sides_a);
    let (apex_b, above_b) = apex(sides_b);
    // Each triangle runs so that the other's apex is above its plane; then the intervals run along the line alike.
    let [p1, q1, r1] = from_apex(a, apex_a, above_b);
    let [p2, q2, r2] = from_apex(b, apex_b, above_a);
    let first = stage.handedness([p1, q1, p2, q2])?;
    if first > 0 {
        return Ok(None);
    }
    let second = stage.handedness([p1, r1, r2, p2])?;
    if second > 0 {
        return Ok(None);
    }
    let interiors_meet = first < 0 && second < 0 && straddles(sides_a) && straddles(sides_b);
    Ok(Some(if interiors_meet { Relation::Cross } else { Relation::Touch }))
}

fn straddles(sides: [Sign; 3]) -> bool {
    sides.contains(&1) && sides.contains(&-1)
}

/// The corner that is apart from the other two as seen from the other's plane, and whether it counts as above it.
fn apex(sides: [Sign; 3]) -> (usize, bool) {
    let only = |wanted: Sign| {
        let at = sides.iter().position(|&side| side == wanted)?;
        (sides.iter().filter(|&&side| side == wanted).count() == 1).then_some(at)
    };
    if let Some(above) = only(1) {
        return (above, true);
    }
    if let Some(below) = only(-1) {
        return (below, false);
    }
    // One corner on the plane, the others both on one side of it: the corner counts as on the other side.
    let on = sides.iter().position(|&side| side == 0).unwrap_or(0);
    (on, sides[(on + 1) % 3] < 0)
}

/// The corners from the apex on, in their own order or in the opposite one.
fn from_apex<P: Copy>(triangle: &[P; 3], apex: usize, own_order: bool) -> [P; 3] {
    let (next, last) = (triangle[(apex + 1) % 3], triangle[(apex + 2) % 3]);
    if own_order { [triangle[apex], next, last] } else { [triangle[apex], last, next] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(a: [[f64; 3]; 3], b: [[f64; 3]; 3], expected: Option<Relation>) {
        let (a, b) = (a.map(DVec3::from), b.map(DVec3::from));
        for turn in 0..3 {
            let turned = [a[turn], a[(turn + 1) % 3], a[(turn + 2) % 3]];
            let mirrored = [turned[0], turned[2], turned[1]];
            for a in [turned, mirrored] {
                assert_eq!(triangles(&a, &b), expected, "{a:?} {b:?}");
                assert_eq!(triangles(&b, &a), expected, "{b:?} {a:?}");
                assert_eq!(triangles_in(AnyRange, &a, &b), expected, "any range: {a:?} {b:?}");
            }
        }
    }

    const FLAT: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn general_position() {
        check(FLAT, [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], Some(Relation::Cross));
        check(FLAT, [[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], Some(Relation::Touch));
        check(FLAT, [[1.0, 1.0, 0.5], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], None);
        check(FLAT, [[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [4.0, 3.0, 1.0]], None);
        check(FLAT, [[2.0, 2.0, -1.0], [2.0, 2.0, 1.0], [4.0, 4.0, 0.0]], Some(Relation::Touch));
        check(FLAT, [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 3.0]], Some(Relation::Touch));
    }

    #[test]
    fn in_one_plane() {
        check(FLAT, FLAT, Some(Relation::Coplanar));
        check(FLAT, [[1.0, 1.0, 0.0], [5.0, 1.0, 0.0], [1.0, 5.0, 0.0]], Some(Relation::Coplanar));
        check(FLAT, [[4.0, 0.0, 0.0], [8.0, 0.0, 0.0], [4.0, 4.0, 0.0]], Some(Relation::Touch));
        check(FLAT, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, -4.0, 0.0]], Some(Relation::Touch));
        check(FLAT, [[3.0, 3.0, 0.0], [8.0, 3.0, 0.0], [3.0, 8.0, 0.0]], None);
    }

    #[test]
    fn without_area() {
        let segment = |p, q| [p, q, q];
        let point = |p| [p, p, p];
        check(FLAT, segment([1.0, 1.0, -1.0], [1.0, 1.0, 1.0]), Some(Relation::Touch));
        check(FLAT, segment([1.0, 1.0, 0.5], [1.0, 1.0, 1.0]), None);
        check(FLAT, segment([-1.0, 1.0, 0.0], [9.0, 1.0, 0.0]), Some(Relation::Touch));
        check(FLAT, segment([4.0, 1.0, 0.0], [1.0, 4.0, 0.0]), None);
        check(FLAT, point([1.0, 1.0, 0.0]), Some(Relation::Touch));
        check(FLAT, point([1.0, 1.0, 1e-300]), None);
        check(FLAT, point([2.0, 2.0, 0.0]), Some(Relation::Touch));
        check(segment([0.0; 3], [2.0; 3]), segment([2.0, 0.0, 0.0], [0.0, 2.0, 2.0]), Some(Relation::Touch));
        check(segment([0.0; 3], [2.0; 3]), segment([2.0, 0.0, 0.0], [0.0, 2.0, 2.1]), None);
        check(segment([0.0; 3], [2.0; 3]), segment([1.0; 3], [5.0; 3]), Some(Relation::Touch));
        check(segment([0.0; 3], [2.0; 3]), segment([3.0; 3], [5.0; 3]), None);
        check(point([1.0; 3]), segment([0.0; 3], [5.0; 3]), Some(Relation::Touch));
        check(point([1.0, 1.0, 2.0]), segment([0.0; 3], [5.0; 3]), None);
        check(point([1.0; 3]), point([1.0; 3]), Some(Relation::Touch));
        check(point([1.0; 3]), point([1.0, 1.0, 2.0]), None);
    }
}
