//! A kernel scene that goes through the steps of the file, over and over.

use std::sync::Arc;

use collided_kernel::{self as kernel, Accuracy, BodyId, Budget, Clock, Object, Report, Scene, StepInput, Transforms};
use collided_protocol::Effects;
use collided_protocol::control::Interest;

use super::error::StudyError;
use super::scene::StudyScene;
use crate::scene::{kernel_effects, kernel_interest};

/// Why no body is unknown.
const NUMBERED: &str = "bodies are numbered as the file has them";

/// The bodies of a studied scene, asked for some of its effects.
pub struct Player<'s> {
    study: &'s StudyScene,
    scene: Scene,
    /// Of pairs without a rule.
    effects: kernel::Effects,
    accuracy: Accuracy,
    /// The body's object, in the order of the bodies.
    objects: Vec<Arc<Object>>,
}

/// What is varied, of the scene and of each pair with a rule of its own.
pub struct Variation<'a> {
    /// What is asked in place of the effects that the file gives.
    pub effects: &'a dyn Fn(Effects) -> Effects,
    /// How exactly, in place of the accuracy that the file gives.
    pub accuracy: &'a dyn Fn(Accuracy) -> Accuracy,
    /// What a step may cost.
    pub budget: Budget,
}

impl<'s> Player<'s> {
    /// A scene of these objects, one for each of the file.
    pub fn new(study: &'s StudyScene, objects: &[Arc<Object>], variation: &Variation<'_>) -> Player<'s> {
        let effects = kernel_effects((variation.effects)(study.file.effects));
        let mut scene = Scene::new(effects);
        let objects: Vec<_> = study.file.bodies.iter().map(|body| Arc::clone(&objects[body.object])).collect();
        for (body, object) in objects.iter().enumerate() {
            scene.add_body(Arc::clone(object), study.group(body));
        }
        for rule in &study.rules {
            let interest = match rule.interest {
                Interest::Effects(effects) => Interest::Effects((variation.effects)(effects)),
                other => other,
            };
            let [a, b] = rule.pair;
            scene.set_interest(a, b, kernel_interest(interest)).expect(NUMBERED);
            scene.set_pair_accuracy(a, b, rule.accuracy.map(variation.accuracy)).expect(NUMBERED);
        }
        for &(body, dynamics) in &study.dynamics {
            scene.set_dynamics(body, Some(dynamics)).expect(NUMBERED);
        }
        scene.set_budget(variation.budget);
        Player { study, scene, effects, accuracy: (variation.accuracy)(study.accuracy), objects }
    }

    /// Goes through all steps from the start, each answered from scratch, and shows each report with the nanoseconds it took.
    ///
    /// # Errors
    /// When the kernel refuses a step.
    pub fn play(
        &mut self,
        clock: &dyn Clock,
        observe: &mut dyn FnMut(usize, u64, &Report<'_>),
    ) -> Result<(), StudyError> {
        self.rewind(clock)?;
        for (number, step) in self.study.steps.iter().enumerate() {
            let input = StepInput {
                transforms: Transforms::Sparse { bodies: &step.bodies, rows: &step.rows },
                rigid: &step.rigid,
                velocities: &step.velocities,
            };
            // Setting it makes the scene forget the last step: what is measured must not depend on how near the steps of the file are.
            self.scene.set_accuracy(self.accuracy);
            let start = clock.nanoseconds();
            let report = self.scene.step(input, clock).map_err(|source| self.study.step_error(number, source))?;
            observe(number, clock.nanoseconds() - start, &report);
        }
        Ok(())
    }

    /// Puts every body where it is before step 0, as if it had never been anywhere: in a scene of one step nothing would move
    /// otherwise.
    fn rewind(&mut self, clock: &dyn Clock) -> Result<(), StudyError> {
        self.scene.set_effects(kernel::Effects::NONE);
        let start = self.scene.step(Transforms::Dense(&self.study.start), clock);
        start.map_err(|source| self.study.step_error(0, source))?;
        self.scene.set_effects(self.effects);
        for (body, object) in (0..).map(BodyId).zip(&self.objects) {
            self.scene.replace_object(body, Arc::clone(object)).expect(NUMBERED);
        }
        Ok(())
    }
}
