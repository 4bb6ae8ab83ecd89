//! The descent through two pyramids of voxels, in the order of time.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::body::MovingBody;
use super::chords::Chords;
use super::frame::{Frame, Window};
use super::triangle_pair::{Bracket, Outcome, TrianglePair, Work};
use crate::affine::Rows;
use crate::polygon_box::bits_of;
use crate::submatrix::Voxel;

/// A span is cut until a body turns less than this in it, in radians, before its voxels are compared: the deviation
/// from a chord is then a two-thousandth of the distance from the axis.
const TURN_OF_A_SPAN: f64 = 0.0625;

/// Pairs of triangles that are compared as they are, rather than splitting a voxel.
const FEW: u64 = 4;

/// A voxel is not split when its children hold so many times its triangles or more.
const MOST_REPEATED: u32 = 4;

/// Work units of comparing two triangles.
const PAIR_COST: u32 = 16;

/// Work units of looking at a span.
const SPAN_COST: u32 = 64;

/// Memory of the effect, kept from call to call.
#[derive(Debug, Default)]
pub struct Memory {
    heap: BinaryHeap<Entry>,
    children: Vec<Entry>,
    triangles: [Vec<MovingTriangle>; 2],
    numbers: Vec<u32>,
}

/// Two voxels that may meet, and when.
#[derive(Debug, Clone, Copy)]
struct Entry {
    window: Window,
    voxels: [Voxel; 2],
    /// Not worth splitting.
    whole: [bool; 2],
}

impl Entry {
    /// The earlier one first; of equals the deeper one, which is nearer to a proof.
    fn key(&self) -> (f64, u8) {
        (-self.window.from, self.voxels[0].level + self.voxels[1].level)
    }
}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        let ((first, depth), (second, other_depth)) = (self.key(), other.key());
        let numbers = |entry: &Entry| entry.voxels.map(|voxel| (voxel.level, voxel.number));
        first.total_cmp(&second).then(depth.cmp(&other_depth)).then_with(|| numbers(other).cmp(&numbers(self)))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Entry {}

/// A triangle at both ends of a span, and its boxes there.
#[derive(Debug, Clone, Copy)]
struct MovingTriangle {
    ends: [[DVec3; 3]; 2],
    min: [DVec3; 2],
    max: [DVec3; 2],
    number: u32,
}

/// A span of time, and what is the same for all voxels in it.
struct Span {
    start: f64,
    end: f64,
    frame: Frame,
    /// Per end and body.
    rows: [[Rows; 2]; 2],
    /// What world positions may stray from the lines between those at the ends.
    pad: f64,
}

impl Span {
    /// Whether one axis proves two triangles apart over a window, or up to a time in it.
    fn keeps_apart(&self, [p, q]: [&MovingTriangle; 2], window: Window, known_until: f64) -> bool {
        // Rounded up: the proof covers a little more.
        let known_until = (known_until - self.start) / (self.end - self.start) + 2.0 * f64::EPSILON;
        let until = window.until.min(known_until);
        let apart = Chords::new(&p.ends, &q.ends, self.pad).separated_longest(window.from, until);
        until < window.from || apart.is_some_and(|apart| apart.until >= until)
    }

    fn time(&self, at: f64) -> f64 {
        if at >= 1.0 { self.end } else { self.start + at * (self.end - self.start) }
    }
}

/// The search for the first contact of two moving bodies.
pub(super) struct Search<'m> {
    pub bodies: [&'m MovingBody<'m>; 2],
    /// The best bracket that is confirmed.
    pub contact: Option<Bracket>,
    /// Two triangles that are near each other where something stays open.
    pub nearest: [u32; 2],
    /// Where contact can be neither proven nor excluded, all such times together.
    doubt: Option<Bracket>,
    /// Where the work has ended.
    given_up: Option<f64>,
    tolerance: f64,
    work: Work,
    memory: &'m mut Memory,
}

impl<'m> Search<'m> {
    pub fn new(bodies: [&'m MovingBody<'m>; 2], tolerance: f64, work: Work, memory: &'m mut Memory) -> Search<'m> {
        Search { bodies, contact: None, nearest: [0; 2], doubt: None, given_up: None, tolerance, work, memory }
    }

    pub fn run(&mut self) {
        self.between(0.0, 1.0);
    }

    /// The times before a confirmed contact at which another can not be excluded.
    pub fn open(&self) -> Option<Bracket> {
        let given_up = self.given_up.map(|lo| Bracket { lo, hi: 1.0 });
        let all = match (self.doubt, given_up) {
            (Some(p), Some(q)) => Some(Bracket { lo: p.lo.min(q.lo), hi: p.hi.max(q.hi) }),
            (one, other) => one.or(other),
        };
        all.filter(|open| open.lo < self.known_until())
    }

    /// Nothing later matters.
    fn known_until(&self) -> f64 {
        self.contact.map_or(f64::INFINITY, |contact| contact.lo)
    }

    /// What is proven free up to here makes a bracket with the contact that is known.
    fn enough(&self) -> f64 {
        self.contact.map_or(f64::INFINITY, |contact| contact.hi - 0.875 * self.tolerance)
    }

    fn contact_not_before(&mut self, lo: f64) {
        if let Some(contact) = &mut self.contact {
            contact.lo = contact.lo.min(lo);
        }
    }

    fn give_up(&mut self, at: f64) {
        self.given_up = Some(self.given_up.map_or(at, |before| before.min(at)));
    }

    fn between(&mut self, start: f64, end: f64) {
        if start >= self.known_until() || self.given_up.is_some() {
            return;
        }
        if !self.work.spend(SPAN_COST) {
            return self.give_up(start);
        }
        let frame = Frame::new(self.bodies, start, end);
        let Some(window) = frame.containers() else { return };
        let turn = self.bodies.iter().map(|body| body.motion.turn()).fold(0.0, f64::max);
        let middle = 0.5 * (start + end);
        if turn * (end - start) > TURN_OF_A_SPAN && start < middle && middle < end {
            self.between(start, middle);
            return self.between(middle, end);
        }
        let rows = [start, end].map(|t| self.bodies.map(|body| body.motion.at(t)));
        let pad = |body: &&MovingBody<'_>| body.deviation(end - start) + body.bound.length() * (1.0 + 1e-15);
        let pad = self.bodies.iter().map(pad).sum();
        self.descend(&Span { start, end, frame, rows, pad }, window);
    }

    fn descend(&mut self, span: &Span, window: Window) {
        self.memory.heap.clear();
        self.memory.heap.push(Entry { window, voxels: [Voxel::CONTAINER; 2], whole: [false; 2] });
        while let Some(entry) = self.memory.heap.pop() {
            let from = span.time(entry.window.from);
            if from >= self.known_until() {
                return;
            }
            if from >= self.enough() {
                return self.contact_not_before(from);
            }
            if self.work.0 == 0 {
                return self.give_up(from);
            }
            match self.split(span, &entry) {
                Some(split) => self.expand(span, &entry, split),
                None => self.compare(span, &entry),
            }
        }
    }

    /// Which voxel to split; `None` when neither can be, or need be.
    fn split(&self, span: &Span, entry: &Entry) -> Option<usize> {
        let matrix = |which: usize| self.bodies[which].object.matrix();
        let triangles = [0, 1].map(|which| {
            let voxel = entry.voxels[which];
            u64::from(matrix(which).triangle_count(usize::from(voxel.level), voxel.number))
        });
        if triangles[0] * triangles[1] <= FEW {
            return None;
        }
        let last = |which: usize| entry.whole[which] || usize::from(entry.voxels[which].level) == matrix(which).depth();
        match (last(0), last(1)) {
            (true, true) => None,
            (true, false) => Some(1),
            (false, true) => Some(0),
            (false, false) => {
                let size = |which: usize| span.frame.size(which, entry.voxels[which].level);
                Some(usize::from(size(0) < size(1)))
            }
        }
    }

    /// Pushes the pairs of the split voxel's children with the other voxel.
    fn expand(&mut self, span: &Span, entry: &Entry, split: usize) {
        let (parent, other) = (entry.voxels[split], entry.voxels[1 - split]);
        let matrix = self.bodies[split].object.matrix();
        let level = usize::from(parent.level);
        let halved = &matrix.lattice().levels()[level];
        let node = matrix.node(level, parent.number);
        let seen = span.frame.seen_from(split, level + 1, other);
        let mut repeated = 0;
        self.memory.children.clear();
        for child in bits_of(node.occupied) {
            let place = halved.place[child as usize];
            let index = [0, 1, 2].map(|axis| parent.index[axis] << halved.bits[axis] | u32::from(place[axis]));
            let Some(window) = span.frame.window(split, &seen, level + 1, index, entry.window) else { continue };
            let voxel = Voxel { level: parent.level + 1, number: node.child(child), index };
            repeated += matrix.triangle_count(level + 1, voxel.number);
            let mut entry = Entry { window, ..*entry };
            entry.voxels[split] = voxel;
            self.memory.children.push(entry);
        }
        self.work.spend(node.occupied.count_ones());
        if repeated / MOST_REPEATED >= node.triangles {
            let mut whole = *entry;
            whole.whole[split] = true;
            self.memory.heap.push(whole);
        } else {
            self.memory.heap.extend(self.memory.children.drain(..));
        }
    }

    /// Searches the pairs of triangles of two voxels.
    fn compare(&mut self, span: &Span, entry: &Entry) {
        for which in 0..2 {
            self.gather(span, which, entry.voxels[which]);
        }
        for i in 0..self.memory.triangles[0].len() {
            for j in 0..self.memory.triangles[1].len() {
                let pair = [&self.memory.triangles[0][i], &self.memory.triangles[1][j]];
                let Some(window) = boxes_meet(pair, span.pad, entry.window) else { continue };
                let from = span.time(window.from);
                if from >= self.enough() {
                    self.contact_not_before(from);
                    continue;
                }
                let triangles = pair.map(|triangle| triangle.number);
                let apart = span.keeps_apart(pair, window, self.known_until());
                if !self.work.spend(PAIR_COST) || !apart && !self.search_pair(span, triangles, window) {
                    return self.give_up(span.time(entry.window.from));
                }
            }
        }
    }

    /// Whether there is work left after it.
    fn search_pair(&mut self, span: &Span, triangles: [u32; 2], window: Window) -> bool {
        let (from, until) = (span.time(window.from), span.time(window.until).min(self.known_until()));
        if from > until {
            return true;
        }
        let enough = self.enough();
        let pair = TrianglePair { bodies: self.bodies, triangles, tolerance: self.tolerance };
        let doubt = &mut self.doubt;
        let nearest = &mut self.nearest;
        let outcome = pair.search(from, until, enough, &mut self.work, |found| {
            if doubt.is_none_or(|known| found.lo < known.lo) {
                *nearest = triangles;
            }
            let joined = |known: Bracket| Bracket { lo: known.lo.min(found.lo), hi: known.hi.max(found.hi) };
            *doubt = Some(doubt.map_or(found, joined));
        });
        match outcome {
            Outcome::Passed => true,
            Outcome::Enough(lo) => {
                self.contact_not_before(lo);
                true
            }
            Outcome::GivenUp => false,
            Outcome::Contact(found) => {
                let hi = self.contact.map_or(found.hi, |known| known.hi.min(found.hi));
                self.contact = Some(Bracket { lo: found.lo.min(self.known_until()), hi });
                if self.doubt.is_none() {
                    self.nearest = triangles;
                }
                true
            }
        }
    }

    /// The triangles of a voxel, each once.
    fn gather(&mut self, span: &Span, which: usize, voxel: Voxel) {
        let (body, memory) = (self.bodies[which], &mut *self.memory);
        memory.numbers.clear();
        memory.numbers.extend_from_slice(body.object.matrix().triangles(usize::from(voxel.level), voxel.number));
        memory.numbers.sort_unstable();
        memory.numbers.dedup();
        let triangles = &mut memory.triangles[which];
        triangles.clear();
        triangles.extend(memory.numbers.iter().map(|&number| {
            let ends = [0, 1].map(|end| body.corners(number, &span.rows[end][which]));
            let [min, max] = [DVec3::min, DVec3::max].map(|of| ends.map(|[p, q, r]| of(of(p, q), r)));
            MovingTriangle { ends, min, max, number }
        }));
    }
}

/// The times within `window` at which the boxes of two triangles may meet. A box's side moves no farther out than the
/// line between its places at the ends. The pad has room for the rounding of the difference.
fn boxes_meet([p, q]: [&MovingTriangle; 2], pad: f64, mut window: Window) -> Option<Window> {
    for axis in 0..3 {
        let beyond =
            |p: &MovingTriangle, q: &MovingTriangle| [0, 1].map(|end| p.min[end][axis] - q.max[end][axis] - pad);
        for [start, end] in [beyond(p, q), beyond(q, p)] {
            if !window.leave_where_not_positive(start, end) {
                return None;
            }
        }
    }
    Some(window)
}
