//! The distance of two triangles that have no point in common, and their nearest points.
//!
//! The nearest points lie on two edges, or one is a corner and the other inside the face (Larsen, Gottschalk, Lin, Manocha,
//! "Fast Proximity Queries with Swept Sphere Volumes", UNC TR99-018, 1999, section 4.2.3, whose order of tests this is; two edges:
//! Ericson, "Real-Time Collision Detection", 2005, section 5.1.9).
//!
//! # Error
//! u = 2^-53; `size` is the largest 1-norm of a corner relative to one of them. Whatever comes out of parallel edges or
//! slivers as parameters, the two points are on the triangles up to the rounding of `corner + edge·parameter`, 6u·size each;
//! with that of their difference and of its length, `value ≥ true distance − 16u·size`. From below the value is checked by the plane
//! between: for any direction n, the distance is at least `(min n·q − max n·p) / |n|`, and at the nearest points n = q − p makes
//! this an equation. The computed quotient errs by less than 16u·size. Where value and quotient differ by more than
//! [`ACCEPTED`]·size, all is computed again in pairs of f64, whose 2^-104 leaves nothing of the differences' cancellation:
//! an angle below 2^-53 moves a point of either triangle by less than u·size.

use glam::DVec3;

use super::numbers::{Number, Vector, along, cross, dot, sub};
use crate::double::Double;

/// Per size of the two triangles: how far a value and its proof may be apart.
const ACCEPTED: f64 = 40.0 * (f64::EPSILON / 2.0);
/// Per size of the two triangles: no value is farther from the true distance. The two bounds of the module added.
pub(super) const ERROR: f64 = 64.0 * (f64::EPSILON / 2.0);

/// Sizes whose fourth power neither overflows nor loses bits; others are scaled by powers of two.
const SMALLEST_SIZE: f64 = f64::from_bits((1023 - 150) << 52);
const LARGEST_SIZE: f64 = f64::from_bits((1023 + 150) << 52);

/// Nearest points of two triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Their distance; never 0.
    pub value: f64,
    /// Proven: the triangles are not nearer.
    pub lower: f64,
    /// World position on the first triangle.
    pub on_p: DVec3,
    /// World position on the second triangle.
    pub on_q: DVec3,
    /// From the first point to the second, of length 1 up to rounding; NaN where they are the same.
    pub direction: DVec3,
}

/// Nearest points of two triangles without a common point. Bit-equal when they are exchanged.
pub(super) fn nearest(p: &[DVec3; 3], q: &[DVec3; 3]) -> Nearest {
    if comes_first(p, q) {
        return ordered(p, q);
    }
    let swapped = ordered(q, p);
    Nearest { on_p: swapped.on_q, on_q: swapped.on_p, direction: -swapped.direction, ..swapped }
}

fn comes_first(p: &[DVec3; 3], q: &[DVec3; 3]) -> bool {
    for (corner, other) in p.iter().zip(q) {
        for axis in 0..3 {
            if corner[axis] != other[axis] {
                return corner[axis] < other[axis];
            }
        }
    }
    true
}

fn ordered(p: &[DVec3; 3], q: &[DVec3; 3]) -> Nearest {
    let relative = Relative::new(p, q, p[0]);
    if relative.is_tame() { relative.nearest().placed(p[0]) } else { scaled(p, q, Relative::nearest).positive() }
}

/// A point that two triangles with a common point share, up to the rounding of its coordinates: `value` is 0. Bit-equal when they are
/// exchanged.
pub(super) fn common_point(p: &[DVec3; 3], q: &[DVec3; 3]) -> Nearest {
    let (p, q) = if comes_first(p, q) { (p, q) } else { (q, p) };
    let relative = Relative::new(p, q, p[0]);
    if relative.is_tame() { relative.common_point().placed(p[0]) } else { scaled(p, q, Relative::common_point) }
}

/// Brings the triangles to a size near 1, and the result back. The powers of two are exact but for what is lost below 2^-1074,
/// which is nothing beside u·size.
#[cold]
fn scaled(p: &[DVec3; 3], q: &[DVec3; 3], solve: impl Fn(&Relative) -> Nearest) -> Nearest {
    /// 2^200.
    const STEP: f64 = f64::from_bits((1023 + 200) << 52);
    let times = |point: DVec3, count: u32, factor: f64| (0..count).fold(point, |point, _| point * factor);
    let (mut relative, mut down, mut up) = (Relative::new(p, q, p[0]), 0, 0);
    while relative.size > LARGEST_SIZE {
        down += 1;
        // Before the difference, which may overflow.
        let [p, q] = [p, q].map(|corners| corners.map(|corner| times(corner, down, 1.0 / STEP)));
        relative = Relative::new(&p, &q, p[0]);
    }
    while relative.size < SMALLEST_SIZE && relative.size > 0.0 {
        up += 1;
        relative = relative.times(STEP);
    }
    let found = solve(&relative);
    let back = |length: f64| times(times(DVec3::splat(length), down, STEP), up, 1.0 / STEP).x;
    let origin = times(p[0], down, 1.0 / STEP);
    let place = |point: DVec3| times(origin + times(point, up, 1.0 / STEP), down, STEP).clamp(DVec3::MIN, DVec3::MAX);
    Nearest {
        value: back(found.value),
        lower: back(found.lower),
        on_p: place(found.on_p),
        on_q: place(found.on_q),
        ..found
    }
}

impl Nearest {
    fn placed(self, origin: DVec3) -> Nearest {
        Nearest { on_p: origin + self.on_p, on_q: origin + self.on_q, ..self }
    }

    /// A distance that scaling back took below or above all numbers is the last one.
    fn positive(self) -> Nearest {
        Nearest { value: self.value.clamp(f64::from_bits(1), f64::MAX), lower: self.lower.min(f64::MAX), ..self }
    }
}

/// Two triangles, relative to one of their corners.
struct Relative {
    p: [Vector<f64>; 3],
    q: [Vector<f64>; 3],
    /// Largest 1-norm of a corner.
    size: f64,
}

impl Relative {
    #[inline(always)]
    fn new(p: &[DVec3; 3], q: &[DVec3; 3], origin: DVec3) -> Relative {
        let [p, q] = [p, q].map(|corners| corners.map(|corner| (corner - origin).to_array()));
        let size = p.iter().chain(&q).fold(0.0, |size, [x, y, z]| f64::max(size, x.abs() + y.abs() + z.abs()));
        Relative { p, q, size }
    }

    fn is_tame(&self) -> bool {
        self.size >= SMALLEST_SIZE && self.size <= LARGEST_SIZE
    }

    fn times(self, factor: f64) -> Relative {
        let [p, q] = [self.p, self.q].map(|corners| corners.map(|corner| corner.map(|x| x * factor)));
        Relative { p, q, size: self.size * factor }
    }

    #[inline(always)]
    fn nearest(&self) -> Nearest {
        let found = self.measured(features(&self.p, &self.q));
        if found.value - found.lower <= ACCEPTED * self.size { found } else { self.with_more_bits() }
    }

    #[cold]
    fn with_more_bits(&self) -> Nearest {
        let [p, q] = [self.p, self.q].map(|corners| corners.map(|corner| corner.map(Double::from)));
        let Points { on_p, on_q } = features(&p, &q);
        let between = sub(&on_q, &on_p).map(Number::rounded);
        let [on_p, on_q] = [on_p, on_q].map(|point| DVec3::from(point.map(Number::rounded)));
        self.proven(between.into(), on_p, on_q)
    }

    /// Where an edge of one meets the face of the other, or two features meet. Which of these is nearest to a common point in
    /// pairs of f64 decides.
    fn common_point(&self) -> Nearest {
        let [p, q] = [self.p, self.q].map(|corners| corners.map(|corner| corner.map(Double::from)));
        let mut best = features(&p, &q);
        let square = |points: &Points<Double>| {
            let between = sub(&points.on_q, &points.on_p);
            dot(&between, &between)
        };
        for (face, other) in [(&p, &q), (&q, &p)] {
            for edge in 0..3 {
                let Some(points) = crossing(face, &other[edge], &other[(edge + 1) % 3]) else { continue };
                if square(&points) < square(&best) {
                    best = points;
                }
            }
        }
        let point = DVec3::from(best.on_p.map(Number::rounded));
        Nearest { value: 0.0, lower: 0.0, on_p: point, on_q: point, direction: DVec3::NAN }
    }

    #[inline(always)]
    fn measured(&self, Points { on_p, on_q }: Points<f64>) -> Nearest {
        self.proven(sub(&on_q, &on_p).into(), on_p.into(), on_q.into())
    }

    #[inline(always)]
    fn proven(&self, between: DVec3, on_p: DVec3, on_q: DVec3) -> Nearest {
        let value = length(between);
        let direction = between / value;
        let [p, q] = [&self.p, &self.q].map(|corners| corners.map(|corner| direction.dot(corner.into())));
        // NaN where the two points are the same; then nothing is proven.
        let gap = q[0].min(q[1]).min(q[2]) - p[0].max(p[1]).max(p[2]);
        let lower = if gap > 0.0 { (gap - 16.0 * (f64::EPSILON / 2.0) * self.size).max(0.0) } else { 0.0 };
        Nearest { value: value.max(f64::from_bits(1)), lower, on_p, on_q, direction }
    }
}

/// The length of a vector of any size.
#[inline(always)]
fn length(vector: DVec3) -> f64 {
    let squared = vector.length_squared();
    if squared > f64::MIN_POSITIVE / f64::EPSILON { squared.sqrt() } else { tiny_length(vector) }
}

#[cold]
fn tiny_length(vector: DVec3) -> f64 {
    let largest = vector.abs().max_element();
    if largest > 0.0 { (vector / largest).length() * largest } else { 0.0 }
}

/// A point of each triangle.
#[derive(Debug, Clone, Copy)]
struct Points<N> {
    on_p: Vector<N>,
    on_q: Vector<N>,
}

/// The nearest points of two triangles without a common point.
#[inline(always)]
fn features<N: Number>(p: &[Vector<N>; 3], q: &[Vector<N>; 3]) -> Points<N> {
    let zero = N::from(0.0);
    let edges = |corners: &[Vector<N>; 3]| [0, 1, 2].map(|edge| sub(&corners[(edge + 1) % 3], &corners[edge]));
    let (edges_p, edges_q) = (edges(p), edges(q));
    let (squares_p, squares_q) =
        ([0, 1, 2].map(|i| dot(&edges_p[i], &edges_p[i])), [0, 1, 2].map(|j| dot(&edges_q[j], &edges_q[j])));
    let mut best = Points { on_p: p[0], on_q: q[0] };
    let between = sub(&q[0], &p[0]);
    let mut smallest = dot(&between, &between);
    for i in 0..3 {
        for j in 0..3 {
            let (s, t) = segments(&sub(&q[j], &p[i]), &edges_p[i], squares_p[i], &edges_q[j], squares_q[j]);
            let found = Points { on_p: along(&p[i], &edges_p[i], s), on_q: along(&q[j], &edges_q[j], t) };
            let between = sub(&found.on_q, &found.on_p);
            let square = dot(&between, &between);
            if square > smallest {
                continue;
            }
            (smallest, best) = (square, found);
            // The rest of each triangle is behind the plane through its edge: there is nothing nearer.
            let behind_p = dot(&sub(&p[(i + 2) % 3], &found.on_p), &between) <= zero;
            if behind_p && dot(&sub(&q[(j + 2) % 3], &found.on_q), &between) >= zero {
                return best;
            }
        }
    }
    if let Some(corner) = nearest_to_face(p, &edges_p, q) {
        let between = sub(&corner.on_q, &corner.on_p);
        let square = dot(&between, &between);
        if square < smallest {
            (smallest, best) = (square, Points { on_p: corner.on_p, on_q: corner.on_q });
        }
    }
    if let Some(corner) = nearest_to_face(q, &edges_q, p) {
        let between = sub(&corner.on_q, &corner.on_p);
        if dot(&between, &between) < smallest {
            best = Points { on_p: corner.on_q, on_q: corner.on_p };
        }
    }
    best
}

/// Parameters of the nearest points of `p + s·u` and `q + t·v`, both from 0 to 1. `w` is q − p, `uu` and `vv` the squares of u and v.
#[inline(always)]
fn segments<N: Number>(w: &Vector<N>, u: &Vector<N>, uu: N, v: &Vector<N>, vv: N) -> (N, N) {
    let (zero, one) = (N::from(0.0), N::from(1.0));
    let (uv, uw, vw) = (dot(u, v), dot(u, w), dot(v, w));
    let s = ratio(uw * vv - vw * uv, uu * vv - uv * uv);
    let along_v = uv * s - vw;
    if along_v <= zero {
        (ratio(uw, uu), zero)
    } else if along_v >= vv {
        (ratio(uw + uv, uu), one)
    } else {
        (s, along_v / vv)
    }
}

/// The quotient, kept between 0 and 1; 0 where there is none.
#[inline(always)]
fn ratio<N: Number>(numerator: N, denominator: N) -> N {
    let (zero, one) = (N::from(0.0), N::from(1.0));
    if !(numerator > zero && denominator > zero) {
        zero
    } else if numerator >= denominator {
        one
    } else {
        numerator / denominator
    }
}

/// The corner of `q` that is nearest to the plane of `p` and its foot, when `q` is on one side of that plane and the foot inside `p`.
/// Otherwise an edge of `p` has the nearest point.
#[inline(always)]
fn nearest_to_face<N: Number>(p: &[Vector<N>; 3], edges: &[Vector<N>; 3], q: &[Vector<N>; 3]) -> Option<Points<N>> {
    let zero = N::from(0.0);
    let normal = cross(&edges[0], &edges[1]);
    let heights = q.map(|corner| dot(&normal, &sub(&corner, &p[0])));
    let above = heights.iter().all(|&height| height > zero);
    let below = heights.iter().all(|&height| height < zero);
    if !(above || below) {
        return None;
    }
    let nearer = |i: usize, j: usize| if (heights[j] < heights[i]) == above { j } else { i };
    let on_q = q[nearer(nearer(0, 1), 2)];
    foot(p, edges, &normal, &on_q).map(|on_p| Points { on_p, on_q })
}

/// The foot of a point on the plane of `p`, when it is inside `p`.
#[inline(always)]
fn foot<N: Number>(
    p: &[Vector<N>; 3],
    edges: &[Vector<N>; 3],
    normal: &Vector<N>,
    point: &Vector<N>,
) -> Option<Vector<N>> {
    let zero = N::from(0.0);
    let square = dot(normal, normal);
    let w = sub(point, &p[0]);
    // The third edge runs back to the first corner: the foot is p + s·(first edge) − t·(third edge).
    let s = dot(&cross(&edges[2], &w), normal) / square;
    let t = dot(&cross(&edges[0], &w), normal) / square;
    // False for NaN, of a triangle without area.
    (s >= zero && t >= zero && s + t <= N::from(1.0)).then(|| along(&along(&p[0], &edges[0], s), &edges[2], -t))
}

/// Where the edge from `start` to `end` crosses the plane of `p`, and its foot, when that is inside `p`.
fn crossing<N: Number>(p: &[Vector<N>; 3], start: &Vector<N>, end: &Vector<N>) -> Option<Points<N>> {
    let edges = [sub(&p[1], &p[0]), sub(&p[2], &p[1]), sub(&p[0], &p[2])];
    let normal = cross(&edges[0], &edges[1]);
    let [from, to] = [start, end].map(|corner| dot(&normal, &sub(corner, &p[0])));
    let at = along(start, &sub(end, start), from / (from - to));
    foot(p, &edges, &normal, &at).map(|on_p| Points { on_p, on_q: at })
}
