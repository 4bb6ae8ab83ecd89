//! One setting, run again and again.

use std::sync::Arc;
use std::time::{Duration, Instant};

use collided_kernel::Budget as StepBudget;
use collided_kernel::effects::distance::DistanceSettings;
use collided_kernel::effects::time_of_contact::TimeSettings;
use collided_kernel::{Accuracy, Clock, Level, Object};
use collided_protocol::{Effect, Effects};

use super::error::StudyError;
use super::measurement::Setting;
use super::plan::Plan;
use super::player::{Player, Variation};
use super::scene::StudyScene;
use super::statistics::Spread;
use super::truth::Answers;

/// Fewer repetitions than this say nothing of their spread.
const LEAST: usize = 3;

/// A setting, and what it gave so far.
pub struct Run<'s> {
    /// The setting.
    pub setting: Setting,
    /// The objects of its scene.
    pub objects: Vec<Arc<Object>>,
    player: Player<'s>,
    /// The first step that counts.
    counts: usize,
    /// Of the first pass; within a budget of every pass, for they differ.
    pub answers: Vec<Answers>,
    /// Nanoseconds of each step that counts in the first pass, which warms up.
    first: Vec<f64>,
    /// Likewise, in each repetition.
    repeated: Vec<Vec<f64>>,
    spent: Duration,
}

impl<'s> Run<'s> {
    /// Goes through the steps for a first time.
    ///
    /// # Errors
    /// When the kernel refuses a step.
    pub fn start(
        scene: &'s StudyScene,
        setting: Setting,
        objects: Vec<Arc<Object>>,
        clock: &dyn Clock,
    ) -> Result<Run<'s>, StudyError> {
        let start = Instant::now();
        let (mut player, counts) = (player(scene, setting, &objects), first_step(scene, setting));
        let (first, answers) = pass(&mut player, clock, counts)?;
        let (answers, repeated, spent) = (vec![answers], Vec::new(), start.elapsed());
        Ok(Run { setting, objects, player, counts, answers, first, repeated, spent })
    }

    /// Whether another repetition is wanted, and there is patience for it.
    pub fn wants_more(&self, plan: &Plan) -> bool {
        let count = self.repeated.len();
        let has_patience = self.spent < plan.patience;
        // A first pass beyond all patience is not repeated at all.
        count < plan.repetitions && (has_patience || (1..LEAST).contains(&count))
    }

    /// Goes through the steps once more.
    ///
    /// # Errors
    /// When the kernel refuses a step.
    pub fn again(&mut self, clock: &dyn Clock) -> Result<(), StudyError> {
        let start = Instant::now();
        let (times, answers) = pass(&mut self.player, clock, self.counts)?;
        self.repeated.push(times);
        self.answers.extend(matches!(self.setting, Setting::Budget { .. }).then_some(answers));
        self.spent += start.elapsed();
        Ok(())
    }

    /// How often it was repeated; the first pass counts when it is the only one.
    pub fn repetitions(&self) -> usize {
        self.times().len()
    }

    /// Nanoseconds of each step that counts, in each repetition.
    pub fn times(&self) -> &[Vec<f64>] {
        if self.repeated.is_empty() { std::slice::from_ref(&self.first) } else { &self.repeated }
    }

    /// Nanoseconds of a step.
    pub fn time(&self) -> Spread {
        Spread::mean_of_columns(self.times()).expect("a scene has steps that count")
    }
}

/// Goes through all steps; gives the nanoseconds of those that count, and all answers.
fn pass(player: &mut Player<'_>, clock: &dyn Clock, counts: usize) -> Result<(Vec<f64>, Answers), StudyError> {
    let (mut steps, mut answers) = (Vec::new(), Answers::default());
    player.play(clock, &mut |step, nanoseconds, report| {
        answers.note(step, report);
        steps.extend((step >= counts).then_some(nanoseconds as f64));
    })?;
    Ok((steps, answers))
}

/// Step 0 only places the bodies, and has no motion.
fn first_step(scene: &StudyScene, setting: Setting) -> usize {
    let has_motion = matches!(setting, Setting::TimeOfContact { .. } | Setting::Effect(Effect::TimeOfContact));
    usize::from(has_motion && scene.steps.len() > 1)
}

fn player<'s>(scene: &'s StudyScene, setting: Setting, objects: &[Arc<Object>]) -> Player<'s> {
    let effect = effect_of(setting);
    let effects = |given: Effects| match effect {
        // Whatever a pair is asked, there is a verdict.
        Effect::Interference if !given.is_empty() => Effects::from(effect),
        _ if given.contains(effect) => Effects::from(effect),
        _ => Effects::NONE,
    };
    let budget = match setting {
        Setting::Budget { nanoseconds } => StepBudget::Nanoseconds(nanoseconds),
        _ => StepBudget::Unlimited,
    };
    let accuracy = |given: Accuracy| accuracy_of(setting, given);
    Player::new(scene, objects, &Variation { effects: &effects, accuracy: &accuracy, budget })
}

/// The effect that a setting is about.
fn effect_of(setting: Setting) -> Effect {
    match setting {
        Setting::Distance { .. } => Effect::Distance,
        Setting::TimeOfContact { .. } => Effect::TimeOfContact,
        Setting::Effect(effect) => effect,
        Setting::Level { .. } | Setting::Matrix { .. } | Setting::Budget { .. } | Setting::Arithmetic(_) => {
            Effect::Interference
        }
    }
}

/// What a setting makes of the accuracy that the file gives.
fn accuracy_of(setting: Setting, given: Accuracy) -> Accuracy {
    let exact = Accuracy { level: Level::Polygons, order: None, ..given };
    match setting {
        Setting::Level { level, order } => Accuracy { level, order, ..given },
        Setting::Distance { tolerance } => {
            Accuracy { distance: DistanceSettings { relative_tolerance: tolerance, ..given.distance }, ..exact }
        }
        Setting::TimeOfContact { tolerance } => Accuracy { time: TimeSettings { tolerance, ..given.time }, ..exact },
        Setting::Matrix { .. } | Setting::Budget { .. } | Setting::Arithmetic(_) => exact,
        Setting::Effect(_) => given,
    }
}
