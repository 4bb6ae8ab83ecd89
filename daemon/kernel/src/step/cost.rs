//! What listing a pair costs, learned from step to step: time that a step with a budget keeps for its ending.

/// Nanoseconds a pair.
///
/// A step that finds more than was known raises it by a quarter at most, so that one slow step is not taken for all that come. It wears
/// off slowly: each time it has become too small a step may end late.
#[derive(Debug, Clone, Copy, Default)]
pub struct CostPerPair {
    /// In parts of a nanosecond: what wears off in a step is less than one.
    parts: u64,
}

impl CostPerPair {
    const PARTS: u64 = 1 << 16;
    /// A first guess is no more than this, 32 ns.
    const FIRST: u64 = 32 * Self::PARTS;
    /// Part that wears off in a step.
    const WEAR: u64 = 256;

    /// Takes in what so many pairs have cost together.
    pub fn learn(&mut self, nanoseconds: u64, pairs: u64) {
        let Some(found) = nanoseconds.saturating_mul(Self::PARTS).checked_div(pairs) else { return self.wear_off() };
        if found > self.parts {
            self.parts = found.min(self.parts + self.parts / 4 + Self::FIRST);
        } else {
            self.wear_off();
        }
    }

    /// A step has ended in which nothing was learned.
    pub fn wear_off(&mut self) {
        self.parts -= self.parts.div_ceil(Self::WEAR);
    }

    /// What so many pairs are likely to cost.
    pub fn of(&self, pairs: u64) -> u64 {
        pairs.saturating_mul(self.parts) / Self::PARTS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_step_is_not_taken_for_all_and_a_cost_that_stays_is_learned() {
        let mut cost = CostPerPair::default();
        cost.learn(1_000_000, 10);
        assert_eq!(cost.of(10), 320);
        (0..20).for_each(|_| cost.learn(1000, 10));
        assert!((99..=100).contains(&cost.of(1)), "{cost:?}");
        (0..4000).for_each(|_| cost.learn(0, 0));
        assert_eq!(cost.of(1000), 0);
    }
}
