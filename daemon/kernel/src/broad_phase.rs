//! Stage 3: the pairs of bodies whose global bounding boxes overlap, without testing all pairs.
//!
//! A balanced tree over the boxes, split at the median of the longest axis, is compared with itself. It is kept from step to step:
//! only its bounds follow the bodies, until they have mixed so much that comparing takes much longer than when it was built. Where few boxes
//! have changed, only these are looked up in it, and the pairs of all others are those of the last step. Comparisons of
//! coordinates are exact, so nothing is culled that overlaps, whatever the tree looks like.

mod tree;

use crate::brute_force;
use crate::global_boxes::GlobalBox;
use crate::workforce::Workforce;
use tree::{LEAF, Tree};

/// The tree is built anew when comparing takes so many times what it took after it was built, in halves.
const WORN: u64 = 3;

/// Where time is short, a worn tree is built anew in one of so many steps: that takes longer than comparing it.
const SELDOM: u32 = 128;

/// Fewer than this part of all boxes are looked up one by one.
const FEW: usize = 8;

/// Pairs sorted, or gone through, between two looks at the budget: some microseconds.
const PAIRS_AT_ONCE: usize = 256;

/// Memory of the stage, kept from step to step.
#[derive(Debug, Default)]
pub struct BroadPhase {
    /// The boxes of the last step.
    boxes: Vec<GlobalBox>,
    tree: Tree,
    look_up_stack: Vec<u32>,
    /// Of the last step; ascending.
    pairs: Vec<(u32, u32)>,
    changed: Vec<u32>,
    found: Vec<(u32, u32)>,
    /// For putting pairs in order: where those of each first body end.
    ends: Vec<u32>,
    /// Pairs of nodes compared when the tree was new; 0 when there is none.
    compared_when_new: u64,
    /// Whether the tree has to be built anew.
    worn: bool,
    /// Whether the tree is over `boxes`.
    is_fit: bool,
    /// Whether `pairs` holds all pairs of `boxes`.
    complete: bool,
    /// Whether there is little time, and for how many steps in which it should be built the tree was not.
    hurried: bool,
    put_off: u32,
}

impl BroadPhase {
    /// The pairs `(i, j)`, `i < j`, of boxes that overlap, ascending. Empty boxes overlap nothing.
    ///
    /// Same as [`brute_force::overlapping_boxes`], which tests all pairs.
    pub fn overlapping_boxes(&mut self, boxes: &[GlobalBox]) -> &[(u32, u32)] {
        self.overlapping_within(boxes, |_| false, &())
    }

    /// As [`overlapping_boxes`](Self::overlapping_boxes), until `spend` says that what it is told of work, in comparisons of boxes, is
    /// too much: then none. What can be shared is done by the workforce.
    pub(crate) fn overlapping_within(
        &mut self,
        boxes: &[GlobalBox],
        spend: impl Fn(u64) -> bool + Sync,
        workforce: &dyn Workforce,
    ) -> &[(u32, u32)] {
        if spend(boxes.len() as u64) {
            return &[];
        }
        if boxes.len() <= 2 * LEAF {
            self.pairs.clear();
            self.complete = false;
            brute_force::overlapping_boxes(boxes, &mut self.pairs);
            return &self.pairs;
        }
        self.find_changed(boxes);
        if self.changed.is_empty() && self.complete {
            return &self.pairs;
        }
        if spend(0) {
            return &[];
        }
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        if !self.fit(&spend) {
            self.complete = false;
            return &[];
        }
        if self.complete && self.changed.len() < boxes.len() / FEW {
            self.complete = self.look_up_changed(spend);
        } else {
            self.complete = self.compare_all(spend, workforce);
        }
        if self.complete { &self.pairs } else { &[] }
    }

    /// Says whether there is little time for what comes.
    pub(crate) fn hurry(&mut self, hurried: bool) {
        self.hurried = hurried;
    }

    /// Which boxes are not those of the last step; a tree over other bodies is thrown away.
    fn find_changed(&mut self, boxes: &[GlobalBox]) {
        self.changed.clear();
        let emptied = |(new, old): (&GlobalBox, &GlobalBox)| (*new == GlobalBox::EMPTY) != (*old == GlobalBox::EMPTY);
        if boxes.len() != self.boxes.len() || boxes.iter().zip(&self.boxes).any(emptied) {
            self.tree.clear();
            self.complete = false;
            return;
        }
        let changed = (0..).zip(boxes.iter().zip(&self.boxes)).filter(|(_, (new, old))| new != old);
        self.changed.extend(changed.map(|(number, _)| number));
    }

    /// The tree is over these boxes from now on, if there is time for that.
    fn fit(&mut self, spend: impl Fn(u64) -> bool) -> bool {
        let is_put_off = self.hurried && self.put_off < SELDOM;
        if self.tree.is_empty() || self.worn && !is_put_off {
            self.tree.build(&self.boxes);
            (self.compared_when_new, self.worn, self.put_off) = (0, false, 0);
        } else {
            self.put_off += u32::from(self.worn);
        }
        self.is_fit = self.tree.fit(&self.boxes, spend);
        self.is_fit
    }

    /// All pairs; says whether it came to the end.
    fn compare_all(&mut self, spend: impl Fn(u64) -> bool + Sync, workforce: &dyn Workforce) -> bool {
        self.found.clear();
        let compared = self.tree.compare(&self.boxes, &spend, workforce, &mut self.found);
        let Some(compared) = compared else { return false };
        if !self.put_in_order(&spend) {
            return false;
        }
        std::mem::swap(&mut self.pairs, &mut self.found);
        if self.compared_when_new == 0 {
            self.compared_when_new = compared;
        }
        self.worn = 2 * compared > WORN * self.compared_when_new;
        true
    }

    /// The pairs of the boxes that have changed, and those of the last step of which neither has; says whether it came to the end.
    fn look_up_changed(&mut self, spend: impl Fn(u64) -> bool) -> bool {
        let changed = |i: u32| self.changed.binary_search(&i).is_ok();
        self.found.clear();
        for pairs in self.pairs.chunks(PAIRS_AT_ONCE) {
            if spend(0) {
                return false;
            }
            self.found.extend(pairs.iter().filter(|&&(i, j)| !changed(i) && !changed(j)));
        }
        for at in 0..self.changed.len() {
            if spend(LEAF as u64) {
                return false;
            }
            self.look_up(self.changed[at]);
        }
        if !self.put_in_order(spend) {
            return false;
        }
        // Two boxes that have both changed were found from either side.
        self.found.dedup();
        std::mem::swap(&mut self.pairs, &mut self.found);
        true
    }

    fn look_up(&mut self, number: u32) {
        let (mut found, mut stack) = (std::mem::take(&mut self.found), std::mem::take(&mut self.look_up_stack));
        self.overlapping(&self.boxes[number as usize], &mut stack, |other| {
            if other != number {
                found.push((number.min(other), number.max(other)));
            }
        });
        (self.found, self.look_up_stack) = (found, stack);
    }

    /// Makes ready for looking up other boxes among these. Where they are those of the last step, there is nothing to do.
    pub(crate) fn hold(&mut self, boxes: &[GlobalBox]) {
        self.find_changed(boxes);
        let is_new = boxes.len() != self.boxes.len();
        if !is_new && self.changed.is_empty() && !self.tree.is_empty() && self.is_fit {
            return;
        }
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        self.complete = false;
        if boxes.len() <= 2 * LEAF {
            self.tree.clear();
        } else {
            self.fit(|_| false);
        }
    }

    /// The numbers of the boxes held that overlap a box.
    pub(crate) fn overlapping(&self, bounds: &GlobalBox, stack: &mut Vec<u32>, mut meet: impl FnMut(u32)) {
        if self.tree.is_empty() {
            let all = (0..).zip(&self.boxes).filter(|(_, other)| other.overlaps(bounds));
            return all.for_each(|(other, _)| meet(other));
        }
        self.tree.overlapping(&self.boxes, bounds, stack, meet);
    }

    /// Orders what was found, by counting the pairs of each first body, then by the second ones, until `spend` says that there is no time
    /// left; says whether it came to the end.
    fn put_in_order(&mut self, spend: impl Fn(u64) -> bool) -> bool {
        self.ends.clear();
        self.ends.resize(self.boxes.len() + 1, 0);
        self.found.iter().for_each(|&(i, _)| self.ends[i as usize + 1] += 1);
        for i in 1..self.ends.len() {
            self.ends[i] += self.ends[i - 1];
        }
        // What was in `pairs` is no longer needed: it takes the ordered pairs, and then changes places with `found`.
        self.pairs.clear();
        self.pairs.resize(self.found.len(), (0, 0));
        for &(i, j) in &self.found {
            let place = &mut self.ends[i as usize];
            self.pairs[*place as usize] = (i, j);
            *place += 1;
        }
        let mut unseen = 0;
        for of_one in self.pairs.chunk_by_mut(|one, other| one.0 == other.0) {
            unseen += of_one.len();
            if unseen > PAIRS_AT_ONCE {
                unseen = 0;
                if spend(0) {
                    return false;
                }
            }
            of_one.sort_unstable();
        }
        std::mem::swap(&mut self.pairs, &mut self.found);
        true
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;
    use glam::DVec3;
    use proptest::prelude::*;

    fn boxes(corners: Vec<([i32; 3], [i32; 3], u8)>) -> Vec<GlobalBox> {
        let widened = |bounds: GlobalBox, kind: u8| match kind {
            0 => GlobalBox::EMPTY,
            1 => GlobalBox { min: bounds.min.with_x(f64::MIN), max: bounds.max.with_y(f64::MAX) },
            _ => bounds,
        };
        let bounds = |(min, size, kind): ([i32; 3], [i32; 3], u8)| {
            let min = DVec3::from(min.map(f64::from));
            widened(GlobalBox { min, max: min + DVec3::from(size.map(f64::from)) }, kind)
        };
        corners.into_iter().map(bounds).collect()
    }

    proptest! {
        #[test]
        fn the_tree_finds_what_testing_all_pairs_finds(
            corners in proptest::collection::vec(
                (proptest::array::uniform3(-20..20), proptest::array::uniform3(0..6), 0u8..20), 0..200)
        ) {
            let boxes = boxes(corners);
            let mut expected = Vec::new();
            brute_force::overlapping_boxes(&boxes, &mut expected);
            let mut broad_phase = BroadPhase::default();
            prop_assert_eq!(broad_phase.overlapping_boxes(&boxes), &expected[..]);
        }

        /// Steps in which none, few or all boxes move, come or go, some of them cut short by a budget.
        #[test]
        fn what_is_kept_from_step_to_step_changes_nothing(
            first in proptest::collection::vec(
                (proptest::array::uniform3(-20..20), proptest::array::uniform3(0..6), 0u8..20), 0..120),
            steps in proptest::collection::vec(
                (proptest::collection::vec(
                    (0usize..120, proptest::array::uniform3(-20..20), proptest::array::uniform3(0..6), 0u8..20), 0..30),
                 0u8..8, proptest::option::of(0u32..12)), 1..12)
        ) {
            let mut corners = first;
            let mut broad_phase = BroadPhase::default();
            for (moves, kind, cut_short) in steps {
                for (at, corner, size, empty) in moves {
                    match corners.len() {
                        0 => corners.push((corner, size, empty)),
                        count => corners[at % count] = (corner, size, empty),
                    }
                }
                match kind {
                    0 => corners.iter_mut().for_each(|corner: &mut ([i32; 3], [i32; 3], u8)| corner.0[0] = -corner.0[0]),
                    1 => corners.push(([0; 3], [5; 3], 9)),
                    2 => drop(corners.pop()),
                    _ => {}
                }
                let boxes = boxes(corners.clone());
                if let Some(looks) = cut_short {
                    // Wherever the budget is looked at it may be up: while the tree is fitted, and while it is compared.
                    let looked = AtomicU32::new(0);
                    broad_phase.overlapping_within(&boxes, |_| looked.fetch_add(1, Ordering::Relaxed) >= looks, &());
                }
                let mut expected = Vec::new();
                brute_force::overlapping_boxes(&boxes, &mut expected);
                broad_phase.hold(&boxes);
                let mut looked_up = Vec::new();
                for (number, bounds) in (0..).zip(&boxes) {
                    broad_phase.overlapping(bounds, &mut Vec::new(), |other| looked_up.push((number, other)));
                }
                looked_up.retain(|(first, second)| first < second);
                looked_up.sort_unstable();
                prop_assert_eq!(&looked_up, &expected);
                prop_assert_eq!(broad_phase.overlapping_boxes(&boxes), &expected[..]);
            }
        }
    }
}
