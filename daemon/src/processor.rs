//! Where the thread of a scene runs: not where its client waits for it.
//!
//! The system puts a thread that is woken where the one runs that has woken it, because that one, as a rule, sleeps next. Client and
//! daemon rather stay awake for short steps, and the system leaves the two on one processor as long as neither sleeps, others idle or
//! not: each looks in vain until it lets the other go first, and a step of 3 µs takes 30 (benchmark `shared_memory`). That shows in how
//! long steps are under way to a thread that is awake.

use std::time::Duration;

use rustix::io;
use rustix::thread::{sched_getaffinity, sched_getcpu, sched_setaffinity};

/// Whether the thread of a scene shares its processor with the client.
#[derive(Debug)]
pub struct Neighbour {
    /// Steps in a row that were under way for too long.
    late: u32,
    /// How many of them tell of a neighbour. Twice as many each time that leaving has not helped.
    enough: u32,
}

impl Default for Neighbour {
    fn default() -> Self {
        Neighbour { late: 0, enough: Neighbour::ENOUGH }
    }
}

impl Neighbour {
    /// A client may be interrupted while it writes, but not every time.
    const ENOUGH: u32 = 8;
    const MOST: u32 = 1 << 16;

    /// A step has come to this thread, which was awake, so long after its client began to write its words. Where that shows time and again
    /// that both share a processor, this thread goes to another one.
    pub fn step_has_come(&mut self, under_way: Duration, words: usize) {
        if self.is_here(under_way, words)
            && let Err(error) = leave()
        {
            tracing::debug!(%error, "a scene's thread stays on its processor");
        }
    }

    fn is_here(&mut self, under_way: Duration, words: usize) -> bool {
        /// More than a step is under way between two processors, less than a client looks before it lets others go first.
        const MESSAGE: Duration = Duration::from_micros(8);
        /// Seconds that it takes to write a word, or more: three times as long as measured. Who leaves for nothing may come to run where the
        /// client does.
        const WORD: f64 = 3e-9;
        if under_way <= MESSAGE + Duration::from_secs_f64(words as f64 * WORD) {
            *self = Neighbour::default();
            return false;
        }
        self.late += 1;
        if self.late < self.enough {
            return false;
        }
        *self = Neighbour { late: 0, enough: (2 * self.enough).min(Self::MOST) };
        true
    }
}

/// Goes to another processor of those that this thread may use, if there is one. It may use all of them as before.
fn leave() -> io::Result<()> {
    let allowed = sched_getaffinity(None)?;
    let mut others = allowed;
    others.unset(sched_getcpu());
    if others.count() == 0 {
        return Ok(());
    }
    sched_setaffinity(None, &others)?;
    sched_setaffinity(None, &allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_steps_that_are_late_time_and_again_tell_of_a_neighbour() {
        let (soon, late) = (Duration::from_micros(2), Duration::from_micros(20));
        let mut neighbour = Neighbour::default();
        assert!(!(0..100).any(|step| neighbour.is_here(if step % 8 == 7 { soon } else { late }, 12)));
        assert!(!(0..100).any(|_| neighbour.is_here(late, 12_000)), "a thousand transforms take as long to write");
        let mut left = |steps: u32| (0..steps).filter(|_| neighbour.is_here(late, 12)).count();
        assert_eq!([left(8), left(8), left(8), left(31), left(1)], [1, 0, 1, 0, 1]);
    }

    #[test]
    fn leaving_a_processor_keeps_those_that_may_be_used() {
        let allowed = sched_getaffinity(None).expect("this thread has a mask");
        leave().expect("a thread may go where it may run");
        assert_eq!(sched_getaffinity(None).expect("this thread has a mask"), allowed);
    }
}
