//! The step: stages 3 to 10, one after the other.

mod worker;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::broad_phase::BroadPhase;
use crate::effects::containment::Containment;
use crate::effects::{Effects, Found, order};
use crate::global_boxes::GlobalBox;
use crate::report::{Level, PairResult, PolygonPair, Report, StageCounts, StageTimes, Verdict};
use crate::scene::Body;
use crate::workforce::Workforce;
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

/// A pair of bodies that matters: indices into the scene's bodies, and what is asked for.
#[derive(Debug)]
pub(crate) struct Kept {
    pub a: u32,
    pub b: u32,
    pub effects: Effects,
    /// Set when a common point is proven.
    pub interfering: AtomicBool,
}

impl Kept {
    /// Whether stage 9 has more to do than to order its polygon pairs.
    fn is_to_conclude(&self) -> bool {
        self.effects.contains(Effects::CONTAINMENT) && !self.interfering.load(Ordering::Relaxed)
    }
}

/// Memory of the step, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Step {
    broad_phase: BroadPhase,
    kept: Vec<Kept>,
    tasks: Vec<Task>,
    /// One per thread of the workforce, and one for the caller.
    workers: Vec<Mutex<Worker>>,
    /// Pairs that stage 9 looks at.
    concluding: Vec<u32>,
    found: Vec<Found>,
    contained: Vec<(u32, Containment)>,
    pairs: Vec<PairResult>,
    polygon_pairs: Vec<PolygonPair>,
    counts: StageCounts,
    times: StageTimes,
}

impl Step {
    /// Runs the stages; `start` is when stage 1 began, `boxes` how many global bounding boxes it computed.
    pub fn run(
        &mut self,
        bodies: &[Body],
        boxes: &[GlobalBox],
        effects: Effects,
        clock: &dyn Clock,
        start: u64,
        box_count: u64,
    ) {
        let mut stopwatch = Stopwatch { clock, last: start };
        self.counts = StageCounts { boxes: box_count, ..StageCounts::default() };
        self.times = StageTimes { boxes: stopwatch.lap(), ..StageTimes::default() };
        let overlapping = self.broad_phase.overlapping_boxes(boxes);
        self.counts.broad_pairs = overlapping.len() as u64;
        self.times.broad_phase = stopwatch.lap();
        keep(overlapping, bodies, effects, &mut self.kept);
        self.counts.interest_pairs = self.kept.len() as u64;
        self.times.interest = stopwatch.lap();
        self.compare(bodies, clock);
        stopwatch.lap();
        self.conclude(bodies, clock);
        self.collect(bodies, clock);
        self.times.effects = stopwatch.lap();
    }

    pub fn report(&self) -> Report<'_> {
        Report { pairs: &self.pairs, polygon_pairs: &self.polygon_pairs, counts: &self.counts, times: &self.times }
    }

    /// Stages 5 to 8 of all pairs. A light step is done by the caller, before another thread would have woken up; the rest is
    /// shared out. A pair that turns out heavy is handed back by its worker in pieces, which the next round shares out again.
    fn compare(&mut self, bodies: &[Body], clock: &dyn Clock) {
        self.workers.resize_with(clock.threads() + 1, Mutex::default);
        self.tasks.clear();
        self.tasks.extend((0..self.kept.len() as u32).rev().map(Task::whole_pair));
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

    /// Stage 9 of the pairs that ask for it.
    fn conclude(&mut self, bodies: &[Body], clock: &dyn Clock) {
        let numbered = (0..).zip(&self.kept);
        self.concluding.clear();
        self.concluding.extend(numbered.filter(|(_, kept)| kept.is_to_conclude()).map(|(pair, _)| pair));
        for pairs in self.concluding.chunks(TASKS_AT_ONCE) {
            clock.share(&mut || {
                pairs.par_iter().for_each(|&pair| {
                    let mut worker = own_worker(&self.workers);
                    worker.conclude(pair, &self.kept[pair as usize], bodies);
                });
            });
        }
    }

    /// What the workers found, in the order of the report.
    fn collect(&mut self, bodies: &[Body], clock: &dyn Clock) {
        self.found.clear();
        self.contained.clear();
        for worker in &mut self.workers {
            let worker = get_mut(worker);
            self.found.append(&mut worker.found);
            self.contained.append(&mut worker.contained);
            worker.report_to(&mut self.counts, &mut self.times);
        }
        order(&mut self.found, clock);
        self.contained.sort_unstable_by_key(|&(pair, _)| pair);
        self.polygon_pairs.clear();
        self.polygon_pairs.extend(self.found.iter().map(PolygonPair::from));
        self.pairs.clear();
        let (mut first_found, mut first_contained) = (0, 0);
        for (pair, kept) in (0..).zip(&self.kept) {
            let polygon_pairs = run(&self.found, &mut first_found, |found| found.pair == pair);
            let containment = run(&self.contained, &mut first_contained, |&(of, _)| of == pair);
            let containment = self.contained[containment].first().map(|&(_, containment)| containment);
            let relation = self.found[polygon_pairs.clone()].iter().map(|found| found.relation).max();
            let touching = kept.interfering.load(Ordering::Relaxed);
            let inside = containment.is_some_and(Containment::is_proven);
            if !touching && containment.is_none_or(|containment| containment == Containment::None) {
                continue;
            }
            self.pairs.push(PairResult {
                a: bodies[kept.a as usize].id,
                b: bodies[kept.b as usize].id,
                verdict: if touching || inside { Verdict::Interfering } else { Verdict::Clear },
                level: Level::Polygons,
                relation,
                containment: kept
                    .effects
                    .contains(Effects::CONTAINMENT)
                    .then(|| containment.unwrap_or(Containment::None)),
                polygon_pairs,
            });
        }
        self.counts.interfering_pairs =
            self.pairs.iter().filter(|pair| pair.verdict == Verdict::Interfering).count() as u64;
        self.counts.polygon_pairs = self.polygon_pairs.len() as u64;
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

/// Stage 4: the pairs that matter.
fn keep(overlapping: &[(u32, u32)], bodies: &[Body], scene: Effects, kept: &mut Vec<Kept>) {
    kept.clear();
    kept.extend(overlapping.iter().filter_map(|&(a, b)| {
        let (first, second) = (&bodies[a as usize], &bodies[b as usize]);
        let effects = first.interest.effects(second.id, &second.interest, scene);
        (!effects.is_empty()).then_some(Kept { a, b, effects, interfering: AtomicBool::new(false) })
    }));
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
