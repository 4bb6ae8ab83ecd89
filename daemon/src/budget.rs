//! The budget of threads: all geometry of all scenes and builds, on so many threads and no more, taking turns.
//!
//! A thread that computes alone holds one slot of the budget. What it shares out runs on the workers, and holds all slots for
//! the short time of one piece of work. Turns are taken in the order in which they were asked for, so a heavy step or a long
//! build delays a light step by a piece or two, not by its own length.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use collided_kernel::{Clock, Workforce};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Worker threads, and the right to compute.
pub struct Budget {
    workers: ThreadPool,
    turns: Mutex<Turns>,
    changed: Condvar,
    started: Instant,
}

struct Turns {
    free: usize,
    next_ticket: u64,
    now_serving: u64,
    /// Threads that sleep until their turn: to wake nobody is a system call, too.
    asleep: usize,
}

/// The right to compute on the thread that asked for it. Given back when dropped.
pub struct Slot<'b> {
    budget: &'b Budget,
}

impl Budget {
    /// A budget of so many threads, and as many workers.
    ///
    /// # Errors
    /// When the system cannot start the workers.
    pub fn new(threads: usize) -> Result<Budget, ThreadPoolBuildError> {
        let workers = ThreadPoolBuilder::new().num_threads(threads).thread_name(|index| format!("worker-{index}"));
        let turns = Turns { free: threads, next_ticket: 0, now_serving: 0, asleep: 0 };
        Ok(Budget {
            workers: workers.build()?,
            turns: Mutex::new(turns),
            changed: Condvar::new(),
            started: Instant::now(),
        })
    }

    /// How many threads may compute at once.
    pub fn threads(&self) -> usize {
        self.workers.current_num_threads()
    }

    /// Waits for this thread's turn to compute.
    pub fn slot(&self) -> Slot<'_> {
        self.take(1);
        Slot { budget: self }
    }

    fn take(&self, slots: usize) {
        let mut turns = self.turns();
        let ticket = turns.next_ticket;
        turns.next_ticket += 1;
        while turns.now_serving != ticket || turns.free < slots {
            turns.asleep += 1;
            turns = self.changed.wait(turns).unwrap_or_else(PoisonError::into_inner);
            turns.asleep -= 1;
        }
        turns.free -= slots;
        turns.now_serving += 1;
        self.let_others_look(turns);
    }

    fn give_back(&self, slots: usize) {
        let mut turns = self.turns();
        turns.free += slots;
        self.let_others_look(turns);
    }

    fn let_others_look(&self, turns: MutexGuard<'_, Turns>) {
        let sleepers = turns.asleep > 0;
        drop(turns);
        if sleepers {
            self.changed.notify_all();
        }
    }

    fn turns(&self) -> MutexGuard<'_, Turns> {
        self.turns.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Slot<'_> {
    fn drop(&mut self) {
        self.budget.give_back(1);
    }
}

impl Workforce for Slot<'_> {
    fn threads(&self) -> usize {
        self.budget.threads()
    }

    fn share(&self, job: &mut (dyn FnMut() + Send)) {
        let all = Exchanged::take(self.budget);
        all.budget.workers.install(job);
    }
}

impl Clock for Slot<'_> {
    fn nanoseconds(&self) -> u64 {
        self.budget.started.elapsed().as_nanos() as u64
    }
}

/// All slots in place of one, until dropped; also when the job panics.
struct Exchanged<'b> {
    budget: &'b Budget,
}

impl Exchanged<'_> {
    fn take(budget: &Budget) -> Exchanged<'_> {
        budget.give_back(1);
        budget.take(budget.threads());
        Exchanged { budget }
    }
}

impl Drop for Exchanged<'_> {
    fn drop(&mut self) {
        self.budget.give_back(self.budget.threads());
        self.budget.take(1);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;

    use super::*;

    /// How many threads computed at once, at most, when `scenes` threads compute alone and together by turns.
    fn most_at_once(budget: &Budget, scenes: usize) -> usize {
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let compute = || {
            most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::yield_now();
            now.fetch_sub(1, Ordering::SeqCst);
        };
        thread::scope(|scope| {
            for _ in 0..scenes {
                scope.spawn(|| {
                    for _ in 0..50 {
                        let slot = budget.slot();
                        compute();
                        slot.share(&mut || {
                            rayon::join(compute, compute);
                        });
                        compute();
                    }
                });
            }
        });
        most.into_inner()
    }

    #[test]
    fn never_more_threads_compute_than_the_budget_has() {
        for threads in 1..=3 {
            let budget = Budget::new(threads).expect("workers");
            assert!(most_at_once(&budget, 6) <= threads, "{threads} threads");
            assert_eq!(budget.turns().free, threads);
        }
    }

    #[test]
    fn a_job_that_panics_gives_its_slots_back() {
        let budget = Budget::new(2).expect("workers");
        let failed = thread::scope(|scope| scope.spawn(|| budget.slot().share(&mut || panic!("on purpose"))).join());
        assert!(failed.is_err());
        assert_eq!(budget.turns().free, 2);
    }
}
