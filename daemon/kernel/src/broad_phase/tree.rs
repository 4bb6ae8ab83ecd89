//! A balanced tree over boxes, split at the median of the longest axis.
//!
//! It holds the boxes in f32, rounded outwards: half the memory, and two comparisons of four numbers each. What overlaps there is
//! compared exactly before it is reported.

use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::{DVec3, Vec4};
use rayon::prelude::*;

use crate::global_boxes::GlobalBox;
use crate::workforce::Workforce;

/// Boxes in a leaf of the tree.
pub(super) const LEAF: usize = 8;

/// Pairs of nodes compared between two looks at the budget: one or two microseconds, if all of them are leaves.
const SLICE: u64 = 16;

/// Boxes, or nodes, fitted between two looks at the budget: about a microsecond.
const FITTED_AT_ONCE: usize = 128;

/// A tree of so many nodes is worth another thread, and is compared in about so many pieces.
const LARGE: usize = 128;
const PIECES: usize = 64;

/// A box that holds the exact one.
#[derive(Debug, Clone, Copy)]
struct Outer {
    min: Vec4,
    max: Vec4,
}

impl Outer {
    const EMPTY: Outer = Outer { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline]
    fn of(bounds: &GlobalBox) -> Outer {
        Outer { min: rounded_down(bounds.min), max: -rounded_down(-bounds.max) }
    }

    #[inline(always)]
    fn overlaps(&self, other: &Outer) -> bool {
        (self.min.cmple(other.max) & other.min.cmple(self.max)).all()
    }

    #[inline]
    fn joined(&self, other: &Outer) -> Outer {
        Outer { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

/// No greater, in f32, and finite or less than all that is. The fourth lane is 0.
#[inline]
fn rounded_down(values: DVec3) -> Vec4 {
    // Rounding takes at most half an ulp, and so does the subtraction: two ulps are more, and cost no branch.
    let margin = |nearest: Vec4| nearest.abs() * (2.0 * f32::EPSILON) + Vec4::splat(f32::MIN_POSITIVE);
    let nearest = Vec4::new(values.x as f32, values.y as f32, values.z as f32, 0.0).min(Vec4::splat(f32::MAX));
    (nearest - margin(nearest)).with_w(0.0)
}

#[derive(Debug, Clone, Copy)]
struct TreeNode {
    bounds: Outer,
    /// The boxes below this node: `order[first..end]`.
    first: u32,
    end: u32,
    /// The second child; the first one follows its parent. 0 in a leaf.
    second_child: u32,
}

/// The tree, and the memory in which it is compared with itself.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// Numbers of the boxes that are not empty, in the order of the leaves; and these boxes.
    order: Vec<u32>,
    held: Vec<Outer>,
    nodes: Vec<TreeNode>,
    open: Vec<(u32, u32)>,
    /// One for each thread.
    piles: Vec<Mutex<Pile>>,
}

/// What one thread has found, and has still to compare.
#[derive(Debug, Default)]
struct Pile {
    found: Vec<(u32, u32)>,
    open: Vec<(u32, u32)>,
    compared: u64,
}

impl Tree {
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Forgets all boxes.
    pub fn clear(&mut self) {
        self.nodes.clear();
    }

    /// A new tree over the boxes that are not empty, which has to be fitted to them.
    pub fn build(&mut self, boxes: &[GlobalBox]) {
        self.order.clear();
        self.order.extend((0..boxes.len() as u32).filter(|&i| boxes[i as usize] != GlobalBox::EMPTY));
        self.nodes.clear();
        if !self.order.is_empty() {
            self.build_node(boxes, 0, self.order.len());
        }
    }

    fn build_node(&mut self, boxes: &[GlobalBox], first: usize, end: usize) {
        let (number, members) = (self.nodes.len(), &mut self.order[first..end]);
        self.nodes.push(TreeNode { bounds: Outer::EMPTY, first: first as u32, end: end as u32, second_child: 0 });
        if members.len() > LEAF {
            let axis = longest_axis(boxes, members);
            let middle = members.len() / 2;
            let key = |i: u32| centre(&boxes[i as usize], axis);
            members.select_nth_unstable_by(middle, |&i, &j| key(i).total_cmp(&key(j)).then(i.cmp(&j)));
            self.build_node(boxes, first, first + middle);
            self.nodes[number].second_child = self.nodes.len() as u32;
            self.build_node(boxes, first + middle, end);
        }
    }

    /// Takes over where the boxes are now, until `spend` says that there is no time left; says whether it came to the end. The bounds of a
    /// node are those of its children, which come behind it.
    pub fn fit(&mut self, boxes: &[GlobalBox], spend: impl Fn(u64) -> bool) -> bool {
        let Tree { order, held, nodes, .. } = self;
        held.clear();
        for slice in order.chunks(FITTED_AT_ONCE) {
            if spend(0) {
                return false;
            }
            held.extend(slice.iter().map(|&i| Outer::of(&boxes[i as usize])));
        }
        for number in (0..nodes.len()).rev() {
            if number % FITTED_AT_ONCE == 0 && spend(0) {
                return false;
            }
            let node = nodes[number];
            nodes[number].bounds = if node.second_child == 0 {
                let members = &held[node.first as usize..node.end as usize];
                members.iter().fold(Outer::EMPTY, |all, member| all.joined(member))
            } else {
                nodes[number + 1].bounds.joined(&nodes[node.second_child as usize].bounds)
            };
        }
        true
    }

    /// Appends all pairs of boxes that overlap, in any order; says how many pairs of nodes were compared, if it came to the end before
    /// `spend` said that what it was told of work was too much.
    pub fn compare(
        &mut self,
        boxes: &[GlobalBox],
        spend: impl Fn(u64) -> bool + Sync,
        workforce: &dyn Workforce,
        found: &mut Vec<(u32, u32)>,
    ) -> Option<u64> {
        let mut open = std::mem::take(&mut self.open);
        let threads = if self.nodes.len() < LARGE { 1 } else { workforce.threads() };
        self.piles.resize_with(threads.max(self.piles.len()), Mutex::default);
        open.clear();
        if !self.nodes.is_empty() {
            open.push((0, 0));
        }
        let mut compared = 0;
        if threads > 1 {
            // A first thread opens a few levels, and all of them share what comes of it.
            compared += self.open_pieces(boxes, &mut open, found);
            let run = |piece: &(u32, u32)| self.own_pile().run(self, boxes, *piece, &spend);
            workforce.share(&mut || open.par_iter().with_max_len(1).for_each(run));
        } else {
            let mut pile = lock(&self.piles[0]);
            open.iter().for_each(|piece| pile.run(self, boxes, *piece, &spend));
        }
        self.open = open;
        let is_done = !spend(0);
        for pile in &mut self.piles {
            let pile = pile.get_mut().unwrap_or_else(PoisonError::into_inner);
            found.append(&mut pile.found);
            compared += std::mem::take(&mut pile.compared);
        }
        is_done.then_some(compared)
    }

    fn own_pile(&self) -> MutexGuard<'_, Pile> {
        lock(&self.piles[rayon::current_thread_index().unwrap_or(0) % self.piles.len()])
    }

    /// Opens the first pairs, breadth first, until there are pieces for all threads.
    fn open_pieces(&self, boxes: &[GlobalBox], open: &mut Vec<(u32, u32)>, found: &mut Vec<(u32, u32)>) -> u64 {
        let mut next = 0;
        while next < open.len() && open.len() - next < PIECES {
            let pair = open[next];
            next += 1;
            self.split(boxes, pair, open, found);
        }
        open.drain(..next);
        next as u64
    }

    /// Compares a pair of nodes, `(n, n)` standing for the pairs within node `n`: pairs of boxes are found, pairs of nodes opened.
    #[inline(always)]
    fn split(&self, boxes: &[GlobalBox], (i, j): (u32, u32), open: &mut Vec<(u32, u32)>, found: &mut Vec<(u32, u32)>) {
        let (a, b) = (&self.nodes[i as usize], &self.nodes[j as usize]);
        if i != j && !a.bounds.overlaps(&b.bounds) {
            return;
        }
        match (a.second_child, b.second_child) {
            (0, 0) => self.compare_leaves(boxes, i, j, found),
            (second, _) if i == j => open.extend([(i + 1, i + 1), (second, second), (i + 1, second)]),
            (second, 0) => open.extend([(i + 1, j), (second, j)]),
            (0, second) => open.extend([(i, j + 1), (i, second)]),
            (second, _) if a.end - a.first >= b.end - b.first => open.extend([(i + 1, j), (second, j)]),
            (_, second) => open.extend([(i, j + 1), (i, second)]),
        }
    }

    fn compare_leaves(&self, boxes: &[GlobalBox], i: u32, j: u32, found: &mut Vec<(u32, u32)>) {
        let (a, b) = (&self.nodes[i as usize], &self.nodes[j as usize]);
        for at in a.first..a.end {
            let bounds = &self.held[at as usize];
            if i != j && !bounds.overlaps(&b.bounds) {
                continue;
            }
            let others = if i == j { at + 1..a.end } else { b.first..b.end };
            for other in others {
                if bounds.overlaps(&self.held[other as usize]) {
                    let (first, second) = (self.order[at as usize], self.order[other as usize]);
                    if boxes[first as usize].overlaps(&boxes[second as usize]) {
                        found.push((first.min(second), first.max(second)));
                    }
                }
            }
        }
    }

    /// The numbers of the boxes that overlap a box.
    pub fn overlapping(
        &self,
        boxes: &[GlobalBox],
        bounds: &GlobalBox,
        stack: &mut Vec<u32>,
        mut meet: impl FnMut(u32),
    ) {
        let outer = Outer::of(bounds);
        stack.clear();
        stack.push(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if !node.bounds.overlaps(&outer) {
                continue;
            }
            if node.second_child != 0 {
                stack.extend([at + 1, node.second_child]);
                continue;
            }
            let members = node.first as usize..node.end as usize;
            let reached = members.filter(|&member| self.held[member].overlaps(&outer));
            let reached = reached.map(|member| self.order[member]);
            reached.filter(|&other| boxes[other as usize].overlaps(bounds)).for_each(&mut meet);
        }
    }
}

impl Pile {
    /// All that a pair of nodes comes to, as long as the budget lasts.
    fn run(&mut self, tree: &Tree, boxes: &[GlobalBox], piece: (u32, u32), spend: &impl Fn(u64) -> bool) {
        let Pile { found, open, compared } = self;
        open.clear();
        open.push(piece);
        while let Some(pair) = open.pop() {
            *compared += 1;
            if *compared % SLICE == 0 && spend(SLICE) {
                return;
            }
            tree.split(boxes, pair, open, found);
        }
    }
}

fn lock<T>(pile: &Mutex<T>) -> MutexGuard<'_, T> {
    pile.lock().unwrap_or_else(PoisonError::into_inner)
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
