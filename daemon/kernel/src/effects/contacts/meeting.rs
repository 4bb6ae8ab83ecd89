//! The common points of two triangles: the features that meet, from exact predicates alone.
//!
//! The common part of two closed triangles is convex, and each of its corners is where a corner of one lies on the other, two
//! edges cross, or an edge passes through the other's inside. All of these are extreme points of the common part: so they
//! are its corners, each told by one pair of features, and two of them are neighbours exactly when they lie on one edge line
//! of either triangle. Triangles without area are taken as the segments or points that they are.

use glam::{DVec2, DVec3};

use super::position::{Met, crossing, kept_axes};
use crate::predicates::{AnyRange, Arithmetic, Sign, Tame, is_tame};

/// A feature of a triangle, as the set of its corners (bits 0 to 2): one for a corner, two for an edge, three for the inside.
pub(super) type Feature = u8;

const FACE: Feature = 0b111;

/// A corner of the common part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct End {
    /// The exact point, rounded once.
    pub position: DVec3,
    /// The smallest feature of the first triangle that holds it.
    pub on_a: Feature,
    /// The smallest feature of the second triangle that holds it.
    pub on_b: Feature,
}

/// The most corners that two triangles in one plane have in common.
const MOST_ENDS: usize = 6;

/// The common part of two triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    ends: [End; MOST_ENDS],
    count: usize,
    /// On which side of the other's plane each corner lies; 0 where the other has none.
    pub sides_a: [Sign; 3],
    pub sides_b: [Sign; 3],
}

impl Meeting {
    /// Of two triangles at any finite positions.
    pub fn of(a: &[DVec3; 3], b: &[DVec3; 3]) -> Meeting {
        if is_tame(a.iter().chain(b)) { meet(Tame, a, b) } else { meet(AnyRange, a, b) }
    }

    /// The corners in order around the common part; two of a segment, one of a point, none where the triangles are apart.
    pub fn ends(&self) -> &[End] {
        &self.ends[..self.count]
    }

    /// The smallest features of both triangles that hold the whole common part.
    pub fn features(&self) -> [Feature; 2] {
        self.ends().iter().fold([0; 2], |[a, b], end| [a | end.on_a, b | end.on_b])
    }

    fn add(&mut self, end: End) {
        // An exact corner has one pair of features, so at most six of them differ.
        let is_new = !self.ends().iter().any(|known| (known.on_a, known.on_b) == (end.on_a, end.on_b));
        if is_new && self.count < MOST_ENDS {
            self.ends[self.count] = end;
            self.count += 1;
        }
    }

    /// Orders the corners so that neighbours lie on one edge line of either triangle.
    fn order(&mut self) {
        for i in 1..self.count.saturating_sub(1) {
            let last = self.ends[i - 1];
            let on_one_line = |end: &End| last.on_a | end.on_a != FACE || last.on_b | end.on_b != FACE;
            if let Some(next) = self.ends[i..self.count].iter().position(on_one_line) {
                self.ends.swap(i, i + next);
            }
        }
    }
}

fn meet<A: Arithmetic>(arithmetic: A, a: &[DVec3; 3], b: &[DVec3; 3]) -> Meeting {
    let (a, b) = (Simplex::new(arithmetic, a), Simplex::new(arithmetic, b));
    let nowhere = End { position: DVec3::ZERO, on_a: 0, on_b: 0 };
    let (sides_a, sides_b) = (b.sides_of(&a), a.sides_of(&b));
    let mut meeting = Meeting { ends: [nowhere; MOST_ENDS], count: 0, sides_a, sides_b };
    for (i, &corner) in a.corners().iter().enumerate() {
        if let Some(on_b) = b.feature_at(corner, sides_a[i]) {
            meeting.add(End { position: corner, on_a: 1 << i, on_b });
        }
    }
    for (i, &corner) in b.corners().iter().enumerate() {
        if let Some(on_a) = a.feature_at(corner, sides_b[i]) {
            meeting.add(End { position: corner, on_a, on_b: 1 << i });
        }
    }
    for edge in a.edges() {
        if let Some(position) = b.pierced_by(&a, edge, sides_a) {
            meeting.add(End { position, on_a: edge.feature(), on_b: FACE });
        }
        for other in b.edges().filter(|other| edge.may_reach(sides_a) && other.may_reach(sides_b)) {
            if let Some(position) = edges_cross(arithmetic, a.ends_of(edge), b.ends_of(other)) {
                meeting.add(End { position, on_a: edge.feature(), on_b: other.feature() });
            }
        }
    }
    for edge in b.edges() {
        if let Some(position) = a.pierced_by(&b, edge, sides_b) {
            meeting.add(End { position, on_a: FACE, on_b: edge.feature() });
        }
    }
    meeting.order();
    meeting
}

/// An edge by its two corners.
#[derive(Debug, Clone, Copy)]
struct Edge(usize, usize);

impl Edge {
    fn feature(self) -> Feature {
        1 << self.0 | 1 << self.1
    }

    /// Whether the inside of the edge may have a point in the other's plane.
    fn may_reach(self, sides: [Sign; 3]) -> bool {
        let (p, q) = (sides[self.0], sides[self.1]);
        p * q < 0 || (p, q) == (0, 0)
    }
}

/// A triangle with area, a segment, or a point.
struct Simplex<A: Arithmetic> {
    arithmetic: A,
    /// Of a segment, the first two; of a point, the first one.
    corners: [DVec3; 3],
    count: usize,
    plane: A::Plane,
    /// The coordinate without which a triangle keeps its area, and how its corners then run.
    dropped: usize,
    turn: Sign,
}

impl<A: Arithmetic> Simplex<A> {
    fn new(arithmetic: A, corners: &[DVec3; 3]) -> Simplex<A> {
        let [o, a, b] = *corners;
        let turn = |dropped: usize| arithmetic.orient2d(seen(o, dropped), seen(a, dropped), seen(b, dropped));
        let plane = arithmetic.plane(corners);
        let flat = Simplex { arithmetic, corners: *corners, count: 3, plane, dropped: 2, turn: 0 };
        match [2, 1, 0].into_iter().find(|&dropped| turn(dropped) != 0) {
            Some(dropped) => Simplex { dropped, turn: turn(dropped), ..flat },
            None => {
                let (first, last) = extremes(corners);
                Simplex { corners: [first, last, last], count: if first == last { 1 } else { 2 }, ..flat }
            }
        }
    }

    fn corners(&self) -> &[DVec3] {
        &self.corners[..self.count]
    }

    fn edges(&self) -> impl Iterator<Item = Edge> + use<A> {
        let count = self.count;
        (0..if count == 3 { 3 } else { count - 1 }).map(move |i| Edge(i, (i + 1) % count))
    }

    fn ends_of(&self, edge: Edge) -> [DVec3; 2] {
        [self.corners[edge.0], self.corners[edge.1]]
    }

    /// Sides of this one's plane on which the other's corners lie; zeros where there is no plane.
    fn sides_of(&self, other: &Simplex<A>) -> [Sign; 3] {
        if self.count < 3 { [0; 3] } else { other.corners.map(|corner| self.arithmetic.side(&self.plane, corner)) }
    }

    /// The smallest feature that holds a point on the given side of the plane; `None` outside.
    fn feature_at(&self, point: DVec3, side: Sign) -> Option<Feature> {
        if self.count < 3 {
            return self.feature_of_segment_at(point);
        }
        if side != 0 {
            return None;
        }
        let at = |point: DVec3| seen(point, self.dropped);
        self.edges().try_fold(FACE, |feature, edge| {
            let [start, end] = self.ends_of(edge);
            match self.turn * self.arithmetic.orient2d(at(start), at(end), at(point)) {
                1 => Some(feature),
                0 => Some(feature & edge.feature()),
                _ => None,
            }
        })
    }

    fn feature_of_segment_at(&self, point: DVec3) -> Option<Feature> {
        let [first, last, _] = self.corners;
        if let Some(corner) = self.corners().iter().position(|&corner| corner == point) {
            return Some(1 << corner);
        }
        let in_box = first.min(last).cmple(point).all() && point.cmple(first.max(last)).all();
        let in_line = |dropped: usize| {
            self.arithmetic.orient2d(seen(first, dropped), seen(last, dropped), seen(point, dropped)) == 0
        };
        (in_box && (0..3).all(in_line)).then_some(0b011)
    }

    /// Where an edge of the other, whose corners lie on the given sides, passes through the inside of this triangle.
    fn pierced_by(&self, other: &Simplex<A>, edge: Edge, sides: [Sign; 3]) -> Option<DVec3> {
        if self.count < 3 || sides[edge.0] * sides[edge.1] >= 0 {
            return None;
        }
        let [p, q] = other.ends_of(edge);
        let turn = |i: usize| self.arithmetic.orient3d(p, q, self.corners[i], self.corners[(i + 1) % 3]);
        let first = turn(0);
        (first != 0 && turn(1) == first && turn(2) == first).then(|| crossing(p, q, &Met::Plane(self.corners)))
    }
}

/// Where the insides of two edges cross in one point.
fn edges_cross<A: Arithmetic>(arithmetic: A, [p, q]: [DVec3; 2], [r, s]: [DVec3; 2]) -> Option<DVec3> {
    let boxes_meet = p.min(q).cmple(r.max(s)).all() && r.min(s).cmple(p.max(q)).all();
    if !boxes_meet || arithmetic.orient3d(p, q, r, s) != 0 {
        return None;
    }
    // Seen along the plane that they share, all four lie in a line; then another view tells.
    let crosses = |&dropped: &usize| {
        let [p, q, r, s] = [p, q, r, s].map(|point| seen(point, dropped));
        arithmetic.orient2d(p, q, r) * arithmetic.orient2d(p, q, s) < 0
            && arithmetic.orient2d(r, s, p) * arithmetic.orient2d(r, s, q) < 0
    };
    [2, 1, 0].iter().find(|&dropped| crosses(dropped)).map(|&dropped| crossing(p, q, &Met::Line([r, s], dropped)))
}

fn seen(point: DVec3, dropped: usize) -> DVec2 {
    let (i, j) = kept_axes(dropped);
    DVec2::new(point[i], point[j])
}

/// The first and the last of points in a line. The order of the coordinates, first by x, is the order along the line.
fn extremes(points: &[DVec3; 3]) -> (DVec3, DVec3) {
    let key = |p: &DVec3| (p.x, p.y, p.z);
    let first = |p: DVec3, q: DVec3| if key(&q) < key(&p) { q } else { p };
    let last = |p: DVec3, q: DVec3| if key(&p) < key(&q) { q } else { p };
    let [o, a, b] = *points;
    (first(first(o, a), b), last(last(o, a), b))
}
