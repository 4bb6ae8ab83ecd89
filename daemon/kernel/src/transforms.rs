//! Stage 1: transforms in. Each number is read once and checked before any body moves.

use glam::DVec3;

use crate::affine::{Rows, magnitude, world_vertex};
use crate::effects::response::Velocity;
use crate::global_boxes::GlobalBox;
use crate::motion::{Motion, MotionError};
use crate::path::displacement;
use crate::scene::{Body, BodyId};
use crate::step::Limit;

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
    fn from(&self, from: Rows) -> Motion {
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

/// What a step brings a body, until all of it is checked; and afterwards, where the body was before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Staged {
    pub rows: Rows,
    /// The step that brought it.
    pub step: u64,
    /// Where the rigid motion that ends here stands in the scene's list.
    pub rigid: Option<u32>,
    /// See [`magnitude`]; over the object's container. Of what was staged it is known when that is checked.
    pub magnitude: DVec3,
}

impl Staged {
    pub fn new(rows: Rows, step: u64, rigid: Option<u32>) -> Staged {
        Staged { rows, step, rigid, magnitude: DVec3::ZERO }
    }
}

/// Reads each transform and each motion, once. `rigid` takes the motions.
pub(crate) fn stage(
    bodies: &mut [Body],
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
        Transforms::Dense(rows) => {
            let staged = bodies.iter_mut().zip(rows);
            staged.for_each(|(body, rows)| body.staged = Staged::new(*rows, step, None));
        }
        Transforms::Sparse { bodies: ids, rows } => {
            for (position, (&id, rows)) in ids.iter().zip(rows).enumerate() {
                let body = unstaged(bodies, "transform", position, BodyId(id), step)?;
                body.staged = Staged::new(*rows, step, None);
            }
        }
    }
    for (position, &(id, motion)) in input.rigid.iter().enumerate() {
        let body = unstaged(bodies, "rigid motion", position, id, step)?;
        let whole = motion.from(body.rows);
        whole.check().map_err(|motion| StepError::BadMotion { body: id, motion })?;
        body.staged = Staged::new(whole.end(), step, Some(position as u32));
        rigid.push(motion);
    }
    Ok(())
}

fn find<'b>(
    bodies: &'b mut [Body],
    what: &'static str,
    position: usize,
    id: BodyId,
) -> Result<&'b mut Body, StepError> {
    let at = bodies.binary_search_by_key(&id, |body| body.id);
    at.map(|at| &mut bodies[at]).map_err(|_| StepError::UnknownBody { what, position, body: id.0 })
}

/// The body, which this step has not named yet.
fn unstaged<'b>(
    bodies: &'b mut [Body],
    what: &'static str,
    position: usize,
    id: BodyId,
    step: u64,
) -> Result<&'b mut Body, StepError> {
    let body = find(bodies, what, position, id)?;
    if body.staged.step == step {
        return Err(StepError::BodyTwice { what, position, body: id.0 });
    }
    Ok(body)
}

/// Checks what [`stage`] has read, and the velocities.
pub(crate) fn check_staged(bodies: &mut [Body], velocities: &[(BodyId, Velocity)], step: u64) -> Result<(), StepError> {
    for (position, &(id, velocity)) in velocities.iter().enumerate() {
        find(bodies, "velocity", position, id)?;
        let numbers = [velocity.linear, velocity.angular];
        if let Some(&value) = numbers.as_flattened().iter().find(|number| !number.is_finite()) {
            return Err(StepError::NonFiniteVelocity { body: id, value });
        }
    }
    for body in bodies {
        if body.staged.step != step {
            if !body.replaced {
                continue;
            }
            body.staged = Staged::new(body.rows, step, None);
        }
        if !rests(body) {
            body.staged.magnitude = check_transform(body, &body.staged.rows)?;
        }
    }
    Ok(())
}

/// Moves the bodies and computes their boxes, as long as the budget lasts; says how many. What was staged now holds where a body was
/// before.
pub(crate) fn commit(
    bodies: &mut [Body],
    boxes: &mut [GlobalBox],
    rigid: &[RigidMotion],
    step: u64,
    limit: &Limit<'_>,
) -> u64 {
    /// Boxes between two looks at the budget: about a microsecond.
    const SLICE: u64 = 32;
    let mut count = 0;
    for (body, bounds) in bodies.iter_mut().zip(boxes) {
        if body.staged.step == step {
            place(body, rigid, step);
        }
        if body.has_box || limit.is_up() || count % SLICE == SLICE - 1 && limit.spend(SLICE) {
            continue;
        }
        *bounds = box_at(body, &body.rows);
        body.has_box = true;
        count += 1;
    }
    count
}

/// Computes the boxes of bodies that no step has placed as they are, where they are; says how many. The next step computes them again.
pub(crate) fn settle(bodies: &mut [Body], boxes: &mut [GlobalBox]) -> Result<u64, StepError> {
    let mut count = 0;
    let unsettled = bodies.iter_mut().zip(boxes).filter(|(body, _)| body.replaced || !body.has_box);
    for (body, bounds) in unsettled {
        body.magnitude = check_transform(body, &body.rows)?;
        *bounds = box_at(body, &body.rows);
        count += 1;
    }
    Ok(count)
}

/// The global bounding box of a body at a transform.
pub(crate) fn box_at(body: &Body, rows: &Rows) -> GlobalBox {
    body.object.container().map_or(GlobalBox::EMPTY, |container| GlobalBox::of(&container, rows))
}

/// Whether the body, which has been checked before, is where it was. Zeros of either sign are different: the report is the same to the bit.
fn rests(body: &Body) -> bool {
    let bits = |rows: &Rows| rows.map(|row| row.map(f64::to_bits));
    !body.replaced
        && body.first_step != u64::MAX
        && body.staged.rigid.is_none()
        && bits(&body.rows) == bits(&body.staged.rows)
}

fn place(body: &mut Body, rigid: &[RigidMotion], step: u64) {
    if rests(body) {
        return;
    }
    body.changed = step;
    std::mem::swap(&mut body.rows, &mut body.staged.rows);
    std::mem::swap(&mut body.magnitude, &mut body.staged.magnitude);
    body.first_step = body.first_step.min(step);
    if body.replaced {
        body.path.begin(step);
    } else if let Some(container) = body.object.container() {
        body.path.advance(
            displacement(&container, &motion(body, rigid, step), &body.rows, body.magnitude + body.staged.magnitude),
            step,
        );
    }
    body.replaced = false;
    body.has_box = false;
}

/// How a body has moved in step number `step`, after [`commit`]. The step that first places a body does not move it.
pub(crate) fn motion(body: &Body, rigid: &[RigidMotion], step: u64) -> Motion {
    if body.staged.step != step || body.first_step == step {
        return Motion::Still(body.rows);
    }
    match body.staged.rigid {
        Some(at) => rigid[at as usize].from(body.staged.rows),
        None if body.staged.rows == body.rows => Motion::Still(body.rows),
        None => Motion::Linear { from: body.staged.rows, to: body.rows },
    }
}

/// Whether a body can be placed so; its magnitude there.
pub(crate) fn check_transform(body: &Body, rows: &Rows) -> Result<DVec3, StepError> {
    check_finite(body.id, rows)?;
    let magnitude = magnitude(rows, body.object.reach());
    if magnitude.is_finite() {
        return Ok(magnitude);
    }
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
