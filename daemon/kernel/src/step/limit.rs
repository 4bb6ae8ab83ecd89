//! What is left of a step's budget, for all of its threads.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, Ordering};

use super::Clock;
use crate::accuracy::Budget;

/// Time that is not worth waking another thread for, in nanoseconds. It wakes late where a client that waits for the report keeps a processor
/// busy, and the step would be late with it.
const TOO_SHORT_TO_SHARE: u64 = 1_000_000;

/// The budget of a step under way.
pub(crate) struct Limit<'c> {
    clock: &'c dyn Clock,
    left: Left,
    is_up: AtomicBool,
    /// When it was found used up.
    up_at: AtomicU64,
}

enum Left {
    Unlimited,
    /// Until the clock shows this.
    Until(u64),
    /// Units of work.
    Work(AtomicI64),
}

impl<'c> Limit<'c> {
    /// The whole budget of a step that began at `start`.
    pub fn new(budget: Budget, clock: &'c dyn Clock, start: u64) -> Limit<'c> {
        let left = match budget {
            Budget::Unlimited => Left::Unlimited,
            Budget::Nanoseconds(time) => Left::Until(start.saturating_add(time)),
            Budget::Work(units) => Left::Work(AtomicI64::new(units.try_into().unwrap_or(i64::MAX))),
        };
        Limit { clock, left, is_up: AtomicBool::new(false), up_at: AtomicU64::new(u64::MAX) }
    }

    /// Whether there is a limit at all.
    pub fn exists(&self) -> bool {
        !matches!(self.left, Left::Unlimited)
    }

    /// Takes so many units of work off; says whether the budget is used up. Once it is, it stays so.
    #[inline]
    pub fn spend(&self, units: u64) -> bool {
        match &self.left {
            Left::Unlimited => false,
            _ if self.is_up() => true,
            Left::Until(end) => {
                let now = self.clock.nanoseconds();
                self.up_at.fetch_min(if now >= *end { now } else { u64::MAX }, Ordering::Relaxed);
                self.note(now >= *end)
            }
            Left::Work(left) => self.note(left.fetch_sub(units as i64, Ordering::Relaxed) < units as i64),
        }
    }

    /// Whether the budget was found used up.
    #[inline]
    pub fn is_up(&self) -> bool {
        self.is_up.load(Ordering::Relaxed)
    }

    /// The time at which it was found used up, or `otherwise`.
    pub fn up_at(&self, otherwise: u64) -> u64 {
        self.up_at.load(Ordering::Relaxed).min(otherwise)
    }

    /// Keeps time for what comes after.
    pub fn reserve(&mut self, nanoseconds: u64) {
        if let Left::Until(end) = &mut self.left {
            *end = end.saturating_sub(nanoseconds);
        }
    }

    /// Whether it is not worth waking another thread for the time that is left.
    pub fn is_short(&self) -> bool {
        matches!(self.left, Left::Until(end) if end.saturating_sub(self.clock.nanoseconds()) < TOO_SHORT_TO_SHARE)
    }

    fn note(&self, is_up: bool) -> bool {
        if is_up {
            self.is_up.store(true, Ordering::Relaxed);
        }
        is_up
    }
}
