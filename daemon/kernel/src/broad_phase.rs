//! Stage 3: the pairs of bodies whose global bounding boxes overlap, without testing all pairs.
//!
//! A balanced tree over the boxes, split at the median of the longest axis, is compared with itself. It is kept from step to step:
//! only its bounds follow the bodies, until they have mixed so much that comparing takes much longer than when it was built. Where few boxes
//! have changed, only these are looked up in it, and the pairs of all others are those of the last step. Comparisons of
//! coordinates are exact, so nothing is culled that overlaps, whatever the tree looks like.

use crate::brute_force;
use crate::global_boxes::GlobalBox;

/// Boxes in a leaf of the tree.
const LEAF: usize = 8;

/// The tree is built anew when comparing takes so many times what it took after it was built, in halves.
const WORN: u64 = 3;

/// Fewer than this part of all boxes are looked up one by one.
const FEW: usize = 8;

/// Memory of the stage, kept from step to step.
#[derive(Debug, Default)]
pub struct BroadPhase {
    /// The boxes of the last step.
    boxes: Vec<GlobalBox>,
    /// Those that are not empty, in the order of the leaves.
    order: Vec<u32>,
    nodes: Vec<TreeNode>,
    stack: Vec<(u32, u32)>,
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
    /// Whether `pairs` holds all pairs of `boxes`.
    complete: bool,
}

#[derive(Debug, Clone, Copy)]
struct TreeNode {
    bounds: GlobalBox,
    /// The boxes below this node: `order[first..end]`.
    first: u32,
    end: u32,
    /// The second child; the first one follows its parent. 0 in a leaf.
    second_child: u32,
}

impl BroadPhase {
    /// The pairs `(i, j)`, `i < j`, of boxes that overlap, ascending. Empty boxes overlap nothing.
    ///
    /// Same as [`brute_force::overlapping_boxes`], which tests all pairs.
    pub fn overlapping_boxes(&mut self, boxes: &[GlobalBox]) -> &[(u32, u32)] {
        self.overlapping_within(boxes, |_| false)
    }

    /// As [`overlapping_boxes`](Self::overlapping_boxes), until `spend` says that what it is told of work, in comparisons of boxes, is
    /// too much: then none.
    pub(crate) fn overlapping_within(&mut self, boxes: &[GlobalBox], spend: impl Fn(u64) -> bool) -> &[(u32, u32)] {
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
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        if self.nodes.is_empty() || self.worn {
            self.build_tree();
        } else {
            self.fit();
        }
        if self.complete && self.changed.len() < boxes.len() / FEW {
            self.complete = self.look_up_changed(spend);
        } else {
            self.complete = self.compare_all(spend);
        }
        if self.complete { &self.pairs } else { &[] }
    }

    /// Which boxes are not those of the last step; a tree over other bodies is thrown away.
    fn find_changed(&mut self, boxes: &[GlobalBox]) {
        self.changed.clear();
        let emptied = |(new, old): (&GlobalBox, &GlobalBox)| (*new == GlobalBox::EMPTY) != (*old == GlobalBox::EMPTY);
        if boxes.len() != self.boxes.len() || boxes.iter().zip(&self.boxes).any(emptied) {
            self.nodes.clear();
            self.complete = false;
            return;
        }
        let changed = (0..).zip(boxes.iter().zip(&self.boxes)).filter(|(_, (new, old))| new != old);
        self.changed.extend(changed.map(|(number, _)| number));
    }

    fn build_tree(&mut self) {
        self.order.clear();
        self.order.extend((0..self.boxes.len() as u32).filter(|&i| self.boxes[i as usize] != GlobalBox::EMPTY));
        self.nodes.clear();
        (self.compared_when_new, self.worn) = (0, false);
        if !self.order.is_empty() {
            self.build(0, self.order.len());
        }
    }

    fn build(&mut self, first: usize, end: usize) -> u32 {
        let number = self.nodes.len();
        let (boxes, members) = (&self.boxes, &mut self.order[first..end]);
        let bounds = members.iter().fold(GlobalBox::EMPTY, |all, &i| all.joined(&boxes[i as usize]));
        self.nodes.push(TreeNode { bounds, first: first as u32, end: end as u32, second_child: 0 });
        if members.len() > LEAF {
            let axis = longest_axis(boxes, members);
            let middle = members.len() / 2;
            let key = |i: u32| centre(&boxes[i as usize], axis);
            members.select_nth_unstable_by(middle, |&i, &j| key(i).total_cmp(&key(j)).then(i.cmp(&j)));
            self.build(first, first + middle);
            let second_child = self.build(first + middle, end);
            self.nodes[number].second_child = second_child;
        }
        number as u32
    }

    /// The bounds of all nodes, from those of their children, which come behind them.
    fn fit(&mut self) {
        for number in (0..self.nodes.len()).rev() {
            let node = self.nodes[number];
            self.nodes[number].bounds = if node.second_child == 0 {
                let members = &self.order[node.first as usize..node.end as usize];
                members.iter().fold(GlobalBox::EMPTY, |all, &i| all.joined(&self.boxes[i as usize]))
            } else {
                self.nodes[number + 1].bounds.joined(&self.nodes[node.second_child as usize].bounds)
            };
        }
    }

    /// All pairs; says whether it came to the end.
    fn compare_all(&mut self, spend: impl Fn(u64) -> bool) -> bool {
        self.found.clear();
        let compared = if self.nodes.is_empty() { Some(0) } else { self.compare(spend) };
        let Some(compared) = compared else { return false };
        self.put_in_order();
        std::mem::swap(&mut self.pairs, &mut self.found);
        if self.compared_when_new == 0 {
            self.compared_when_new = compared;
        }
        self.worn = 2 * compared > WORN * self.compared_when_new;
        true
    }

    /// The tree against itself, `(n, n)` standing for the pairs within node `n`; says how many pairs of nodes were compared, if it came to
    /// the end.
    fn compare(&mut self, spend: impl Fn(u64) -> bool) -> Option<u64> {
        /// Pairs of nodes between two looks at the budget: about a microsecond.
        const SLICE: u64 = 64;
        let mut compared = 0;
        self.stack.clear();
        self.stack.push((0, 0));
        while let Some((i, j)) = self.stack.pop() {
            compared += 1;
            if compared % SLICE == 0 && spend(SLICE) {
                return None;
            }
            let (a, b) = (&self.nodes[i as usize], &self.nodes[j as usize]);
            if i != j && !a.bounds.overlaps(&b.bounds) {
                continue;
            }
            match (a.second_child, b.second_child) {
                (0, 0) => self.compare_leaves(i, j),
                (second, _) if i == j => self.stack.extend([(i + 1, i + 1), (second, second), (i + 1, second)]),
                (second, 0) => self.stack.extend([(i + 1, j), (second, j)]),
                (0, second) => self.stack.extend([(i, j + 1), (i, second)]),
                (second, _) if a.end - a.first >= b.end - b.first => self.stack.extend([(i + 1, j), (second, j)]),
                (_, second) => self.stack.extend([(i, j + 1), (i, second)]),
            }
        }
        Some(compared)
    }

    fn compare_leaves(&mut self, i: u32, j: u32) {
        let (a, b) = (&self.nodes[i as usize], &self.nodes[j as usize]);
        for at in a.first..a.end {
            let first = self.order[at as usize];
            let bounds = &self.boxes[first as usize];
            if i != j && !bounds.overlaps(&b.bounds) {
                continue;
            }
            let others = if i == j { at + 1..a.end } else { b.first..b.end };
            for &second in &self.order[others.start as usize..others.end as usize] {
                if bounds.overlaps(&self.boxes[second as usize]) {
                    self.found.push((first.min(second), first.max(second)));
                }
            }
        }
    }

    /// The pairs of the boxes that have changed, and those of the last step of which neither has; says whether it came to the end.
    fn look_up_changed(&mut self, spend: impl Fn(u64) -> bool) -> bool {
        let changed = |i: u32| self.changed.binary_search(&i).is_ok();
        self.found.clear();
        self.found.extend(self.pairs.iter().filter(|&&(i, j)| !changed(i) && !changed(j)));
        for at in 0..self.changed.len() {
            if spend(LEAF as u64) {
                return false;
            }
            self.look_up(self.changed[at]);
        }
        self.put_in_order();
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
        if !is_new && self.changed.is_empty() && !self.nodes.is_empty() {
            return;
        }
        self.boxes.clear();
        self.boxes.extend_from_slice(boxes);
        self.complete = false;
        if boxes.len() <= 2 * LEAF {
            self.nodes.clear();
        } else if self.nodes.is_empty() || self.worn {
            self.build_tree();
        } else {
            self.fit();
        }
    }

    /// The numbers of the boxes held that overlap a box.
    pub(crate) fn overlapping(&self, bounds: &GlobalBox, stack: &mut Vec<u32>, mut meet: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            let all = (0..).zip(&self.boxes).filter(|(_, other)| other.overlaps(bounds));
            return all.for_each(|(other, _)| meet(other));
        }
        stack.clear();
        stack.push(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.bounds.overlaps(bounds) {
                continue;
            }
            if node.second_child != 0 {
                stack.extend([at + 1, node.second_child]);
                continue;
            }
            let members = &self.order[node.first as usize..node.end as usize];
            members.iter().filter(|&&other| self.boxes[other as usize].overlaps(bounds)).for_each(|&other| meet(other));
        }
    }

    /// Orders what was found: by counting those of each first body, then by the second ones.
    fn put_in_order(&mut self) {
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
        self.pairs.chunk_by_mut(|one, other| one.0 == other.0).for_each(<[_]>::sort_unstable);
        std::mem::swap(&mut self.pairs, &mut self.found);
    }
}

fn centre(bounds: &GlobalBox, axis: usize) -> f64 {
    0.5 * bounds.min[axis] + 0.5 * bounds.max[axis]
}

fn longest_axis(boxes: &[GlobalBox], members: &[u32]) -> usize {
    let spread = |axis: usize| {
        let centres = members.iter().map(|&i| centre(&boxes[i as usize], axis));
        let ends = centres.fold((f64::MAX, f64::MIN), |(low, high), c| (c.min(low), c.max(high)));
        0.5 * ends.1 - 0.5 * ends.0
    };
    let spreads = [spread(0), spread(1), spread(2)];
    (1..3).fold(0, |best, axis| if spreads[axis] > spreads[best] { axis } else { best })
}

#[cfg(test)]
mod tests {
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
                 0u8..8, proptest::bool::ANY), 1..12)
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
                if cut_short {
                    let left = std::cell::Cell::new(2 * boxes.len() as i64);
                    broad_phase.overlapping_within(&boxes, |work| {
                        left.set(left.get() - work as i64);
                        left.get() < 0
                    });
                }
                let mut expected = Vec::new();
                brute_force::overlapping_boxes(&boxes, &mut expected);
                prop_assert_eq!(broad_phase.overlapping_boxes(&boxes), &expected[..]);
            }
        }
    }
}
