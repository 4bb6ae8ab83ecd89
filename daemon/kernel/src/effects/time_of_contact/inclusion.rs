//! Proofs that two moving triangles have met, by inclusion.
//!
//! Two plates that pass through each other meet at one instant, and no f64 time need be that instant: the exact static
//! test never fires. But a corner that is on one side of a moving face at one time and on the other side at a later
//! one, and within the face's edges all the while, has gone through it (intermediate value theorem); likewise an edge
//! through an edge. The volume of the four points tells the side. Seen along a coordinate axis, whether a point is
//! within three edges, or two edges cross, are signs of products of two linear functions of time: quadratic, and never
//! negative while their three Bernstein coefficients are not. Closed conditions suffice, as long as what is seen keeps
//! an area: what lies on a common edge of two faces must not fall between them.

use glam::DVec3;
use num_bigint::{BigInt, Sign as BigSign};

/// Numbers in which signs are proven.
pub(super) trait Number: Clone {
    fn zero() -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    /// Proven to be greater than zero.
    fn is_positive(&self) -> bool;
    /// Proven not to be less than zero.
    fn is_not_negative(&self) -> bool;
}

/// A real number within `error` of `value`. Each operation adds its own rounding.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub value: f64,
    pub error: f64,
}

impl Ball {
    /// Rounds up the sums and products that an error is made of, at most seven of them.
    const UPWARD: f64 = 1.0 + 8.0 * f64::EPSILON;
    /// 2^-1070, above what a product may lose to underflow.
    const UNDERFLOW: f64 = f64::from_bits(1 << 4);

    fn rounded(value: f64, error: f64) -> Ball {
        Ball { value, error: (error + value.abs() * (f64::EPSILON / 2.0)) * Self::UPWARD + Self::UNDERFLOW }
    }
}

impl Number for Ball {
    fn zero() -> Ball {
        Ball { value: 0.0, error: 0.0 }
    }

    fn plus(&self, other: &Ball) -> Ball {
        Ball::rounded(self.value + other.value, self.error + other.error)
    }

    fn minus(&self, other: &Ball) -> Ball {
        Ball::rounded(self.value - other.value, self.error + other.error)
    }

    fn times(&self, other: &Ball) -> Ball {
        let error = self.value.abs() * other.error + self.error * (other.value.abs() + other.error);
        Ball::rounded(self.value * other.value, error)
    }

    fn is_positive(&self) -> bool {
        self.value > self.error
    }

    fn is_not_negative(&self) -> bool {
        self.value >= self.error
    }
}

impl Number for BigInt {
    fn zero() -> BigInt {
        BigInt::ZERO
    }

    fn plus(&self, other: &BigInt) -> BigInt {
        self + other
    }

    fn minus(&self, other: &BigInt) -> BigInt {
        self - other
    }

    fn times(&self, other: &BigInt) -> BigInt {
        self * other
    }

    fn is_positive(&self) -> bool {
        self.sign() == BigSign::Plus
    }

    fn is_not_negative(&self) -> bool {
        self.sign() != BigSign::Minus
    }
}

/// A point in space.
pub(super) type Point<N> = [N; 3];

/// Two triangles at both ends of a span of time: the corners of the first, then of the second.
pub(super) struct Span<N> {
    /// As good as the ends themselves are known: they tell the sides.
    pub ends: [[Point<N>; 6]; 2],
    /// The corners are on the lines between these two, all the while: wide enough for what they stray.
    pub lines: [[Point<N>; 6]; 2],
    /// About where the corners are: they choose the axis to look along.
    pub about: [DVec3; 6],
}

/// Whether the two triangles are proven to have a point in common at some time of the span.
pub(super) fn proves_contact<N: Number>(span: &Span<N>) -> bool {
    let faces = [[3, 4, 5], [0, 1, 2]];
    let corners = (0..6).any(|corner| span.corner_passes(corner, faces[corner / 3]));
    let next = |corner: usize| corner / 3 * 3 + (corner + 1) % 3;
    corners || (0..9).any(|i| span.edges_pass([i / 3, next(i / 3)], [3 + i % 3, next(3 + i % 3)]))
}

impl<N: Number> Span<N> {
    fn corner_passes(&self, corner: usize, [o, a, b]: [usize; 3]) -> bool {
        if !self.volume_vanishes([o, a, b, corner]) {
            return false;
        }
        let about = &self.about;
        let axes = plane_of((about[a] - about[o]).cross(about[b] - about[o]));
        let area = self.area(axes, [o, a, b]);
        let parts = [[o, a, corner], [a, b, corner], [b, o, corner]].map(|part| self.area(axes, part));
        let (inside, mirrored) =
            (parts.iter().all(not_negative), parts.iter().all(|part| not_negative(&negated(part))));
        inside && positive(&area) || mirrored && positive(&negated(&area))
    }

    fn edges_pass(&self, [p, q]: [usize; 2], [r, s]: [usize; 2]) -> bool {
        if !self.volume_vanishes([p, q, r, s]) {
            return false;
        }
        let about = &self.about;
        let axes = plane_of((about[q] - about[p]).cross(about[s] - about[r]));
        let parts = [[p, q, r], [p, q, s], [r, s, p], [r, s, q]].map(|part| self.area(axes, part));
        let [pqr, pqs, rsp, rsq] = &parts;
        // Where the edges cross, their ends are on different sides of each other; one way round or the other.
        let cross = |pqr: &Quadratic<N>, pqs: &Quadratic<N>, rsp: &Quadratic<N>, rsq: &Quadratic<N>| {
            not_negative(&negated(pqr)) && not_negative(pqs) && not_negative(rsp) && not_negative(&negated(rsq)) && {
                let turn: Quadratic<N> = [0, 1, 2].map(|i| pqs[i].minus(&pqr[i]));
                positive(&turn)
            }
        };
        cross(pqr, pqs, rsp, rsq) || cross(pqs, pqr, rsq, rsp)
    }

    /// Whether the four points are in one plane at some time.
    fn volume_vanishes(&self, points: [usize; 4]) -> bool {
        let [start, end] = [0, 1].map(|end| volume(points.map(|point| &self.ends[end][point])));
        let not_positive = |volume: &N| N::zero().minus(volume).is_not_negative();
        start.is_not_negative() && not_positive(&end) || not_positive(&start) && end.is_not_negative()
    }

    /// Twice the signed area of a triangle seen along an axis, over time.
    fn area(&self, axes: [usize; 2], [o, a, p]: [usize; 3]) -> Quadratic<N> {
        let side = |end: usize, point: usize| {
            let line = &self.lines[end];
            axes.map(|axis| line[point][axis].minus(&line[o][axis]))
        };
        let [(a0, p0), (a1, p1)] = [0, 1].map(|end| (side(end, a), side(end, p)));
        let cross = |a: &[N; 2], p: &[N; 2]| a[0].times(&p[1]).minus(&a[1].times(&p[0]));
        // The middle coefficient counts double, which does not change its sign.
        [cross(&a0, &p0), cross(&a0, &p1).plus(&cross(&a1, &p0)), cross(&a1, &p1)]
    }
}

/// Bernstein coefficients (the middle one doubled) of a quadratic function over the span.
type Quadratic<N> = [N; 3];

fn not_negative<N: Number>(quadratic: &Quadratic<N>) -> bool {
    quadratic.iter().all(N::is_not_negative)
}

fn positive<N: Number>(quadratic: &Quadratic<N>) -> bool {
    quadratic.iter().all(N::is_positive)
}

fn negated<N: Number>(quadratic: &Quadratic<N>) -> Quadratic<N> {
    [0, 1, 2].map(|i| N::zero().minus(&quadratic[i]))
}

/// Six times the signed volume of four points.
fn volume<N: Number>([o, a, b, p]: [&Point<N>; 4]) -> N {
    let [u, v, w] = [a, b, p].map(|point| [0, 1, 2].map(|axis| point[axis].minus(&o[axis])));
    let minor = |i: usize, j: usize| u[i].times(&v[j]).minus(&u[j].times(&v[i]));
    w[0].times(&minor(1, 2)).plus(&w[1].times(&minor(2, 0))).plus(&w[2].times(&minor(0, 1)))
}

/// The two axes that are left when the one nearest to the normal is looked along.
fn plane_of(normal: DVec3) -> [usize; 2] {
    let size = normal.abs();
    if size.z >= size.x.max(size.y) {
        [0, 1]
    } else if size.y >= size.x {
        [2, 0]
    } else {
        [1, 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Triangle = [[f64; 3]; 3];

    fn span<N: Number>(a: [Triangle; 2], b: [Triangle; 2], number: impl Fn(f64) -> N) -> Span<N> {
        let six = |end: usize| [a[end][0], a[end][1], a[end][2], b[end][0], b[end][1], b[end][2]];
        let ends = [0, 1].map(|end| six(end).map(|point| point.map(&number)));
        Span { lines: ends.clone(), ends, about: six(0).map(DVec3::from) }
    }

    /// Coordinates are multiples of 1/8 here.
    fn exact(value: f64) -> BigInt {
        BigInt::from((8.0 * value) as i64)
    }

    fn check(a: [Triangle; 2], b: [Triangle; 2], expected: bool, even_if_rounded: bool) {
        assert_eq!(proves_contact(&span(a, b, exact)), expected);
        assert_eq!(proves_contact(&span(b, a, exact)), expected);
        let ball = |value| Ball { value, error: 1e-9 };
        assert_eq!(proves_contact(&span(a, b, ball)), even_if_rounded);
    }

    fn moved(triangle: Triangle, shift: [f64; 3]) -> [Triangle; 2] {
        [triangle, triangle.map(|corner| [0, 1, 2].map(|axis| corner[axis] + shift[axis]))]
    }

    const FLAT: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    #[test]
    fn a_corner_through_a_face() {
        let above = [[1.0, 1.0, 1.0], [9.0, 1.0, 3.0], [1.0, 9.0, 3.0]];
        check(moved(FLAT, [0.0; 3]), moved(above, [0.0, 0.0, -1.5]), true, true);
        check(moved(FLAT, [0.0; 3]), moved(above, [0.0, 0.0, -0.5]), false, false);
        check(moved(FLAT, [0.0; 3]), moved(above, [5.0, 5.0, -1.5]), false, false);
    }

    #[test]
    fn an_edge_through_an_edge() {
        let roof = [[-1.0, 1.0, 1.0], [5.0, 2.0, 1.0], [2.0, 2.0, 9.0]];
        check(moved(FLAT, [0.0; 3]), moved(roof, [0.0, 0.0, -1.5]), true, true);
        check(moved(FLAT, [0.0; 3]), moved(roof, [0.0, 9.0, -1.5]), false, false);
    }

    #[test]
    fn a_point_through_the_border_of_a_face_is_for_exact_numbers() {
        let point = |p| moved([p, p, p], [0.0, 0.0, -2.0]);
        check(moved(FLAT, [0.0; 3]), point([2.0, 2.0, 1.0]), true, false);
        check(moved(FLAT, [0.0; 3]), point([0.0, 0.0, 1.0]), true, false);
        check(moved(FLAT, [0.0; 3]), point([-0.125, 0.0, 1.0]), false, false);
        check(moved(FLAT, [0.0; 3]), point([1.0, 1.0, 2.0]), true, false);
    }

    #[test]
    fn balls_hold_what_they_stand_for() {
        let tenth = Ball { value: 0.1, error: 1e-17 };
        let difference = tenth.times(&tenth).minus(&Ball { value: 0.01, error: 1e-18 });
        assert!(difference.error >= difference.value.abs() && difference.error < 1e-16);
        assert!(!difference.is_positive() && !difference.is_not_negative());
        assert!(Ball::zero().is_not_negative() && !Ball { value: f64::NAN, error: 0.0 }.is_not_negative());
    }
}
