//! Where the thread of a scene runs: not where its client waits for it.
//!
//! The system puts a thread that is woken where the one runs that has woken it, because that one, as a rule, sleeps next. Client and
//! daemon rather stay awake for short steps, and the system leaves the two on one processor as long as neither sleeps, others idle or
//! not: each looks in vain until it lets the other go first, and a step of 3 µs takes 30 (benchmark `shared_memory`). So a
//! client says with each step where it runs.

use collided_client::transport;
use rustix::io;
use rustix::thread::{sched_getaffinity, sched_setaffinity};

/// Whether the thread of a scene shares its processor with the client.
#[derive(Debug)]
pub struct Neighbour {
    /// Steps in a row whose client ran here.
    here: u32,
    /// How many of them are enough to leave. Twice as many each time that leaving has not helped.
    enough: u32,
}

impl Default for Neighbour {
    fn default() -> Self {
        Neighbour { here: 0, enough: Neighbour::ENOUGH }
    }
}

impl Neighbour {
    /// Leaving takes as long as a few short steps. A client or a thread may be on its way already.
    const ENOUGH: u32 = 4;
    /// There may be nowhere else to go.
    const MOST: u32 = 1 << 16;

    /// A step has come to this thread, which was awake, from a client on `processor`: 1 plus its number, zero when unknown. Where both are
    /// on one time and again, this thread goes to another.
    pub fn step_has_come(&mut self, processor: u32) {
        let here = transport::processor();
        if self.is_enough(processor as usize == 1 + here)
            && let Err(error) = leave(here)
        {
            tracing::debug!(%error, "a scene's thread stays on its processor");
        }
    }

    fn is_enough(&mut self, is_here: bool) -> bool {
        if !is_here {
            *self = Neighbour::default();
            return false;
        }
        self.here += 1;
        if self.here < self.enough {
            return false;
        }
        *self = Neighbour { here: 0, enough: (2 * self.enough).min(Self::MOST) };
        true
    }
}

/// Goes from a processor to another one of those that this thread may use, if there is one. It may use all of them as before.
fn leave(processor: usize) -> io::Result<()> {
    let allowed = sched_getaffinity(None)?;
    let mut others = allowed;
    others.unset(processor);
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
    fn a_client_on_this_processor_is_left_less_often_where_leaving_does_not_help() {
        let mut neighbour = Neighbour::default();
        assert!(!(0..100).any(|step| neighbour.is_enough(step % 4 != 3)), "others come and go");
        let mut left = |steps: u32| (0..steps).filter(|_| neighbour.is_enough(true)).count();
        assert_eq!([left(4), left(7), left(1), left(15), left(1)], [1, 0, 1, 0, 1]);
    }

    #[test]
    fn leaving_a_processor_keeps_those_that_may_be_used() {
        let allowed = sched_getaffinity(None).expect("this thread has a mask");
        leave(transport::processor()).expect("a thread may go where it may run");
        assert_eq!(sched_getaffinity(None).expect("this thread has a mask"), allowed);
    }
}
