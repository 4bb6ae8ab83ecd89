//! In which order pairs of cells are looked at.

use crate::cells::Cell;

/// Two cells that may be nearer than the best pair of triangles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Open {
    /// They are not nearer, but for the noise of [`CellBounds`](super::cell_bounds::CellBounds).
    pub least: f32,
    pub cells: [Cell; 2],
    /// Numbers of their shapes.
    pub shapes: [u32; 2],
    /// Whether the first, or the second, is not worth cutting.
    pub whole: [bool; 2],
}

/// Pairs that are still to be looked at.
///
/// Those that leave most room for something nearer come first; of these the latest, so that few are open at a time. Most pairs
/// are bounded by nearly the distance itself: they wait until it is known better.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    stacks: [Vec<Open>; ROOMS],
    /// The stacks that are not empty, a bit each.
    filled: u32,
}

/// Pairs with less room than the limit halved so many times come last, in no order.
const ROOMS: usize = 16;

/// How often what lies between a bound and the limit is to be doubled to make it the limit.
#[inline(always)]
fn room(least: f32, limit: f32) -> usize {
    let share = (limit - least.max(0.0)) / limit;
    // The exponent; of an infinite limit the share is NaN, whose exponent is the largest.
    let exponent = 127 - (share.to_bits() >> 23) as i32;
    exponent.clamp(0, ROOMS as i32 - 1) as usize
}

impl Waiting {
    /// Forgets all pairs but this one.
    pub fn start(&mut self, open: Open) {
        self.stacks.iter_mut().for_each(Vec::clear);
        self.filled = 0;
        self.put(0, open);
    }

    /// One that is to be looked at when its turn comes.
    #[inline(always)]
    pub fn add(&mut self, open: Open, limit: f32) {
        self.put(room(open.least, limit), open);
    }

    #[inline(always)]
    fn put(&mut self, room: usize, open: Open) {
        self.stacks[room].push(open);
        self.filled |= 1 << room;
    }

    /// The next one that is not proven farther than `limit`.
    #[inline(always)]
    pub fn next(&mut self, limit: f32) -> Option<Open> {
        while self.filled != 0 {
            let at = self.filled.trailing_zeros() as usize;
            let Some(open) = self.stacks[at].pop() else {
                self.filled &= !(1 << at);
                continue;
            };
            if open.least > limit {
                continue;
            }
            // The limit may have come nearer since it was put there.
            let room = room(open.least, limit);
            if room <= at {
                return Some(open);
            }
            self.put(room, open);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(least: f32) -> Open {
        let cell = Cell {
            rank: 0,
            octant: 0,
            number: 0,
            bounds: crate::cell_boxes::CellBox::WHOLE,
            triangles: 0,
            centre: [0; 3],
        };
        Open { least, cells: [cell; 2], shapes: [0; 2], whole: [false; 2] }
    }

    fn order(all: &[f32], limit: f32) -> Vec<f32> {
        let mut waiting = Waiting::default();
        waiting.start(open(all[0]));
        all[1..].iter().for_each(|&least| waiting.add(open(least), limit));
        std::iter::from_fn(|| waiting.next(limit)).map(|open| open.least).collect()
    }

    #[test]
    fn most_room_comes_first_then_the_latest_and_nothing_beyond_the_limit() {
        assert_eq!(order(&[0.9, 1.1, 0.1, 0.99, 0.0, 0.6, 1.0], 1.0), [0.0, 0.1, 0.6, 0.9, 0.99, 1.0]);
        assert_eq!(order(&[0.0, 7.0, 2.0, -3.0], f32::INFINITY), [-3.0, 2.0, 7.0, 0.0]);
        assert_eq!(order(&[0.0, -1.0, 1e-30], f32::MIN_POSITIVE), [-1.0, 0.0]);
    }

    #[test]
    fn what_is_not_bounded_is_kept() {
        let all = order(&[0.5, f32::NAN, 0.0], 1.0);
        assert!(all.len() == 3 && all[1].is_nan(), "{all:?}");
    }
}
