//! Stage 3: the pairs of bodies whose global bounding boxes overlap, without testing all pairs.
//!
//! A balanced tree over the boxes is built anew each step by splitting at the median of the longest axis, and then compared
//! with itself. Comparisons of coordinates are exact, so nothing is culled that overlaps.

use crate::brute_force;
use crate::global_boxes::GlobalBox;

/// Boxes in a leaf of the tree.
const LEAF: usize = 8;

/// Memory of the stage, kept from step to step.
#[derive(Debug, Default)]
pub struct BroadPhase {
    order: Vec<u32>,
    nodes: Vec<TreeNode>,
    stack: Vec<(u32, u32)>,
    pairs: Vec<(u32, u32)>,
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
    /// too much: then only the pairs found so far.
    pub(crate) fn overlapping_within(&mut self, boxes: &[GlobalBox], spend: impl Fn(u64) -> bool) -> &[(u32, u32)] {
        self.pairs.clear();
        if spend(boxes.len() as u64) {
            return &self.pairs;
        }
        if boxes.len() <= 2 * LEAF {
            brute_force::overlapping_boxes(boxes, &mut self.pairs);
            return &self.pairs;
        }
        self.order.clear();
        self.order.extend((0..boxes.len() as u32).filter(|&i| boxes[i as usize] != GlobalBox::EMPTY));
        self.nodes.clear();
        if !self.order.is_empty() {
            self.build(boxes, 0, self.order.len());
            self.compare(boxes, spend);
        }
        self.pairs.sort_unstable();
        &self.pairs
    }

    fn build(&mut self, boxes: &[GlobalBox], first: usize, end: usize) -> u32 {
        let number = self.nodes.len();
        let members = &mut self.order[first..end];
        let bounds = members.iter().fold(GlobalBox::EMPTY, |all, &i| all.joined(&boxes[i as usize]));
        self.nodes.push(TreeNode { bounds, first: first as u32, end: end as u32, second_child: 0 });
        if members.len() > LEAF {
            let axis = longest_axis(boxes, members);
            let middle = members.len() / 2;
            let key = |i: u32| centre(&boxes[i as usize], axis);
            members.select_nth_unstable_by(middle, |&i, &j| key(i).total_cmp(&key(j)).then(i.cmp(&j)));
            self.build(boxes, first, first + middle);
            let second_child = self.build(boxes, first + middle, end);
            self.nodes[number].second_child = second_child;
        }
        number as u32
    }

    /// The tree against itself; `(n, n)` stands for the pairs within node `n`.
    fn compare(&mut self, boxes: &[GlobalBox], spend: impl Fn(u64) -> bool) {
        /// Pairs of nodes between two looks at the budget: about a microsecond.
        const SLICE: u64 = 64;
        let mut compared = 0;
        self.stack.clear();
        self.stack.push((0, 0));
        while let Some((i, j)) = self.stack.pop() {
            compared += 1;
            if compared % SLICE == 0 && spend(SLICE) {
                return;
            }
            let (a, b) = (self.nodes[i as usize], self.nodes[j as usize]);
            if i != j && !a.bounds.overlaps(&b.bounds) {
                continue;
            }
            match (a.second_child, b.second_child) {
                (0, 0) => self.compare_leaves(boxes, &a, &b, i == j),
                (second, _) if i == j => self.stack.extend([(i + 1, i + 1), (second, second), (i + 1, second)]),
                (second, 0) => self.stack.extend([(i + 1, j), (second, j)]),
                (0, second) => self.stack.extend([(i, j + 1), (i, second)]),
                (second, _) if a.end - a.first >= b.end - b.first => self.stack.extend([(i + 1, j), (second, j)]),
                (_, second) => self.stack.extend([(i, j + 1), (i, second)]),
            }
        }
    }

    fn compare_leaves(&mut self, boxes: &[GlobalBox], a: &TreeNode, b: &TreeNode, same: bool) {
        let members = |node: &TreeNode| node.first as usize..node.end as usize;
        for at in members(a) {
            let i = self.order[at];
            let others = if same { at + 1..a.end as usize } else { members(b) };
            for &j in &self.order[others] {
                if boxes[i as usize].overlaps(&boxes[j as usize]) {
                    self.pairs.push((i.min(j), i.max(j)));
                }
            }
        }
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
    }
}
