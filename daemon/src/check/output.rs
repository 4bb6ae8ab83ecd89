//! What the two ways of printing have in common.

use std::collections::HashMap;
use std::io;
use std::path::Path;

use collided_client::{BodyId, Interest, Report, Verdict};
use collided_protocol::{Effect, Effects};

use crate::scene_file::SceneFile;

/// A way of printing.
pub(super) trait Output {
    /// A scene begins.
    fn begin(&mut self, path: &Path, file: &SceneFile) -> io::Result<()>;
    /// A step of it was answered.
    fn step(&mut self, result: &StepResult<'_>) -> io::Result<()>;
    /// It was answered to its end.
    fn end(&mut self) -> io::Result<()>;
}

/// A step that was answered.
pub(super) struct StepResult<'a> {
    pub path: &'a Path,
    pub index: usize,
    pub file: &'a SceneFile,
    /// Ids of the bodies, in the order of the file: ascending.
    pub bodies: &'a [BodyId],
    pub effects: &'a PairEffects,
    pub report: &'a Report,
}

/// A pair of a step, in the words of the file.
pub(super) struct Pair<'a> {
    pub a: &'a str,
    pub b: &'a str,
    /// What was asked for.
    pub effects: Effects,
    /// What the report says.
    pub found: collided_client::Pair<'a>,
}

impl<'a> StepResult<'a> {
    /// The pairs of the report, in its order.
    pub fn pairs(&self) -> impl Iterator<Item = Pair<'a>> {
        let (file, bodies, effects) = (self.file, self.bodies, self.effects);
        self.report.pairs().map(move |pair| {
            // The daemon reports on no bodies but those of the scene, which are these.
            let [a, b] = [pair.a(), pair.b()].map(|id| bodies.partition_point(|&other| other < id));
            let effects = effects.of_pair(a, b);
            let [a, b] = [a, b].map(|place| file.bodies[place].name.as_str());
            Pair { a, b, effects, found: pair }
        })
    }

    /// Whether a pair interferes at the end of the step, or meets, or may meet, on the way.
    pub fn is_interfering(&self) -> bool {
        !self.report.is_complete()
            || self.report.pairs().any(|pair| pair.verdict() != Verdict::Clear || pair.time_of_contact().is_some())
    }

    /// A body that counts as still though it was given a motion. That the first step of a file places bodies is no fault as such.
    pub fn time_fault(&self) -> Option<&'a str> {
        let moves = !self.file.steps[self.index].motions.is_empty();
        self.report.time_fault().filter(|_| moves).map(|body| self.name(body))
    }

    /// The name of a body.
    pub fn name(&self, body: BodyId) -> &'a str {
        &self.file.bodies[self.bodies.partition_point(|&other| other < body)].name
    }
}

/// The effects of each pair of bodies.
pub(super) struct PairEffects {
    default: Effects,
    rules: HashMap<(usize, usize), Effects>,
}

impl PairEffects {
    pub fn of(file: &SceneFile) -> PairEffects {
        let rules = file.interest.iter().map(|rule| {
            let effects = match rule.interest {
                Interest::Default => file.effects,
                Interest::Ignore => Effects::NONE,
                Interest::Effects(effects) => effects,
            };
            ((rule.a.min(rule.b), rule.a.max(rule.b)), effects)
        });
        PairEffects { default: file.effects, rules: rules.collect() }
    }

    /// Effects of the pair of bodies at places `a < b` of the file.
    fn of_pair(&self, a: usize, b: usize) -> Effects {
        self.rules.get(&(a, b)).copied().unwrap_or(self.default)
    }

    /// Whether an effect is asked of any pair.
    pub fn any(&self, effect: Effect) -> bool {
        self.rules.values().chain([&self.default]).any(|effects| effects.contains(effect))
    }
}
