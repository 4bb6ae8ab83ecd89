//! The separating axes over a span of time: when two cells of moving bodies may meet.
//!
//! Over a span every point moves on the straight line between its places at the ends, but for a known stray. Along a fixed axis
//! the distance between the centres of two cells is then linear in time, and half the extent of each is convex, so at most the
//! line between its values at the ends: an axis leaves the cells an interval of time, two linear inequalities, and what all axes
//! leave is the window in which they may meet. The axes are those of the middle of the span. World boxes do the same for
//! triangles.
//!
//! # Why nothing is lost
//! As written in [`submatrix`](crate::submatrix), at both ends of the span, with the magnitudes of the whole motion; what points
//! stray from their lines is the clearance. Two linear functions are compared at both ends, and so in between: whatever rounding
//! adds at an end is covered by the slack there, and the line between two such values is covered too.
//!
//! In f32, roundings of u = 2^-24. Everything along an axis is divided by what the containers reach along it, at the end where
//! that is more; X is the sum of the distances of the middles at both ends, so. The place of a part's box is the sum of X's share,
//! six products of at most 1 together and the sums with the box beside, with the part and with the box within it: less than
//! 11u·X + 41u in all. [`ROUNDING`] is 64u·(1 + X). Reaches are widened as in a frame at rest. The root of a
//! linear function passes three roundings, and is moved by twice that, outwards.
//!
//! World boxes are measured as those of a pair at rest, by what reaches to the farthest point at either end, and widened: what is
//! measured along another direction of length 1, or between the ends, passes less than sixteen roundings more.

use glam::{DVec3, Vec4};

use super::containers::{Along, Containers};
use super::lanes::{LANES, Lanes};
use super::side::{GrainShare, Side};
use super::world_boxes::BOX_ROUNDING;
use super::{Placed, Which, columns, directions};
use crate::affine::Rows;
use crate::cell_boxes::CellBox;
use crate::cells::{Cell, Cut, MAX_RANKS};
use crate::container::MAX_ORDER;

/// 2^-18.
const ROUNDING: f64 = 1.0 / (1 << 18) as f64;

/// 2^-10.
const SHORTEST: f32 = 1.0 / 1024.0;

/// A window of time, in the time of a span: 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    pub from: f32,
    pub until: f32,
}

impl Window {
    pub const WHOLE: Window = Window { from: 0.0, until: 1.0 };

    /// Leaves what is not before `entry`, and not in the last `exit`; `None` when that is nothing.
    #[inline(always)]
    fn left(&self, entry: Vec4, exit: Vec4) -> Option<Window> {
        const INWARD: f32 = 1.0 - 4.0 * f32::EPSILON;
        let from = self.from.max(entry.max_element() * INWARD);
        let until = self.until.min(1.0 - exit.max_element() * INWARD + f32::EPSILON);
        (from <= until).then_some(Window { from, until })
    }

    /// A window within this one.
    #[inline(always)]
    pub fn within(&self, window: &Window) -> Window {
        let time = |at: f32| self.from + (self.until - self.from) * at;
        let (from, until) = (time(window.from).next_down(), time(window.until).next_up());
        Window { from: from.max(self.from), until: until.min(self.until) }
    }
}

/// Linear functions of time by their values at both ends, four registers or one at a time: when they are positive.
#[derive(Clone, Copy)]
struct Positive {
    /// Until then some function is positive.
    entry: Vec4,
    /// So long before the end some function is.
    exit: Vec4,
}

impl Positive {
    const NEVER: Positive = Positive { entry: Vec4::ZERO, exit: Vec4::ZERO };

    /// Takes in two functions a lane, of which at most one is positive at an end, and none at both.
    #[inline(always)]
    fn add(&mut self, ends: &[[Vec4; 2]; 2]) {
        let zero = Vec4::ZERO;
        // Whichever is positive at one end, and its value at the other.
        let root = |[above, below]: [Vec4; 2], [other_above, other_below]: [Vec4; 2]| {
            let here = above.max(below);
            let there = Vec4::select(above.cmpgt(below), other_above, other_below);
            Vec4::select(here.cmpgt(zero), here / (here - there), zero)
        };
        self.entry = self.entry.max(root(ends[0], ends[1]));
        self.exit = self.exit.max(root(ends[1], ends[0]));
    }

    /// The lanes in which one of two functions is positive at both ends, a bit each. NaN is not positive.
    #[inline(always)]
    fn throughout([[above, below], [last_above, last_below]]: &[[Vec4; 2]; 2]) -> u32 {
        let zero = Vec4::ZERO;
        (above.cmpgt(zero) & last_above.cmpgt(zero) | below.cmpgt(zero) & last_below.cmpgt(zero)).bitmask()
    }
}

/// Two bodies along the axes in f64, at both ends of a span.
pub(crate) struct MovingContainers<'o> {
    ends: [Containers<'o>; 2],
    along: [Along; 2],
}

impl<'o> MovingContainers<'o> {
    /// The bodies at both ends of the span; their rows in the middle of it choose the axes. `clearance`: what points of both bodies
    /// may stray from their lines, together.
    pub fn new(ends: [[Placed<'o>; 2]; 2], middle: [&Rows; 2], clearance: f64) -> MovingContainers<'o> {
        let axes = directions(&columns(middle[0]), &columns(middle[1]));
        let ends = ends.map(|[a, b]| Containers::new(clearance, a, b));
        let along = ends.each_ref().map(|end| end.along_axes(&axes));
        MovingContainers { ends, along }
    }

    /// The times of the span at which the containers may meet.
    pub fn window(&self) -> Option<[f64; 2]> {
        const INWARD: f64 = 1.0 - 4.0 * f64::EPSILON;
        let [start, end] = &self.along;
        let (mut from, mut until) = (0.0f64, 1.0f64);
        for lane in 0..LANES {
            for sign in [1.0, -1.0] {
                let first = sign * start.offset[lane] - start.reach[lane];
                let last = sign * end.offset[lane] - end.reach[lane];
                if first > 0.0 && last > 0.0 {
                    return None;
                } else if first > 0.0 {
                    from = from.max(first / (first - last) * INWARD);
                } else if last > 0.0 {
                    until = until.min(1.0 - last / (last - first) * INWARD + f64::EPSILON);
                }
            }
        }
        (from <= until).then_some([from, until])
    }
}

/// Two moving bodies over a span of time, ready for comparing their cells. Used for one span after the other.
#[derive(Debug, Default)]
pub(crate) struct MovingFrame {
    /// Per end and body.
    sides: [[Side; 2]; 2],
    /// Per end: from the middle of the second container to that of the first.
    offset: [Lanes; 2],
    slack: Lanes,
    /// Bodies that do not turn are the same along the axes at both ends.
    turns: [bool; 2],
    /// Per body and rank: the longest side of a cell in the world, roughly; decides which cell is cut.
    size: [[f64; MAX_RANKS]; 2],
    /// Per body: the rank at which the descent ends.
    depth: [usize; 2],
    boxes: Boxes,
}

/// How world boxes are measured: from a point, by what reaches from there to the farthest point on the way.
#[derive(Debug, Clone, Copy, Default)]
struct Boxes {
    origin: DVec3,
    unit: f64,
    /// What rounding may move a box by, and points from their lines; along each axis, and along any direction.
    slack: Vec4,
}

/// The parts of a cell as the separating axes see them from the box within the other cell, at both ends.
pub(crate) struct MovingParts<'f> {
    sides: [&'f Side; 2],
    split: Which,
    turns: bool,
    rank: u8,
    centres: [&'f [Lanes; 8]; 2],
    base: [Lanes; 2],
    /// How far apart the centres of a part and of that box may be.
    reach: [Lanes; 2],
    /// The same for a part that is a point.
    beside: [Lanes; 2],
}

impl MovingParts<'_> {
    /// Where a part is; `None` when some axis proves it apart from the other box throughout.
    #[inline(always)]
    pub fn part(&self, part: usize) -> Option<[Lanes; 2]> {
        let at = [0, 1].map(|end| self.base[end].plus(&self.centres[end][part]));
        (!Lanes::are_beyond_at_both(&at, &self.reach)).then_some(at)
    }

    /// The times in `window` at which the box within a part may meet the other one.
    #[inline(always)]
    pub fn window(&self, at: &[Lanes; 2], bounds: &CellBox, window: &Window) -> Option<Window> {
        let share = GrainShare::of(self.split, bounds);
        let mut positive = Positive::NEVER;
        let mut throughout = 0;
        let first = self.sides[0].bounds_of(self.rank, &share);
        let last = if self.turns { self.sides[1].bounds_of(self.rank, &share) } else { first };
        for register in 0..LANES / 4 {
            let apart = [(0, &first), (1, &last)].map(|(end, bounds)| {
                let reach = bounds.reach.register(register) + self.beside[end].register(register);
                let place = at[end].register(register) + bounds.centre.register(register);
                [place - reach, -place - reach]
            });
            throughout |= Positive::throughout(&apart);
            positive.add(&apart);
        }
        if throughout == 0 { window.left(positive.entry, positive.exit) } else { None }
    }
}

impl MovingFrame {
    /// Makes ready for the span that the containers were looked at over.
    pub fn start(&mut self, containers: &MovingContainers<'_>) {
        let [first, last] = &containers.along;
        let scale: [f64; LANES] = std::array::from_fn(|lane| 1.0 / first.reach[lane].max(last.reach[lane]));
        let scaled = |values: &[f64; LANES]| -> [f64; LANES] { std::array::from_fn(|lane| values[lane] * scale[lane]) };
        self.depth = [0; 2];
        self.size = [[0.0; MAX_RANKS]; 2];
        for (end, along) in containers.along.iter().enumerate() {
            self.offset[end] = Lanes::rounded(&scaled(&along.offset));
            for (body, side) in self.sides[end].iter_mut().enumerate() {
                side.edges = along.edges[body].each_ref().map(|edge| Lanes::rounded(&scaled(edge)));
                let at = &containers.ends[end];
                let object = at.placed[body].object;
                side.start(object, &at.columns[body], &at.halves[body]);
                let last = object.matrix().lattice().cuts().len();
                self.depth[body] = self.depth[body].max(side.depth(last, at.noise()));
                self.size[body].iter_mut().zip(&side.size).for_each(|(size, at_end)| *size = size.max(*at_end));
            }
        }
        // NaN and infinity of either end stay.
        self.slack = Lanes::rounded(&std::array::from_fn(|lane| {
            let distance = (first.offset[lane].abs() + last.offset[lane].abs()) * scale[lane];
            (first.slack[lane] + last.slack[lane]) * scale[lane] + ROUNDING * (1.0 + distance)
        }));
        let [start, end] = &containers.ends;
        self.turns = [0, 1].map(|body| start.columns[body] != end.columns[body]);
        self.place_boxes(containers);
    }

    fn place_boxes(&mut self, containers: &MovingContainers<'_>) {
        let ends = &containers.ends;
        let origin = ends[0].world_middle(0);
        let reach = ends.iter().fold(DVec3::ZERO, |reach, end| reach.max(end.world_reach(origin))).max_element();
        let Some(unit) = ends[0].box_unit(reach) else {
            self.boxes = Boxes { slack: Vec4::INFINITY, ..Boxes::default() };
            self.sides.as_flattened_mut().iter_mut().for_each(Side::place_nowhere);
            return;
        };
        for (end, sides) in ends.iter().zip(&mut self.sides) {
            for (body, side) in sides.iter_mut().enumerate() {
                side.place(end.world_middle(body) - origin, &end.world_edges(body), unit);
            }
        }
        // Of two boxes that are compared, each has half of what points may stray.
        let stray = (0.5 * ends[0].clearance * unit) as f32 * (1.0 + BOX_ROUNDING);
        let slack = ends[0].box_rounding(unit) + BOX_ROUNDING + stray;
        // Along any direction of length 1.
        let along = slack.truncate().length() * (1.0 + BOX_ROUNDING);
        self.boxes = Boxes { origin, unit, slack: slack.truncate().extend(along) };
    }

    /// Whether the descent ends at this cell of `which`.
    #[inline(always)]
    pub fn is_last(&self, which: Which, cell: &Cell) -> bool {
        usize::from(cell.rank) >= self.depth[which as usize]
    }

    /// Which of two cells is larger in the world.
    #[inline(always)]
    pub fn larger(&self, [a, b]: &[Cell; 2]) -> Which {
        let size = |which: usize, cell: &Cell| self.size[which][cell.rank as usize];
        if size(0, a) >= size(1, b) { Which::First } else { Which::Second }
    }

    /// The parts of the cell of `split`, which are of `part_rank`, as seen from the box within the other cell.
    #[inline(always)]
    pub fn parts(&mut self, split: Which, part_rank: u8, cut: &Cut, cells: &[Cell; 2]) -> MovingParts<'_> {
        let (own, other) = (split as usize, split.other() as usize);
        let rank = cells[own].rank;
        for sides in &mut self.sides {
            if sides[own].known >> rank & 1 == 0 {
                sides[own].learn(split, rank, cut);
            }
        }
        let mut parts = MovingParts {
            sides: self.sides.each_ref().map(|sides| &sides[own]),
            split,
            turns: self.turns[own],
            rank: part_rank,
            centres: self.sides.each_ref().map(|sides| &sides[own].parts[rank as usize]),
            base: self.offset,
            reach: [Lanes::default(); 2],
            beside: [Lanes::default(); 2],
        };
        for end in 0..2 {
            let [a, b] = &self.sides[end];
            let beside = self.sides[end][other].bounds(split.other(), cells[other].rank, &cells[other].bounds);
            let between = parts.base[end].plus(&a.centre(&cells[0])).minus(&b.centre(&cells[1]));
            parts.base[end] = between.plus(&beside.centre);
            parts.beside[end] = beside.reach.plus(&self.slack);
            parts.reach[end] = self.sides[end][own].reach[part_rank as usize].plus(&parts.beside[end]);
        }
        parts
    }

    /// The world box around the box within a cell, and what points of its polygons may stray.
    #[inline(always)]
    pub fn cell_box(&self, which: Which, cell: &Cell) -> MovingBox {
        let boxes = [0, 1].map(|end| self.sides[end][which as usize].world_box(cell));
        MovingBox {
            min: boxes.map(|(centre, half)| centre - half - self.boxes.slack),
            max: boxes.map(|(centre, half)| centre + half + self.boxes.slack),
        }
    }

    /// Adds a direction, of length 1 or less, to the box of these corners over a window.
    #[inline(always)]
    pub fn add_direction(&self, bounds: &mut MovingBox, corners: &[[DVec3; 3]; 2], direction: DVec3, window: &Window) {
        let along = |end: usize| {
            let [p, q, r] = corners[end].map(|at| (at - self.boxes.origin).dot(direction) * self.boxes.unit);
            [p.min(q).min(r) as f32 - self.boxes.slack.w, p.max(q).max(r) as f32 + self.boxes.slack.w]
        };
        let ([min, max], [last_min, last_max]) = (along(0), along(1));
        for (end, t) in [window.from, window.until].into_iter().enumerate() {
            bounds.min[end].w = min + (last_min - min) * t;
            bounds.max[end].w = max + (last_max - max) * t;
        }
    }

    /// The world box of corners at both ends.
    #[inline(always)]
    pub fn box_of(&self, corners: &[[DVec3; 3]; 2]) -> MovingBox {
        let measured = |at: DVec3| ((at - self.boxes.origin) * self.boxes.unit).as_vec3().extend(0.0);
        let [first, last] = corners.map(|corners| corners.map(measured));
        MovingBox {
            min: [first, last].map(|[p, q, r]| p.min(q).min(r) - self.boxes.slack),
            max: [first, last].map(|[p, q, r]| p.max(q).max(r) + self.boxes.slack),
        }
    }
}

impl Side {
    /// The centre of a cell, seen from that of the container.
    #[inline(always)]
    fn centre(&self, cell: &Cell) -> Lanes {
        /// 2^-30.
        const UNIT: f32 = 1.0 / (1 << MAX_ORDER) as f32;
        let [x, y, z] = [0, 1, 2].map(|axis| self.edges[axis].times(cell.centre[axis] as f32 * UNIT));
        x.plus(&y).plus(&z)
    }
}

/// A box at both ends of a span. What it holds is, on the way, between the lines from its sides at the start to those at the end.
/// A fourth extent, along any direction, is none unless it is [added](MovingFrame::add_direction) to all boxes that are compared.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MovingBox {
    min: [Vec4; 2],
    max: [Vec4; 2],
}

impl MovingBox {
    pub const EMPTY: MovingBox = MovingBox { min: [Vec4::INFINITY; 2], max: [Vec4::NEG_INFINITY; 2] };

    /// The box around both.
    #[inline(always)]
    pub fn joined(&self, other: &MovingBox) -> MovingBox {
        MovingBox {
            min: [0, 1].map(|end| self.min[end].min(other.min[end])),
            max: [0, 1].map(|end| self.max[end].max(other.max[end])),
        }
    }

    /// How far they are apart along each axis, in one direction or the other, at both ends.
    #[inline(always)]
    fn gaps(&self, other: &MovingBox) -> [[Vec4; 2]; 2] {
        [0, 1].map(|end| [self.min[end] - other.max[end], other.min[end] - self.max[end]])
    }

    /// Whether some axis keeps two boxes apart.
    #[inline(always)]
    pub fn is_apart_from(&self, other: &MovingBox) -> bool {
        Positive::throughout(&self.gaps(other)) != 0
    }

    /// The times in `window` at which two boxes may meet.
    #[inline(always)]
    pub fn meet(&self, other: &MovingBox, window: &Window) -> Option<Window> {
        let gaps = self.gaps(other);
        if Positive::throughout(&gaps) != 0 {
            return None;
        }
        let mut positive = Positive::NEVER;
        positive.add(&gaps);
        window.left(positive.entry, positive.exit)
    }

    /// The box at the ends of a window instead.
    #[inline(always)]
    pub fn over(&self, window: &Window) -> MovingBox {
        let between = |[first, last]: [Vec4; 2]| [window.from, window.until].map(|t| first + (last - first) * t);
        MovingBox { min: between(self.min), max: between(self.max) }
    }

    /// The share of the span in which two boxes move by about as much, one against the other, as the smaller of them is long.
    pub fn passing_time(&self, other: &MovingBox) -> f32 {
        let length = |bounds: &MovingBox| (bounds.max[0] - bounds.min[0]).truncate().max_element();
        let way = |bounds: &MovingBox| (bounds.min[1] + bounds.max[1] - bounds.min[0] - bounds.max[0]).truncate();
        let way = 0.5 * (way(self) - way(other)).abs().max_element();
        let share = length(self).min(length(other)) / way;
        // The whole span, too, where nothing moves or nothing is known: NaN.
        if share < 1.0 { share.max(SHORTEST) } else { 1.0 }
    }

    /// A box that holds what both hold: each side is that of one of them, the inner one where it is so at both ends.
    #[inline(always)]
    pub fn within(&self, other: &MovingBox) -> MovingBox {
        let later = self.min[0].cmplt(other.min[0]) & self.min[1].cmplt(other.min[1]);
        let sooner = self.max[0].cmpgt(other.max[0]) & self.max[1].cmpgt(other.max[1]);
        MovingBox {
            min: [0, 1].map(|end| Vec4::select(later, other.min[end], self.min[end])),
            max: [0, 1].map(|end| Vec4::select(sooner, other.max[end], self.max[end])),
        }
    }
}
