//! The descent through two pyramids of voxels, in the order of time.

use glam::DVec3;

use super::body::MovingBody;
use super::chords::Chords;
use super::moving_triangles::{Carrier, MovingTriangles, candidates};
use super::queue::Queue;
use super::span::Span;
use super::triangle_pair::{Bracket, Outcome, RESOLUTION, TrianglePair, Work as WorkLeft};
use crate::cells::Cell;
use crate::instructions::{Work, dispatch};
use crate::polygon_pairs::Recent;
use crate::submatrix::{MovingFrame, Which, Window};

/// Pairs of triangles that are compared as they are, rather than cutting a cell.
const FEW: u64 = 4;

/// A cell is not cut when its parts hold so many times its triangles or more.
const MOST_REPEATED: u32 = 4;

/// The triangles of two cells are compared over so much of a span at a time: most of what is later need not be looked at.
const SLICE: f32 = 0.5;

/// Work units of comparing two triangles.
const PAIR_COST: u32 = 16;

/// Work units of looking at a span.
const SPAN_COST: u32 = 64;

/// Memory of the effect, kept from call to call.
#[derive(Debug, Default)]
pub struct Memory {
    frame: MovingFrame,
    queue: Queue<Open>,
    parts: Vec<(Window, Cell)>,
    triangles: [MovingTriangles; 2],
    /// Pairs of triangles that have been searched to the end of the span.
    searched: Recent,
}

/// What may hold the first contact.
#[derive(Debug, Clone, Copy)]
enum Open {
    /// Two cells; `whole` are those that are not worth cutting.
    Cells {
        cells: [Cell; 2],
        whole: [bool; 2],
    },
    Triangles([u32; 2]),
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
    work: WorkLeft,
}

/// [`Search::expand`], for the instructions of the processor.
struct Expand<'e, 'm> {
    search: &'e mut Search<'m>,
    cells: [Cell; 2],
    whole: [bool; 2],
    split: Which,
    window: Window,
    memory: &'e mut Memory,
}

impl Work for Expand<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.search.expand(self.cells, self.whole, self.split, self.window, self.memory);
    }
}

impl<'m> Search<'m> {
    pub fn new(bodies: [&'m MovingBody<'m>; 2], tolerance: f64, work: WorkLeft) -> Search<'m> {
        Search { bodies, contact: None, nearest: [0; 2], doubt: None, given_up: None, tolerance, work }
    }

    pub fn run(&mut self, memory: &mut Memory) {
        self.between(0.0, 1.0, memory);
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

    fn between(&mut self, start: f64, end: f64, memory: &mut Memory) {
        if start >= self.known_until() || self.given_up.is_some() {
            return;
        }
        if !self.work.spend(SPAN_COST) {
            return self.give_up(start);
        }
        let span = Span::new(self.bodies, start, end);
        let containers = span.containers(self.bodies);
        let Some(window) = containers.window() else { return };
        let [from, until] = span.times(window);
        let middle = 0.5 * (from + until);
        let is_straight = self.bodies.iter().all(|body| body.is_nearly_straight(until - from));
        if !is_straight && from < middle && middle < until {
            self.between(from, middle, memory);
            return self.between(middle, until, memory);
        }
        if until - from < 0.5 * (end - start) && until - from > RESOLUTION {
            return self.between(from, until, memory);
        }
        memory.frame.start(&containers);
        let window = Window { from: (window[0] as f32).next_down().max(0.0), until: (window[1] as f32).next_up() };
        self.descend(&span, window, memory);
    }

    fn descend(&mut self, span: &Span, window: Window, memory: &mut Memory) {
        memory.triangles.iter_mut().for_each(MovingTriangles::start);
        memory.searched.forget();
        memory.queue.clear();
        let cells = self.bodies.map(|body| Cell::container(body.object));
        memory.queue.push(window, Open::Cells { cells, whole: [false; 2] });
        while let Some((window, open)) = memory.queue.pop() {
            let from = span.time(window.from.into());
            if from >= self.known_until() {
                return;
            }
            if from >= self.enough() {
                return self.contact_not_before(from);
            }
            if self.work.0 == 0 {
                return self.give_up(from);
            }
            match open {
                Open::Triangles(triangles) => self.compare(span, triangles, window, memory),
                Open::Cells { cells, whole } => match self.split(&cells, whole, &memory.frame) {
                    Some(split) => dispatch(Expand { search: self, cells, whole, split, window, memory }),
                    None => self.gather(span, &cells, window, memory),
                },
            }
        }
    }

    /// Which cell to cut; `None` when neither can be, or need be.
    fn split(&self, cells: &[Cell; 2], whole: [bool; 2], frame: &MovingFrame) -> Option<Which> {
        let [a, b] = cells;
        if u64::from(a.triangles) * u64::from(b.triangles) <= FEW {
            return None;
        }
        let last = |which: Which| whole[which as usize] || frame.is_last(which, &cells[which as usize]);
        match (last(Which::First), last(Which::Second)) {
            (true, true) => None,
            (true, false) => Some(Which::Second),
            (false, true) => Some(Which::First),
            (false, false) => Some(frame.larger(cells)),
        }
    }

    /// Opens the pairs of the cut cell's parts with the other cell.
    #[inline(always)]
    fn expand(&mut self, cells: [Cell; 2], mut whole: [bool; 2], split: Which, window: Window, memory: &mut Memory) {
        let parent = cells[split as usize];
        let matrix = self.bodies[split as usize].object.matrix();
        let cut = &matrix.lattice().cuts()[parent.rank as usize];
        let mut parts = matrix.parts(&parent);
        let along = memory.frame.parts(split, parts.rank, cut, &cells);
        let (mut repeated, mut occupied) = (0, parts.occupied);
        memory.parts.clear();
        while occupied != 0 {
            let part = occupied.trailing_zeros() as usize;
            occupied &= occupied - 1;
            if let Some(at) = along.part(part) {
                let bounds = matrix.bounds_of_part(&parent, &parts);
                if let Some(window) = along.window(&at, &bounds, &window) {
                    let cell = matrix.part(&parent, &parts, cut, part, bounds);
                    repeated += cell.triangles;
                    memory.parts.push((window, cell));
                }
            }
            parts.pass();
        }
        self.work.spend(parts.occupied.count_ones());
        if parent.rank % 2 == 1 && repeated / MOST_REPEATED >= parent.triangles {
            whole[split as usize] = true;
            return memory.queue.push(window, Open::Cells { cells, whole });
        }
        for &(window, cell) in &memory.parts {
            let mut cells = cells;
            cells[split as usize] = cell;
            memory.queue.push(window, Open::Cells { cells, whole });
        }
    }

    /// Opens the pairs of triangles of two cells.
    fn gather(&mut self, span: &Span, cells: &[Cell; 2], window: Window, memory: &mut Memory) {
        let boxes = [Which::First, Which::Second].map(|which| memory.frame.cell_box(which, &cells[which as usize]));
        let passing = boxes[0].passing_time(&boxes[1]);
        let slice = Window { until: window.until.min(window.from + SLICE * passing), ..window };
        if slice.until < window.until {
            memory.queue.push(Window { from: slice.until, ..window }, Open::Cells { cells: *cells, whole: [true; 2] });
        }
        let known_until = self.known_until();
        let (frame, queue) = (&memory.frame, &mut memory.queue);
        let carrier = |which: Which| Carrier { body: self.bodies[which as usize], which, span, frame };
        let carriers = [carrier(Which::First), carrier(Which::Second)];
        let compared = candidates(&mut memory.triangles, cells, &boxes, &slice, &carriers, |triangles, window| {
            if span.time(window.from.into()) < known_until {
                queue.push(window, Open::Triangles(triangles));
            }
        });
        self.work.spend(u32::try_from(compared).unwrap_or(u32::MAX));
    }

    /// Proves a pair of triangles apart over a window, or searches it.
    fn compare(&mut self, span: &Span, triangles: [u32; 2], window: Window, memory: &mut Memory) {
        let frame = &memory.frame;
        let carrier = |which: Which| Carrier { body: self.bodies[which as usize], which, span, frame };
        let [a, b] = &mut memory.triangles;
        let ends = [a.ends(triangles[0], &carrier(Which::First)), b.ends(triangles[1], &carrier(Which::Second))];
        let apart = keeps_apart(span, ends, window, self.known_until());
        let from = span.time(window.from.into());
        if !self.work.spend(PAIR_COST) {
            return self.give_up(from);
        }
        // Windows come in the order of their starts: what has been searched from an earlier one on is done with.
        let is_done = apart || !memory.searched.is_new(triangles[0], triangles[1]);
        if !is_done && !self.search_pair(from, span.end, triangles) {
            self.give_up(from);
        }
    }

    /// Searches a pair of triangles to the end of the span; whether there is work left after it.
    fn search_pair(&mut self, from: f64, end: f64, triangles: [u32; 2]) -> bool {
        let until = end.min(self.known_until());
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
}

/// Whether one axis proves two triangles apart over a window, or up to a time in it.
fn keeps_apart(span: &Span, [a, b]: [&[[DVec3; 3]; 2]; 2], window: Window, known_until: f64) -> bool {
    // Rounded up: the proof covers a little more.
    let known_until = (known_until - span.start) / (span.end - span.start) + 2.0 * f64::EPSILON;
    let (from, until) = (f64::from(window.from), f64::from(window.until).min(known_until));
    let apart = Chords::new(a, b, span.stray).separated_longest(from, until);
    until < from || apart.is_some_and(|apart| apart.until >= until)
}
