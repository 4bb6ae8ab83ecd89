//! Scenes: bodies, interest, effects.

use std::fmt;
use std::sync::Arc;
use std::time::Duration;

use collided_protocol::control::{
    self, Accuracy, BodyDynamics, ClampedOrder, Dynamics, InterestRule, PairAccuracy, Reply, Request,
};
use collided_protocol::step::Rows;
use collided_protocol::{Effect, Effects};

pub use collided_protocol::control::Interest;

use crate::batch::{Batch, BatchReport};
use crate::connect::{Client, unexpected};
use crate::database::Object;
use crate::error::Error;
use crate::report::Report;
use crate::step::{Pending, StepChannel, StepInput};

/// How long [`Scene::step`] waits unless [`Scene::set_deadline`] says otherwise.
const DEFAULT_DEADLINE: Duration = Duration::from_secs(10);

/// The id of a body: stable, and never used again in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BodyId(pub u32);

impl fmt::Display for BodyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "body {}", self.0)
    }
}

/// A body to add.
#[derive(Clone, Debug, PartialEq)]
pub struct BodySpec {
    spec: control::BodySpec,
}

impl BodySpec {
    /// A body called `name`, unique in its scene, made of `object`.
    pub fn new(name: impl Into<String>, object: &Object) -> BodySpec {
        let (database, object) = (object.database().to_owned(), object.name().to_owned());
        BodySpec { spec: control::BodySpec { name: name.into(), database, object, group: None } }
    }

    /// Puts the body in a group: pairs within a group are ignored.
    #[must_use]
    pub fn group(mut self, group: impl Into<String>) -> BodySpec {
        self.spec.group = Some(group.into());
        self
    }
}

/// Settings of a scene. See [`Client::scene`].
#[derive(Clone, Debug)]
#[must_use = "no scene is created before `create` is called"]
pub struct SceneBuilder {
    client: Client,
    name: String,
    effects: Effects,
}

impl SceneBuilder {
    pub(crate) fn new(client: Client, name: String) -> SceneBuilder {
        SceneBuilder { client, name, effects: Effect::Interference.into() }
    }

    /// What is computed for every pair without a rule of its own; `interference` unless set.
    pub fn effects(mut self, effects: impl IntoIterator<Item = Effect>) -> SceneBuilder {
        self.effects = effects.into_iter().collect();
        self
    }

    /// Creates the scene. It ends when the [`Scene`] is dropped, or with the connection.
    ///
    /// # Errors
    /// [`Error::Refused`] for a bad name or a full host, [`Error::DaemonGone`], [`Error::Transport`].
    pub fn create(self) -> Result<Scene, Error> {
        let request = Request::CreateScene { name: self.name, effects: self.effects };
        let id = match self.client.request(&request)? {
            Reply::SceneCreated { scene } => scene,
            other => return Err(unexpected(&other)),
        };
        let channel = StepChannel::open(&self.client, id).inspect_err(|_| {
            let _ = self.client.request(&Request::DropScene { scene: id });
        })?;
        let (client, channel) = (self.client, Arc::new(channel));
        Ok(Scene { client, channel, id, bodies: Vec::new(), deadline: DEFAULT_DEADLINE })
    }
}

/// A scene of this client. Dropping it ends it in the daemon.
#[derive(Debug)]
pub struct Scene {
    client: Client,
    channel: Arc<StepChannel>,
    id: u32,
    bodies: Vec<BodyId>,
    deadline: Duration,
}

impl Scene {
    /// Its id, as in `collided status`.
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Its living bodies, in ascending order: the order of a dense step's transforms.
    pub fn bodies(&self) -> &[BodyId] {
        &self.bodies
    }

    /// Places an object, at the identity until a step says otherwise.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownDatabase`, `UnknownObject`, `DuplicateBody` or `BadName`.
    pub fn add_body(&mut self, name: &str, object: &Object) -> Result<BodyId, Error> {
        let ids = self.add_bodies(&[BodySpec::new(name, object)])?;
        ids.first().copied().ok_or_else(|| Error::BadReply("one body was added, no id came".to_owned()))
    }

    /// Places many objects; all are added, or none. Ids come in the order asked.
    ///
    /// # Errors
    /// As [`Scene::add_body`].
    pub fn add_bodies(&mut self, bodies: &[BodySpec]) -> Result<Vec<BodyId>, Error> {
        let bodies = bodies.iter().map(|body| body.spec.clone()).collect();
        match self.client.request(&Request::AddBodies { scene: self.id, bodies })? {
            Reply::BodiesAdded { ids } => {
                let ids: Vec<BodyId> = ids.into_iter().map(BodyId).collect();
                self.bodies.extend(&ids);
                self.bodies.sort_unstable();
                Ok(ids)
            }
            other => Err(unexpected(&other)),
        }
    }

    /// Takes bodies out; all are removed, or none.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownBody`.
    pub fn remove_bodies(&mut self, bodies: &[BodyId]) -> Result<(), Error> {
        let ids = bodies.iter().map(|body| body.0).collect();
        self.client.expect_done(&Request::RemoveBodies { scene: self.id, bodies: ids })?;
        self.bodies.retain(|body| !bodies.contains(body));
        Ok(())
    }

    /// Changes what is computed for every pair without a rule of its own.
    ///
    /// # Errors
    /// [`Error::DaemonGone`], [`Error::Deadline`].
    pub fn set_effects(&mut self, effects: impl IntoIterator<Item = Effect>) -> Result<(), Error> {
        let effects = effects.into_iter().collect();
        self.client.expect_done(&Request::SetEffects { scene: self.id, effects })
    }

    /// Changes how exactly pairs without an accuracy of their own are answered, and what a step may take.
    ///
    /// Where an `order` is asked for, returns the objects of the scene's bodies whose own order M is below it: for these, M counts. What was
    /// compared of a pair left possible stands in its [`bound`](crate::Pair::bound).
    ///
    /// # Errors
    /// [`Error::Refused`] with `BadAccuracy`.
    pub fn set_accuracy(&mut self, accuracy: Accuracy) -> Result<Vec<ClampedOrder>, Error> {
        self.request_accuracy(&Request::SetAccuracy { scene: self.id, accuracy })
    }

    /// Gives pairs an accuracy of their own instead of the scene's, or takes it back; all are set, or none. A budget is of the scene only.
    /// Returns the same as [`Scene::set_accuracy`], of the bodies named.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownBody` or `BadAccuracy`.
    pub fn set_pair_accuracy(
        &mut self,
        pairs: &[(BodyId, BodyId, Option<Accuracy>)],
    ) -> Result<Vec<ClampedOrder>, Error> {
        let pairs = pairs.iter().map(|&(a, b, accuracy)| PairAccuracy { a: a.0, b: b.0, accuracy }).collect();
        self.request_accuracy(&Request::SetPairAccuracy { scene: self.id, pairs })
    }

    fn request_accuracy(&self, request: &Request) -> Result<Vec<ClampedOrder>, Error> {
        match self.client.request(request)? {
            Reply::AccuracySet { clamped } => Ok(clamped),
            other => Err(unexpected(&other)),
        }
    }

    /// Gives bodies mass, or takes it from them, for the effect `response`; all are set, or none. A body without is static,
    /// with restitution 0 and friction 1; [`Mass::Static`](collided_protocol::control::Mass::Static) gives it others.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownBody` or `BadDynamics`.
    pub fn set_dynamics(&mut self, bodies: &[(BodyId, Option<Dynamics>)]) -> Result<(), Error> {
        let bodies = bodies.iter().map(|&(body, dynamics)| BodyDynamics { body: body.0, dynamics }).collect();
        self.client.expect_done(&Request::SetDynamics { scene: self.id, bodies })
    }

    /// Has nothing computed for a pair.
    ///
    /// # Errors
    /// As [`Scene::set_interest`].
    pub fn ignore(&mut self, a: BodyId, b: BodyId) -> Result<(), Error> {
        self.set_interest(&[(a, b, Interest::Ignore)])
    }

    /// Changes entries of the collision interest matrix; all are set, or none.
    ///
    /// # Errors
    /// [`Error::Refused`] with `UnknownBody`.
    pub fn set_interest(&mut self, rules: &[(BodyId, BodyId, Interest)]) -> Result<(), Error> {
        let rules = rules.iter().map(|&(a, b, interest)| InterestRule { a: a.0, b: b.0, interest }).collect();
        self.client.expect_done(&Request::SetInterest { scene: self.id, rules })
    }

    /// How long the `step` functions wait for a report.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.deadline = deadline;
    }

    /// Moves every living body, in ascending order of id, and waits for the report.
    ///
    /// # Errors
    /// [`Error::Refused`] with `BadStep`, `NonFiniteTransform` or `WorldOverflow` (no body has moved then),
    /// `UnknownScene`; [`Error::Deadline`], [`Error::DaemonGone`], [`Error::TooManyInFlight`],
    /// [`Error::TooManyReportsHeld`], [`Error::OutOfSharedMemory`].
    pub fn step(&mut self, transforms: &[Rows]) -> Result<Report, Error> {
        self.send(transforms)?.collect(self.deadline)
    }

    /// Moves the bodies named, and waits for the report. The others stay where they are.
    ///
    /// # Errors
    /// As [`Scene::step`], and `UnknownBody`.
    pub fn step_sparse(&mut self, transforms: &[(BodyId, Rows)]) -> Result<Report, Error> {
        self.send_sparse(transforms)?.collect(self.deadline)
    }

    /// Moves the bodies named, along straight lines or rigidly, gives velocities, and waits for the report.
    ///
    /// # Errors
    /// As [`Scene::step_sparse`], and `BadMotion` and `BadDynamics`.
    pub fn step_with(&mut self, input: &StepInput<'_>) -> Result<Report, Error> {
        self.send_with(input)?.collect(self.deadline)
    }

    /// Like [`Scene::step`], with transforms written straight into shared memory: one for each of [`Scene::bodies`],
    /// all zero at first.
    ///
    /// Who has the transforms at hand already is better off with [`Scene::step`]: of 350 bodies and more it copies them past the caches,
    /// which is faster than to write where the daemon has read.
    ///
    /// # Errors
    /// As [`Scene::step`].
    pub fn write_step(&mut self, write: impl FnOnce(&mut [Rows])) -> Result<Report, Error> {
        self.channel.send_written(&self.client, self.bodies.len(), write)?.collect(self.deadline)
    }

    /// Asks for the verdict of each of many candidate poses, in one message. No body moves: the next step begins where the bodies are.
    ///
    /// A candidate is the scene with the bodies that the batch names where the candidate has them, and all others where they are. Its
    /// verdict is that of the pairs of interest that have a named body in them: interfering when some pair is proven to (inside
    /// another body, too, where `containment` is asked), clear when all are proven clear, possible when the accuracy or the budget leaves
    /// it open. Pairs of two other bodies are the same for every candidate; a step says what is known of them. Effects besides
    /// `containment` are not computed.
    ///
    /// The first free pose of a part, as a planner samples it:
    ///
    /// ```no_run
    /// use collided_client::{Batch, BodyId, Rows, Scene, Verdict, translation};
    ///
    /// # fn first_free(scene: &mut Scene, part: BodyId) -> Result<Option<Rows>, collided_client::Error> {
    /// let samples: Vec<Rows> = (0..1000).map(|sample| translation([0.0, 0.0, 0.001 * f64::from(sample)])).collect();
    /// let batch = Batch { bodies: &[part], candidates: &samples, stop_at: Some(Verdict::Clear) };
    /// let free = scene.step_batch(&batch)?.first_clear();
    /// # Ok(free.map(|number| samples[number]))
    /// # }
    /// ```
    ///
    /// Whether a robot of several links collides on its way, with `stop_at: Some(Verdict::Interfering)` and the transforms of all links at
    /// each waypoint, is the same question:
    ///
    /// ```no_run
    /// use collided_client::{Batch, BodyId, Rows, Scene, Verdict};
    ///
    /// # fn is_free(scene: &mut Scene, links: &[BodyId], waypoints: &[Vec<Rows>]) -> Result<bool, collided_client::Error> {
    /// let candidates = waypoints.concat();
    /// let report = scene.step_batch(&Batch { bodies: links, candidates: &candidates, stop_at: Some(Verdict::Interfering) })?;
    /// # let is_free =
    /// report.verdicts().all(|verdict| verdict == Some(Verdict::Clear))
    /// # ; Ok(is_free)
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Scene::step_sparse`]; the message names the candidate. Nothing is computed then.
    pub fn step_batch(&mut self, batch: &Batch<'_>) -> Result<BatchReport, Error> {
        let count = batch.count()?;
        self.channel.send_batch(&self.client, batch)?.collect_batch(count, self.deadline)
    }

    /// Sends a dense step; its report is collected later.
    ///
    /// # Errors
    /// As [`Scene::step`], save those that come with the report.
    pub fn send(&mut self, transforms: &[Rows]) -> Result<Pending, Error> {
        self.channel.send_dense(&self.client, transforms)
    }

    /// Sends a sparse step; its report is collected later.
    ///
    /// # Errors
    /// As [`Scene::step`], save those that come with the report.
    pub fn send_sparse(&mut self, transforms: &[(BodyId, Rows)]) -> Result<Pending, Error> {
        self.send_with(&StepInput { transforms, ..StepInput::default() })
    }

    /// Sends a step; its report is collected later.
    ///
    /// # Errors
    /// As [`Scene::step_with`], save those that come with the report.
    pub fn send_with(&mut self, input: &StepInput<'_>) -> Result<Pending, Error> {
        self.channel.send_input(&self.client, input)
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // The daemon that is gone has no scene to drop.
        let _ = self.client.request(&Request::DropScene { scene: self.id });
    }
}
