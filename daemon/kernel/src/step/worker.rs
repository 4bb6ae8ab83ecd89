//! One thread's share of stages 5 to 9.

use std::sync::atomic::Ordering;

use super::conclusion::{AT_CONTACTS, Conclusion};
use super::limit::Limit;
use super::{Clock, Kept, Stopwatch, World};
use crate::effects::contacts::TrianglePair;
use crate::effects::{Effects, Found, Touching};
use crate::open_bound::{self, Bounds};
use crate::polygon_pairs::Candidates;
use crate::polygon_test::triangles_in;
use crate::predicates::{AnyRange, Arithmetic, TAME_LIMIT, Tame};
use crate::report::{Level, OpenBound, StageCounts, StageTimes};
use crate::scene::Body;
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, VoxelPair};

/// Voxels compared before a pair counts as heavy and is shared: some 50 µs of work, many times what sharing costs.
const BUDGET: i64 = 4096;

/// Voxels compared before a step is worth sharing: some 20 µs of work, about what it takes to wake another thread.
const LIGHT: u64 = 256;

/// The same for a pair that is looked at for the first, second, … time in a step with a budget: every pair gets its share before one gets
/// more, and to begin anew costs less than what the last time took.
const SHARES: [i64; 2] = [64, 512];

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

/// Voxels put aside of which the best bound is sought.
const MOST_BOUNDS: usize = 8;

/// What all tasks of a round share.
pub(crate) struct Round<'r> {
    pub world: World<'r>,
    pub clock: &'r dyn Clock,
    pub limit: &'r Limit<'r>,
}

/// A task under way.
struct Visit<'v> {
    task: &'v Task,
    kept: &'v Kept,
    bodies: (&'v Body, &'v Body),
    descent: Descent<'v>,
    limit: &'v Limit<'v>,
}

impl Visit<'_> {
    fn bounds(&self) -> Bounds<'_> {
        Bounds { frame: self.descent.frame, a: placed(self.bodies.0), b: placed(self.bodies.1) }
    }

    /// Voxels to compare before the pair counts as heavy, or others have their turn.
    fn share(&self) -> i64 {
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
#[derive(Debug, Clone, Copy)]
pub(crate) struct Task {
    /// Which of the kept pairs.
    pub pair: u32,
    voxels: VoxelPair,
    /// How many times it was given up for the sake of other pairs.
    round: u8,
}

impl Task {
    pub fn whole_pair(pair: u32) -> Task {
        Task { pair, voxels: VoxelPair::CONTAINERS, round: 0 }
    }

    fn is_whole(&self) -> bool {
        (self.voxels.a.level, self.voxels.b.level) == (0, 0)
    }
}

/// Memory of one thread, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct Worker {
    stack: Vec<VoxelPair>,
    leaves: Vec<VoxelPair>,
    candidates: Candidates,
    /// Stage 9.
    pub conclusion: Conclusion,
    /// Interfering polygon pairs of this step.
    pub found: Vec<Found>,
    /// Interfering triangle pairs of this step, of the pairs of bodies that stage 9 wants them of.
    pub touching: Vec<Touching>,
    /// Parts of heavy pairs, for the next round.
    pub left_over: Vec<Task>,
    /// What is known of pairs that are refined as far as their accuracy asks, and open; each once.
    pub open: Vec<(u32, OpenBound)>,
    /// What is known of pairs that were put aside in a step with a budget.
    pub progress: Vec<(u32, OpenBound)>,
    counts: StageCounts,
    times: StageTimes,
}

impl Worker {
    /// Whether this thread has done so little in this step that waking another one was not worth it yet.
    pub fn is_light(&self) -> bool {
        self.counts.voxels_visited < LIGHT
    }

    /// Looks at a pair, or a part of one, at the accuracy it asks for.
    pub fn run(&mut self, task: &Task, kept: &Kept, round: &Round<'_>) {
        if is_decided(kept) {
            return;
        }
        if round.limit.spend(WORK_OF_A_PAIR) {
            return kept.leave_unfinished();
        }
        let mut stopwatch = Stopwatch { clock: round.clock, last: round.clock.nanoseconds() };
        let accuracy = round.world.accuracy_of(kept);
        if accuracy.level == Level::GlobalBoxes {
            let boxes = [kept.a, kept.b].map(|body| &round.world.boxes[body as usize]);
            return self.leave_open(task.pair, kept, open_bound::of_boxes(boxes[0], boxes[1]));
        }
        let (a, b) = (&round.world.bodies[kept.a as usize], &round.world.bodies[kept.b as usize]);
        let order = if accuracy.level == Level::Voxels { accuracy.order } else { None };
        let frame = PairFrame::new(placed(a), placed(b), order);
        self.times.voxels += stopwatch.lap();
        let Some(frame) = frame else { return };
        self.counts.container_pairs += u64::from(task.is_whole());
        let descent = Descent { frame: &frame, a: &a.object, b: &b.object };
        let pair = Visit { task, kept, bodies: (a, b), descent, limit: round.limit };
        self.stack.clear();
        self.stack.push(task.voxels);
        let tame = (a.magnitude.max_element()).max(b.magnitude.max_element()) < TAME_LIMIT;
        match accuracy.level {
            Level::Containers => self.leave_open(task.pair, kept, pair.bounds().of(&VoxelPair::CONTAINERS)),
            Level::Voxels => self.find_voxels(&pair, &mut stopwatch),
            _ if tame => self.descend(Tame, &pair, &mut stopwatch),
            _ => self.descend(AnyRange, &pair, &mut stopwatch),
        }
    }

    fn leave_open(&mut self, pair: u32, kept: &Kept, bound: OpenBound) {
        // Of several threads the first one says it; where the accuracy ends a pair, all would say the same.
        if !kept.open.swap(true, Ordering::Relaxed) {
            self.open.push((pair, bound));
        }
    }

    /// Stage 6 alone, until two voxels of the order asked for reach each other.
    fn find_voxels(&mut self, pair: &Visit<'_>, stopwatch: &mut Stopwatch<'_>) {
        let mut budget = pair.share();
        while !self.stack.is_empty() && !is_decided(pair.kept) && self.may_go_on(pair, &mut budget) {
            let mut slice = pair.slice(budget);
            let before = slice;
            let bounds = pair.bounds();
            let reaches = |voxels: &VoxelPair| bounds.reach_each_other(voxels);
            if let Some(voxels) = pair.descent.find(&mut self.stack, reaches, &mut slice, &mut self.counts) {
                self.leave_open(pair.task.pair, pair.kept, bounds.of_any_like(&voxels));
            }
            budget -= before - slice;
            pair.spend(before - slice);
        }
        self.times.voxels += stopwatch.lap();
    }

    /// Alternates between stages 6, 7 and 8 until the pair is decided or turns out heavy.
    fn descend<A: Arithmetic>(&mut self, arithmetic: A, pair: &Visit<'_>, stopwatch: &mut Stopwatch<'_>) {
        let mut budget = pair.share();
        let mut batch = 1;
        self.candidates.start_pair();
        while !self.stack.is_empty() && !is_decided(pair.kept) && self.may_go_on(pair, &mut budget) {
            let mut slice = pair.slice(budget);
            let before = slice;
            self.leaves.clear();
            pair.descent.advance(&mut self.stack, &mut self.leaves, batch, &mut slice, &mut self.counts);
            budget -= before - slice;
            pair.spend(before - slice);
            self.times.voxels += stopwatch.lap();
            self.gather(pair);
            self.times.polygon_pairs += stopwatch.lap();
            self.test(arithmetic, pair);
            self.times.polygon_tests += stopwatch.lap();
            batch = (2 * batch).min(pair.largest_batch());
        }
    }

    /// Whether the work on a pair goes on, on this thread and now; if not, what is left is put aside.
    fn may_go_on(&mut self, pair: &Visit<'_>, budget: &mut i64) -> bool {
        let is_up = pair.limit.is_up();
        if !is_up && *budget > 0 {
            return true;
        }
        if pair.limit.exists() {
            // The voxels compared last are the smallest ones.
            let bounds = pair.bounds();
            let deepest = self.stack.iter().rev().take(MOST_BOUNDS).map(|voxels| bounds.of(voxels));
            let best = deepest.min_by(|one, other| one.apart_at_most.total_cmp(&other.apart_at_most));
            self.progress.extend(best.map(|bound| (pair.task.pair, bound)));
        }
        if is_up {
            pair.kept.leave_unfinished();
        } else if pair.task.is_whole() && pair.limit.exists() && usize::from(pair.task.round) < SHARES.len() {
            self.left_over.push(Task { round: pair.task.round + 1, ..*pair.task });
        } else {
            let left_over = self.stack.drain(..).map(|voxels| Task { voxels, ..*pair.task });
            self.left_over.extend(left_over);
        }
        false
    }

    /// Stage 7.
    fn gather(&mut self, pair: &Visit<'_>) {
        let (a, b) = pair.bodies;
        self.candidates.clear();
        for voxels in &self.leaves {
            self.counts.polygon_candidates += self.candidates.add(voxels, (&a.object, &a.rows), (&b.object, &b.rows));
            pair.spend(1);
        }
    }

    /// Stage 8.
    fn test<A: Arithmetic>(&mut self, arithmetic: A, visit: &Visit<'_>) {
        let (pair, kept, (a, b)) = (visit.task.pair, visit.kept, visit.bodies);
        let (polygons, touching) = (kept.effects.contains(Effects::POLYGON_PAIRS), kept.effects.meets(AT_CONTACTS));
        for (p, q) in self.candidates.iter() {
            self.counts.exact_tests += 1;
            if self.counts.exact_tests.is_multiple_of(TESTS_AT_ONCE) && visit.spend(TESTS_AT_ONCE as i64) {
                return;
            }
            let Some(relation) = triangles_in(arithmetic, &p.corners, &q.corners) else { continue };
            kept.interfering.store(true, Ordering::Relaxed);
            if !polygons && !touching {
                return;
            }
            if polygons {
                let (a, b) = (a.object.polygon_of(p.number as usize), b.object.polygon_of(q.number as usize));
                self.found.push(Found { pair, a, b, relation });
            }
            if touching {
                let triangles = TrianglePair { a: p.number, b: q.number, relation };
                self.touching.push(Touching { pair, triangles });
            }
        }
    }

    /// Adds this thread's counts and times to the step's, and forgets them.
    pub fn report_to(&mut self, counts: &mut StageCounts, times: &mut StageTimes) {
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

fn placed(body: &Body) -> Placed<'_> {
    Placed { object: &body.object, rows: &body.rows, magnitude: body.magnitude }
}
