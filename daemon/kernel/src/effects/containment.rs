//! The effect `containment`: which body lies wholly inside the other, their surfaces apart.
//!
//! Only the outer body must bound a volume. A point is inside it where its surface winds around the point a number of times
//! that is not zero: that holds for surfaces turned inside out or mirrored, and a void within a body is outside. As the
//! surfaces are apart, one point of each connected part of the inner body decides for the whole part.

mod winding;

use glam::DVec3;

use crate::affine::world_vertex;
use crate::global_boxes::GlobalBox;
use crate::predicates::{AnyRange, TAME_LIMIT, Tame};
use crate::submatrix::Placed;
use crate::topology::Closure;
pub(crate) use winding::Ray;
use winding::winding;

/// Which of two bodies, whose surfaces are apart, lies inside the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Containment {
    /// Neither: proven.
    None,
    /// The whole of `a` is inside `b`.
    AInB,
    /// The whole of `b` is inside `a`.
    BInA,
    /// Some connected parts of `a` are inside `b`, others are not.
    APartlyInB,
    /// Some connected parts of `b` are inside `a`, others are not.
    BPartlyInA,
    /// `a` is within the container of `b`, and the surface of `b` bounds no volume: it is open.
    UnknownBOpen,
    /// `b` is within the container of `a`, and the surface of `a` bounds no volume: it is open.
    UnknownAOpen,
    /// As [`Containment::UnknownBOpen`], but the polygons of `b` disagree about which side is out.
    UnknownBInconsistent,
    /// As [`Containment::UnknownAOpen`], but the polygons of `a` disagree about which side is out.
    UnknownAInconsistent,
}

impl Containment {
    /// Whether the solids have a point in common.
    pub fn is_proven(self) -> bool {
        use Containment::{AInB, APartlyInB, BInA, BPartlyInA};
        matches!(self, AInB | BInA | APartlyInB | BPartlyInA)
    }
}

/// How much of a body is inside another.
enum Inside {
    Nothing,
    Parts,
    Everything,
    /// Not known: the outer body's surface bounds no volume.
    Unknown(Closure),
}

/// Which of two bodies is inside the other. Their surfaces must have no point in common.
pub(crate) fn containment(a: Placed<'_>, b: Placed<'_>, ray: &mut Ray) -> Containment {
    use Containment as C;
    match (inside(a, b, ray), inside(b, a, ray)) {
        (Inside::Everything, _) => C::AInB,
        (_, Inside::Everything) => C::BInA,
        (Inside::Parts, _) => C::APartlyInB,
        (_, Inside::Parts) => C::BPartlyInA,
        (Inside::Unknown(Closure::Inconsistent { .. }), _) => C::UnknownBInconsistent,
        (Inside::Unknown(_), _) => C::UnknownBOpen,
        (_, Inside::Unknown(Closure::Inconsistent { .. })) => C::UnknownAInconsistent,
        (_, Inside::Unknown(_)) => C::UnknownAOpen,
        (Inside::Nothing, Inside::Nothing) => C::None,
    }
}

fn inside(inner: Placed<'_>, outer: Placed<'_>, ray: &mut Ray) -> Inside {
    let Some(container) = outer.object.container() else { return Inside::Nothing };
    let bounds = GlobalBox::of(&container, outer.rows);
    let is_bounded = |&vertex: &u32| {
        let position = position(inner, vertex);
        bounds.overlaps(&GlobalBox { min: position, max: position })
    };
    let parts = inner.object.topology().parts();
    if !parts.iter().any(is_bounded) {
        return Inside::Nothing;
    }
    let closure = outer.object.topology().closure();
    if closure != Closure::Closed {
        // What sticks out of the container would not be inside if the mesh were closed.
        let is_whole = inner.object.triangles().iter().flatten().all(is_bounded);
        return if is_whole { Inside::Unknown(closure) } else { Inside::Nothing };
    }
    let mut is_within = |vertex: &&u32| is_bounded(vertex) && winds_around(outer, position(inner, **vertex), ray);
    match parts.iter().filter(&mut is_within).count() {
        0 => Inside::Nothing,
        within if within == parts.len() => Inside::Everything,
        _ => Inside::Parts,
    }
}

fn position(body: Placed<'_>, vertex: u32) -> DVec3 {
    world_vertex(body.rows, body.object.vertices()[vertex as usize])
}

fn winds_around(outer: Placed<'_>, position: DVec3, ray: &mut Ray) -> bool {
    let reach = outer.magnitude.max(position.abs()).max_element();
    let winding =
        if reach < TAME_LIMIT { winding(Tame, outer, position, ray) } else { winding(AnyRange, outer, position, ray) };
    winding != 0
}
