//! The step: stages 3 to 10, one after the other.

mod conclusion;
mod reach;
mod response;
mod results;
mod unmoved;
mod worker;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::broad_phase::BroadPhase;
use crate::effects::{Effects, Found, Touching, order};
use crate::global_boxes::GlobalBox;
use crate::motion::Motion;
use crate::report::{Report, StageCounts, StageTimes};
use crate::scene::{Accuracy, Body};
use crate::transforms::{RigidMotion, motion};
use crate::workforce::Workforce;
use reach::{FAR, Reach};
pub(crate) use response::StepResponse;
pub(crate) use results::Results;
use unmoved::LastStep;
use worker::{Task, Worker};

/// Tells the time. The kernel has no clock of its own.
pub trait Clock: Workforce {
    /// Nanoseconds since some moment; never goes back.
    fn nanoseconds(&self) -> u64;
}

/// It is always midnight: for callers that do not ask for times.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoClock;

impl Workforce for NoClock {}

impl Clock for NoClock {
    fn nanoseconds(&self) -> u64 {
        0
    }
}

/// What the stages look at: the scene after its bodies have moved.
#[derive(Clone, Copy)]
pub(crate) struct World<'s> {
    pub bodies: &'s [Body],
    /// The global bounding box of each.
    pub boxes: &'s [GlobalBox],
    /// Effects of pairs without a rule of their own.
    pub effects: Effects,
    /// All effects that any pair may ask for.
    pub asked: Effects,
    pub accuracy: &'s Accuracy,
    /// The rigid motions of the step.
    pub rigid: &'s [RigidMotion],
    /// Number of the step.
    pub step: u64,
}

impl World<'_> {
    /// How a body has moved in this step.
    pub fn motion(&self, body: u32) -> Motion {
        motion(&self.bodies[body as usize], self.rigid, self.step)
    }
}

/// A pair of bodies that matters: indices into the scene's bodies, and what is asked for.
#[derive(Debug)]
pub(crate) struct Kept {
    pub a: u32,
    pub b: u32,
    pub effects: Effects,
    /// Whether the global bounding boxes overlap; if not, the bodies are proven apart, and only effects that look farther are
    /// of interest.
    pub overlapping: bool,
    /// Which pair of the last step it was, when neither body has moved since.
    pub unmoved: Option<u32>,
    /// Set when a common point is proven.
    pub interfering: AtomicBool,
}

impl Kept {
    pub fn is_interfering(&self) -> bool {
        self.interfering.load(Ordering::Relaxed)
    }
}

/// Memory of the step, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Step {
    broad_phase: BroadPhase,
    reach: Reach,
    last: LastStep,
    kept: Vec<Kept>,
    tasks: Vec<Task>,
    /// One per thread of the workforce, and one for the caller.
    workers: Vec<Mutex<Worker>>,
    found: Vec<Found>,
    touching: Vec<Touching>,
    /// Pairs that stage 9 looks at, and which of `touching` are theirs.
    concluding: Vec<(u32, Range<usize>)>,
    results: Results,
    response: StepResponse,
    counts: StageCounts,
    times: StageTimes,
}

impl Step {
    /// Runs the stages; `start` is when stage 1 began, `boxes` how many global bounding boxes it computed.
    pub fn run(&mut self, world: World<'_>, clock: &dyn Clock, start: u64, box_count: u64) {
        let mut stopwatch = Stopwatch { clock, last: start };
        self.counts = StageCounts { boxes: box_count, ..StageCounts::default() };
        self.times = StageTimes { boxes: stopwatch.lap(), ..StageTimes::default() };
        let overlapping = self.broad_phase.overlapping_boxes(world.boxes);
        self.counts.broad_pairs = overlapping.len() as u64;
        let farther = self.reach.pairs(&world);
        self.times.broad_phase = stopwatch.lap();
        self.last.take(&mut self.kept, &mut self.found, &mut self.touching);
        keep(overlapping, farther, &world, &mut self.kept);
        self.last.decide(&mut self.kept, &world);
        self.counts.interest_pairs = self.kept.len() as u64;
        self.times.interest = stopwatch.lap();
        self.compare(world.bodies, clock);
        stopwatch.lap();
        self.gather(clock);
        self.conclude(world, clock);
        self.collect(world);
        self.times.effects = stopwatch.lap();
        self.last.end(world.step);
    }

    /// Forgets the last step: bodies have other indices now.
    pub fn forget(&mut self) {
        self.kept.clear();
        self.last.forget();
    }

    pub fn report(&self) -> Report<'_> {
        Report { results: &self.results, response: &self.response, counts: &self.counts, times: &self.times }
    }

    /// Stages 5 to 8 of all pairs that have moved. A light step is done by the caller, before another thread would have woken up; the rest is
    /// shared out. A pair that turns out heavy is handed back by its worker in pieces, which the next round shares out again.
    fn compare(&mut self, bodies: &[Body], clock: &dyn Clock) {
        self.workers.resize_with(clock.threads() + 1, Mutex::default);
        self.tasks.clear();
        let open = self.kept.iter().enumerate().rev().filter(|(_, kept)| kept.overlapping && kept.unmoved.is_none());
        self.tasks.extend(open.map(|(pair, _)| Task::whole_pair(pair as u32)));
        self.compare_alone(bodies, clock);
        while !self.tasks.is_empty() {
            for tasks in self.tasks.chunks(TASKS_AT_ONCE) {
                clock.share(&mut || share(tasks, &self.kept, &self.workers, bodies, clock));
            }
            self.tasks.clear();
            self.take_left_over();
        }
    }

    fn compare_alone(&mut self, bodies: &[Body], clock: &dyn Clock) {
        let Some(caller) = self.workers.last_mut() else { return };
        let worker = get_mut(caller);
        while worker.is_light()
            && let Some(task) = self.tasks.pop()
        {
            worker.run(&task, &self.kept[task.pair as usize], bodies, clock);
        }
        self.take_left_over();
    }

    fn take_left_over(&mut self) {
        for worker in &mut self.workers {
            self.tasks.append(&mut get_mut(worker).left_over);
        }
    }

    /// What the workers found in stage 8, in the order of the report.
    fn gather(&mut self, clock: &dyn Clock) {
        self.found.clear();
        self.touching.clear();
        self.last.recall(&self.kept, &mut self.found, &mut self.touching);
        for worker in &mut self.workers {
            let worker = get_mut(worker);
            self.found.append(&mut worker.found);
            self.touching.append(&mut worker.touching);
        }
        order(&mut self.found, clock);
        self.touching.sort_unstable();
        self.touching.dedup();
    }

    /// Stage 9 of the pairs that ask for more than their polygon pairs.
    fn conclude(&mut self, world: World<'_>, clock: &dyn Clock) {
        self.concluding.clear();
        let mut first = 0;
        for (pair, kept) in (0..).zip(&self.kept) {
            let touching = run(&self.touching, &mut first, |touching| touching.pair == pair);
            if conclusion::is_needed(kept) {
                self.concluding.push((pair, touching));
            }
        }
        if let [(pair, touching)] = &self.concluding[..] {
            let mut worker = own_worker(&self.workers);
            return worker.conclusion.add(*pair, &self.kept[*pair as usize], &self.touching[touching.clone()], world);
        }
        for pairs in self.concluding.chunks(TASKS_AT_ONCE) {
            clock.share(&mut || {
                pairs.par_iter().for_each(|(pair, touching)| {
                    let mut worker = own_worker(&self.workers);
                    worker.conclusion.add(*pair, &self.kept[*pair as usize], &self.touching[touching.clone()], world);
                });
            });
        }
    }

    /// Stage 10: the report, put together from what all threads have found.
    fn collect(&mut self, world: World<'_>) {
        self.results.clear();
        for worker in &mut self.workers {
            let worker = get_mut(worker);
            self.results.take(&mut worker.conclusion);
            worker.report_to(&mut self.counts, &mut self.times);
        }
        self.results.take_regions(&mut self.workers);
        self.results.list(world.bodies, &self.kept, &self.found);
        self.response.solve(&self.results, &self.kept, world.bodies);
        self.results.count(&mut self.counts);
    }
}

/// The records from `first` on that belong together; moves `first` behind them.
fn run<T>(records: &[T], first: &mut usize, belongs: impl Fn(&T) -> bool) -> Range<usize> {
    let start = *first;
    *first += records[start..].iter().take_while(|&record| belongs(record)).count();
    start..*first
}

/// Tasks that are shared out at once. Each is short, so that the steps of several scenes take turns.
const TASKS_AT_ONCE: usize = 128;

/// Runs tasks on all threads of the current pool.
fn share(tasks: &[Task], kept: &[Kept], workers: &[Mutex<Worker>], bodies: &[Body], clock: &dyn Clock) {
    tasks.par_iter().for_each(|task| {
        own_worker(workers).run(task, &kept[task.pair as usize], bodies, clock);
    });
}

/// The worker of the current thread; the last one is the caller's.
fn own_worker(workers: &[Mutex<Worker>]) -> MutexGuard<'_, Worker> {
    let place = rayon::current_thread_index().map_or(workers.len() - 1, |index| index % workers.len());
    workers[place].lock().unwrap_or_else(PoisonError::into_inner)
}

/// What a worker holds is good even if another task of it has panicked: it is cleared before each use.
fn get_mut(worker: &mut Mutex<Worker>) -> &mut Worker {
    worker.get_mut().unwrap_or_else(PoisonError::into_inner)
}

/// Stage 4: the pairs that matter, ordered. `farther` holds all of `overlapping`, or nothing.
fn keep(overlapping: &[(u32, u32)], farther: &[(u32, u32)], world: &World<'_>, kept: &mut Vec<Kept>) {
    kept.clear();
    let pair = |a: u32, b: u32, overlapping: bool| {
        let (first, second) = (&world.bodies[a as usize], &world.bodies[b as usize]);
        let effects = first.interest.effects(second.id, &second.interest, world.effects);
        let matters = if overlapping { !effects.is_empty() } else { effects.meets(FAR) };
        matters.then_some(Kept { a, b, effects, overlapping, unmoved: None, interfering: AtomicBool::new(false) })
    };
    if farther.is_empty() {
        return kept.extend(overlapping.iter().filter_map(|&(a, b)| pair(a, b, true)));
    }
    let mut next = overlapping.iter().peekable();
    kept.extend(farther.iter().filter_map(|&far| pair(far.0, far.1, next.next_if_eq(&&far).is_some())));
}

pub(crate) struct Stopwatch<'c> {
    pub clock: &'c dyn Clock,
    pub last: u64,
}

impl Stopwatch<'_> {
    /// Nanoseconds since the last lap.
    pub fn lap(&mut self) -> u64 {
        let now = self.clock.nanoseconds();
        now - std::mem::replace(&mut self.last, now)
    }
}
