//! The effect `distance`: the minimum distance of two placed objects, and their nearest points.
//!
//! The two pyramids are descended together, depth first, the pair of voxels with the smallest bound first; what cannot be as near as the best
//! pair of triangles so far is left out. Pairs of triangles that have a common point are told by the exact test, so the value is
//! 0 exactly when the bodies interfere.
//!
//! # Why the answer does not depend on the order M
//! Every bound is below the true distance, and every computed value at most [`Distance`]'s rounding away from it. A pair is left out
//! only when its bound exceeds the best value by more than that rounding (the margin): its own computed value would have been
//! larger. So at `relative_tolerance` 0 the result is the least pair of triangles, by (value, polygon of a, polygon of b), of all.

mod numbers;
mod patches;
mod triangles;
mod voxel_bounds;

use glam::DVec3;

use crate::affine::{Rows, magnitude};
use crate::global_boxes::GlobalBox;
use crate::object::Object;
use crate::polygon_box::bits_of;
use crate::polygon_pairs::{Recent, WorldTriangle};
use crate::polygon_test;
use crate::submatrix::{Placed, Voxel, Which};
use patches::{NearFrame, Patches};
use triangles::{ERROR, Nearest};
use voxel_bounds::VoxelBounds;

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
/// `minimum ≤ value + 16·2^-53·S`, and `value − lower ≤ relative_tolerance·value + 65·2^-53·S`. A distance beyond the largest f64 is given as
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
    bounds: VoxelBounds,
    stack: Vec<Open>,
    patches: [Patches; 2],
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
    let mut search = Search::new(a, b, boxes[0].joined(&boxes[1]), settings, memory);
    if search.are_far(&boxes[0], &boxes[1]) {
        return None;
    }
    search.run();
    search.result()
}

/// The most triangles of a voxel that are compared as they are. The best of 12, 32, 64 and 128 on two meshes of 69,451 triangles.
const FEW: u32 = 128;

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

/// Two voxels that may be nearer than the best pair of triangles.
#[derive(Debug, Clone, Copy)]
struct Open {
    /// See [`voxel_bounds::Bound`].
    square: f64,
    centres: f64,
    voxels: [Voxel; 2],
    /// Whether the first, or the second, is not worth splitting.
    whole: [bool; 2],
}

impl Open {
    const CONTAINERS: Open = Open { square: 0.0, centres: 0.0, voxels: [Voxel::CONTAINER; 2], whole: [false; 2] };
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
    /// What rounding may change a value by, scaled.
    margin: f64,
    best: Option<Best>,
    frame: NearFrame,
    /// The least proof of a pair of triangles whose value could not be proven within the margin; infinite when there was none.
    weakest: f64,
    /// What is proven farther than this, scaled, is left out; the same squared, for boxes in the frame and for voxels.
    limit: f64,
    near_limit: f64,
    voxel_limit: f64,
    memory: &'s mut Memory,
}

impl<'s> Search<'s> {
    fn new(
        a: (&'s Object, &'s Rows),
        b: (&'s Object, &'s Rows),
        both: GlobalBox,
        settings: DistanceSettings,
        memory: &'s mut Memory,
    ) -> Search<'s> {
        let scale = scale_of(&both);
        let sides = if scale < 1.0 { both.max * scale - both.min * scale } else { (both.max - both.min) * scale };
        memory.bounds.start(placed(a), placed(b), scale);
        memory.compared.forget();
        memory.patches.iter_mut().for_each(Patches::clear);
        let mut search = Search {
            bodies: [a, b],
            settings,
            scale,
            margin: sides.element_sum() * ERROR,
            best: None,
            frame: NearFrame::of_world(both.min, scale),
            weakest: f64::INFINITY,
            limit: 0.0,
            near_limit: 0.0,
            voxel_limit: 0.0,
            memory,
        };
        search.set_limit();
        search
    }

    fn run(&mut self) {
        self.first_guess();
        self.memory.stack.push(Open::CONTAINERS);
        while let Some(open) = self.memory.stack.pop() {
            if open.square > self.voxel_limit || self.near_square(&open) > self.voxel_limit {
                continue;
            }
            match self.split(&open, FEW) {
                None => self.compare(&open),
                Some(which) => self.expand(&open, which),
            }
        }
    }

    /// Compares the triangles of two small voxels that are near each other, so that the search starts with a good limit.
    fn first_guess(&mut self) {
        let mut open = Open::CONTAINERS;
        self.memory.stack.clear();
        while let Some(which) = self.split(&open, 1) {
            self.expand(&open, which);
            let Some(nearest) = self.memory.stack.pop() else { return };
            open = nearest;
            self.memory.stack.clear();
        }
        self.compare(&open);
    }

    /// After the best value has changed.
    fn set_limit(&mut self) {
        let DistanceSettings { up_to, relative_tolerance } = self.settings;
        let value = self.best.map(|best| best.nearest.value).filter(|&value| value <= up_to);
        let wanted = value.map_or(up_to, |value| value * (1.0 - relative_tolerance));
        self.limit = wanted * self.scale + self.margin;
        let near = self.limit + self.margin;
        self.near_limit = near * near * (1.0 + NearFrame::SKEW);
        self.voxel_limit = self.limit * self.limit * self.memory.bounds.divisor();
    }

    fn near_square(&self, open: &Open) -> f64 {
        self.memory.bounds.near_square(self.bodies.map(|(object, _)| object), open.voxels)
    }

    /// Which voxel to split; `None` when neither can be, or need be: both have at most so many triangles.
    fn split(&self, open: &Open, enough: u32) -> Option<Which> {
        let few = |which: Which| {
            let voxel = open.voxels[which as usize];
            let matrix = self.bodies[which as usize].0.matrix();
            open.whole[which as usize]
                || self.memory.bounds.is_last(which, voxel)
                || matrix.triangle_count(usize::from(voxel.level), voxel.number) <= enough
        };
        match (few(Which::First), few(Which::Second)) {
            (true, true) => None,
            (true, false) => Some(Which::Second),
            (false, true) => Some(Which::First),
            (false, false) => Some(self.memory.bounds.larger(open.voxels[0], open.voxels[1])),
        }
    }

    /// Pushes the pairs of the split voxel's children with the other voxel, the nearest last.
    fn expand(&mut self, open: &Open, which: Which) {
        /// A voxel is not split when its children, those that are near enough, hold so many times its triangles or more.
        const MOST_REPEATED: u32 = 4;
        let (parent, other) = (open.voxels[which as usize], open.voxels[which.other() as usize]);
        let matrix = self.bodies[which as usize].0.matrix();
        let level = usize::from(parent.level);
        let (node, halved) = (matrix.node(level, parent.number), &matrix.lattice().levels()[level]);
        let Memory { bounds, stack, .. } = &mut *self.memory;
        let split = bounds.split(which, parent, halved, other);
        let (first_new, mut repeated) = (stack.len(), 0);
        for child in bits_of(node.occupied) {
            let place = halved.place[child as usize];
            let bound = split.bound(place);
            if bound.square > self.voxel_limit {
                continue;
            }
            let index = [0, 1, 2].map(|axis| parent.index[axis] << halved.bits[axis] | u32::from(place[axis]));
            let voxel = Voxel { level: parent.level + 1, number: node.child(child), index };
            repeated += matrix.triangle_count(level + 1, voxel.number);
            let mut next = Open { square: bound.square, centres: bound.centres, ..*open };
            next.voxels[which as usize] = voxel;
            stack.push(next);
        }
        if repeated / MOST_REPEATED >= node.triangles {
            stack.truncate(first_new);
            let mut whole = *open;
            whole.whole[which as usize] = true;
            stack.push(whole);
            return;
        }
        stack[first_new..].sort_unstable_by(|x, y| y.square.total_cmp(&x.square).then(y.centres.total_cmp(&x.centres)));
    }

    /// Compares the triangles of two voxels.
    fn compare(&mut self, open: &Open) {
        let mut patches = std::mem::take(&mut self.memory.patches);
        let [first, second] = &mut patches;
        let a = first.of(open.voxels[0], self.bodies[0], &self.frame);
        let b = second.of(open.voxels[1], self.bodies[1], &self.frame);
        if a.bounds.gap(&b.bounds) <= self.near_limit {
            for (p, bounds) in first.triangles(&a) {
                if bounds.gap(&b.bounds) > self.near_limit {
                    continue;
                }
                for (q, other) in second.triangles(&b) {
                    if bounds.gap(other) <= self.near_limit {
                        self.compare_triangles(p, q);
                    }
                }
            }
        }
        self.memory.patches = patches;
    }

    fn compare_triangles(&mut self, p: &WorldTriangle, q: &WorldTriangle) {
        let polygons = [(self.bodies[0].0, p), (self.bodies[1].0, q)];
        let polygons = polygons.map(|(object, triangle)| object.polygon_of(triangle.number as usize));
        let interfering = self.best.is_some_and(|best| best.nearest.value == 0.0);
        if let Some(best) = &self.best {
            let numbers = (polygons, [p.number, q.number]);
            let farther = if interfering { numbers >= (best.polygons, best.triangles) } else { self.apart(best, p, q) };
            if farther {
                return;
            }
        }
        if !self.memory.compared.is_new(p.number, q.number) {
            return;
        }
        let interferes = p.bounds.overlaps(&q.bounds) && polygon_test::triangles(&p.corners, &q.corners).is_some();
        let nearest = match (interferes, interfering) {
            (true, _) => triangles::common_point(&p.corners, &q.corners),
            (false, true) => return,
            (false, false) => triangles::nearest(&p.corners, &q.corners),
        };
        self.offer(nearest, polygons, [p.number, q.number]);
    }

    /// Whether the plane between the best points so far proves the triangles too far apart.
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
            if nearest.value > 0.0 {
                self.frame.follow(nearest.direction, nearest.on_p);
                let [a, b] = self.bodies.map(placed);
                self.memory.bounds.follow(nearest.direction, a, b, self.scale);
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
        (gap * self.scale).length_squared() > self.near_limit
    }
}

fn placed<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    let reach = object.matrix().lattice().container().reach();
    Placed { object, rows, magnitude: magnitude(rows, reach) }
}

/// 1 where lengths within the box can be squared without overflow, or loss that matters; else the power of two that makes them so.
fn scale_of(both: &GlobalBox) -> f64 {
    let longest = (0.5 * both.max - 0.5 * both.min).max_element();
    let exponent = (longest.to_bits() >> 52) as i32 - 1023;
    if (-200..=200).contains(&exponent) {
        return 1.0;
    }
    f64::from_bits(((1023 - exponent.clamp(-1000, 1000)) as u64) << 52)
}
