//! Straight motion of two triangles in exact arithmetic: what f64 leaves open.
//!
//! Entries of matrices, coordinates and times are integers times a power of two, and so are all positions on the way,
//! the exact reals `(1 − t)·M0·v + t·M1·v`.

use num_bigint::BigInt;

use super::body::MovingBody;
use super::inclusion::{self, Number, Point, Span};
use crate::predicates::integers;

type Vector = Point<BigInt>;

/// The corners of two triangles at the start and at the end of the step; all in one scale.
pub(super) struct ExactTriangles {
    ends: [[Vector; 6]; 2],
}

impl ExactTriangles {
    /// `None` unless both bodies move straight.
    pub fn new(bodies: [&MovingBody<'_>; 2], triangles: [u32; 2]) -> Option<ExactTriangles> {
        if !bodies.iter().all(|body| body.motion.is_straight()) {
            return None;
        }
        let rows = bodies.map(|body| [0.0, 1.0].map(|t| body.motion.at(t)));
        let rows = integers::<48>(std::array::from_fn(|i| rows[i / 24][i / 12 % 2][i / 4 % 3][i % 4]));
        let corner = |i: usize| {
            let (body, triangle) = (bodies[i / 3], triangles[i / 3]);
            body.object.vertices()[body.object.triangles()[triangle as usize][i % 3] as usize]
        };
        let coordinates = integers::<19>(std::array::from_fn(|i| if i < 18 { corner(i / 3)[i % 3] } else { 1.0 }));
        let place = |end: usize, corner: usize, axis: usize| {
            let row = &rows[24 * (corner / 3) + 12 * end + 4 * axis..][..4];
            let [x, y, z] = [0, 1, 2].map(|i| &row[i] * &coordinates[3 * corner + i]);
            x + y + z + &row[3] * &coordinates[18]
        };
        let ends = [0, 1].map(|end| std::array::from_fn(|corner| std::array::from_fn(|axis| place(end, corner, axis))));
        Some(ExactTriangles { ends })
    }

    /// At two times; in one scale.
    fn at(&self, times: [f64; 2]) -> [[Vector; 6]; 2] {
        let [start, end, one] = integers([times[0], times[1], 1.0]);
        let between = |time: &BigInt, corner: usize, axis: usize| {
            let [from, to] = [0, 1].map(|end| &self.ends[end][corner][axis]);
            from * &one + (to - from) * time
        };
        [start, end].map(|time| std::array::from_fn(|corner| std::array::from_fn(|axis| between(&time, corner, axis))))
    }

    /// Whether they have a point in common between two times, proven by inclusion. `about` is as in [`Span`].
    pub fn meet(&self, start: f64, end: f64, about: [glam::DVec3; 6]) -> bool {
        let ends = self.at([start, end]);
        inclusion::proves_contact(&Span { lines: ends.clone(), ends, about })
    }

    /// How far they are proven apart from `start` on, at most to `end`: by one axis after the other, over spans that
    /// shrink where they come near. Straight lines pass each other at some distance in few spans; at a contact there is
    /// none small enough.
    pub fn apart_until(&self, start: f64, end: f64) -> f64 {
        const MOST_SPANS: u32 = 64;
        let (mut now, mut span) = (start, end - start);
        for _ in 0..MOST_SPANS {
            let next = (now + span).min(end);
            if next <= now {
                break;
            }
            if self.are_apart(now, next) {
                (now, span) = (next, 4.0 * span);
            } else {
                span *= 0.125;
            }
        }
        now
    }

    /// Whether some axis separates them from `start` to `end`: at both, and so in between.
    pub fn are_apart(&self, start: f64, end: f64) -> bool {
        let ends = self.at([start, end]);
        let unit = |axis: usize| std::array::from_fn(|i| BigInt::from(u8::from(i == axis)));
        let separates = |axis: Vector| separates(&axis, &ends);
        (0..3).map(unit).any(separates) || ends.iter().flat_map(axes).any(separates)
    }
}

/// The normals of two triangles, the products of their edges, and the normals of their edges in their planes.
fn axes(corners: &[Vector; 6]) -> impl Iterator<Item = Vector> {
    let edge = |i: usize| minus(&corners[i / 3 * 3 + (i + 1) % 3], &corners[i]);
    let edges: [Vector; 6] = std::array::from_fn(edge);
    let normals = [cross(&edges[0], &edges[1]), cross(&edges[3], &edges[4])];
    let products: Vec<Vector> = (0..9).map(|i| cross(&edges[i / 3], &edges[3 + i % 3])).collect();
    let in_plane: Vec<Vector> = (0..6).map(|i| cross(&edges[i], &normals[i / 3])).collect();
    let ways: Vec<Vector> = (0..9).map(|i| minus(&corners[3 + i % 3], &corners[i / 3])).collect();
    normals.into_iter().chain(products).chain(in_plane).chain(ways)
}

fn separates(axis: &Vector, ends: &[[Vector; 6]; 2]) -> bool {
    let [[up, down], [up_later, down_later]] = ends.each_ref().map(|corners| gaps(axis, corners));
    up && up_later || down && down_later
}

/// Whether the first triangle is wholly below the second along an axis, or wholly above.
fn gaps(axis: &Vector, corners: &[Vector; 6]) -> [bool; 2] {
    let places = corners.each_ref().map(|corner| (0..3).map(|i| &axis[i] * &corner[i]).sum::<BigInt>());
    let (a, b) = places.split_at(3);
    [a.iter().max() < b.iter().min(), b.iter().max() < a.iter().min()]
}

fn minus(p: &Vector, q: &Vector) -> Vector {
    std::array::from_fn(|i| p[i].minus(&q[i]))
}

fn cross(u: &Vector, v: &Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        &u[j] * &v[k] - &u[k] * &v[j]
    })
}
