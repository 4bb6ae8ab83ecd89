//! A body under way.

use glam::DVec3;

use crate::affine::{Rows, world_vertex};
use crate::motion::Motion;
use crate::object::Object;

/// An object and its motion, with the bounds that every stage needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovingBody<'o> {
    pub object: &'o Object,
    pub motion: &'o Motion,
    /// The largest magnitude of each coordinate of what the voxels hold.
    pub reach: [f64; 3],
    /// See [`Motion::magnitude`].
    pub magnitude: DVec3,
    /// See [`Motion::position_bound`].
    pub bound: DVec3,
    /// See [`Motion::radius`].
    radius: f64,
    /// The transforms at the start and at the end of the step.
    ends: [Rows; 2],
}

impl<'o> MovingBody<'o> {
    /// `None` when there is no polygon.
    pub fn new(object: &'o Object, motion: &'o Motion) -> Option<MovingBody<'o>> {
        let container = object.container()?;
        let reach = container.reach();
        Some(MovingBody {
            object,
            motion,
            reach,
            magnitude: motion.magnitude(reach),
            bound: motion.position_bound(reach),
            radius: motion.radius(&container),
            ends: [motion.at(0.0), motion.end()],
        })
    }

    /// How far a point strays from its chord over `duration` of the step.
    pub fn deviation(&self, duration: f64) -> f64 {
        self.motion.deviation(self.radius, duration)
    }

    /// World positions of a triangle's corners at a time.
    pub fn corners_at(&self, triangle: u32, t: f64) -> [DVec3; 3] {
        match (self.motion, t) {
            (Motion::Still(rows), _) => self.corners(triangle, rows),
            (_, 0.0) => self.corners(triangle, &self.ends[0]),
            (_, 1.0) => self.corners(triangle, &self.ends[1]),
            _ => self.corners(triangle, &self.motion.at(t)),
        }
    }

    /// World positions of a triangle's corners under one transform.
    pub fn corners(&self, triangle: u32, rows: &Rows) -> [DVec3; 3] {
        let corner = |vertex: u32| world_vertex(rows, self.object.vertices()[vertex as usize]);
        self.object.triangles()[triangle as usize].map(corner)
    }
}
