//! The step: stages 3 to 10, one after the other.

mod worker;

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::broad_phase::BroadPhase;
use crate::effects::{Effects, Found, order};
use crate::global_boxes::GlobalBox;
use crate::report::{Level, PairResult, PolygonPair, Report, StageCounts, StageTimes, Verdict};
use crate::scene::Body;
use worker::{Task, Worker};

/// Tells the time. The kernel has no clock of its own.
pub trait Clock: Sync {
    /// Nanoseconds since some moment; never goes back.
    fn nanoseconds(&self) -> u64;
}

/// It is always midnight: for callers that do not ask for times.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoClock;

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

/// Memory of the step, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Step {
    broad_phase: BroadPhase,
    kept: Vec<Kept>,
    tasks: Vec<Task>,
    /// One per thread of the pool, and one for a caller outside of it.
    workers: Vec<Mutex<Worker>>,
    found: Vec<Found>,
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
        self.collect(bodies);
        self.times.effects = stopwatch.lap();
    }

    pub fn report(&self) -> Report<'_> {
        Report { pairs: &self.pairs, polygon_pairs: &self.polygon_pairs, counts: &self.counts, times: &self.times }
    }

    /// Stages 5 to 8 of all pairs, over the threads of the pool. A pair that turns out heavy is handed back by its worker in
    /// pieces, which the next round shares out again.
    fn compare(&mut self, bodies: &[Body], clock: &dyn Clock) {
        self.workers.resize_with(rayon::current_num_threads() + 1, Mutex::default);
        self.tasks.clear();
        self.tasks.extend((0..self.kept.len() as u32).map(Task::whole_pair));
        while !self.tasks.is_empty() {
            let (kept, workers) = (&self.kept, &self.workers);
            let run = |task: &Task| {
                let place = rayon::current_thread_index().unwrap_or(workers.len() - 1);
                let mut worker = lock(&workers[place]);
                worker.run(task, &kept[task.pair as usize], bodies, clock);
            };
            match self.tasks.as_slice() {
                [task] => run(task),
                tasks => tasks.par_iter().for_each(run),
            }
            self.tasks.clear();
            for worker in &mut self.workers {
                self.tasks.append(&mut worker.get_mut().unwrap_or_else(|poisoned| poisoned.into_inner()).left_over);
            }
        }
    }

    /// Stage 9: what the workers found, in the order of the report.
    fn collect(&mut self, bodies: &[Body]) {
        self.found.clear();
        for worker in &mut self.workers {
            let worker = worker.get_mut().unwrap_or_else(|poisoned| poisoned.into_inner());
            self.found.append(&mut worker.found);
            worker.report_to(&mut self.counts, &mut self.times);
        }
        order(&mut self.found);
        self.polygon_pairs.clear();
        self.polygon_pairs.extend(self.found.iter().map(PolygonPair::from));
        self.pairs.clear();
        let mut first = 0;
        for (number, kept) in self.kept.iter().enumerate() {
            if !kept.interfering.load(Ordering::Relaxed) {
                continue;
            }
            let count = self.found[first..].iter().take_while(|found| found.pair == number as u32).count();
            let polygon_pairs = first..first + count;
            first += count;
            self.pairs.push(PairResult {
                a: bodies[kept.a as usize].id,
                b: bodies[kept.b as usize].id,
                verdict: Verdict::Interfering,
                level: Level::Polygons,
                relation: self.found[polygon_pairs.clone()].iter().map(|found| found.relation).max(),
                polygon_pairs,
            });
        }
        self.counts.interfering_pairs = self.pairs.len() as u64;
        self.counts.polygon_pairs = self.polygon_pairs.len() as u64;
    }
}

/// A worker's memory is valid whatever happened: it is cleared before each use.
fn lock(worker: &Mutex<Worker>) -> std::sync::MutexGuard<'_, Worker> {
    worker.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
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
