//! The study: every setting of the plan is run, timed, and compared with the exact answers.

use std::sync::Arc;
use std::time::Instant;

use collided_kernel::{Level, Object, ObjectError};
use collided_protocol::Effect;

use super::error::StudyError;
use super::measurement::{Measurement, Precision, Setting, Worth};
use super::plan::{Plan, TIGHTEST_DISTANCE, TIGHTEST_TIME};
use super::polygon_tests::PolygonTests;
use super::progress::Progress;
use super::run::Run;
use super::scene::StudyScene;
use super::statistics::{Spread, quantile};
use super::truth::{Answers, Place};
use crate::budget::Budget;

/// An order of the voxel matrices that takes so many times the least time found is not worth measuring, nor are those beyond it.
const HOPELESS: f64 = 20.0;

const NO_PAIR: &str = "no two boxes of its bodies overlap in any step, so there is no pair to decide; bring bodies nearer to \
                       each other, or look at \"interest\" and groups";

/// A study under way.
pub struct Study<'s> {
    scene: &'s StudyScene,
    plan: &'s Plan,
    progress: Progress,
    /// The threads that compute now.
    threads: Budget,
    truth: Truth,
    measured: Vec<Measurement>,
}

/// The exact answers.
#[derive(Default)]
struct Truth {
    /// The pairs that boxes do not decide.
    candidates: Vec<Place>,
    verdicts: Answers,
    distances: Answers,
    times: Answers,
}

impl Truth {
    fn is_empty(&self) -> bool {
        self.candidates.is_empty() && self.distances.distances.is_empty() && self.times.times.is_empty()
    }
}

/// Runs the whole plan.
///
/// # Errors
/// When a step is refused, an object cannot be built, or there is no pair to decide.
pub fn run(scene: &StudyScene, plan: &Plan) -> Result<Vec<Measurement>, StudyError> {
    let progress = Progress::new(plan.settings(scene));
    let mut study = Study { scene, plan, progress, threads: pool(1)?, truth: Truth::default(), measured: Vec::new() };
    study.find_truth()?;
    for &threads in plan.threads {
        study.threads = pool(threads)?;
        if !study.truth.candidates.is_empty() {
            study.verdicts()?;
        }
        study.all(&plan.tolerances(scene, Effect::Distance))?;
        study.all(&plan.tolerances(scene, Effect::TimeOfContact))?;
        study.all(&plan.effects(scene))?;
    }
    if !study.truth.candidates.is_empty() {
        study.polygon_tests()?;
    }
    Ok(study.measured)
}

fn pool(threads: usize) -> Result<Budget, StudyError> {
    Budget::new(threads).map_err(|error| StudyError::Threads(error.to_string()))
}

impl<'s> Study<'s> {
    fn find_truth(&mut self) -> Result<(), StudyError> {
        let boxes = self.answers(Setting::Level { level: Level::GlobalBoxes, order: None })?;
        self.truth.candidates = boxes.verdicts.into_keys().collect();
        self.truth.verdicts = self.answers(Setting::Level { level: Level::Polygons, order: None })?;
        if self.scene.asks(Effect::Distance) {
            self.truth.distances = self.answers(Setting::Distance { tolerance: TIGHTEST_DISTANCE })?;
        }
        if self.scene.asks(Effect::TimeOfContact) {
            self.truth.times = self.answers(Setting::TimeOfContact { tolerance: TIGHTEST_TIME })?;
        }
        match self.truth.is_empty() {
            true => Err(self.scene.nothing(NO_PAIR)),
            false => Ok(()),
        }
    }

    fn answers(&self, setting: Setting) -> Result<Answers, StudyError> {
        let mut run = Run::start(self.scene, setting, self.scene.objects.clone(), &self.threads.slot())?;
        Ok(run.answers.swap_remove(0))
    }

    /// Levels, budgets, and orders of the voxel matrices.
    fn verdicts(&mut self) -> Result<(), StudyError> {
        self.all(&self.plan.levels(self.scene))?;
        let budgets = self.budgets()?;
        self.measure(budgets)?;
        let matrices = self.matrices()?;
        self.measure(matrices)
    }

    fn all(&mut self, settings: &[Setting]) -> Result<(), StudyError> {
        let runs = settings.iter().map(|&setting| self.start(setting, self.scene.objects.clone()));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        self.measure(runs)
    }

    fn start(&self, setting: Setting, objects: Vec<Arc<Object>>) -> Result<Run<'s>, StudyError> {
        self.progress.begin(setting, self.threads.threads());
        Run::start(self.scene, setting, objects, &self.threads.slot())
    }

    /// Repeats settings in turn, so that whatever else the machine does meanwhile slows all of them alike.
    fn measure(&mut self, mut runs: Vec<Run<'_>>) -> Result<(), StudyError> {
        while runs.iter().any(|run| run.wants_more(self.plan)) {
            for run in runs.iter_mut().filter(|run| run.wants_more(self.plan)) {
                self.progress.begin(run.setting, self.threads.threads());
                run.again(&self.threads.slot())?;
            }
        }
        for run in &runs {
            let (setting, threads, worth) = (run.setting, self.threads.threads(), self.worth(run));
            self.check(setting, &worth)?;
            let (repetitions, time) = (run.repetitions(), run.time());
            self.measured.push(Measurement { setting, threads, repetitions, time, worth });
            self.progress.end();
        }
        Ok(())
    }

    /// Budgets until one is enough for every step.
    fn budgets(&self) -> Result<Vec<Run<'s>>, StudyError> {
        let mut runs = Vec::new();
        for nanoseconds in self.plan.budgets() {
            let run = self.start(Setting::Budget { nanoseconds }, self.scene.objects.clone())?;
            let is_enough = self.worth(&run).open == 0;
            runs.push(run);
            if is_enough {
                break;
            }
        }
        Ok(runs)
    }

    /// The chosen orders of the voxel matrices, and others for all objects alike: from the largest chosen one in both directions, as
    /// far as there is hope.
    fn matrices(&self) -> Result<Vec<Run<'s>>, StudyError> {
        let largest = self.scene.largest_order();
        let chosen = self.start(Setting::Matrix { order: largest, chosen: true }, self.scene.objects.clone())?;
        let mut best = chosen.time().median;
        let mut runs = Vec::new();
        for orders in self.plan.matrices(self.scene) {
            for order in orders {
                let objects = match self.scene.build(Some(order)) {
                    Err(StudyError::Object { source: ObjectError::MatrixTooLarge { .. }, .. }) => break,
                    objects => objects?,
                };
                let run = self.start(Setting::Matrix { order, chosen: false }, objects)?;
                let time = run.time().median;
                best = best.min(time);
                runs.push((order, run));
                if time > HOPELESS * best {
                    break;
                }
            }
        }
        runs.sort_by_key(|(order, _)| *order);
        Ok([chosen].into_iter().chain(runs.into_iter().map(|(_, run)| run)).collect())
    }

    fn worth(&self, run: &Run<'_>) -> Worth {
        let truth = &self.truth;
        let verdicts = |answers: &Answers| answers.verdicts_against(&truth.verdicts, &truth.candidates);
        let first = &run.answers[0];
        match run.setting {
            Setting::Level { .. } => verdicts(first),
            Setting::Matrix { .. } => Worth { memory: Some(memory(&run.objects)), ..verdicts(first) },
            Setting::Budget { nanoseconds } => {
                // The first pass only warms up, unless it is the only one.
                let passes = run.answers.iter().skip(usize::from(run.answers.len() > 1)).map(verdicts);
                Worth { overrun: overrun(run.times(), nanoseconds as f64), ..middle(passes.collect()) }
            }
            Setting::Distance { .. } => first.distances_against(&truth.distances),
            Setting::TimeOfContact { .. } => first.times_against(&truth.times),
            Setting::Effect(_) | Setting::Arithmetic(_) => Worth::default(),
        }
    }

    /// What the kernel says must never contradict what it says exactly.
    fn check(&self, setting: Setting, worth: &Worth) -> Result<(), StudyError> {
        match worth.wrong {
            0 => Ok(()),
            wrong => {
                Err(StudyError::Contradiction { wrong, setting: format!("{} {}", setting.curve(), setting.label()) })
            }
        }
    }

    fn polygon_tests(&mut self) -> Result<(), StudyError> {
        let tests = PolygonTests::of(self.scene, &self.truth.candidates);
        // In turn, so that whatever else the machine does meanwhile slows all three alike.
        let mut times = Precision::ALL.map(|_| Vec::new());
        let start = Instant::now();
        let patience = self.plan.patience * Precision::ALL.len() as u32;
        while times[0].len() < self.plan.repetitions && (start.elapsed() < patience || times[0].is_empty()) {
            for (precision, times) in Precision::ALL.into_iter().zip(&mut times) {
                times.push(tests.time(precision));
            }
        }
        for (precision, times) in Precision::ALL.into_iter().zip(times) {
            let setting = Setting::Arithmetic(precision);
            self.progress.begin(setting, 1);
            let (repetitions, worth) = (times.len(), tests.worth(precision));
            let time = Spread::of(times).expect("each arithmetic is run at least once");
            self.measured.push(Measurement { setting, threads: 1, repetitions, time, worth });
            self.progress.end();
        }
        Ok(())
    }
}

/// The pass with the median number of open pairs, with all that any pass has said wrongly.
fn middle(mut passes: Vec<Worth>) -> Worth {
    passes.sort_unstable_by_key(|worth| worth.open);
    let wrong = passes.iter().map(|worth| worth.wrong).max().unwrap_or(0);
    Worth { wrong, ..passes[passes.len() / 2] }
}

fn memory(objects: &[Arc<Object>]) -> u64 {
    objects.iter().map(|object| object.memory_bytes() as u64).sum()
}

/// By how much 99 of 100 steps do not overrun their budget.
fn overrun(times: &[Vec<f64>], budget: f64) -> Option<f64> {
    let mut over: Vec<f64> = times.iter().flatten().map(|time| (time - budget).max(0.0)).collect();
    over.sort_unstable_by(f64::total_cmp);
    quantile(&over, 0.99)
}
