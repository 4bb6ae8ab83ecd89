//! Scenes: bodies, what is wanted of their pairs, and the memory of the steps.

use std::sync::Arc;

use crate::accuracy::{Accuracy, Budget};
use crate::batch::{BatchInput, BatchReport, Candidates};
use crate::effects::Effects;
use crate::effects::response::{MassProperties, Velocity};
use crate::interest::{GroupId, Interest, InterestRow};
use crate::object::Object;
use crate::places::Places;
use crate::report::Report;
use crate::step::{Clock, CostPerPair, Limit, Step, World};
use crate::transforms::{RigidMotion, StepError, StepInput, stage};

/// Names a body of a scene. Ids ascend from 0 and are never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BodyId(pub u32);

/// No living body of the scene has this id.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the scene has no body {}", .0.0)]
pub struct UnknownBody(pub BodyId);

/// A body: an object placed in the scene.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub id: BodyId,
    pub object: Arc<Object>,
    pub interest: InterestRow,
    pub velocity: Velocity,
    /// `None`: static.
    pub dynamics: Option<Dynamics>,
}

/// What the effect `response` needs to know of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dynamics {
    /// Mass, its centre and its inertia.
    pub mass: MassProperties,
    /// From 0, no rebound, to 1, all of the speed.
    pub restitution: f64,
    /// Coulomb's coefficient, 0 or more.
    pub friction: f64,
}

/// Bodies, a collision interest matrix and effects; and the memory in which its steps are computed.
#[derive(Debug, Default)]
pub struct Scene {
    /// Ascending by id.
    bodies: Vec<Body>,
    /// Where each is.
    places: Places,
    wanted: Wanted,
    budget: Budget,
    report_cost: CostPerPair,
    /// The rigid motions of the step under way.
    rigid: Vec<RigidMotion>,
    next_id: u32,
    steps: u64,
    step: Step,
    candidates: Candidates,
}

/// What is asked of pairs.
#[derive(Debug, Default)]
struct Wanted {
    /// Of pairs without a rule of their own.
    effects: Effects,
    /// All effects that a rule has ever asked for.
    rule_effects: Effects,
    /// Whether any pair has ever had a rule, or a group of its own; and whether any has had an accuracy.
    any_rule: bool,
    any_accuracy: bool,
    /// Of pairs without one of their own.
    accuracy: Accuracy,
    /// The farthest that a pair with an accuracy of its own has ever asked distances for.
    rule_up_to: f64,
}

impl Wanted {
    fn of<'s>(&'s self, bodies: &'s [Body], places: &'s Places, rigid: &'s [RigidMotion], step: u64) -> World<'s> {
        World {
            bodies,
            places,
            boxes: places.boxes(),
            effects: self.effects,
            asked: self.effects.union(self.rule_effects),
            any_rule: self.any_rule,
            accuracy: &self.accuracy,
            any_accuracy: self.any_accuracy,
            up_to: self.accuracy.distance.up_to.max(self.rule_up_to),
            rigid,
            step,
        }
    }
}

impl Scene {
    /// A scene without bodies; `effects` are those of every pair without a rule of its own.
    pub fn new(effects: Effects) -> Scene {
        Scene { wanted: Wanted { effects, ..Wanted::default() }, ..Scene::default() }
    }

    /// Changes the effects of every pair without a rule of its own.
    pub fn set_effects(&mut self, effects: Effects) {
        self.wanted.effects = effects;
    }

    /// Places an object. The identity places it until a step says otherwise. Pairs within a group are ignored.
    pub fn add_body(&mut self, object: Arc<Object>, group: Option<GroupId>) -> BodyId {
        let id = BodyId(self.next_id);
        self.next_id += 1;
        self.places.add(&object);
        let interest = InterestRow::of(group);
        self.wanted.any_rule |= group.is_some();
        self.bodies.push(Body { id, object, interest, velocity: Velocity::default(), dynamics: None });
        id
    }

    /// Takes a body out.
    ///
    /// # Errors
    /// [`UnknownBody`] when it is not there.
    pub fn remove_body(&mut self, body: BodyId) -> Result<(), UnknownBody> {
        let at = self.index(body)?;
        self.bodies.remove(at);
        self.places.remove(at);
        self.step.forget();
        for other in &mut self.bodies[..at] {
            other.interest.set(body, Interest::Default);
            other.interest.set_accuracy(body, None);
        }
        Ok(())
    }

    /// Gives a body another object; it stays where it is.
    ///
    /// # Errors
    /// [`UnknownBody`] when it is not there.
    pub fn replace_object(&mut self, body: BodyId, object: Arc<Object>) -> Result<(), UnknownBody> {
        let at = self.index(body)?;
        self.places.replace(at, &object);
        self.bodies[at].object = object;
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
        self.wanted.any_rule = true;
        if let Interest::Effects(effects) = interest {
            self.wanted.rule_effects = self.wanted.rule_effects.union(effects);
        }
        Ok(())
    }

    /// Changes how exactly pairs without an accuracy of their own are answered.
    pub fn set_accuracy(&mut self, accuracy: Accuracy) {
        self.wanted.accuracy = accuracy;
        self.step.forget();
    }

    /// Gives a pair an accuracy of its own, or takes it back. It does not matter which body is named first.
    ///
    /// # Errors
    /// [`UnknownBody`] when one of them is not there.
    pub fn set_pair_accuracy(&mut self, a: BodyId, b: BodyId, accuracy: Option<Accuracy>) -> Result<(), UnknownBody> {
        let at = self.index(a.min(b))?;
        self.index(a.max(b))?;
        self.bodies[at].interest.set_accuracy(a.max(b), accuracy);
        self.wanted.any_accuracy = true;
        let farthest = self.wanted.rule_up_to;
        self.wanted.rule_up_to = accuracy.map_or(farthest, |accuracy| accuracy.distance.up_to.max(farthest));
        self.step.forget();
        Ok(())
    }

    /// Changes what a step may cost.
    pub fn set_budget(&mut self, budget: Budget) {
        self.budget = budget;
    }

    /// Says what listing a pair costs the caller after a step: a step with a budget keeps as much time.
    pub fn set_report_cost(&mut self, cost: CostPerPair) {
        self.report_cost = cost;
    }

    /// Gives a body mass, or makes it static.
    ///
    /// # Errors
    /// [`UnknownBody`] when it is not there.
    pub fn set_dynamics(&mut self, body: BodyId, dynamics: Option<Dynamics>) -> Result<(), UnknownBody> {
        let at = self.index(body)?;
        self.bodies[at].dynamics = dynamics;
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
    pub fn step<'i>(&mut self, input: impl Into<StepInput<'i>>, clock: &dyn Clock) -> Result<Report<'_>, StepError> {
        let (input, start) = (input.into(), clock.nanoseconds());
        self.steps += 1;
        stage(&self.bodies, &mut self.places, &mut self.rigid, &input, self.steps)?;
        for &(body, velocity) in input.velocities {
            if let Ok(at) = self.index(body) {
                self.bodies[at].velocity = velocity;
            }
        }
        let limit = Limit::new(self.budget, clock, start);
        let box_count = self.places.commit(self.steps, &limit);
        let world = self.wanted.of(&self.bodies, &self.places, &self.rigid, self.steps);
        self.step.run(world, clock, (limit, self.report_cost), start, box_count);
        Ok(self.step.report())
    }

    /// One batch: candidate poses in, a verdict for each out. No body moves, and the next step is answered as without the batch. What
    /// can be shared is done by the clock's [`Workforce`](crate::Workforce).
    ///
    /// ```
    /// # use std::sync::Arc;
    /// use collided_kernel::affine::IDENTITY;
    /// use collided_kernel::{BatchInput, Effects, NoClock, Object, PolygonMesh, Scene, Verdict};
    ///
    /// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// let mesh = PolygonMesh::from_polygons(corners, [vec![0, 1, 2]]);
    /// let triangle = Arc::new(Object::build(mesh, None, &()).expect("a good mesh"));
    /// let mut scene = Scene::new(Effects::INTERFERENCE);
    /// let (_wall, tool) = (scene.add_body(Arc::clone(&triangle), None), scene.add_body(triangle, None));
    /// let mut aside = IDENTITY;
    /// aside[2][3] = 0.5;
    /// let batch = BatchInput { bodies: &[tool], rows: &[IDENTITY, aside], stop_at: None };
    /// let report = scene.batch(&batch, &NoClock).expect("good transforms");
    /// assert!(report.verdicts().eq([Some(Verdict::Interfering), Some(Verdict::Clear)]));
    /// ```
    ///
    /// # Errors
    /// [`StepError`] names the candidate, the body and the value; nothing is computed then.
    pub fn batch(&mut self, input: &BatchInput<'_>, clock: &dyn Clock) -> Result<BatchReport<'_>, StepError> {
        let start = clock.nanoseconds();
        let settled = self.places.settle(&self.bodies)?;
        self.candidates.take(&self.bodies, &self.places, input)?;
        let limit = Limit::new(self.budget, clock, start);
        let world = self.wanted.of(&self.bodies, &self.places, &[], self.steps);
        self.step.batch(world, &self.candidates, input.stop_at, clock, limit, start);
        Ok(self.step.batch_report(settled))
    }

    fn index(&self, body: BodyId) -> Result<usize, UnknownBody> {
        self.bodies.binary_search_by_key(&body, |body| body.id).map_err(|_| UnknownBody(body))
    }
}
