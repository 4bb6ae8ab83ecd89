//! Turns: how the tasks of stages 5 to 8 are shared out.
//!
//! The threads take the next task whenever they are done with one, until all are taken or the turn has done its share: then the
//! steps of other scenes have theirs.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use rayon::prelude::*;

use super::worker::{Round, Task, Worker};
use super::{Kept, own_worker};
use crate::voxel_pairs::VoxelPair;

/// The work of one turn, as [`Worker::work_done`] counts it: a millisecond or two.
const TURN: u64 = 1 << 16;

/// Runs all tasks, on all threads of the workforce, turn by turn.
pub(super) fn take_turns(
    tasks: &[Task],
    voxels: &[VoxelPair],
    kept: &[Kept],
    workers: &[Mutex<Worker>],
    round: &Round<'_>,
) {
    let next = AtomicUsize::new(0);
    while next.load(Ordering::Relaxed) < tasks.len() {
        let done = AtomicU64::new(0);
        let take_tasks = |_| {
            let mut worker = own_worker(workers);
            while done.load(Ordering::Relaxed) < TURN
                && let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed))
            {
                let before = worker.work_done();
                worker.run(task, &kept[task.pair as usize], round, voxels);
                done.fetch_add(worker.work_done() - before, Ordering::Relaxed);
            }
        };
        let threads = round.clock.threads();
        round.clock.share(&mut || (0..threads).into_par_iter().with_max_len(1).for_each(take_tasks));
    }
}
