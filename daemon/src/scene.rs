//! A scene's bodies, as its client names them, and the kernel scene below.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use collided_kernel as kernel;
use collided_kernel::{BodyId, GroupId};
use collided_protocol::control::{
    Accuracy, BodyDynamics, BodySpec, ClampedOrder, Interest, InterestRule, PairAccuracy,
};
use collided_protocol::limits::MAX_BODIES;
use collided_protocol::{Effect, Effects, ErrorCode, WireError};

use crate::database::{BodyUse, Databases};
use crate::{kernel_errors, names, settings_of_effects};

/// A scene, between its thread, which steps it, and the connection of its client, which changes it.
pub struct SharedScene {
    scene: Mutex<Scene>,
    bodies: AtomicU64,
    steps: AtomicU64,
    ended: AtomicBool,
}

/// A scene.
pub struct Scene {
    /// The geometry.
    pub kernel: kernel::Scene,
    /// Set when a step failed inside the kernel: what it holds can no longer be trusted.
    pub broken: bool,
    /// What a step may take.
    pub budget: Option<Duration>,
    bodies: BTreeMap<u32, Body>,
    ids: HashMap<String, u32>,
    groups: HashMap<String, GroupId>,
    /// The counter of replacements up to which the bodies' objects are known.
    objects_revision: u64,
}

struct Body {
    name: String,
    object: BodyUse,
}

impl SharedScene {
    /// An empty scene.
    pub fn new(effects: Effects) -> SharedScene {
        let scene = Scene {
            kernel: kernel::Scene::new(kernel_effects(effects)),
            broken: false,
            budget: None,
            bodies: BTreeMap::new(),
            ids: HashMap::new(),
            groups: HashMap::new(),
            objects_revision: 0,
        };
        let (bodies, steps, ended) = Default::default();
        SharedScene { scene: Mutex::new(scene), bodies, steps, ended }
    }

    /// Waits for the step under way, and then holds the scene.
    pub fn lock(&self) -> MutexGuard<'_, Scene> {
        self.scene.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Living bodies; does not wait for a step.
    pub fn body_count(&self) -> u64 {
        self.bodies.load(Ordering::Relaxed)
    }

    /// Steps answered; does not wait for a step.
    pub fn step_count(&self) -> u64 {
        self.steps.load(Ordering::Relaxed)
    }

    /// Counts a step. Returns how many there were before it.
    pub fn count_step(&self) -> u64 {
        self.steps.fetch_add(1, Ordering::Relaxed)
    }

    /// Answers no more steps than the one under way.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
    }

    /// Whether [`SharedScene::end`] was called.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }

    /// Places objects: all, or none. Returns their ids in the order asked.
    ///
    /// # Errors
    /// `BadName`, `DuplicateBody`, `UnknownDatabase`, `UnknownObject`, `LimitExceeded`.
    pub fn add_bodies(&self, databases: &Databases, specs: Vec<BodySpec>) -> Result<Vec<u32>, WireError> {
        let mut scene = self.lock();
        let objects = scene.check_bodies(databases, &specs)?;
        let ids = specs.into_iter().zip(objects).map(|(spec, object)| scene.add_body(spec, object)).collect();
        self.bodies.store(scene.bodies.len() as u64, Ordering::Relaxed);
        Ok(ids)
    }

    /// Takes bodies out: all, or none.
    ///
    /// # Errors
    /// `UnknownBody`.
    pub fn remove_bodies(&self, ids: &[u32]) -> Result<(), WireError> {
        let mut scene = self.lock();
        let mut seen = HashSet::new();
        if let Some(&id) = ids.iter().find(|&&id| !scene.bodies.contains_key(&id) || !seen.insert(id)) {
            return Err(unknown_body(id));
        }
        ids.iter().try_for_each(|&id| scene.remove_body(id))?;
        self.bodies.store(scene.bodies.len() as u64, Ordering::Relaxed);
        Ok(())
    }

    /// Changes the effects of pairs without a rule.
    pub fn set_effects(&self, effects: Effects) {
        self.lock().kernel.set_effects(kernel_effects(effects));
    }

    /// Changes how exactly pairs without an accuracy of their own are answered, and what a step may take. Returns the objects that have
    /// no voxels of the order asked for.
    ///
    /// # Errors
    /// `BadAccuracy` names the field and its range.
    pub fn set_accuracy(&self, accuracy: Accuracy) -> Result<Vec<ClampedOrder>, WireError> {
        let budget = settings_of_effects::budget(&accuracy)?;
        let accuracy = settings_of_effects::accuracy(&accuracy)?;
        let mut scene = self.lock();
        scene.kernel.set_accuracy(accuracy);
        scene.budget = budget;
        Ok(clamped_orders(scene.bodies.values().map(|body| (body, accuracy.order))))
    }

    /// Gives pairs an accuracy of their own, or takes it back: all, or none. Returns the objects that have no voxels of the order asked for.
    ///
    /// # Errors
    /// `UnknownBody`; `BadMessage` for a pair of one body with itself; `BadAccuracy` names the bodies, the field and its range.
    pub fn set_pair_accuracy(&self, pairs: &[PairAccuracy]) -> Result<Vec<ClampedOrder>, WireError> {
        let mut scene = self.lock();
        let accuracies = pairs.iter().map(|pair| scene.pair_accuracy(pair)).collect::<Result<Vec<_>, _>>()?;
        for (pair, accuracy) in pairs.iter().zip(accuracies) {
            let set = scene.kernel.set_pair_accuracy(BodyId(pair.a), BodyId(pair.b), accuracy);
            set.map_err(|error| unknown_body(error.0.0))?;
        }
        let order = |pair: &PairAccuracy| pair.accuracy.and_then(|accuracy| accuracy.order);
        let bodies = pairs.iter().flat_map(|pair| [pair.a, pair.b].map(|id| (&scene.bodies[&id], order(pair))));
        Ok(clamped_orders(bodies))
    }

    /// Gives bodies mass, or makes them static: all, or none.
    ///
    /// # Errors
    /// `UnknownBody`, `BadDynamics`.
    pub fn set_dynamics(&self, bodies: &[BodyDynamics]) -> Result<(), WireError> {
        let mut scene = self.lock();
        let dynamics = bodies.iter().map(|body| scene.dynamics(body)).collect::<Result<Vec<_>, _>>()?;
        for (body, dynamics) in bodies.iter().zip(dynamics) {
            let set = scene.kernel.set_dynamics(BodyId(body.body), dynamics);
            set.map_err(|error| unknown_body(error.0.0))?;
        }
        Ok(())
    }

    /// Changes entries of the interest matrix: all, or none.
    ///
    /// # Errors
    /// `UnknownBody`, `BadMessage` for a pair of one body with itself.
    pub fn set_interest(&self, rules: &[InterestRule]) -> Result<(), WireError> {
        let mut scene = self.lock();
        rules.iter().try_for_each(|rule| scene.check_pair("an interest rule", rule.a, rule.b))?;
        for rule in rules {
            let interest = kernel_interest(rule.interest);
            let set = scene.kernel.set_interest(BodyId(rule.a), BodyId(rule.b), interest);
            set.map_err(|error| unknown_body(error.0.0))?;
        }
        Ok(())
    }
}

impl Scene {
    /// The name of a body, quoted, or that it is not known.
    pub fn body_name(&self, id: u32) -> String {
        self.bodies.get(&id).map_or_else(|| "(unknown)".to_owned(), |body| format!("{:?}", body.name))
    }

    /// Takes over the objects that were replaced since the last step.
    pub fn refresh_objects(&mut self, databases: &Databases) {
        if databases.revision() == self.objects_revision {
            return;
        }
        let unchanged = databases.hold();
        for (&id, body) in &self.bodies {
            let (id, object) = (BodyId(id), body.object.object());
            let is_same = self.kernel.object(id).is_some_and(|known| Arc::ptr_eq(known, &object));
            if !is_same && self.kernel.replace_object(id, object).is_err() {
                tracing::error!(body = id.0, "the kernel does not know a body of the scene");
            }
        }
        self.objects_revision = unchanged.revision;
    }

    fn dynamics(&self, body: &BodyDynamics) -> Result<Option<kernel::Dynamics>, WireError> {
        let object = self.kernel.object(BodyId(body.body)).ok_or_else(|| unknown_body(body.body))?;
        let dynamics = body.dynamics.map(|dynamics| settings_of_effects::dynamics(object, &dynamics)).transpose();
        dynamics.map_err(|error| kernel_errors::dynamics_error(&error, &self.body_name(body.body), body.body))
    }

    fn check_bodies(&self, databases: &Databases, specs: &[BodySpec]) -> Result<Vec<BodyUse>, WireError> {
        let count = self.bodies.len() + specs.len();
        if count > MAX_BODIES as usize {
            return Err(WireError::new(
                ErrorCode::LimitExceeded,
                format!("the scene would have {count} bodies, more than the limit of {MAX_BODIES}"),
                "split it into several scenes",
            ));
        }
        let mut new = HashSet::new();
        specs.iter().map(|spec| self.check_body(databases, spec, new.insert(&spec.name))).collect()
    }

    fn check_body(&self, databases: &Databases, spec: &BodySpec, is_first: bool) -> Result<BodyUse, WireError> {
        names::check("body", &spec.name)?;
        if let Some(group) = &spec.group {
            names::check("group", group)?;
        }
        if !is_first || self.ids.contains_key(&spec.name) {
            return Err(WireError::new(
                ErrorCode::DuplicateBody,
                format!("the scene already has a body {:?}", spec.name),
                "choose another name, or remove that body first",
            ));
        }
        databases.use_object(&spec.database, &spec.object).map_err(|mut error| {
            error.message = format!("body {:?}: {}", spec.name, error.message);
            error
        })
    }

    fn add_body(&mut self, spec: BodySpec, object: BodyUse) -> u32 {
        let next_group = GroupId(self.groups.len() as u32);
        let group = spec.group.map(|group| *self.groups.entry(group).or_insert(next_group));
        let BodyId(id) = self.kernel.add_body(object.object(), group);
        self.ids.insert(spec.name.clone(), id);
        self.bodies.insert(id, Body { name: spec.name, object });
        id
    }

    fn remove_body(&mut self, id: u32) -> Result<(), WireError> {
        self.kernel.remove_body(BodyId(id)).map_err(|error| unknown_body(error.0.0))?;
        if let Some(body) = self.bodies.remove(&id) {
            self.ids.remove(&body.name);
        }
        Ok(())
    }

    fn pair_accuracy(&self, pair: &PairAccuracy) -> Result<Option<kernel::Accuracy>, WireError> {
        self.check_pair("an accuracy", pair.a, pair.b)?;
        let Some(given) = &pair.accuracy else { return Ok(None) };
        let accuracy = match given.budget_us {
            None => settings_of_effects::accuracy(given),
            Some(budget) => Err(WireError::new(
                ErrorCode::BadAccuracy,
                format!("budget_us is {budget}"),
                "give the budget with the accuracy of the scene: it is that of a whole step",
            )),
        };
        let names = [pair.a, pair.b].map(|id| self.body_name(id));
        let named = |error: WireError| WireError {
            message: format!("bodies {} and {}: {}", names[0], names[1], error.message),
            ..error
        };
        accuracy.map(Some).map_err(named)
    }

    fn check_pair(&self, what: &str, a: u32, b: u32) -> Result<(), WireError> {
        if let Some(id) = [a, b].into_iter().find(|id| !self.bodies.contains_key(id)) {
            return Err(unknown_body(id));
        }
        if a == b {
            return Err(WireError::new(
                ErrorCode::BadMessage,
                format!("{what} names body {} (id {a}) twice", self.body_name(a)),
                "name two bodies",
            ));
        }
        Ok(())
    }
}

/// The objects of the bodies whose own order is below the one asked for, each once.
fn clamped_orders<'s>(bodies: impl Iterator<Item = (&'s Body, Option<u32>)>) -> Vec<ClampedOrder> {
    let mut clamped: BTreeMap<(&str, &str), (u32, u32)> = BTreeMap::new();
    for (body, asked) in bodies {
        let Some(asked) = asked else { continue };
        let order = body.object.object().order();
        if asked > order {
            let (highest, _) = clamped.entry(body.object.names()).or_insert((asked, order));
            *highest = asked.max(*highest);
        }
    }
    let named = |((database, object), (asked, order)): ((&str, &str), (u32, u32))| ClampedOrder {
        database: database.to_owned(),
        object: object.to_owned(),
        asked,
        order,
    };
    clamped.into_iter().map(named).collect()
}

fn unknown_body(id: u32) -> WireError {
    WireError::new(
        ErrorCode::UnknownBody,
        format!("the scene has no body with id {id}, or no longer"),
        "use the ids that came when the bodies were added, each once, and none that was removed",
    )
}

/// A set of effects in the kernel's terms.
pub fn kernel_effects(effects: Effects) -> kernel::Effects {
    effects.iter().fold(kernel::Effects::NONE, |all, effect| {
        all.union(match effect {
            Effect::PolygonPairs => kernel::Effects::POLYGON_PAIRS,
            Effect::Containment => kernel::Effects::CONTAINMENT,
            Effect::Distance => kernel::Effects::DISTANCE,
            Effect::Contacts => kernel::Effects::CONTACTS,
            Effect::Penetration => kernel::Effects::PENETRATION,
            Effect::TimeOfContact => kernel::Effects::TIME_OF_CONTACT,
            Effect::Response => kernel::Effects::RESPONSE,
            _ => kernel::Effects::INTERFERENCE,
        })
    })
}

/// An entry of the interest matrix in the kernel's terms.
pub fn kernel_interest(interest: Interest) -> kernel::Interest {
    match interest {
        Interest::Default => kernel::Interest::Default,
        Interest::Ignore => kernel::Interest::Ignore,
        Interest::Effects(effects) => kernel::Interest::Effects(kernel_effects(effects)),
    }
}
