//! The effect `distance`: the minimum distance of two placed objects, and their nearest points.
//!
//! The two pyramids are descended together, cell by cell (`cells.rs`): of a pair of cells the larger one is cut, and each of its parts
//! is bounded beside the other. Pairs that leave most room for something nearer come first, so that hardly more are cut than a
//! search would cut that knows the distance beforehand. What cannot be as near as the best pair of triangles so far is left out.
//! Pairs of triangles that have a common point are told by the exact test, so the value is 0 exactly when the bodies interfere.
//!
//! # Why the answer does not depend on the order M
//! Every bound is below the true distance, and every computed value at most [`Distance`]'s rounding away from it. A pair is left out
//! only when its bound exceeds the best value by more than that rounding (the margin): its own computed value would have been
//! larger. So at `relative_tolerance` 0 the result is the least pair of triangles, by (value, polygon of a, polygon of b), of all.

mod cell_bounds;
mod near_corners;
mod near_triangles;
mod numbers;
mod triangles;
mod waiting;

use glam::DVec3;

use crate::affine::{Rows, magnitude};
use crate::cell_boxes::CellBox;
use crate::cells::Cell;
use crate::effects::contacts::TrianglePair;
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::polygon_pairs::{Recent, WorldTriangle};
use crate::polygon_test;
use crate::submatrix::{Placed, Which};
use cell_bounds::{Afar, CellBounds, LANES, Lanes};
use near_triangles::{NearFrame, NearTriangles};
use triangles::{ERROR, Nearest};
use waiting::{Open, Waiting};

/// How far and how exactly a distance is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DistanceSettings {
    /// Larger distances are not wanted. World length; infinity: no limit.
    pub up_to: f64,
    /// The value may be larger than the minimum by this share of itself, 0 to 1. 0: as exact as f64 allows.
    pub relative_tolerance: f64,
}

impl Default for DistanceSettings {
    fn default() -> Self {
        DistanceSettings { up_to: f64::INFINITY, relative_tolerance: 0.0 }
    }
}

/// The minimum distance of two placed objects: of their surfaces at rounded world positions.
///
/// With S the sum of the sides of the world box that holds both transformed containers, `lower ≤ minimum` is proven,
/// `minimum ≤ value + 16·2^-53·S`, and `value − lower ≤ relative_tolerance·value + 66·2^-53·S`. A distance beyond the largest f64 is given as
/// the largest f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance of the nearest points found, world length. 0 exactly when the bodies interfere.
    pub value: f64,
    /// Proven: the bodies are not nearer, rounding included.
    pub lower: f64,
    /// Nearest point of the first body, world coordinates; where the bodies interfere, a common point, up to its rounding.
    pub on_a: [f64; 3],
    /// Nearest point of the second body, world coordinates.
    pub on_b: [f64; 3],
    /// Polygon of the first body with the nearest point; of equally near ones the pair of the smallest numbers.
    pub polygon_a: u32,
    /// Polygon of the second body with the nearest point.
    pub polygon_b: u32,
}

/// Memory of the search, kept from pair to pair. One per thread.
#[derive(Debug, Default)]
pub struct Memory {
    bounds: CellBounds,
    waiting: Waiting,
    triangles: [NearTriangles; 2],
    compared: Recent,
}

/// The minimum distance of two placed objects; `None` when it is proven to exceed `up_to`, or when an object is empty.
///
/// The transforms must leave every world vertex finite. The value is the same, to the bit, for any order M and whichever body is named
/// first, at `relative_tolerance` 0.
///
/// ```
/// use collided_kernel::{Object, PolygonMesh, affine::IDENTITY};
/// use collided_kernel::effects::distance::{DistanceSettings, Memory, distance};
/// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let triangle = Object::build(PolygonMesh::from_polygons(corners, [[0, 1, 2]]), None, &())?;
/// let mut above = IDENTITY;
/// above[2][3] = 0.5;
/// let found = distance((&triangle, &IDENTITY), (&triangle, &above), DistanceSettings::default(), &mut Memory::default());
/// assert_eq!(found.map(|found| found.value), Some(0.5));
/// # Ok::<(), collided_kernel::ObjectError>(())
/// ```
pub fn distance(
    a: (&Object, &Rows),
    b: (&Object, &Rows),
    settings: DistanceSettings,
    memory: &mut Memory,
) -> Option<Distance> {
    let containers = [a.0.container()?, b.0.container()?];
    let boxes = [GlobalBox::of(&containers[0], a.1), GlobalBox::of(&containers[1], b.1)];
    let mut search = Search::new(a, b, &boxes, settings, memory);
    if search.are_far(&boxes[0], &boxes[1]) {
        return None;
    }
    search.run();
    search.result()
}

/// The distance of two placed objects that interfere, from all pairs of triangles that do: what [`distance`] finds, without a search.
pub(crate) fn at_contact(
    a: (&Object, &Rows),
    b: (&Object, &Rows),
    interfering: impl Iterator<Item = TrianglePair>,
) -> Option<Distance> {
    let polygons = |pair: &TrianglePair| [a.0.polygon_of(pair.a as usize), b.0.polygon_of(pair.b as usize)];
    let first = interfering.min_by_key(|pair| (polygons(pair), [pair.a, pair.b]))?;
    let [p, q] = [WorldTriangle::new(first.a, a.0, a.1), WorldTriangle::new(first.b, b.0, b.1)];
    let Nearest { value, lower, on_p, on_q, .. } = triangles::common_point(&p.corners, &q.corners);
    let [polygon_a, polygon_b] = polygons(&first);
    Some(Distance { value, lower, on_a: on_p.to_array(), on_b: on_q.to_array(), polygon_a, polygon_b })
}

/// Pairs of triangles that are compared as they are: about what it costs to cut a cell.
const FEW: u64 = 24;

/// The distance of two triangles at world positions, 0 exactly when they interfere; within `16·2^-53` of the sum of the sides of their box.
pub(crate) fn of_triangles(p: &[DVec3; 3], q: &[DVec3; 3]) -> f64 {
    if polygon_test::triangles(p, q).is_some() { 0.0 } else { triangles::nearest(p, q).value }
}

/// A distance that two triangles at world positions, which do not interfere, exceed or have.
pub(crate) fn of_triangles_at_least(p: &[DVec3; 3], q: &[DVec3; 3]) -> f64 {
    let corners = || p.iter().chain(q).copied();
    let (min, max) = (corners().fold(p[0], DVec3::min), corners().fold(p[0], DVec3::max));
    let nearest = triangles::nearest(p, q);
    (nearest.lower.min(nearest.value) - 2.0 * ERROR * (max - min).element_sum()).max(0.0)
}

/// The parts of a cell that are near enough, the farthest first.
#[derive(Default)]
struct NearParts {
    /// Bound, number in the cut, number of the shape.
    parts: [(f32, u8, u32); 8],
    count: usize,
}

impl NearParts {
    #[inline(always)]
    fn add(&mut self, least: f32, part: u8, shape: u32) {
        let mut at = self.count;
        while at > 0 && self.parts[at - 1].0 < least {
            self.parts[at] = self.parts[at - 1];
            at -= 1;
        }
        self.parts[at] = (least, part, shape);
        self.count += 1;
    }
}

/// The nearest pair of triangles so far.
#[derive(Debug, Clone, Copy)]
struct Best {
    nearest: Nearest,
    polygons: [u32; 2],
    triangles: [u32; 2],
}

impl Best {
    /// Of equal values, that of the smallest numbers.
    fn key(&self) -> (f64, [u32; 2], [u32; 2]) {
        (self.nearest.value, self.polygons, self.triangles)
    }
}

/// One query.
struct Search<'s> {
    bodies: [(&'s Object, &'s Rows); 2],
    settings: DistanceSettings,
    /// The power of two that lengths are multiplied by before they are squared.
    scale: f64,
    /// The sum of the sides of the box of both, scaled.
    sides: f64,
    /// What rounding may change a value by, scaled.
    margin: f64,
    best: Option<Best>,
    frames: [NearFrame; 2],
    /// The least proof of a pair of triangles whose value could not be proven within the margin; infinite when there was none.
    weakest: f64,
    /// What is proven farther than this, scaled, is left out; the same squared for boxes in the frame, and the same for corners there, and
    /// for cells.
    limit: f64,
    near_limit: f32,
    corner_limit: f32,
    cell_limit: f32,
    memory: &'s mut Memory,
}

impl<'s> Search<'s> {
    fn new(
        a: (&'s Object, &'s Rows),
        b: (&'s Object, &'s Rows),
        boxes: &[GlobalBox; 2],
        settings: DistanceSettings,
        memory: &'s mut Memory,
    ) -> Search<'s> {
        let both = boxes[0].joined(&boxes[1]);
        let scale = scale_of(&both);
        let sides = if scale < 1.0 { both.max * scale - both.min * scale } else { (both.max - both.min) * scale };
        memory.bounds.start(placed(a), placed(b), scale);
        let frames = match memory.bounds.afar {
            Some(afar) => NearFrame::from_afar(afar, boxes[0].min, scale),
            None => [NearFrame::of_world(both.min, scale); 2],
        };
        memory.compared.forget();
        memory.triangles.iter_mut().zip([a, b]).for_each(|(triangles, (object, _))| triangles.start(object));
        let mut search = Search {
            bodies: [a, b],
            settings,
            scale,
            sides: sides.element_sum(),
            margin: sides.element_sum() * ERROR,
            best: None,
            frames,
            weakest: f64::INFINITY,
            limit: 0.0,
            near_limit: 0.0,
            corner_limit: 0.0,
            cell_limit: 0.0,
            memory,
        };
        search.set_limit();
        search
    }

    #[inline(always)]
    fn run(&mut self) {
        let cells = self.bodies.map(|(object, _)| Cell::container(object));
        let containers = Open { least: 0.0, cells, shapes: [0; 2], whole: [false; 2] };
        self.memory.waiting.start(containers);
        while let Some(open) = self.memory.waiting.next(self.cell_limit) {
            match self.split(&open) {
                None => self.compare(&open),
                Some(which) => self.expand(&open, which),
            }
        }
    }

    /// After the best value has changed.
    fn set_limit(&mut self) {
        /// More than the rounding to f32.
        const WIDEN: f64 = 4.0 * f32::EPSILON as f64;
        let DistanceSettings { up_to, relative_tolerance } = self.settings;
        let value = self.best.map(|best| best.nearest.value).filter(|&value| value <= up_to);
        let wanted = value.map_or(up_to, |value| value * (1.0 - relative_tolerance));
        self.limit = wanted * self.scale + self.margin;
        let CellBounds { noise, afar, .. } = self.memory.bounds;
        let near = self.limit + self.margin;
        // From afar a point may seem nearer than any is, by the noise.
        let (near, sides) = afar.map_or((near, self.sides), |Afar { from, reach, .. }| {
            ((near + noise - from).max(2.0 * noise), 4.0 * reach)
        });
        self.near_limit = NearFrame::square_of(near, sides);
        self.corner_limit = near_corners::limit_of(near, sides);
        let beyond = self.limit + noise - self.memory.bounds.from();
        self.cell_limit = (beyond + beyond.abs() * WIDEN) as f32 + f32::MIN_POSITIVE;
    }

    /// Which cell to cut; `None` when neither can be, or need be.
    #[inline(always)]
    fn split(&self, open: &Open) -> Option<Which> {
        let [a, b] = &open.cells;
        if u64::from(a.triangles) * u64::from(b.triangles) <= FEW {
            return None;
        }
        let is_whole =
            |which: Which| open.whole[which as usize] || self.memory.bounds.is_last(which, &open.cells[which as usize]);
        match (is_whole(Which::First), is_whole(Which::Second)) {
            (true, true) => None,
            (true, false) => Some(Which::Second),
            (false, true) => Some(Which::First),
            (false, false) => Some(self.memory.bounds.larger(&open.cells)),
        }
    }

    /// Opens the pairs of the cut cell's parts with the other cell, the nearest last.
    #[inline(always)]
    fn expand(&mut self, open: &Open, which: Which) {
        /// A cell is not cut when its parts, those that are near enough, hold so many times its triangles or more.
        const MOST_REPEATED: u32 = 4;
        let (object, other) = (self.bodies[which as usize].0, self.bodies[which.other() as usize].0);
        let (matrix, shapes) = (object.matrix(), object.shapes());
        let parent = &open.cells[which as usize];
        let cut = &matrix.lattice().cuts()[usize::from(parent.rank)];
        let Memory { bounds, waiting, .. } = &mut *self.memory;
        let beside = other.shapes().of(open.shapes[which.other() as usize]);
        let seen = bounds.parts(which, &open.cells, beside);
        let mut parts = matrix.parts(parent);
        let mut near = NearParts::default();
        let mut occupied = parts.occupied;
        let mut lanes = Lanes::default();
        while occupied != 0 {
            let (first, mut numbers, mut count) = (parts.next(), [0; LANES], 0);
            while occupied != 0 && count < LANES {
                let part = occupied.trailing_zeros() as usize;
                occupied &= occupied - 1;
                seen.put(&mut lanes, count, cut.centres[part], shapes.of(shapes.number(parent, parts.next())));
                numbers[count] = part as u8;
                count += 1;
                parts.pass();
            }
            let least = seen.bounds(&lanes);
            for lane in 0..count {
                // Kept where it is NaN.
                if least[lane] > self.cell_limit {
                    continue;
                }
                near.add(least[lane], numbers[lane], first + lane as u32);
            }
        }
        let near = &near.parts[..near.count];
        if parent.rank % 2 == 1 {
            let level = usize::from(parent.rank / 2) + 1;
            let repeated: u32 = near.iter().map(|&(.., number)| matrix.triangle_count(level, number)).sum();
            if repeated / MOST_REPEATED >= parent.triangles {
                let mut whole = *open;
                whole.whole[which as usize] = true;
                waiting.add(whole, self.cell_limit);
                return;
            }
        }
        for &(least, part, number) in near {
            parts.go_to(number);
            let mut next = Open { least, ..*open };
            next.cells[which as usize] = matrix.part(parent, &parts, cut, usize::from(part), CellBox::WHOLE);
            next.shapes[which as usize] = shapes.number(parent, number);
            waiting.add(next, self.cell_limit);
        }
    }

    /// Compares the triangles of two cells.
    #[inline(always)]
    fn compare(&mut self, open: &Open) {
        let [a, b] = &mut self.memory.triangles;
        let first = a.look_at(&open.cells[0], self.bodies[0], &self.frames[0]);
        let second = b.look_at(&open.cells[1], self.bodies[1], &self.frames[1]);
        if first.gap(&second) > self.near_limit {
            return;
        }
        b.keep(&first, self.near_limit);
        for i in 0..a.kept().len() {
            let (bounds, p) = self.memory.triangles[0].kept()[i];
            if bounds.gap(&second) > self.near_limit {
                continue;
            }
            for j in 0..self.memory.triangles[1].kept().len() {
                let (other, q) = self.memory.triangles[1].kept()[j];
                if bounds.gap(&other) <= self.near_limit {
                    self.compare_triangles(p, q);
                }
            }
        }
    }

    /// Compares the triangles at these places.
    #[inline(always)]
    fn compare_triangles(&mut self, p: u32, q: u32) {
        let ((p, corners), (q, others)) = (self.memory.triangles[0].at(p), self.memory.triangles[1].at(q));
        if !self.memory.compared.is_new(p.number, q.number) {
            return;
        }
        let interfering = self.best.is_some_and(|best| best.nearest.value == 0.0);
        if let Some(best) = &self.best
            && !interfering
            && (self.apart(best, p, q) || corners.are_apart(others, self.corner_limit))
        {
            return;
        }
        let numbers = [p.number, q.number];
        let polygons = [0, 1].map(|body: usize| self.bodies[body].0.polygon_of(numbers[body] as usize));
        if interfering && self.best.is_some_and(|best| (polygons, numbers) >= (best.polygons, best.triangles)) {
            return;
        }
        let interferes = p.bounds.overlaps(&q.bounds) && polygon_test::triangles(&p.corners, &q.corners).is_some();
        let nearest = match (interferes, interfering) {
            (true, _) => triangles::common_point(&p.corners, &q.corners),
            (false, true) => return,
            (false, false) => triangles::nearest(&p.corners, &q.corners),
        };
        self.offer(nearest, polygons, numbers);
    }

    /// Whether the plane between the best points so far proves the triangles too far apart.
    #[inline(always)]
    fn apart(&self, best: &Best, p: &WorldTriangle, q: &WorldTriangle) -> bool {
        let at = |corner: &DVec3| best.nearest.direction.dot(*corner - best.nearest.on_p);
        let (p, q) = (p.corners.each_ref().map(at), q.corners.each_ref().map(at));
        let gap = q[0].min(q[1]).min(q[2]) - p[0].max(p[1]).max(p[2]);
        // The margin is more than the rounding of this. False for NaN.
        gap * self.scale > self.limit + self.margin
    }

    fn offer(&mut self, nearest: Nearest, polygons: [u32; 2], triangles: [u32; 2]) {
        if nearest.lower + self.rounding() < nearest.value {
            self.weakest = self.weakest.min(nearest.lower);
        }
        let offered = Best { nearest, polygons, triangles };
        if self.best.is_none_or(|best| offered.key() < best.key()) {
            self.best = Some(offered);
            if nearest.value > 0.0 && self.memory.bounds.afar.is_none() {
                self.frames.iter_mut().for_each(|frame| frame.follow(nearest.direction, nearest.on_p));
            }
            self.set_limit();
        }
    }

    fn result(&self) -> Option<Distance> {
        let Best { nearest, polygons: [polygon_a, polygon_b], .. } = self.best?;
        let proven = nearest.value * (1.0 - self.settings.relative_tolerance) - self.rounding();
        let lower = proven.min(self.weakest).max(0.0);
        let (on_a, on_b) = (nearest.on_p.to_array(), nearest.on_q.to_array());
        let farther = nearest.value > self.settings.up_to && nearest.value - self.rounding() > self.settings.up_to;
        (!farther).then_some(Distance { value: nearest.value, lower, on_a, on_b, polygon_a, polygon_b })
    }

    /// The margin in world length, and what is lost below the smallest number.
    fn rounding(&self) -> f64 {
        /// 2^-1072.
        const SMALLEST: f64 = f64::from_bits(4);
        self.margin / self.scale + SMALLEST
    }

    /// Whether the boxes of the bodies are proven farther apart than is wanted.
    fn are_far(&self, a: &GlobalBox, b: &GlobalBox) -> bool {
        let gap = (b.min - a.max).max(a.min - b.max).max(DVec3::ZERO);
        let near = self.limit + self.margin;
        (gap * self.scale).length_squared() > near * near * (1.0 + 16.0 * f64::EPSILON)
    }
}

fn placed<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    let reach = object.matrix().lattice().container().reach();
    Placed { object, rows, magnitude: magnitude(rows, reach) }
}

/// The power of two that makes the longest side of the box 2 to 4 long: its squares fit into f32 too.
fn scale_of(both: &GlobalBox) -> f64 {
    let longest = (0.5 * both.max - 0.5 * both.min).max_element();
    let exponent = (longest.to_bits() >> 52) as i32 - 1023;
    f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52)
}
