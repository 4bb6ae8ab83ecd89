//! The distance of triangles with small integer coordinates, exactly: the twin that shares no arithmetic with the kernel.

use std::cmp::Ordering;

use crate::oracle::{self, Relation};

type Point = [i128; 3];

/// A square of a length: numerator and denominator, the latter positive.
#[derive(Debug, Clone, Copy)]
pub struct Square(i128, i128);

impl Square {
    /// The length.
    pub fn root(self) -> f64 {
        (self.0 as f64 / self.1 as f64).sqrt()
    }

    /// Whether it is 0.
    pub fn is_zero(self) -> bool {
        self.0 == 0
    }

    /// Which is larger.
    pub fn compare(&self, other: &Square) -> Ordering {
        (self.0 * other.1).cmp(&(other.0 * self.1))
    }
}

fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Point, b: Point) -> i128 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The squared distance of two triangles of any area, with integer coordinates below 2^10.
///
/// Every candidate is the squared distance of two points of the triangles, and the smallest one is among them: corners, feet of corners
/// on edges and faces, common perpendiculars of edges.
///
/// # Panics
/// When a coordinate is no such integer.
pub fn triangles(p: &[[f64; 3]; 3], q: &[[f64; 3]; 3]) -> Square {
    if oracle::triangles(p, q) != Relation::None {
        return Square(0, 1);
    }
    let whole = |corner: &[f64; 3]| {
        corner.map(|x| {
            assert!(x.fract() == 0.0 && x.abs() < 1024.0, "{x} is no small integer");
            x as i128
        })
    };
    let (p, q) = (p.each_ref().map(whole), q.each_ref().map(whole));
    let mut candidates = Vec::new();
    for (corners, other) in [(&p, &q), (&q, &p)] {
        for &corner in corners {
            candidates.extend(other.iter().map(|&at| Square(dot(sub(corner, at), sub(corner, at)), 1)));
            candidates.extend((0..3).filter_map(|edge| to_edge(corner, other[edge], other[(edge + 1) % 3])));
            candidates.extend(to_face(corner, other));
        }
    }
    for (i, j) in (0..9).map(|pair| (pair / 3, pair % 3)) {
        candidates.extend(edges([p[i], p[(i + 1) % 3]], [q[j], q[(j + 1) % 3]]));
    }
    candidates.into_iter().min_by(Square::compare).expect("there are corners")
}

fn to_edge(corner: Point, start: Point, end: Point) -> Option<Square> {
    let (edge, w) = (sub(end, start), sub(corner, start));
    let (square, along) = (dot(edge, edge), dot(edge, w));
    (square > 0 && (0..=square).contains(&along)).then(|| Square(dot(w, w) * square - along * along, square))
}

fn to_face(corner: Point, [a, b, c]: &[Point; 3]) -> Option<Square> {
    let (u, v, w) = (sub(*b, *a), sub(*c, *a), sub(corner, *a));
    let normal = cross(u, v);
    let square = dot(normal, normal);
    let (s, t) = (dot(cross(w, v), normal), dot(cross(u, w), normal));
    (square > 0 && s >= 0 && t >= 0 && s + t <= square).then(|| Square(dot(normal, w).pow(2), square))
}

fn edges(first: [Point; 2], second: [Point; 2]) -> Option<Square> {
    let (u, v, w) = (sub(first[1], first[0]), sub(second[1], second[0]), sub(second[0], first[0]));
    let (uu, uv, vv, uw, vw) = (dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w));
    let determinant = uu * vv - uv * uv;
    let (s, t) = (uw * vv - vw * uv, uv * uw - uu * vw);
    let inside = determinant > 0 && (0..=determinant).contains(&s) && (0..=determinant).contains(&t);
    inside.then(|| Square(dot(cross(u, v), w).pow(2), determinant))
}
