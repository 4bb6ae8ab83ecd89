//! Scenes, and stage 1: transforms in.

use std::sync::Arc;

use glam::DVec3;

use crate::affine::{IDENTITY, Rows, magnitude, world_vertex};
use crate::effects::Effects;
use crate::global_boxes::GlobalBox;
use crate::interest::{GroupId, Interest, InterestRow};
use crate::object::Object;
use crate::report::Report;
use crate::step::{Clock, Step};

/// Names a body of a scene. Ids ascend from 0 and are never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub u32);

/// No living body of the scene has this id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the scene has no body {}", .0.0)]
pub struct UnknownBody(pub BodyId);

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
    /// A sparse step names a body that is not there.
    #[error("transform {position} of the step is for body {body}, which the scene does not have")]
    UnknownBody {
        /// Number of the transform.
        position: usize,
        /// The id it names.
        body: u32,
    },
    /// A sparse step names a body twice.
    #[error("transform {position} of the step is for body {body}, which already has one in this step")]
    BodyTwice {
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
}

/// A body: an object placed in the scene.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub id: BodyId,
    pub object: Arc<Object>,
    pub interest: InterestRow,
    pub rows: Rows,
    /// See [`magnitude`]; over the object's container.
    pub magnitude: DVec3,
    /// What a step brought, until all of it is checked.
    staged: Rows,
    /// The step that brought it.
    staged_in: u64,
    /// Whether the object is new since the last step.
    replaced: bool,
}

/// Bodies, a collision interest matrix and effects; and the memory in which its steps are computed.
#[derive(Debug, Default)]
pub struct Scene {
    /// Ascending by id.
    bodies: Vec<Body>,
    /// The global bounding box of each.
    boxes: Vec<GlobalBox>,
    effects: Effects,
    next_id: u32,
    steps: u64,
    step: Step,
}

impl Scene {
    /// A scene without bodies; `effects` are those of every pair without a rule of its own.
    pub fn new(effects: Effects) -> Scene {
        Scene { effects, ..Scene::default() }
    }

    /// Changes the effects of every pair without a rule of its own.
    pub fn set_effects(&mut self, effects: Effects) {
        self.effects = effects;
    }

    /// Places an object. The identity places it until a step says otherwise. Pairs within a group are ignored.
    pub fn add_body(&mut self, object: Arc<Object>, group: Option<GroupId>) -> BodyId {
        let id = BodyId(self.next_id);
        self.next_id += 1;
        self.bodies.push(Body {
            id,
            object,
            interest: InterestRow::of(group),
            rows: IDENTITY,
            magnitude: DVec3::ZERO,
            staged: IDENTITY,
            staged_in: 0,
            replaced: true,
        });
        self.boxes.push(GlobalBox::EMPTY);
        id
    }

    /// Takes a body out.
    ///
    /// # Errors
    /// [`UnknownBody`] when it is not there.
    pub fn remove_body(&mut self, body: BodyId) -> Result<(), UnknownBody> {
        let at = self.index(body)?;
        self.bodies.remove(at);
        self.boxes.remove(at);
        self.bodies[..at].iter_mut().for_each(|other| other.interest.set(body, Interest::Default));
        Ok(())
    }

    /// Gives a body another object; it stays where it is.
    ///
    /// # Errors
    /// [`UnknownBody`] when it is not there.
    pub fn replace_object(&mut self, body: BodyId, object: Arc<Object>) -> Result<(), UnknownBody> {
        let at = self.index(body)?;
        self.bodies[at].object = object;
        self.bodies[at].replaced = true;
        Ok(())
    }

    /// Sets an entry of the collision interest matrix. It does not matter which body is named first.
    ///
    /// # Errors
    /// [`UnknownBody`] when one of them is not there.
    pub fn set_interest(&mut self, a: BodyId, b: BodyId, interest: Interest) -> Result<(), UnknownBody> {
        let at = self.index(a.min(b))?;
        self.index(a.max(b))?;
        self.bodies[at].interest.set(a.max(b), interest);
        Ok(())
    }

    /// Number of living bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// The living bodies, ascending.
    pub fn bodies(&self) -> impl Iterator<Item = BodyId> {
        self.bodies.iter().map(|body| body.id)
    }

    /// A body's object.
    pub fn object(&self, body: BodyId) -> Option<&Arc<Object>> {
        self.index(body).ok().map(|at| &self.bodies[at].object)
    }

    /// One step: transforms in, report out. What can be shared is done by the clock's [`Workforce`](crate::Workforce).
    ///
    /// # Errors
    /// [`StepError`] names the body and the value. No body has moved then.
    pub fn step(&mut self, transforms: Transforms<'_>, clock: &dyn Clock) -> Result<Report<'_>, StepError> {
        let start = clock.nanoseconds();
        self.steps += 1;
        self.stage(transforms)?;
        self.check_staged()?;
        let boxes = self.commit();
        self.step.run(&self.bodies, &self.boxes, self.effects, clock, start, boxes);
        Ok(self.step.report())
    }

    fn index(&self, body: BodyId) -> Result<usize, UnknownBody> {
        self.bodies.binary_search_by_key(&body, |body| body.id).map_err(|_| UnknownBody(body))
    }

    /// Reads each transform, once.
    fn stage(&mut self, transforms: Transforms<'_>) -> Result<(), StepError> {
        let (expected, found) = match transforms {
            Transforms::Dense(rows) => (self.bodies.len(), rows.len()),
            Transforms::Sparse { bodies, rows } => (bodies.len(), rows.len()),
        };
        if expected != found {
            return Err(StepError::TransformCount { expected, found });
        }
        match transforms {
            Transforms::Dense(rows) => {
                let staged = self.bodies.iter_mut().zip(rows);
                staged.for_each(|(body, rows)| (body.staged, body.staged_in) = (*rows, self.steps));
            }
            Transforms::Sparse { bodies, rows } => {
                for (position, (&body, rows)) in bodies.iter().zip(rows).enumerate() {
                    let at = self.index(BodyId(body)).map_err(|_| StepError::UnknownBody { position, body })?;
                    if self.bodies[at].staged_in == self.steps {
                        return Err(StepError::BodyTwice { position, body });
                    }
                    (self.bodies[at].staged, self.bodies[at].staged_in) = (*rows, self.steps);
                }
            }
        }
        Ok(())
    }

    fn check_staged(&mut self) -> Result<(), StepError> {
        for body in &mut self.bodies {
            if body.staged_in != self.steps {
                if !body.replaced {
                    continue;
                }
                (body.staged, body.staged_in) = (body.rows, self.steps);
            }
            check_finite(body)?;
            check_overflow(body)?;
        }
        Ok(())
    }

    /// Moves the bodies and computes their boxes; says how many.
    fn commit(&mut self) -> u64 {
        let mut count = 0;
        for (body, bounds) in self.bodies.iter_mut().zip(&mut self.boxes) {
            if body.staged_in != self.steps {
                continue;
            }
            body.rows = body.staged;
            body.magnitude = magnitude(&body.rows, body.object.reach());
            body.replaced = false;
            *bounds =
                body.object.container().map_or(GlobalBox::EMPTY, |container| GlobalBox::of(&container, &body.rows));
            count += 1;
        }
        count
    }
}

fn check_finite(body: &Body) -> Result<(), StepError> {
    for (row, entries) in body.staged.iter().enumerate() {
        if let Some(column) = entries.iter().position(|entry| !entry.is_finite()) {
            return Err(StepError::NonFiniteTransform { body: body.id, row, column, value: entries[column] });
        }
    }
    Ok(())
}

fn check_overflow(body: &Body) -> Result<(), StepError> {
    if magnitude(&body.staged, body.object.reach()).is_finite() {
        return Ok(());
    }
    for (vertex, &position) in body.object.vertices().iter().enumerate() {
        let world = world_vertex(&body.staged, position);
        if let Some(axis) = (0..3).find(|&axis| !world[axis].is_finite()) {
            return Err(StepError::WorldOverflow { body: body.id, vertex, axis, position });
        }
    }
    Ok(())
}
