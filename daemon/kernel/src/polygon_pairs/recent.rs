//! Which pairs of triangles were met before.

use crate::voxel_matrix::MAX_ENTRIES;

/// Candidates of this pair of bodies, by a hash of their numbers; one that is overwritten is tested again, to no harm.
/// Forgetting is counting on, and clearing when the count is over.
#[derive(Debug)]
pub(crate) struct Recent {
    /// The triangle numbers, and above them the generation they were seen in; 0 when there was none.
    seen: Vec<u64>,
    /// How many places are in use, a power of two, less one.
    mask: usize,
    generation: u64,
    /// Entries of this generation.
    count: usize,
}

impl Default for Recent {
    fn default() -> Self {
        Recent { seen: vec![0; Recent::SMALLEST], mask: Recent::SMALLEST - 1, generation: 1, count: 0 }
    }
}

impl Recent {
    /// 8 KiB: leaves room in the innermost cache.
    const SMALLEST: usize = 1 << 10;
    /// 8 MiB. Polygons that are large for their voxels meet in very many pairs of them.
    const LARGEST: usize = 1 << 20;
    /// Bits of a triangle number. No object has as many triangles: each takes an entry of its lists.
    const BITS: u32 = MAX_ENTRIES.ilog2();

    pub fn forget(&mut self) {
        self.generation += 1;
        self.count = 0;
        self.mask = Self::SMALLEST - 1;
        if self.generation >> (u64::BITS - 2 * Self::BITS) != 0 {
            self.seen.fill(0);
            self.generation = 1;
        }
    }

    #[inline]
    pub fn is_new(&mut self, a: u32, b: u32) -> bool {
        debug_assert!((a | b) >> Self::BITS == 0);
        let pair = u64::from(a) << Self::BITS | u64::from(b);
        // Fibonacci hashing (Knuth, The Art of Computer Programming 3, section 6.4).
        let hash = pair.wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let place = (hash >> 32) as usize & self.mask;
        let entry = self.generation << (2 * Self::BITS) | pair;
        let is_new = std::mem::replace(&mut self.seen[place], entry) != entry;
        self.count += usize::from(is_new);
        if self.count > self.mask && self.mask < Self::LARGEST - 1 {
            self.grow();
        }
        is_new
    }

    #[cold]
    fn grow(&mut self) {
        let size = 4 * (self.mask + 1);
        self.seen.resize(size.max(self.seen.len()), 0);
        self.mask = size - 1;
        self.count = 0;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The other way round it may fail: a pair that was overwritten counts as new again.
        #[test]
        fn what_was_not_met_since_forgetting_is_new(
            pairs in proptest::collection::vec((0u32..40, 0u32..40, proptest::bool::weighted(0.1)), 0..3000),
            far in proptest::bool::ANY,
        ) {
            let (mut recent, mut met) = (Recent::default(), HashSet::new());
            let offset = if far { MAX_ENTRIES as u32 - 40 } else { 0 };
            for (a, b, forget) in pairs {
                if forget {
                    recent.forget();
                    met.clear();
                }
                prop_assert!(recent.is_new(a + offset, b + offset) || met.contains(&(a, b)));
                met.insert((a, b));
                prop_assert!(!recent.is_new(a + offset, b + offset));
            }
        }
    }

    #[test]
    fn most_of_what_was_met_is_known_however_much_it_is() {
        let mut recent = Recent::default();
        let met = |recent: &mut Recent| (0..100_000).filter(|&pair| recent.is_new(pair / 100, pair % 100)).count();
        assert_eq!(met(&mut recent), 100_000);
        // While it grew, it forgot.
        met(&mut recent);
        assert!(met(&mut recent) < 30_000);
    }
}
