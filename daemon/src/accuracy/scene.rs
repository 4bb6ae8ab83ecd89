//! The scene of a file, in this process: its objects built, its steps as the kernel takes them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::response::Velocity;
use collided_kernel::{
    Accuracy, BodyId, Dynamics, GroupId, Motion, Object, ObjectError, PolygonMesh, RigidMotion, Rows, StepError,
};
use collided_protocol::control::Interest;
use collided_protocol::{Effect, Effects, WireError};

use super::error::StudyError;
use crate::load_bar::LoadBar;
use crate::scene_file::{self, SceneFile, Source, Step};
use crate::{kernel_errors, mesh_file, settings_of_effects};

/// A scene that is studied.
pub struct StudyScene {
    /// Its file.
    pub path: PathBuf,
    /// What the file says.
    pub file: SceneFile,
    /// The polygons of each object.
    meshes: Vec<PolygonMesh>,
    /// The objects with the orders that the file or the kernel chooses.
    pub objects: Vec<Arc<Object>>,
    /// The steps.
    pub steps: Vec<StudyStep>,
    /// Where each body is before step 0.
    pub start: Vec<Rows>,
    /// The accuracy that the file asks for; what is varied is varied from there.
    pub accuracy: Accuracy,
    /// Pairs with a rule of their own.
    pub rules: Vec<StudyRule>,
    /// The bodies with mass.
    pub dynamics: Vec<(BodyId, Dynamics)>,
}

/// A pair with a rule of its own.
pub struct StudyRule {
    /// The bodies.
    pub pair: [BodyId; 2],
    /// What is asked.
    pub interest: Interest,
    /// How exactly, if not as the scene.
    pub accuracy: Option<Accuracy>,
}

/// A step as the kernel takes it. Ids are places in the file.
pub struct StudyStep {
    /// Bodies that have a transform.
    pub bodies: Vec<u32>,
    /// As many transforms.
    pub rows: Vec<Rows>,
    /// Bodies that turn.
    pub rigid: Vec<(BodyId, RigidMotion)>,
    /// Velocities.
    pub velocities: Vec<(BodyId, Velocity)>,
    /// Where each body is at the end.
    pub end: Vec<Rows>,
}

impl StudyScene {
    /// Reads the scene file and its meshes, and builds the objects.
    ///
    /// # Errors
    /// [`StudyError`] names the file, the object and the value.
    pub fn read(path: &Path) -> Result<StudyScene, StudyError> {
        let file = SceneFile::read(path)?;
        let setting = |source: WireError| StudyError::Setting { scene: path.to_owned(), source: source.into() };
        let accuracy = settings_of_effects::accuracy(&file.accuracy).map_err(setting)?;
        let rules = file.interest.iter().map(rule).collect::<Result<Vec<_>, _>>().map_err(setting)?;
        let meshes = file.objects.iter().map(|object| polygons(path, object)).collect::<Result<Vec<_>, _>>()?;
        let mut start = vec![IDENTITY; file.bodies.len()];
        if let Some(first) = file.steps.first() {
            first.poses.iter().for_each(|pose| start[pose.body] = pose.rows);
        }
        let mut scene = StudyScene {
            path: path.to_owned(),
            meshes,
            objects: Vec::new(),
            steps: steps(&file.steps, &start),
            start,
            accuracy,
            rules,
            dynamics: Vec::new(),
            file,
        };
        scene.objects = scene.build(None)?;
        scene.dynamics = scene.masses().map_err(setting)?;
        scene.check()?;
        Ok(scene)
    }

    fn check(&self) -> Result<(), StudyError> {
        let nothing = match (self.file.bodies.len(), self.steps.len()) {
            (..2, _) => "a study needs a pair of bodies; add bodies under \"bodies\"",
            (_, 0) => "a study needs at least one step; add transforms under \"steps\"",
            _ => return Ok(()),
        };
        Err(self.nothing(nothing))
    }

    /// There is nothing to measure.
    pub fn nothing(&self, nothing: &'static str) -> StudyError {
        StudyError::Nothing { scene: self.path.clone(), nothing }
    }

    /// The objects with matrices of order `order`; `None`: as the file says.
    ///
    /// # Errors
    /// What the kernel finds wrong with an object.
    pub fn build(&self, order: Option<u32>) -> Result<Vec<Arc<Object>>, StudyError> {
        let objects = self.file.objects.iter().zip(&self.meshes);
        let build = |(object, mesh): (&scene_file::Object, &PolygonMesh)| {
            let built = Object::build(mesh.clone(), order.or(object.order), &());
            built.map(Arc::new).map_err(|source| self.object_error(&object.name, source))
        };
        objects.map(build).collect()
    }

    fn object_error(&self, object: &str, source: ObjectError) -> StudyError {
        StudyError::Object { scene: self.path.clone(), object: object.to_owned(), source }
    }

    /// A step that the kernel refuses, in the words of the file.
    pub fn step_error(&self, step: usize, source: StepError) -> StudyError {
        StudyError::Step { scene: self.path.clone(), step, source: source.into() }
    }

    /// The group of a body, if it is in one.
    pub fn group(&self, body: usize) -> Option<GroupId> {
        let bodies = &self.file.bodies;
        let group = bodies[body].group.as_ref()?;
        // Named after the first body of the group.
        bodies.iter().position(|other| other.group.as_ref() == Some(group)).map(|first| GroupId(first as u32))
    }

    fn masses(&self) -> Result<Vec<(BodyId, Dynamics)>, WireError> {
        let mass = |&(body, ref given): &(usize, collided_protocol::control::Dynamics)| {
            let (name, object) = (&self.file.bodies[body].name, &self.objects[self.file.bodies[body].object]);
            let dynamics = settings_of_effects::dynamics(object, given);
            let dynamics =
                dynamics.map_err(|error| kernel_errors::dynamics_error(&error, &format!("{name:?}"), body as u32))?;
            Ok((BodyId(body as u32), dynamics))
        };
        self.file.dynamics.iter().map(mass).collect()
    }

    /// The object of a body.
    pub fn object_of(&self, body: usize) -> &Arc<Object> {
        &self.objects[self.file.bodies[body].object]
    }

    /// Whether some pair is asked for an effect.
    pub fn asks(&self, effect: Effect) -> bool {
        let rules = self.file.interest.iter().filter_map(|rule| match rule.interest {
            Interest::Effects(effects) => Some(effects),
            Interest::Default | Interest::Ignore => None,
        });
        rules.chain([self.file.effects]).any(|effects| effects.contains(effect))
    }

    /// All effects that some pair is asked for.
    pub fn effects(&self) -> Effects {
        Effect::ALL.into_iter().filter(|&effect| self.asks(effect)).collect()
    }

    /// The scene, as lines of (what, value).
    pub fn describe(&self) -> Vec<(&'static str, String)> {
        let object = |(object, built): (&scene_file::Object, &Arc<Object>)| {
            let memory = indicatif::HumanBytes(built.memory_bytes() as u64);
            format!("{}: {} polygons, order {}, {memory}", object.name, built.polygon_count(), built.order())
        };
        let effects: Vec<&str> = self.effects().iter().map(Effect::name).collect();
        let objects: Vec<String> = self.file.objects.iter().zip(&self.objects).map(object).collect();
        vec![
            ("scene", self.path.display().to_string()),
            ("objects", objects.join("; ")),
            ("bodies", self.file.bodies.len().to_string()),
            ("steps", self.steps.len().to_string()),
            ("effects", effects.join(", ")),
        ]
    }

    /// The largest order of its objects' matrices.
    pub fn largest_order(&self) -> u32 {
        self.objects.iter().map(|object| object.order()).max().unwrap_or(0)
    }
}

fn rule(rule: &scene_file::Rule) -> Result<StudyRule, WireError> {
    let accuracy = rule.accuracy.as_ref().map(settings_of_effects::accuracy).transpose()?;
    Ok(StudyRule { pair: [rule.a, rule.b].map(|body| BodyId(body as u32)), interest: rule.interest, accuracy })
}

fn polygons(scene: &Path, object: &scene_file::Object) -> Result<PolygonMesh, StudyError> {
    match &object.source {
        Source::Inline(mesh) => Ok(mesh.clone()),
        Source::File(path) => {
            let bar = LoadBar::new(&object.name);
            let mesh = mesh_file::read(path, &mut |done, total| bar.show("read", done, total));
            mesh.map_err(|source| StudyError::Mesh {
                scene: scene.to_owned(),
                object: object.name.clone(),
                source: source.into(),
            })
        }
    }
}

/// The steps of a file, from where the bodies start.
fn steps(file: &[Step], start: &[Rows]) -> Vec<StudyStep> {
    let mut now = start.to_vec();
    file.iter()
        .map(|step| {
            step.poses.iter().for_each(|pose| now[pose.body] = pose.rows);
            let rigid = step.motions.iter().map(|&(body, motion)| {
                let collided_client::RigidMotion { axis, centre, angle, translate } = motion;
                now[body] = Motion::Rigid { from: now[body], axis, centre, angle, translate }.end();
                (BodyId(body as u32), RigidMotion { axis, centre, angle, translate })
            });
            let velocities = step.velocities.iter().map(|&(body, velocity)| {
                let collided_client::Velocity { linear, angular } = velocity;
                (BodyId(body as u32), Velocity { linear, angular })
            });
            StudyStep {
                bodies: step.poses.iter().map(|pose| pose.body as u32).collect(),
                rows: step.poses.iter().map(|pose| pose.rows).collect(),
                rigid: rigid.collect(),
                velocities: velocities.collect(),
                end: now.clone(),
            }
        })
        .collect()
}
