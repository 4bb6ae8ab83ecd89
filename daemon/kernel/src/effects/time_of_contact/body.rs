//! A body under way.

use glam::DVec3;

use crate::affine::{Rows, world_vertex};
use crate::motion::Motion;
use crate::object::Object;
use crate::submatrix::columns;

/// A turning body is as good as one that moves straight while its points stray from their chords by no more than this share of
/// half a cell of the full order. Triangles are seldom much larger.
const STRAY_OF_A_CELL: f64 = 1.0 / 80.0;

/// Nor is a way cut that is shorter than this share of half the container's longest side: each piece costs a descent.
const SHORT_WAY: f64 = 1.0 / 32.0;

/// In radians: beyond this the lines of a turning cell lie far within what it sweeps, however large it is.
const MOST_TURN: f64 = 0.125;

/// An object and its motion, with the bounds that every stage needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovingBody<'o> {
    pub object: &'o Object,
    pub motion: &'o Motion,
    /// See [`Motion::magnitude`].
    pub magnitude: DVec3,
    /// See [`Motion::position_bound`].
    pub bound: DVec3,
    /// See [`Motion::radius`].
    radius: f64,
    /// Half the longest side in the world, at the start, roughly: of the container, and of a cell of the full order.
    half_sides: [f64; 2],
    /// The transforms at the start and at the end of the step.
    ends: [Rows; 2],
}

impl<'o> MovingBody<'o> {
    /// `None` when there is no polygon.
    pub fn new(object: &'o Object, motion: &'o Motion) -> Option<MovingBody<'o>> {
        let container = object.container()?;
        let (reach, from, lattice) = (container.reach(), motion.at(0.0), object.matrix().lattice());
        let columns = columns(&from);
        let half_side = |level: usize| {
            let halves = lattice.half_sides_at(level);
            (0..3).map(|axis| columns[axis].length() * halves[axis]).fold(0.0, f64::max)
        };
        Some(MovingBody {
            object,
            motion,
            magnitude: motion.magnitude(reach),
            bound: motion.position_bound(reach),
            radius: motion.radius(&container),
            half_sides: [half_side(0), half_side(lattice.levels().len())],
            ends: [from, motion.end()],
        })
    }

    /// How far a point strays from its chord over `duration` of the step.
    pub fn deviation(&self, duration: f64) -> f64 {
        self.motion.deviation(self.radius, duration)
    }

    /// Whether, over `duration` of the step, lines between the places at its ends are as good as the way itself.
    pub fn is_nearly_straight(&self, duration: f64) -> bool {
        let (turn, stray) = (self.motion.turn() * duration, self.deviation(duration));
        let [container, cell] = self.half_sides;
        let is_short = self.radius * turn <= SHORT_WAY * container;
        turn <= MOST_TURN && (is_short || stray <= STRAY_OF_A_CELL * cell || stray <= self.bound.length())
    }

    /// The transform at a time.
    pub fn rows_at(&self, t: f64) -> Rows {
        match t {
            0.0 => self.ends[0],
            1.0 => self.ends[1],
            _ => self.motion.at(t),
        }
    }

    /// World positions of a triangle's corners at a time.
    pub fn corners_at(&self, triangle: u32, t: f64) -> [DVec3; 3] {
        self.corners(triangle, &self.rows_at(t))
    }

    /// World positions of a triangle's corners under one transform.
    pub fn corners(&self, triangle: u32, rows: &Rows) -> [DVec3; 3] {
        let corner = |vertex: u32| world_vertex(rows, self.object.vertices()[vertex as usize]);
        self.object.triangles()[triangle as usize].map(corner)
    }
}
