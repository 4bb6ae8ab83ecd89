//! A span of time, and what is the same for all cells in it.

use super::body::MovingBody;
use super::triangle_pair::RESOLUTION;
use crate::affine::Rows;
use crate::submatrix::{MovingContainers, Placed};

/// A span of time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub start: f64,
    pub end: f64,
    /// Per end and body: the transform.
    pub rows: [[Rows; 2]; 2],
    /// In the middle.
    middle: [Rows; 2],
    /// What world positions of both bodies together may stray from the lines between those at the ends.
    pub stray: f64,
}

impl Span {
    pub fn new(bodies: [&MovingBody<'_>; 2], start: f64, end: f64) -> Span {
        let rows_at = |t: f64| bodies.map(|body| body.rows_at(t));
        let stray = |body: &&MovingBody<'_>| body.deviation(end - start) + body.bound.length() * (1.0 + 1e-15);
        let stray = bodies.iter().map(stray).sum();
        Span { start, end, rows: [rows_at(start), rows_at(end)], middle: rows_at(0.5 * start + 0.5 * end), stray }
    }

    /// The containers over the span.
    pub fn containers<'s>(&'s self, bodies: [&MovingBody<'s>; 2]) -> MovingContainers<'s> {
        let placed = |end: usize, body: usize| Placed {
            object: bodies[body].object,
            rows: &self.rows[end][body],
            magnitude: bodies[body].magnitude,
        };
        let ends = [0, 1].map(|end| [placed(end, 0), placed(end, 1)]);
        MovingContainers::new(ends, self.middle.each_ref(), self.stray)
    }

    /// The times between which a window of the span is, rounded outwards.
    pub fn times(&self, [from, until]: [f64; 2]) -> [f64; 2] {
        let [from, until] = [self.time(from) - 0.25 * RESOLUTION, self.time(until) + 0.25 * RESOLUTION];
        [from.max(self.start), until.min(self.end)]
    }

    /// The time at a share of the span.
    pub fn time(&self, at: f64) -> f64 {
        if at >= 1.0 { self.end } else { self.start + at * (self.end - self.start) }
    }
}
