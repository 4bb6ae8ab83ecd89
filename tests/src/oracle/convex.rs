//! Hulls of up to three points in space, as lists of corners and as intersections of half-spaces, and their common part.

use num_bigint::{BigInt, Sign};

use super::integers::IntegerPoint;

type Vector = [BigInt; 3];

/// A rational point `numerators / denominator`; the denominator is positive.
#[derive(Clone)]
pub struct Point {
    numerators: Vector,
    denominator: BigInt,
}

impl Point {
    /// The coordinates, each times the denominator.
    pub fn numerators(&self) -> &Vector {
        &self.numerators
    }

    /// Positive.
    pub fn denominator(&self) -> &BigInt {
        &self.denominator
    }
}

/// The closed half-space of all `x` with `normal · x >= offset`.
struct HalfSpace {
    normal: Vector,
    offset: BigInt,
}

impl HalfSpace {
    /// Bounded by the plane through `point`, on the side that `normal` points to.
    fn through(point: &Vector, normal: Vector) -> HalfSpace {
        HalfSpace { offset: dot(&normal, point), normal }
    }

    /// Positive inside, zero on the boundary; proportional to the depth with a factor that is the point's own.
    fn depth(&self, point: &Point) -> BigInt {
        dot(&self.normal, &point.numerators) - &self.offset * &point.denominator
    }

    /// Keeps the part of a convex polygon that is inside. The polygon is given by its corners in order; it may be flat
    /// (a segment there and back) or one point over and over (Sutherland and Hodgman 1974, "Reentrant polygon clipping").
    fn clip(&self, polygon: &[Point]) -> Vec<Point> {
        let depths: Vec<BigInt> = polygon.iter().map(|point| self.depth(point)).collect();
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, (point, depth)) in polygon.iter().zip(&depths).enumerate() {
            let next = (i + 1) % polygon.len();
            if depth.sign() != Sign::Minus {
                kept.push(point.clone());
            }
            if opposite(depth, &depths[next]) {
                kept.push(between(point, depth, &polygon[next], &depths[next]));
            }
        }
        kept
    }
}

fn opposite(a: &BigInt, b: &BigInt) -> bool {
    matches!((a.sign(), b.sign()), (Sign::Plus, Sign::Minus) | (Sign::Minus, Sign::Plus))
}

/// The point of the boundary on the segment from `p` to `q`, whose depths have opposite signs.
fn between(p: &Point, depth_p: &BigInt, q: &Point, depth_q: &BigInt) -> Point {
    let (weight_p, weight_q) = (depth_q.magnitude(), depth_p.magnitude());
    let (weight_p, weight_q) = (BigInt::from(weight_p.clone()), BigInt::from(weight_q.clone()));
    let mix = |p: &BigInt, q: &BigInt| p * &weight_p + q * &weight_q;
    Point {
        numerators: [0, 1, 2].map(|i| mix(&p.numerators[i], &q.numerators[i])),
        denominator: mix(&p.denominator, &q.denominator),
    }
}

/// The hull of three points: a triangle, a segment or a point.
pub enum ConvexHull {
    /// Three corners, not on one line, and a vector perpendicular to their plane.
    Triangle { corners: [Vector; 3], normal: Vector },
    /// Its two ends.
    Segment([Vector; 2]),
    /// The point.
    Point([Vector; 1]),
}

impl ConvexHull {
    /// Of three points, which may be on one line or all the same.
    pub fn new(points: &[IntegerPoint]) -> ConvexHull {
        let [a, b, c] = points else { unreachable!("a triangle has three corners") };
        let normal = cross(&minus(b, a), &minus(c, a));
        if !is_zero(&normal) {
            return ConvexHull::Triangle { corners: [a.clone(), b.clone(), c.clone()], normal };
        }
        let length = |[p, q]: &[&Vector; 2]| {
            let along = minus(q, p);
            dot(&along, &along)
        };
        let [p, q] = [[a, b], [b, c], [c, a]].into_iter().max_by_key(length).unwrap_or([a, a]);
        if p == q { ConvexHull::Point([p.clone()]) } else { ConvexHull::Segment([p.clone(), q.clone()]) }
    }

    /// 0 for a point, 1 for a segment, 2 for a triangle of positive area.
    pub fn dimension(&self) -> usize {
        self.corners().len() - 1
    }

    fn corners(&self) -> &[Vector] {
        match self {
            ConvexHull::Triangle { corners, .. } => corners,
            ConvexHull::Segment(ends) => ends,
            ConvexHull::Point(point) => point,
        }
    }

    fn polygon(&self) -> Vec<Point> {
        let point = |corner: &Vector| Point { numerators: corner.clone(), denominator: 1.into() };
        self.corners().iter().map(point).collect()
    }

    /// Half-spaces in pairs, whose common part is the plane or line through the corners, or the point.
    fn flat(&self) -> Vec<HalfSpace> {
        let normals = match self {
            ConvexHull::Triangle { normal, .. } => vec![normal.clone()],
            // x is on the line through p along d when d × (x − p) = 0, coordinate by coordinate.
            ConvexHull::Segment([p, q]) => {
                let along = minus(q, p);
                axes().iter().map(|axis| cross(&along, axis)).collect()
            }
            ConvexHull::Point(_) => axes().to_vec(),
        };
        let through = &self.corners()[0];
        let both = |normal: Vector| {
            let opposite = [0, 1, 2].map(|i| -&normal[i]);
            [HalfSpace::through(through, normal), HalfSpace::through(through, opposite)]
        };
        normals.into_iter().flat_map(both).collect()
    }

    /// Half-spaces that bound the hull within [`flat`](Self::flat).
    fn sides(&self) -> Vec<HalfSpace> {
        match self {
            ConvexHull::Triangle { corners: [a, b, c], normal } => {
                [(a, b), (b, c), (c, a)].map(|(p, q)| HalfSpace::through(p, cross(normal, &minus(q, p)))).into()
            }
            ConvexHull::Segment([p, q]) => {
                vec![HalfSpace::through(p, minus(q, p)), HalfSpace::through(q, minus(p, q))]
            }
            ConvexHull::Point(_) => Vec::new(),
        }
    }

    /// The common part of the two hulls, as corners in order; empty when they are apart.
    pub fn clipped_by(&self, other: &ConvexHull) -> Vec<Point> {
        let on_flat = clip_by_all(self.polygon(), &other.flat());
        if on_flat.is_empty() { on_flat } else { clip_by_all(on_flat, &other.sides()) }
    }

    /// Whether each side of this hull has one of `points` strictly inside, none of them being outside.
    pub fn sides_hold_inside(&self, points: &[Point]) -> bool {
        let strictly_inside = |side: &HalfSpace| points.iter().any(|point| side.depth(point).sign() == Sign::Plus);
        self.sides().iter().all(strictly_inside)
    }

    /// Whether all of this hull is in the plane, line or point that the other one spans.
    pub fn lies_in_plane_of(&self, other: &ConvexHull) -> bool {
        let polygon = self.polygon();
        other.flat().iter().all(|half| polygon.iter().all(|point| half.depth(point) == BigInt::ZERO))
    }
}

fn clip_by_all(polygon: Vec<Point>, half_spaces: &[HalfSpace]) -> Vec<Point> {
    half_spaces.iter().fold(polygon, |rest, half_space| half_space.clip(&rest))
}

fn axes() -> [Vector; 3] {
    [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(|axis| axis.map(BigInt::from))
}

fn minus(a: &Vector, b: &Vector) -> Vector {
    [0, 1, 2].map(|i| &a[i] - &b[i])
}

fn dot(a: &Vector, b: &Vector) -> BigInt {
    &a[0] * &b[0] + &a[1] * &b[1] + &a[2] * &b[2]
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| &a[i] * &b[j] - &a[j] * &b[i])
}

fn is_zero(vector: &Vector) -> bool {
    vector.iter().all(|coordinate| *coordinate == BigInt::ZERO)
}
