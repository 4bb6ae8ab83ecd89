//! Stage 1: transforms in. Each number is read once and checked before any body moves.

use glam::DVec3;

use crate::affine::{Rows, magnitude, world_vertex};
use crate::effects::response::Velocity;
use crate::motion::{Motion, MotionError};
use crate::places::Places;
use crate::scene::{Body, BodyId};

/// The transforms of one step. Each is read once, so they may stand in memory that another process can write.
#[derive(Debug, Clone, Copy)]
pub enum Transforms<'a> {
    /// One per living body, in ascending order of id.
    Dense(&'a [Rows]),
    /// Those of some bodies; the others stay where they are.
    Sparse {
        /// Their ids.
        bodies: &'a [u32],
        /// As many transforms.
        rows: &'a [Rows],
    },
}

/// What one step brings.
#[derive(Debug, Clone, Copy)]
pub struct StepInput<'a> {
    /// Where bodies are at the end of the step. They get there along straight lines.
    pub transforms: Transforms<'a>,
    /// Bodies that turn on their way; they have no transform in this step.
    pub rigid: &'a [(BodyId, RigidMotion)],
    /// Velocities at the end of the step, for the effect `response`.
    pub velocities: &'a [(BodyId, Velocity)],
}

impl<'a> From<Transforms<'a>> for StepInput<'a> {
    fn from(transforms: Transforms<'a>) -> Self {
        StepInput { transforms, rigid: &[], velocities: &[] }
    }
}

/// A rigid motion from where a body is: see [`Motion::Rigid`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidMotion {
    /// Direction of the axis, of any length but zero.
    pub axis: [f64; 3],
    /// A point on the axis.
    pub centre: [f64; 3],
    /// Rotation over the step, in radians.
    pub angle: f64,
    /// Displacement of the centre over the step.
    pub translate: [f64; 3],
}

impl RigidMotion {
    pub(crate) fn from(&self, from: Rows) -> Motion {
        let &RigidMotion { axis, centre, angle, translate } = self;
        Motion::Rigid { from, axis, centre, angle, translate }
    }
}

/// Why a step was refused. No body has moved then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// Dense: one transform per living body. Sparse: as many transforms as ids.
    #[error("the step has {found} transforms for {expected} bodies")]
    TransformCount {
        /// How many are needed.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A sparse step, a motion or a velocity names a body that is not there.
    #[error("{what} {position} of the step is for body {body}, which the scene does not have")]
    UnknownBody {
        /// `transform`, `rigid motion` or `velocity`.
        what: &'static str,
        /// Number of the transform.
        position: usize,
        /// The id it names.
        body: u32,
    },
    /// A sparse step names a body twice.
    #[error("{what} {position} of the step is for body {body}, which already has one in this step")]
    BodyTwice {
        /// `transform` or `rigid motion`.
        what: &'static str,
        /// Number of the second transform.
        position: usize,
        /// The id it names.
        body: u32,
    },
    /// NaN or infinity in a transform.
    #[error("the transform of body {} has {value} in row {row}, column {column}; every entry must be a finite number", body.0)]
    NonFiniteTransform {
        /// The body.
        body: BodyId,
        /// 0, 1 or 2.
        row: usize,
        /// 0 to 3; 3 is the translation.
        column: usize,
        /// The entry.
        value: f64,
    },
    /// The transform carries a vertex beyond the range of f64.
    #[error("the transform of body {} carries vertex {vertex}, at {position:?}, beyond the range of f64", body.0)]
    WorldOverflow {
        /// The body.
        body: BodyId,
        /// Number of the vertex in the body's object.
        vertex: usize,
        /// The world axis, 0, 1 or 2.
        axis: usize,
        /// The vertex in the object's frame.
        position: [f64; 3],
    },
    /// A rigid motion that is none.
    #[error("the rigid motion of body {}: {motion}", body.0)]
    BadMotion {
        /// The body.
        body: BodyId,
        /// What is wrong with it.
        motion: MotionError,
    },
    /// NaN or infinity in a velocity.
    #[error("the velocity of body {} has the number {value}; every number must be finite", body.0)]
    NonFiniteVelocity {
        /// The body.
        body: BodyId,
        /// The number.
        value: f64,
    },
    /// A transform of a batch.
    #[error("candidate {candidate}: {fault}")]
    BadCandidate {
        /// Number of the candidate.
        candidate: usize,
        /// What is wrong with it.
        fault: Box<StepError>,
    },
}

/// Reads each transform and each motion, once, and checks all of it. `rigid` takes the motions.
pub(crate) fn stage(
    bodies: &[Body],
    places: &mut Places,
    rigid: &mut Vec<RigidMotion>,
    input: &StepInput<'_>,
    step: u64,
) -> Result<(), StepError> {
    rigid.clear();
    let (expected, found) = match input.transforms {
        Transforms::Dense(rows) => (bodies.len(), rows.len()),
        Transforms::Sparse { bodies, rows } => (bodies.len(), rows.len()),
    };
    if expected != found {
        return Err(StepError::TransformCount { expected, found });
    }
    match input.transforms {
        Transforms::Dense(rows) => places.stage_all(bodies, rows, step)?,
        Transforms::Sparse { bodies: ids, rows } => {
            places.stage_some();
            for (position, (&id, rows)) in ids.iter().zip(rows).enumerate() {
                stage_one(bodies, places, ("transform", position), BodyId(id), (*rows, None), step)?;
            }
        }
    }
    for (position, &(id, motion)) in input.rigid.iter().enumerate() {
        let whole = motion.from(*places.rows(find(bodies, ("rigid motion", position), id)? as u32));
        whole.check().map_err(|motion| StepError::BadMotion { body: id, motion })?;
        let end = (whole.end(), Some(position as u32));
        stage_one(bodies, places, ("rigid motion", position), id, end, step)?;
        rigid.push(motion);
    }
    check_velocities(bodies, input.velocities)?;
    places.check_some(bodies, step)
}

/// Index of a body. `what` names it, and the place in the input.
fn find(bodies: &[Body], (what, position): (&'static str, usize), id: BodyId) -> Result<usize, StepError> {
    let at = bodies.binary_search_by_key(&id, |body| body.id);
    at.map_err(|_| StepError::UnknownBody { what, position, body: id.0 })
}

/// A body that this step must not have named yet.
fn stage_one(
    bodies: &[Body],
    places: &mut Places,
    what: (&'static str, usize),
    id: BodyId,
    (rows, rigid): (Rows, Option<u32>),
    step: u64,
) -> Result<(), StepError> {
    let is_first = places.stage_one(find(bodies, what, id)?, rows, rigid, step);
    let (what, position) = what;
    if is_first { Ok(()) } else { Err(StepError::BodyTwice { what, position, body: id.0 }) }
}

fn check_velocities(bodies: &[Body], velocities: &[(BodyId, Velocity)]) -> Result<(), StepError> {
    for (position, &(id, velocity)) in velocities.iter().enumerate() {
        find(bodies, ("velocity", position), id)?;
        let numbers = [velocity.linear, velocity.angular];
        if let Some(&value) = numbers.as_flattened().iter().find(|number| !number.is_finite()) {
            return Err(StepError::NonFiniteVelocity { body: id, value });
        }
    }
    Ok(())
}

/// Whether a body can be placed so; its magnitude there. `reach`: of its vertices.
#[inline]
pub(crate) fn check_transform(body: &Body, reach: [f64; 3], rows: &Rows) -> Result<DVec3, StepError> {
    // An entry that is not finite leaves no finite sum.
    let magnitude = magnitude(rows, reach);
    if magnitude.is_finite() {
        return Ok(magnitude);
    }
    check_finite(body.id, rows)?;
    check_overflow(body, rows).map(|()| magnitude)
}

fn check_finite(body: BodyId, rows: &Rows) -> Result<(), StepError> {
    for (row, entries) in rows.iter().enumerate() {
        if let Some(column) = entries.iter().position(|entry| !entry.is_finite()) {
            return Err(StepError::NonFiniteTransform { body, row, column, value: entries[column] });
        }
    }
    Ok(())
}

/// Vertex by vertex: where the magnitude overflows, perhaps none of them does.
fn check_overflow(body: &Body, rows: &Rows) -> Result<(), StepError> {
    for (vertex, &position) in body.object.vertices().iter().enumerate() {
        let world = world_vertex(rows, position);
        if let Some(axis) = (0..3).find(|&axis| !world[axis].is_finite()) {
            return Err(StepError::WorldOverflow { body: body.id, vertex, axis, position });
        }
    }
    Ok(())
}
