//! One thread's share of stages 5 to 9.

use std::sync::atomic::Ordering;

use super::conclusion::{AT_CONTACTS, Conclusion};
use super::{Clock, Kept, Stopwatch};
use crate::effects::contacts::TrianglePair;
use crate::effects::{Effects, Found, Touching};
use crate::polygon_pairs::Candidates;
use crate::polygon_test::triangles_in;
use crate::predicates::{AnyRange, Arithmetic, TAME_LIMIT, Tame};
use crate::report::{StageCounts, StageTimes};
use crate::scene::Body;
use crate::submatrix::{PairFrame, Placed};
use crate::voxel_pairs::{Descent, VoxelPair};

/// Voxels compared before a pair counts as heavy and is shared: some 50 µs of work, many times what sharing costs.
const BUDGET: i64 = 4096;

/// Voxels compared before a step is worth sharing: some 20 µs of work, about what it takes to wake another thread.
const LIGHT: u64 = 256;

/// The most voxel pairs in a batch. Batches start with one pair, so that an early proof costs little, and double.
const BATCH: usize = 64;

/// A pair of bodies, or a part of one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Task {
    /// Which of the kept pairs.
    pub pair: u32,
    voxels: VoxelPair,
}

impl Task {
    pub fn whole_pair(pair: u32) -> Task {
        Task { pair, voxels: VoxelPair::CONTAINERS }
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
    counts: StageCounts,
    times: StageTimes,
}

impl Worker {
    /// Whether this thread has done so little in this step that waking another one was not worth it yet.
    pub fn is_light(&self) -> bool {
        self.counts.voxels_visited < LIGHT
    }

    pub fn run(&mut self, task: &Task, kept: &Kept, bodies: &[Body], clock: &dyn Clock) {
        if is_decided(kept) {
            return;
        }
        let mut stopwatch = Stopwatch { clock, last: clock.nanoseconds() };
        let (a, b) = (&bodies[kept.a as usize], &bodies[kept.b as usize]);
        let frame = PairFrame::new(placed(a), placed(b));
        self.times.voxels += stopwatch.lap();
        let Some(frame) = frame else { return };
        self.counts.container_pairs += u64::from(task.is_whole());
        let descent = Descent { frame: &frame, a: &a.object, b: &b.object };
        let tame = (a.magnitude.max_element()).max(b.magnitude.max_element()) < TAME_LIMIT;
        self.stack.clear();
        self.stack.push(task.voxels);
        self.candidates.start_pair();
        if tame {
            self.descend(Tame, task, kept, (a, b), &descent, &mut stopwatch);
        } else {
            self.descend(AnyRange, task, kept, (a, b), &descent, &mut stopwatch);
        }
    }

    /// Alternates between stages 6, 7 and 8 until the pair is decided or turns out heavy.
    fn descend<A: Arithmetic>(
        &mut self,
        arithmetic: A,
        task: &Task,
        kept: &Kept,
        (a, b): (&Body, &Body),
        descent: &Descent<'_>,
        stopwatch: &mut Stopwatch<'_>,
    ) {
        let mut budget = BUDGET;
        let mut batch = 1;
        while !self.stack.is_empty() && !is_decided(kept) {
            if budget <= 0 {
                let left_over = self.stack.drain(..).map(|voxels| Task { pair: task.pair, voxels });
                self.left_over.extend(left_over);
                break;
            }
            self.leaves.clear();
            descent.advance(&mut self.stack, &mut self.leaves, batch, &mut budget, &mut self.counts);
            self.times.voxels += stopwatch.lap();
            self.gather(a, b);
            self.times.polygon_pairs += stopwatch.lap();
            self.test(arithmetic, task.pair, kept, (a, b));
            self.times.polygon_tests += stopwatch.lap();
            batch = (2 * batch).min(BATCH);
        }
    }

    /// Stage 7.
    fn gather(&mut self, a: &Body, b: &Body) {
        self.candidates.clear();
        for voxels in &self.leaves {
            self.counts.polygon_candidates += self.candidates.add(voxels, (&a.object, &a.rows), (&b.object, &b.rows));
        }
    }

    /// Stage 8.
    fn test<A: Arithmetic>(&mut self, arithmetic: A, pair: u32, kept: &Kept, (a, b): (&Body, &Body)) {
        let (polygons, touching) = (kept.effects.contains(Effects::POLYGON_PAIRS), kept.effects.meets(AT_CONTACTS));
        for (p, q) in self.candidates.iter() {
            self.counts.exact_tests += 1;
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

/// Whether nothing more is to be learnt: a common point is proven, and no effect needs all of them.
fn is_decided(kept: &Kept) -> bool {
    !kept.effects.meets(Effects::POLYGON_PAIRS.union(AT_CONTACTS)) && kept.is_interfering()
}

fn placed(body: &Body) -> Placed<'_> {
    Placed { object: &body.object, rows: &body.rows, magnitude: body.magnitude }
}
