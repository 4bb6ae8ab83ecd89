//! One thread's share of stages 5 to 9.

use std::ops::Range;
use std::sync::atomic::Ordering;

use super::conclusion::{Conclusion, OF_TRIANGLES};
use super::limit::Limit;
use super::witness::{self, Witness};
use super::{Clock, Kept, Stopwatch, World};
use crate::accuracy::Accuracy;
use crate::effects::contacts::TrianglePair;
use crate::effects::distance::of_triangles_at_least;
use crate::effects::{Effects, Found, Touching};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::open_bound::{self, Bounds};
use crate::polygon_pairs::Candidates;
use crate::polygon_test::triangles_in;
use crate::predicates::{AnyRange, Arithmetic, TAME_LIMIT, Tame};
use crate::report::{Level, OpenBound, StageCounts, StageTimes};
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, Open, VoxelPair};

/// Voxels compared before a pair counts as heavy and is shared: some 150 µs of work, many times what sharing costs.
const BUDGET: i64 = 4096;

/// Voxels compared before a step is worth sharing: some 20 µs of work, about what it takes to wake another thread.
const LIGHT: u64 = 512;

/// The same for a pair that is looked at for the first, second, … time in a step with a budget: every pair gets its share before one gets
/// more, and to begin anew costs less than what the last time took. The cheap proofs come first: the witness of the last step, and the
/// containers.
const SHARES: [i64; 3] = [0, 64, 512];

/// Voxels compared between two looks at the budget: a few microseconds.
const SLICE: i64 = 128;

/// The most voxel pairs in a batch. Batches start with one pair, so that an early proof costs little, and double.
const BATCH: usize = 64;

/// The same in a step with a budget: a few microseconds.
const SMALL_BATCH: usize = 4;

/// Exact tests between two looks at the budget.
const TESTS_AT_ONCE: u64 = 8;

/// What it costs to look at a pair at all, in comparisons of voxels.
const WORK_OF_A_PAIR: u64 = 16;

/// What an exact test costs, likewise.
const EXACT_TEST: u64 = 2;

/// The most pieces that a heavy pair is handed back in: several for each thread.
const PIECES: usize = 8;

/// Voxels put aside of which the best bound is sought.
const MOST_BOUNDS: usize = 8;

/// What all tasks of a round share.
pub(crate) struct Round<'r> {
    pub world: World<'r>,
    pub clock: &'r dyn Clock,
    pub limit: &'r Limit<'r>,
    /// Whether a thread that has begun a pair ends it, however heavy it is: nothing is handed back.
    pub alone: bool,
}

/// A task under way.
struct Visit<'v> {
    task: &'v Task,
    kept: &'v Kept,
    sides: [Placed<'v>; 2],
    limit: &'v Limit<'v>,
    alone: bool,
}

/// What a task may still do before others have their turn, and how many voxel pairs the next batch has.
struct Work {
    left: i64,
    batch: usize,
}

impl Visit<'_> {
    fn objects(&self) -> [&Object; 2] {
        self.sides.map(|side| side.object)
    }

    fn bounds<'f>(&'f self, frame: &'f PairFrame) -> Bounds<'f> {
        Bounds { frame, a: self.sides[0], b: self.sides[1] }
    }

    /// Voxels to compare before the pair counts as heavy, or others have their turn.
    fn share(&self) -> i64 {
        if self.alone {
            return i64::MAX;
        }
        let share = SHARES.get(usize::from(self.task.round)).filter(|_| self.limit.exists() && self.task.is_whole());
        *share.unwrap_or(&BUDGET)
    }

    /// Of these, how many before the next look at the budget.
    fn slice(&self, left: i64) -> i64 {
        if self.limit.exists() { left.min(SLICE) } else { left }
    }

    fn largest_batch(&self) -> usize {
        if self.limit.exists() { SMALL_BATCH } else { BATCH }
    }

    /// Takes work off the budget; says whether the pair must be left for want of it.
    #[inline]
    fn spend(&self, work: i64) -> bool {
        let is_up = self.limit.spend(work.unsigned_abs());
        if is_up {
            self.kept.leave_unfinished();
        }
        is_up
    }
}

/// A pair of bodies, or a part of one.
#[derive(Debug, Clone)]
pub(crate) struct Task {
    /// Which of the kept pairs.
    pub pair: u32,
    /// Of a part: where its pairs of voxels stand among those that were left over.
    voxels: Option<Range<usize>>,
    /// How many times it was given up for the sake of other pairs.
    round: u8,
}

impl Task {
    pub fn whole_pair(pair: u32) -> Task {
        Task { pair, voxels: None, round: 0 }
    }

    fn is_whole(&self) -> bool {
        self.voxels.is_none()
    }
}

/// Work for the next round.
#[derive(Debug, Default)]
pub(crate) struct LeftOver {
    pub tasks: Vec<Task>,
    /// The pairs of voxels of all parts.
    pub voxels: Vec<VoxelPair>,
}

impl LeftOver {
    /// Appends what another one holds, which then is empty.
    pub fn append(&mut self, other: &mut LeftOver) {
        let first = self.voxels.len();
        self.tasks.extend(other.tasks.drain(..).map(|mut task| {
            task.voxels = task.voxels.map(|voxels| first + voxels.start..first + voxels.end);
            task
        }));
        self.voxels.append(&mut other.voxels);
    }

    /// Takes in what is open of a task, in pieces. Each holds some of all sizes.
    fn put(&mut self, task: &Task, open: &mut Open) {
        let first = self.voxels.len();
        self.voxels.extend(open.drain());
        let count = self.voxels.len() - first;
        let pieces = count.min(PIECES);
        for piece in 0..pieces {
            let start = self.voxels.len();
            for at in (piece..count).step_by(pieces) {
                self.voxels.push(self.voxels[first + at]);
            }
            let voxels = start - count..self.voxels.len() - count;
            self.tasks.push(Task { voxels: Some(voxels), pair: task.pair, round: task.round });
        }
        self.voxels.drain(first..first + count);
    }
}

/// Memory of one thread, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct Worker {
    frame: Option<Box<PairFrame>>,
    open_voxels: Open,
    leaves: Vec<VoxelPair>,
    candidates: Candidates,
    /// Stage 9.
    pub conclusion: Conclusion,
    /// Interfering polygon pairs of this step.
    pub found: Vec<Found>,
    /// Interfering triangle pairs of this step, of the pairs of bodies that stage 9 wants them of.
    pub touching: Vec<Touching>,
    /// Triangles that proved a common point, of pairs of which no more is asked.
    pub witnesses: Vec<(u32, Witness)>,
    /// How far apart the bodies of the task are known to be, if no point in common turns up; see [`Clearance`](super::coherence::Clearance).
    clearance: f64,
    /// Parts of heavy pairs, for the next round.
    pub left_over: LeftOver,
    /// What is known of pairs that are refined as far as their accuracy asks, and open; each once.
    pub open: Vec<(u32, OpenBound)>,
    /// What is known of pairs that were put aside in a step with a budget.
    pub progress: Vec<(u32, OpenBound)>,
    /// Tasks looked at in this step.
    visits: u64,
    counts: StageCounts,
    times: StageTimes,
}

impl Worker {
    /// Whether this thread has done so little in this step that waking another one was not worth it yet.
    pub fn is_light(&self) -> bool {
        self.counts.voxels_visited < LIGHT
    }

    /// What this thread has done in this step, in comparisons of voxels, roughly.
    pub fn work_done(&self) -> u64 {
        self.counts.voxels_visited + WORK_OF_A_PAIR * self.visits + EXACT_TEST * self.counts.exact_tests
    }

    /// Looks at a pair, or a part of one, at the accuracy it asks for. `left_over`: the voxels of all parts.
    pub fn run(&mut self, task: &Task, kept: &Kept, round: &Round<'_>, left_over: &[VoxelPair]) {
        let sides = [kept.a, kept.b].map(|body| (round.world.placed(body), &round.world.boxes[body as usize]));
        self.run_at(sides, task, kept, round, left_over);
    }

    /// The same with the bodies, and their boxes, where the caller says.
    pub fn run_at(
        &mut self,
        sides: [(Placed<'_>, &GlobalBox); 2],
        task: &Task,
        kept: &Kept,
        round: &Round<'_>,
        left_over: &[VoxelPair],
    ) {
        if is_decided(kept) {
            return;
        }
        self.visits += 1;
        if round.limit.spend(WORK_OF_A_PAIR) {
            return kept.leave_unfinished();
        }
        let mut stopwatch = Stopwatch { clock: round.clock, last: round.clock.nanoseconds() };
        let accuracy = round.world.accuracy_of(kept.a, kept.b);
        if accuracy.level == Level::GlobalBoxes {
            return self.leave_open(task.pair, kept, open_bound::of_boxes(sides[0].1, sides[1].1));
        }
        let pair = Visit { task, kept, sides: sides.map(|side| side.0), limit: round.limit, alone: round.alone };
        match &task.voxels {
            None => self.open_voxels.start([VoxelPair::containers(pair.objects())]),
            Some(voxels) => self.open_voxels.start(left_over[voxels.clone()].iter().copied()),
        }
        let mut frame = self.frame.take().unwrap_or_default();
        if accuracy.level == Level::Polygons {
            self.compare_polygons(&pair, &mut frame, &mut stopwatch);
        } else {
            self.compare_voxels(&pair, &mut frame, accuracy, &mut stopwatch);
        }
        self.frame = Some(frame);
    }

    /// Stage 5, and stage 6 if the accuracy goes so far.
    fn compare_voxels(
        &mut self,
        pair: &Visit<'_>,
        frame: &mut PairFrame,
        accuracy: &Accuracy,
        stopwatch: &mut Stopwatch<'_>,
    ) {
        let order = if accuracy.level == Level::Voxels { accuracy.order } else { None };
        let meet = frame.start(pair.sides[0], pair.sides[1], order);
        self.times.voxels += stopwatch.lap();
        if !meet {
            return;
        }
        self.counts.container_pairs += u64::from(pair.task.is_whole());
        if accuracy.level == Level::Containers {
            let bound = pair.bounds(frame).of(&VoxelPair::containers(pair.objects()));
            self.leave_open(pair.task.pair, pair.kept, bound);
        } else {
            self.find_voxels(pair, frame, stopwatch);
        }
    }

    /// Stages 5 to 8. What the last step knows comes first.
    fn compare_polygons(&mut self, pair: &Visit<'_>, frame: &mut PairFrame, stopwatch: &mut Stopwatch<'_>) {
        let kept = pair.kept;
        let witness = kept.memory.witness.filter(|_| pair.task.is_whole() && !kept.wants_all());
        if let Some(witness) = witness {
            self.counts.exact_tests += 1;
            let holds = witness::holds(witness, &pair.sides);
            self.times.polygon_tests += stopwatch.lap();
            if holds {
                return kept.interfering.store(true, Ordering::Relaxed);
            }
            if let Some(neighbourhood) = witness::neighbourhood(witness, &pair.sides) {
                self.open_voxels.put_first(neighbourhood);
            }
        }
        self.clearance = kept.clearance.now();
        self.descend_narrowing(pair, frame, stopwatch);
        kept.clearance.lower(self.clearance);
    }

    /// Descends, with narrower frames as the clearance becomes smaller.
    fn descend_narrowing(&mut self, pair: &Visit<'_>, frame: &mut PairFrame, stopwatch: &mut Stopwatch<'_>) {
        let [a, b] = pair.sides;
        let tame = a.magnitude.max(b.magnitude).max_element() < TAME_LIMIT;
        let mut work = Work { left: pair.share(), batch: 1 };
        let mut narrowed = 0;
        loop {
            let meet = frame.start_within(self.clearance, a, b, None);
            self.times.voxels += stopwatch.lap();
            if !meet {
                return;
            }
            if narrowed == 0 {
                self.counts.container_pairs += u64::from(pair.task.is_whole());
                self.candidates.start_pair([a.rows, b.rows], frame.boxes());
            } else {
                self.open_voxels.measure_anew();
            }
            let is_done = if tame {
                self.descend(Tame, pair, frame, &mut work, stopwatch)
            } else {
                self.descend(AnyRange, pair, frame, &mut work, stopwatch)
            };
            if is_done {
                return;
            }
            narrowed += 1;
        }
    }

    fn leave_open(&mut self, pair: u32, kept: &Kept, bound: OpenBound) {
        // Of several threads the first one says it; where the accuracy ends a pair, all would say the same.
        if !kept.open.swap(true, Ordering::Relaxed) {
            self.open.push((pair, bound));
        }
    }

    /// Stage 6 alone, until two voxels of the order asked for reach each other.
    fn find_voxels(&mut self, pair: &Visit<'_>, frame: &mut PairFrame, stopwatch: &mut Stopwatch<'_>) {
        let mut budget = pair.share();
        while !self.open_voxels.is_empty() && !is_decided(pair.kept) && self.may_go_on(pair, frame, &mut budget) {
            let mut slice = pair.slice(budget);
            let before = slice;
            let reaches = |frame: &PairFrame, voxels: &VoxelPair| pair.bounds(frame).reach_each_other(voxels);
            let mut descent = Descent { frame, objects: pair.objects(), deepest_first: true };
            if let Some(voxels) = descent.find(&mut self.open_voxels, reaches, &mut slice, &mut self.counts) {
                self.leave_open(pair.task.pair, pair.kept, pair.bounds(frame).of_any_like(&voxels));
            }
            budget -= before - slice;
            pair.spend(before - slice);
        }
        self.times.voxels += stopwatch.lap();
    }

    /// Alternates between stages 6, 7 and 8 until the pair is decided or turns out heavy. Whether that is so; if not, the frame is wider
    /// than it need be.
    fn descend<A: Arithmetic>(
        &mut self,
        arithmetic: A,
        pair: &Visit<'_>,
        frame: &mut PairFrame,
        work: &mut Work,
        stopwatch: &mut Stopwatch<'_>,
    ) -> bool {
        let clearance = self.clearance;
        while !self.open_voxels.is_empty() && !is_decided(pair.kept) && self.may_go_on(pair, frame, &mut work.left) {
            if self.clearance < 0.5 * clearance {
                return false;
            }
            let mut slice = pair.slice(work.left);
            let before = slice;
            self.leaves.clear();
            let mut descent = Descent { frame, objects: pair.objects(), deepest_first: !pair.kept.wants_all() };
            descent.advance(&mut self.open_voxels, &mut self.leaves, work.batch, &mut slice, &mut self.counts);
            work.left -= before - slice;
            pair.spend(before - slice);
            self.times.voxels += stopwatch.lap();
            self.gather(pair, frame);
            self.times.polygon_pairs += stopwatch.lap();
            self.test(arithmetic, pair);
            self.times.polygon_tests += stopwatch.lap();
            self.clearance = pair.kept.clearance.useful(self.clearance);
            work.batch = (2 * work.batch).min(pair.largest_batch());
        }
        true
    }

    /// Whether the work on a pair goes on, on this thread and now; if not, what is left is put aside.
    fn may_go_on(&mut self, pair: &Visit<'_>, frame: &PairFrame, budget: &mut i64) -> bool {
        let is_up = pair.limit.is_up();
        if !is_up && *budget > 0 {
            return true;
        }
        if pair.limit.exists() {
            // The voxels compared last are the smallest ones.
            let bounds = pair.bounds(frame);
            let deepest = self.open_voxels.latest(MOST_BOUNDS).map(|voxels| bounds.of(voxels));
            let best = deepest.min_by(|one, other| one.apart_at_most.total_cmp(&other.apart_at_most));
            self.progress.extend(best.map(|bound| (pair.task.pair, bound)));
        }
        if is_up {
            pair.kept.leave_unfinished();
        } else if pair.task.is_whole() && pair.limit.exists() && usize::from(pair.task.round) < SHARES.len() {
            self.left_over.tasks.push(Task { round: pair.task.round + 1, ..pair.task.clone() });
        } else {
            self.left_over.put(pair.task, &mut self.open_voxels);
        }
        false
    }

    /// Stage 7.
    fn gather(&mut self, pair: &Visit<'_>, frame: &PairFrame) {
        self.candidates.clear();
        // With a budget, each pair of voxels is followed by a look at it.
        let count = if pair.limit.exists() { 1 } else { self.leaves.len().max(1) };
        for voxels in self.leaves.chunks(count) {
            self.counts.polygon_candidates +=
                self.candidates.add_all(voxels, pair.objects(), frame, &mut self.clearance);
            pair.spend(voxels.len() as i64);
        }
    }

    /// Stage 8.
    fn test<A: Arithmetic>(&mut self, arithmetic: A, visit: &Visit<'_>) {
        let (pair, kept, [a, b]) = (visit.task.pair, visit.kept, visit.sides);
        let (polygons, touching) = (kept.effects.contains(Effects::POLYGON_PAIRS), kept.effects.meets(OF_TRIANGLES));
        for at in 0..self.candidates.pairs().len() {
            let numbers = self.candidates.pairs()[at];
            let [p, q] = self.candidates.corners(numbers, visit.objects());
            self.counts.exact_tests += 1;
            if self.counts.exact_tests.is_multiple_of(TESTS_AT_ONCE) && visit.spend(TESTS_AT_ONCE as i64) {
                return;
            }
            let Some(relation) = triangles_in(arithmetic, p, q) else {
                if self.clearance > 0.0 {
                    self.clearance = self.clearance.min(of_triangles_at_least(p, q));
                }
                continue;
            };
            kept.interfering.store(true, Ordering::Relaxed);
            self.clearance = 0.0;
            if !polygons && !touching {
                return self.witnesses.push((pair, numbers));
            }
            if polygons {
                let (a, b) = (a.object.polygon_of(numbers[0] as usize), b.object.polygon_of(numbers[1] as usize));
                self.found.push(Found { pair, a, b, relation });
            }
            if touching {
                let triangles = TrianglePair { a: numbers[0], b: numbers[1], relation };
                self.touching.push(Touching { pair, triangles });
            }
        }
    }

    /// Forgets what was found of single pairs, for a caller that wants no more than their verdicts.
    pub fn forget_pairs(&mut self) {
        self.witnesses.clear();
        self.open.clear();
        self.progress.clear();
    }

    /// Adds this thread's counts and times to the step's, and forgets them.
    pub fn report_to(&mut self, counts: &mut StageCounts, times: &mut StageTimes) {
        if std::mem::take(&mut self.visits) == 0 {
            return;
        }
        let (own_counts, own_times) = (std::mem::take(&mut self.counts), std::mem::take(&mut self.times));
        counts.container_pairs += own_counts.container_pairs;
        counts.voxels_visited += own_counts.voxels_visited;
        counts.voxel_pairs += own_counts.voxel_pairs;
        counts.polygon_candidates += own_counts.polygon_candidates;
        counts.exact_tests += own_counts.exact_tests;
        times.voxels += own_times.voxels;
        times.polygon_pairs += own_times.polygon_pairs;
        times.polygon_tests += own_times.polygon_tests;
    }
}

/// Whether nothing more is to be learnt: a common point is proven and no effect needs all of them, or the accuracy ends here.
fn is_decided(kept: &Kept) -> bool {
    kept.is_open() || !kept.wants_all() && kept.is_interfering()
}
