//! The step: stages 3 to 10, one after the other.

mod batch;
mod coherence;
mod conclusion;
mod cost;
mod first_step;
mod limit;
mod reach;
mod response;
mod results;
mod screen;
mod turn;
mod unmoved;
mod witness;
mod worker;

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::accuracy::Accuracy;
use crate::broad_phase::BroadPhase;
use crate::effects::{Effects, Found, Touching, order};
use crate::global_boxes::GlobalBox;
use crate::motion::Motion;
use crate::places::Places;
use crate::report::{Report, StageCounts, StageTimes, Verdict};
use crate::scene::Body;
use crate::submatrix::Placed;
use crate::transforms::RigidMotion;
use crate::workforce::{Alone, Workforce};
pub(crate) use batch::Batch;
use coherence::{Clearance, Memory};
use conclusion::{BEYOND_SURFACES, OF_TRIANGLES};
pub use cost::CostPerPair;
use first_step::time_fault;
pub(crate) use limit::Limit;
use reach::{FAR, Reach};
pub(crate) use response::StepResponse;
pub(crate) use results::Results;
use screen::Screen;
use turn::take_turns;
use unmoved::LastStep;
use worker::{LeftOver, Round, Task, Worker};

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
    /// Where they are.
    pub places: &'s Places,
    /// The global bounding box of each.
    pub boxes: &'s [GlobalBox],
    /// Effects of pairs without a rule of their own.
    pub effects: Effects,
    /// All effects that any pair may ask for.
    pub asked: Effects,
    /// Whether any pair may have a rule of its own: if not, no body has to be asked.
    pub any_rule: bool,
    /// Accuracy of pairs without one of their own.
    pub accuracy: &'s Accuracy,
    /// Whether any pair may have one of its own.
    pub any_accuracy: bool,
    /// The farthest that any pair asks distances for.
    pub up_to: f64,
    /// The rigid motions of the step.
    pub rigid: &'s [RigidMotion],
    /// Number of the step.
    pub step: u64,
}

impl<'s> World<'s> {
    /// A body where it is.
    pub fn placed(&self, body: u32) -> Placed<'s> {
        let object = &*self.bodies[body as usize].object;
        Placed { object, rows: self.places.rows(body), magnitude: self.places.magnitude(body) }
    }

    /// How a body has moved in this step.
    pub fn motion(&self, body: u32) -> Motion {
        self.places.motion(body, self.rigid, self.step)
    }

    /// What is asked of a pair of bodies, of which the first comes first.
    #[inline]
    pub fn effects_of(&self, a: u32, b: u32) -> Effects {
        if !self.any_rule {
            return self.effects;
        }
        let (a, b) = (&self.bodies[a as usize], &self.bodies[b as usize]);
        a.interest.effects(b.id, &b.interest, self.effects)
    }

    /// The accuracy of such a pair.
    #[inline]
    pub fn accuracy_of(&self, a: u32, b: u32) -> &Accuracy {
        if !self.any_accuracy {
            return self.accuracy;
        }
        let (a, b) = (&self.bodies[a as usize], &self.bodies[b as usize]);
        a.interest.accuracy(b.id).unwrap_or(self.accuracy)
    }
}

/// A pair of bodies that matters: indices into the scene's bodies, and what is asked for.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    pub a: u32,
    pub b: u32,
    pub effects: Effects,
    /// Whether the global bounding boxes overlap; if not, the bodies are proven apart, and only effects that look farther are
    /// of interest.
    pub overlapping: bool,
    /// Which pair of the last step it was, when neither body has moved since.
    pub unmoved: Option<u32>,
    /// Whether stage 9 found then what it would find now.
    pub concluded: bool,
    /// Whether the bodies have together moved less than they were apart: proven clear.
    pub apart: bool,
    /// Whether they were that far apart at the start of the step, so that they do not meet in it.
    pub free: bool,
    pub memory: Memory,
    /// What the test looks for besides.
    pub clearance: Clearance,
    /// Set when a common point is proven.
    pub interfering: AtomicBool,
    /// Set when the pair is refined as far as its accuracy, or the budget, allows and is not proven clear.
    pub open: AtomicBool,
    /// Set when the budget was used up before all was done that the pair asks for.
    pub unfinished: AtomicBool,
    /// Whether it interfered in the last step.
    pub was_interfering: bool,
}

impl Kept {
    pub fn is_interfering(&self) -> bool {
        self.interfering.load(Ordering::Relaxed)
    }

    pub fn is_open(&self) -> bool {
        self.open.load(Ordering::Relaxed)
    }

    pub fn is_unfinished(&self) -> bool {
        self.unfinished.load(Ordering::Relaxed)
    }

    /// The budget is used up before stages 5 to 8 have decided the pair.
    pub fn leave_unfinished(&self) {
        self.open.store(true, Ordering::Relaxed);
        self.unfinished.store(true, Ordering::Relaxed);
    }

    /// Whether an effect needs every pair of polygons that interfere.
    pub fn wants_all(&self) -> bool {
        self.effects.meets(Effects::POLYGON_PAIRS.union(OF_TRIANGLES))
    }

    /// What stages 5 to 8 have come to.
    pub fn verdict(&self) -> Verdict {
        match (self.is_interfering(), self.is_open()) {
            (true, _) => Verdict::Interfering,
            (false, true) => Verdict::Possible,
            (false, false) => Verdict::Clear,
        }
    }

    /// Whether it is clear without a test, and nothing else is asked.
    fn is_settled(&self) -> bool {
        self.apart && !self.effects.meets(BEYOND_SURFACES)
    }

    /// Whether stages 5 to 8 have to look at it.
    fn needs_test(&self) -> bool {
        self.overlapping && self.unmoved.is_none() && !self.apart
    }
}

/// Memory of the step, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Step {
    broad_phase: BroadPhase,
    reach: Reach,
    screen: Screen,
    last: LastStep,
    kept: Vec<Kept>,
    work: LeftOver,
    /// One per thread of the workforce, and one for the caller.
    workers: Vec<Mutex<Worker>>,
    found: Vec<Found>,
    touching: Vec<Touching>,
    /// Pairs that stage 9 looks at, and which of `touching` are theirs.
    concluding: Vec<(u32, Range<usize>)>,
    results: Box<Results>,
    response: StepResponse,
    counts: StageCounts,
    times: StageTimes,
    /// Whether all pairs that matter were found within the budget.
    is_complete: bool,
    /// What it takes to come to an end and put the report together.
    ending: CostPerPair,
    batch: Batch,
}

impl Step {
    /// Runs the stages; `start` is when stage 1 began, `boxes` how many global bounding boxes it computed.
    pub fn run(
        &mut self,
        world: World<'_>,
        clock: &dyn Clock,
        (mut limit, report_cost): (Limit<'_>, CostPerPair),
        start: u64,
        box_count: u64,
    ) {
        let mut stopwatch = Stopwatch { clock, last: start };
        self.counts = StageCounts { boxes: box_count, ..StageCounts::default() };
        self.times = StageTimes { boxes: stopwatch.lap(), ..StageTimes::default() };
        let is_short = limit.is_short();
        let workforce: &dyn Workforce = if is_short { &Alone } else { clock };
        self.broad_phase.hurry(is_short);
        let overlapping = self.broad_phase.overlapping_within(world.boxes, |work| limit.spend(work), workforce);
        self.counts.broad_pairs = overlapping.len() as u64;
        let farther = self.reach.pairs(&world, &limit, workforce);
        let pairs = overlapping.len().max(farther.len()) as u64;
        limit.reserve(self.ending.of(pairs) + report_cost.of(pairs));
        // Pairs that there is no time to list are not worth more than the word that they are open.
        let (overlapping, farther) = if limit.spend(0) { (&[][..], &[][..]) } else { (overlapping, farther) };
        self.times.broad_phase = stopwatch.lap();
        self.last.take(&mut self.kept, &mut self.found, &mut self.touching, &mut self.results);
        self.counts.interest_pairs = self.screen.ask(overlapping, farther, &world, &self.last, workforce) as u64;
        self.is_complete = !limit.is_up();
        if self.counts.interest_pairs > 0 {
            self.screen.keep(&world, &limit, clock, &mut self.kept);
        }
        self.results.clear();
        self.results.time_fault = time_fault(&world);
        if self.kept.is_empty() {
            self.response.clear();
            self.ending.wear_off();
        } else {
            self.examine(world, &limit, &mut stopwatch);
        }
        self.last.end(world.step);
    }

    /// Stages 4 to 10 of the pairs that matter.
    fn examine(&mut self, world: World<'_>, limit: &Limit<'_>, stopwatch: &mut Stopwatch<'_>) {
        let clock = stopwatch.clock;
        let workforce: &dyn Workforce = if limit.is_short() { &Alone } else { clock };
        self.last.decide(&mut self.kept, &world, workforce);
        self.times.interest = stopwatch.lap();
        if self.kept.iter().all(Kept::is_settled) {
            return self.response.clear();
        }
        self.compare(&Round { world, clock, limit, alone: false });
        stopwatch.lap();
        let ending = limit.up_at(stopwatch.last);
        self.learn(&world);
        self.gather(clock);
        self.conclude(world, clock, limit);
        self.collect(world);
        self.times.effects = stopwatch.lap();
        self.ending.learn(stopwatch.last - ending, self.counts.interest_pairs);
    }

    /// Forgets the last step: bodies have other indices now.
    pub fn forget(&mut self) {
        self.kept.clear();
        self.screen.forget();
        self.last.forget();
    }

    pub fn report(&self) -> Report<'_> {
        let Step { results, response, counts, times, is_complete, .. } = self;
        Report { results, response, counts, times, is_complete: *is_complete }
    }

    /// Stages 5 to 8 of all pairs that have moved. A light step is done by the caller, before another thread would have woken up; the rest is
    /// shared out. A pair that turns out heavy is handed back by its worker in pieces, which the next round shares out again.
    fn compare(&mut self, round: &Round<'_>) {
        if self.workers.len() != round.clock.threads() + 1 {
            self.workers.resize_with(round.clock.threads() + 1, Mutex::default);
        }
        self.work.tasks.clear();
        self.work.voxels.clear();
        let open = self.kept.iter().enumerate().rev().filter(|(_, kept)| kept.needs_test());
        self.work.tasks.extend(open.map(|(pair, _)| Task::whole_pair(pair as u32)));
        if round.limit.exists() {
            // The last ones come first: what interfered in the last step is likely to be proven soon.
            let (kept, tasks) = (&self.kept, &mut self.work.tasks);
            let is_likely = |pair: &u32| kept[*pair as usize].was_interfering && kept[*pair as usize].needs_test();
            let likely = (0..kept.len() as u32).rev().filter(is_likely);
            tasks.retain(|task| !kept[task.pair as usize].was_interfering);
            tasks.extend(likely.map(Task::whole_pair));
        }
        self.compare_alone(round);
        while !self.work.tasks.is_empty() {
            if round.limit.is_up() {
                self.work.tasks.drain(..).for_each(|task| self.kept[task.pair as usize].leave_unfinished());
            } else if is_for_one(&self.work.tasks, round.limit) {
                self.compare_alone(round);
            } else {
                take_turns(&self.work.tasks, &self.work.voxels, &self.kept, &self.workers, round);
                self.work.tasks.clear();
            }
            self.take_left_over();
        }
        if round.limit.is_up() {
            // Proven, and nothing more is asked.
            let done = self.kept.iter_mut().filter(|kept| kept.is_interfering() && !kept.wants_all());
            done.for_each(|kept| *kept.unfinished.get_mut() = false);
        }
    }

    /// A step that is light, or short of time, is the caller's alone.
    fn compare_alone(&mut self, round: &Round<'_>) {
        let Some(caller) = self.workers.last_mut() else { return };
        let worker = get_mut(caller);
        while (worker.is_light() || is_for_one(&self.work.tasks, round.limit))
            && let Some(task) = self.work.tasks.pop()
        {
            worker.run(&task, &self.kept[task.pair as usize], round, &self.work.voxels);
        }
        self.take_left_over();
    }

    fn take_left_over(&mut self) {
        if self.work.tasks.is_empty() {
            self.work.voxels.clear();
        }
        for worker in &mut self.workers {
            self.work.append(&mut get_mut(worker).left_over);
        }
    }

    /// What the next step need not find anew.
    fn learn(&mut self, world: &World<'_>) {
        for kept in self.kept.iter_mut().filter(|kept| kept.needs_test()) {
            self.last.learn(kept, world);
        }
        for worker in &mut self.workers {
            for (pair, triangles) in get_mut(worker).witnesses.drain(..) {
                self.kept[pair as usize].memory.witness = Some(triangles);
            }
        }
    }

    /// What the workers found in stage 8, in the order of the report.
    fn gather(&mut self, clock: &dyn Clock) {
        self.last.recall(&self.kept, &mut self.found, &mut self.touching);
        for worker in &mut self.workers {
            let worker = get_mut(worker);
            self.found.append(&mut worker.found);
            self.touching.append(&mut worker.touching);
        }
        if self.kept.iter().any(Kept::is_unfinished) {
            // Some of their polygon pairs are known, not all.
            self.found.retain(|found| !self.kept[found.pair as usize].is_unfinished());
            self.touching.retain(|touching| !self.kept[touching.pair as usize].is_unfinished());
        }
        order(&mut self.found, clock);
        self.touching.sort_unstable();
        self.touching.dedup();
    }

    /// Stage 9 of the pairs that ask for more than their polygon pairs.
    fn conclude(&mut self, world: World<'_>, clock: &dyn Clock, limit: &Limit<'_>) {
        self.concluding.clear();
        let mut first = 0;
        for (pair, kept) in (0..).zip(&self.kept) {
            let touching = run(&self.touching, &mut first, |touching| touching.pair == pair);
            if !kept.concluded && conclusion::is_needed(kept) {
                self.concluding.push((pair, touching));
            }
        }
        let conclude = |(pair, touching): &(u32, Range<usize>)| {
            let kept = &self.kept[*pair as usize];
            if limit.spend(WORK_OF_AN_EFFECT) {
                kept.unfinished.store(true, Ordering::Relaxed);
                return;
            }
            own_worker(&self.workers).conclusion.add(*pair, kept, &self.touching[touching.clone()], world);
        };
        if self.concluding.len() == 1 || limit.is_short() {
            return self.concluding.iter().for_each(conclude);
        }
        for pairs in self.concluding.chunks(PAIRS_AT_ONCE) {
            clock.share(&mut || pairs.par_iter().for_each(conclude));
        }
    }

    /// Stage 10: the report, put together from what all threads have found.
    fn collect(&mut self, world: World<'_>) {
        for worker in &mut self.workers {
            let worker = get_mut(worker);
            self.results.take(worker);
            worker.report_to(&mut self.counts, &mut self.times);
        }
        self.results.recall(&self.kept, &self.last.results);
        self.results.take_regions(&mut self.workers, &self.last.results);
        self.results.list(&world, &self.kept, &self.found);
        self.response.solve(&self.results, &self.kept, &world);
        self.results.count(&mut self.counts);
    }
}

/// The records from `first` on that belong together; moves `first` behind them.
fn run<T>(records: &[T], first: &mut usize, belongs: impl Fn(&T) -> bool) -> Range<usize> {
    let start = *first;
    *first += records[start..].iter().take_while(|&record| belongs(record)).count();
    start..*first
}

/// Pairs of which stage 9 is shared out at once, so that the steps of several scenes take turns.
const PAIRS_AT_ONCE: usize = 128;

/// What stage 9 of a pair counts for in a budget of work.
const WORK_OF_AN_EFFECT: u64 = 256;

/// Whether waking another thread would cost more of the budget than it saves: the time is short, or there is but one task.
fn is_for_one(tasks: &[Task], limit: &Limit<'_>) -> bool {
    limit.exists() && (limit.is_short() || tasks.len() == 1)
}

/// What belongs to the current thread; the last one is the caller's.
fn own_worker<T>(workers: &[Mutex<T>]) -> MutexGuard<'_, T> {
    let place = rayon::current_thread_index().map_or(workers.len() - 1, |index| index % workers.len());
    workers[place].lock().unwrap_or_else(PoisonError::into_inner)
}

/// What a worker holds is good even if another task of it has panicked: it is cleared before each use.
fn get_mut<T>(worker: &mut Mutex<T>) -> &mut T {
    worker.get_mut().unwrap_or_else(PoisonError::into_inner)
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
