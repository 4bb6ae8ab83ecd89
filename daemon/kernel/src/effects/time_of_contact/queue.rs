//! What is still to be looked at, the earliest first.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::submatrix::Window;

/// A queue in the order of the windows' starts; of equal ones the latest comes first, which is nearer to a proof.
#[derive(Debug)]
pub(super) struct Queue<T> {
    heap: BinaryHeap<Key>,
    entries: Vec<(Window, T)>,
    /// Places among the entries that are free.
    free: Vec<u32>,
    pushed: u32,
}

/// Bits of the start, which ascend as the number does, for it is not negative; how many were pushed before; the entry's place.
type Key = (Reverse<u32>, u32, u32);

impl<T> Default for Queue<T> {
    fn default() -> Self {
        Queue { heap: BinaryHeap::new(), entries: Vec::new(), free: Vec::new(), pushed: 0 }
    }
}

impl<T: Copy> Queue<T> {
    pub fn clear(&mut self) {
        self.heap.clear();
        self.entries.clear();
        self.free.clear();
        self.pushed = 0;
    }

    #[inline(always)]
    pub fn push(&mut self, window: Window, entry: T) {
        let place = match self.free.pop() {
            Some(place) => {
                self.entries[place as usize] = (window, entry);
                place
            }
            None => {
                self.entries.push((window, entry));
                self.entries.len() as u32 - 1
            }
        };
        self.heap.push((Reverse(window.from.to_bits()), self.pushed, place));
        self.pushed = self.pushed.wrapping_add(1);
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<(Window, T)> {
        let (_, _, place) = self.heap.pop()?;
        self.free.push(place);
        Some(self.entries[place as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_earliest_comes_first_and_of_equals_the_latest() {
        let mut queue = Queue::default();
        for (number, from) in [0.5, 0.25, 0.0, 0.25, 1.0].into_iter().enumerate() {
            queue.push(Window { from, until: 1.0 }, number);
        }
        let mut order = Vec::new();
        while let Some((_, number)) = queue.pop() {
            order.push(number);
            if number == 3 {
                queue.push(Window { from: 0.75, until: 1.0 }, 5);
            }
        }
        assert_eq!(order, [2, 3, 1, 0, 5, 4]);
    }
}
