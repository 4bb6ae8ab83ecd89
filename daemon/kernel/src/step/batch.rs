//! Stages 3 to 8 of a batch, candidate by candidate.
//!
//! Candidates are taken in the order of their numbers, each by one thread. Those behind the first of the verdict at which the batch
//! stops may have been begun by then: what they came to is not reported, so that nothing of how the work was shared can be observed.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

use rayon::prelude::*;

use super::worker::{Round, Task, Worker};
use super::{Clock, Kept, Limit, Step, Stopwatch, WORK_OF_AN_EFFECT, World, get_mut, own_worker};
use crate::batch::{BatchReport, Candidates, Placement};
use crate::broad_phase::BroadPhase;
use crate::effects::Effects;
use crate::report::{Level, StageCounts, StageTimes, Verdict};
use crate::submatrix::{Outline, are_apart};
use crate::workforce::Alone;

/// Candidates that are shared out at once: less than a millisecond of work, so that several scenes take turns.
const CANDIDATES_AT_ONCE: usize = 128;

/// The most that the caller does alone: if their boxes meet nothing, about what it takes to wake another thread.
const LIGHT: usize = 64;

/// What looking a box up counts for in a budget of work.
const WORK_OF_A_LOOK_UP: u64 = 8;

/// Memory of the batches of a scene, kept from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Batch {
    outcomes: Vec<OnceLock<Verdict>>,
    /// How many of them are reported.
    reported: usize,
    /// One per thread of the workforce, and one for the caller.
    searches: Vec<Mutex<Search>>,
    counts: StageCounts,
    times: StageTimes,
}

/// One thread's memory for stages 3 and 4.
#[derive(Debug, Default)]
struct Search {
    /// For the pairs of two bodies that are named.
    among: BroadPhase,
    stack: Vec<u32>,
    near: Vec<u32>,
    counts: StageCounts,
}

/// A batch under way.
struct Judging<'j> {
    round: Round<'j>,
    candidates: &'j Candidates,
    /// Holds the boxes of the bodies where they rest.
    tree: &'j BroadPhase,
    workers: &'j [Mutex<Worker>],
    searches: &'j [Mutex<Search>],
    outcomes: &'j [OnceLock<Verdict>],
    stop_at: Option<Verdict>,
    /// The first candidate known to be of that verdict.
    stop: AtomicUsize,
}

impl Batch {
    /// The verdicts of the candidates that are reported.
    pub fn verdicts(&self) -> impl ExactSizeIterator<Item = Option<Verdict>> {
        let reported = self.reported;
        self.outcomes.iter().enumerate().map(move |(at, verdict)| verdict.get().copied().filter(|_| at < reported))
    }

    pub fn counts(&self) -> StageCounts {
        self.counts
    }

    pub fn times(&self) -> StageTimes {
        self.times
    }

    fn begin(&mut self, candidates: &Candidates, threads: usize) {
        self.outcomes.clear();
        self.outcomes.resize_with(candidates.count(), OnceLock::new);
        self.searches.resize_with(threads + 1, Mutex::default);
        self.counts = StageCounts { boxes: candidates.transform_count() as u64, ..StageCounts::default() };
        self.times = StageTimes::default();
    }
}

impl Step {
    /// The verdicts of a batch; `start` is when stage 1 began. What the last step knows stays as it is.
    pub fn batch(
        &mut self,
        world: World<'_>,
        candidates: &Candidates,
        stop_at: Option<Verdict>,
        clock: &dyn Clock,
        limit: Limit<'_>,
        start: u64,
    ) {
        let mut stopwatch = Stopwatch { clock, last: start };
        self.workers.resize_with(clock.threads() + 1, Mutex::default);
        self.batch.begin(candidates, clock.threads());
        self.batch.times.boxes = stopwatch.lap();
        self.broad_phase.hold(world.boxes);
        self.batch.times.broad_phase = stopwatch.lap();
        let judging = Judging {
            round: Round { world, clock, limit: &limit, alone: true },
            candidates,
            tree: &self.broad_phase,
            workers: &self.workers,
            searches: &self.batch.searches,
            outcomes: &self.batch.outcomes,
            stop_at,
            stop: AtomicUsize::new(usize::MAX),
        };
        judging.run();
        self.batch.reported = judging.stop.into_inner().saturating_add(1);
        self.count_batch();
    }

    /// Adds up what the threads have counted.
    fn count_batch(&mut self) {
        let Batch { outcomes, searches, counts, times, .. } = &mut self.batch;
        for (worker, search) in self.workers.iter_mut().zip(searches) {
            let worker = get_mut(worker);
            worker.report_to(counts, times);
            counts.add(&std::mem::take(&mut worker.conclusion.counts));
            counts.add(&std::mem::take(&mut get_mut(search).counts));
        }
        let interfering = outcomes.iter().filter(|outcome| outcome.get() == Some(&Verdict::Interfering));
        counts.interfering_pairs = interfering.count() as u64;
    }

    pub fn batch_report(&self, settled: u64) -> BatchReport<'_> {
        BatchReport { batch: &self.batch, settled }
    }
}

impl Judging<'_> {
    /// A light batch is done by the caller, before another thread would have woken up; the rest is shared out.
    fn run(&self) {
        let count = self.candidates.count();
        let mut next = 0;
        while next < self.end(count) && (self.is_light(next) || self.round.limit.is_short()) {
            self.judge(next);
            next += 1;
        }
        while next < self.end(count) {
            let end = count.min(next + CANDIDATES_AT_ONCE);
            self.round.clock.share(&mut || self.share(next, end));
            next = end;
        }
    }

    fn is_light(&self, done: usize) -> bool {
        done < LIGHT && own_worker(self.workers).is_light()
    }

    /// Where the candidates end that need to be looked at, as far as is known.
    fn end(&self, end: usize) -> usize {
        end.min(self.stop.load(Ordering::Relaxed).saturating_add(1))
    }

    /// Some candidates, on all threads of the current pool, each of which takes the next one.
    fn share(&self, first: usize, end: usize) {
        let next = AtomicUsize::new(first);
        (0..self.round.clock.threads()).into_par_iter().for_each(|_| {
            loop {
                let candidate = next.fetch_add(1, Ordering::Relaxed);
                if candidate >= self.end(end) {
                    break;
                }
                self.judge(candidate);
            }
        });
    }

    fn judge(&self, candidate: usize) {
        let verdict = self.verdict(candidate, &mut own_worker(self.searches), &mut own_worker(self.workers));
        if self.stop_at == Some(verdict) {
            self.stop.fetch_min(candidate, Ordering::Relaxed);
        }
        // Each candidate is taken once.
        let _ = self.outcomes[candidate].set(verdict);
    }

    fn verdict(&self, candidate: usize, search: &mut Search, worker: &mut Worker) -> Verdict {
        let bodies = self.round.world.bodies;
        let Search { among, stack, near, counts } = search;
        let mut verdict = Verdict::Clear;
        for named in self.candidates.placements(candidate, bodies) {
            if self.round.limit.spend(WORK_OF_A_LOOK_UP) {
                return Verdict::Possible;
            }
            near.clear();
            let rests = |body: u32| !self.candidates.is_named(body);
            self.tree.overlapping(named.bounds, stack, |other| near.extend(rests(other).then_some(other)));
            for &other in &*near {
                verdict = stronger(verdict, self.pair(named, self.at_rest(other), counts, worker));
                if verdict == Verdict::Interfering {
                    return verdict;
                }
            }
        }
        let boxes = self.candidates.boxes(candidate);
        let pairs = if boxes.len() > 1 {
            among.overlapping_within(boxes, |work| self.round.limit.spend(work), &Alone)
        } else {
            &[]
        };
        for pair in pairs {
            let [a, b] = [pair.0, pair.1].map(|place| self.candidates.placement(candidate, place as usize, bodies));
            verdict = stronger(verdict, self.pair(a, b, counts, worker));
            if verdict == Verdict::Interfering {
                return verdict;
            }
        }
        // Not all pairs were found then.
        if self.round.limit.is_up() { Verdict::Possible } else { verdict }
    }

    fn at_rest(&self, body: u32) -> Placement<'_> {
        let world = &self.round.world;
        Placement { body, placed: world.placed(body), bounds: &world.boxes[body as usize] }
    }

    /// Stages 4 to 8 of two bodies whose boxes overlap, and `containment` if it is asked.
    fn pair(&self, one: Placement<'_>, other: Placement<'_>, counts: &mut StageCounts, worker: &mut Worker) -> Verdict {
        let (a, b) = if one.body < other.body { (one, other) } else { (other, one) };
        let effects = self.round.world.effects_of(a.body, b.body);
        counts.broad_pairs += 1;
        if effects.is_empty() {
            return Verdict::Clear;
        }
        counts.interest_pairs += 1;
        let only_surfaces = !effects.contains(Effects::CONTAINMENT);
        if only_surfaces && self.round.world.accuracy_of(a.body, b.body).level == Level::Polygons {
            let placed = [a.placed, b.placed];
            let outlines = placed.map(Outline::of);
            if are_apart(placed, outlines.each_ref()) {
                return Verdict::Clear;
            }
        }
        let kept = Kept { a: a.body, b: b.body, effects: Effects::INTERFERENCE, ..Kept::default() };
        let sides = [(a.placed, a.bounds), (b.placed, b.bounds)];
        worker.run_at(sides, &Task::whole_pair(0), &kept, &self.round, &[]);
        worker.forget_pairs();
        if kept.verdict() != Verdict::Clear || only_surfaces {
            return kept.verdict();
        }
        if self.round.limit.spend(WORK_OF_AN_EFFECT) {
            return Verdict::Possible;
        }
        let contained = worker.conclusion.containment(a.placed, b.placed).is_proven();
        if contained { Verdict::Interfering } else { Verdict::Clear }
    }
}

/// What is known of several pairs, from what is known of some and of one more.
fn stronger(one: Verdict, other: Verdict) -> Verdict {
    match (one, other) {
        (Verdict::Interfering, _) | (_, Verdict::Interfering) => Verdict::Interfering,
        (Verdict::Possible, _) | (_, Verdict::Possible) => Verdict::Possible,
        (Verdict::Clear, Verdict::Clear) => Verdict::Clear,
    }
}
