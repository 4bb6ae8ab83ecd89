//! The normal of one piece of contact. The rules stand in [the module above](super).

use glam::DVec3;

use super::meeting::Meeting;
use crate::polygon_box::unit_scale;
use crate::predicates::Sign;
use crate::report::Relation;

/// Unit vector from the first triangle to the second, or zero. `mirrored` says whose transform turns its faces inside out.
pub(super) fn of_piece(
    relation: Relation,
    meeting: &Meeting,
    mirrored: [bool; 2],
    a: &[DVec3; 3],
    b: &[DVec3; 3],
) -> DVec3 {
    let outwards = |triangle: &[DVec3; 3], mirrored: bool| face_normal(triangle) * if mirrored { -1.0 } else { 1.0 };
    let (face_a, face_b) = (outwards(a, mirrored[0]), outwards(b, mirrored[1]));
    match relation {
        Relation::Coplanar => face_a,
        Relation::Cross => unit(face_a - face_b),
        Relation::Touch => of_touch(meeting, (a, face_a), (b, face_b)),
    }
}

fn of_touch(meeting: &Meeting, (a, face_a): (&[DVec3; 3], DVec3), (b, face_b): (&[DVec3; 3], DVec3)) -> DVec3 {
    let [on_a, on_b] = meeting.features().map(u8::count_ones);
    if let ([end], 2, 2) = (meeting.ends(), on_a, on_b) {
        return of_edges(edge(a, end.on_a), edge(b, end.on_b), a, b);
    }
    if on_a > on_b && one_side(meeting.sides_b) {
        turned_to(b, face_a, a)
    } else if on_b > on_a && one_side(meeting.sides_a) {
        -turned_to(a, face_b, b)
    } else {
        unit(turned_to(b, face_a, a) - turned_to(a, face_b, b))
    }
}

/// The face's normal, turned to the side that the other triangle reaches farther on; as it is where the other one lies in its
/// plane, rounding apart.
fn turned_to(other: &[DVec3; 3], normal: DVec3, face: &[DVec3; 3]) -> DVec3 {
    /// A part of the distance that may be rounding.
    const NOISE: f64 = 1e-9;
    let (mut behind, mut ahead, mut size) = (0.0f64, 0.0f64, 0.0f64);
    for corner in other {
        let away = *corner - face[0];
        let distance = normal.dot(away);
        (behind, ahead, size) = (behind.max(-distance), ahead.max(distance), size.max(away.length()));
    }
    if behind > ahead && behind > NOISE * size { -normal } else { normal }
}

/// At right angles to two edges that cross, from where the rest of the one triangle lies to where that of the other does.
fn of_edges(u: DVec3, v: DVec3, a: &[DVec3; 3], b: &[DVec3; 3]) -> DVec3 {
    let normal = unit(unit(u).cross(unit(v)));
    let middle = |t: &[DVec3; 3]| t[0] / 3.0 + t[1] / 3.0 + t[2] / 3.0;
    let ahead = normal.dot(middle(b) - middle(a));
    if ahead < 0.0 { -normal } else { normal }
}

/// The direction of the edge whose two corners the feature has; of a segment, that of its triangle.
fn edge(triangle: &[DVec3; 3], feature: u8) -> DVec3 {
    let [o, a, b] = *triangle;
    let along = match feature {
        0b011 => a - o,
        0b110 => b - a,
        _ => o - b,
    };
    if face_normal(triangle) != DVec3::ZERO { along } else { longest([a - o, b - a, o - b]) }
}

fn longest(edges: [DVec3; 3]) -> DVec3 {
    edges.into_iter().max_by(|u, v| u.abs().max_element().total_cmp(&v.abs().max_element())).unwrap_or(DVec3::ZERO)
}

/// Whether no two corners lie on opposite sides of the plane, but not all in it.
fn one_side(sides: [Sign; 3]) -> bool {
    sides.contains(&1) != sides.contains(&-1)
}

fn face_normal(&[o, a, b]: &[DVec3; 3]) -> DVec3 {
    unit(unit_scale(a - o).cross(unit_scale(b - o)))
}

/// The unit vector of that direction; zero for zero.
pub(in crate::effects) fn unit(v: DVec3) -> DVec3 {
    unit_scale(v).normalize_or_zero()
}
