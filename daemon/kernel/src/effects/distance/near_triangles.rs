//! Triangles at their world positions, with boxes along the direction in which the bodies are nearest.
//!
//! Near the nearest points both surfaces are nearly at right angles to the line between them. Boxes along that line are thin, so
//! that they tell pairs of triangles apart that cells do not. A triangle is carried into the world once per query.

use glam::{DVec3, Vec4};

use super::cell_bounds::Afar;
use super::near_corners::NearCorners;
use crate::affine::Rows;
use crate::cells::Cell;
use crate::object::Object;
use crate::polygon_pairs::WorldTriangle;

/// Three axes at right angles, from an origin; coordinates are scaled by a power of two. From afar the first two are zero.
///
/// In f64 a coordinate errs by less than 8·2^-53 of the 1-norm of the position relative to the origin, and the axes are of length 1 and at
/// right angles up to a few roundings of 2^-53. [`NearFrame::square_of`] covers that and what f32 rounds.
#[derive(Debug, Clone, Copy)]
pub(super) struct NearFrame {
    axes: [DVec3; 3],
    origin: DVec3,
    scale: f64,
    /// What the third coordinate is counted from.
    from: f64,
    /// Boxes made in another frame are made anew.
    generation: u32,
}

impl NearFrame {
    /// The world's axes, before any direction is known.
    pub fn of_world(origin: DVec3, scale: f64) -> NearFrame {
        NearFrame { axes: DVec3::AXES, origin, scale, from: 0.0, generation: 0 }
    }

    /// Frames of two bodies far apart, the origin at the first one: only how far their points reach along the direction is seen, of the
    /// second body from a distance on.
    pub fn from_afar(Afar { direction, from, .. }: Afar, origin: DVec3, scale: f64) -> [NearFrame; 2] {
        let axes = [DVec3::ZERO, DVec3::ZERO, direction];
        [0.0, from].map(|from| NearFrame { axes, origin, scale, from, generation: 0 })
    }

    /// Turns to a new direction of length 1, when it differs enough to be worth it.
    pub fn follow(&mut self, direction: DVec3, origin: DVec3) {
        /// Boxes are thicker by their width times the sine of the angle between.
        const WORTH_IT: f64 = 1.0 - 3e-3;
        if direction.is_finite() && (self.generation == 0 || direction.dot(self.axes[2]) < WORTH_IT) {
            let (first, second) = direction.any_orthonormal_pair();
            *self = NearFrame { axes: [first, second, direction], origin, generation: self.generation + 1, ..*self };
        }
    }

    /// The square of the distance that two boxes may have whose triangles are no farther apart than `limit`; `sides` is the sum of the
    /// sides of the world box of both bodies. Scaled.
    ///
    /// Roundings in f32, of 2^-24: one of each coordinate, which is at most `sides`; in the gaps, their squares and sums four of the result.
    pub fn square_of(limit: f64, sides: f64) -> f32 {
        /// 2^-21.
        const ROUNDING: f64 = 1.0 / (1 << 21) as f64;
        let limit = (limit * (1.0 + ROUNDING) + sides * ROUNDING) as f32;
        limit * limit * (1.0 + 8.0 * f32::EPSILON)
    }

    #[inline(always)]
    fn corners(&self, triangle: &WorldTriangle) -> NearCorners {
        let [p, q, r] = &triangle.corners;
        NearCorners([self.coordinates(*p), self.coordinates(*q), self.coordinates(*r)])
    }

    #[inline(always)]
    fn coordinates(&self, point: DVec3) -> Vec4 {
        // Neither the difference nor the scaled point may overflow.
        let point = if self.scale < 1.0 {
            point * self.scale - self.origin * self.scale
        } else {
            (point - self.origin) * self.scale
        };
        let [x, y, z] = self.axes.map(|axis| axis.dot(point));
        Vec4::new(x as f32, y as f32, (z - self.from) as f32, 0.0)
    }
}

/// A box along the axes of a [`NearFrame`].
#[derive(Debug, Clone, Copy)]
pub(super) struct NearBox {
    min: Vec4,
    max: Vec4,
}

impl NearBox {
    const EMPTY: NearBox = NearBox { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn of(NearCorners([p, q, r]): &NearCorners) -> NearBox {
        let (p, q, r) = (*p, *q, *r);
        NearBox { min: p.min(q).min(r), max: p.max(q).max(r) }
    }

    #[inline(always)]
    fn joined(&self, other: &NearBox) -> NearBox {
        NearBox { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The square of the distance of two boxes.
    #[inline(always)]
    pub fn gap(&self, other: &NearBox) -> f32 {
        let gap = (other.min - self.max).max(self.min - other.max).max(Vec4::ZERO);
        gap.dot(gap)
    }
}

/// A triangle that was met, its corners and its box in the frame of some generation.
#[derive(Debug, Clone, Copy)]
struct Met {
    triangle: WorldTriangle,
    corners: NearCorners,
    bounds: NearBox,
    generation: u32,
}

/// One body's triangles that were met so far, and those of the cell that is looked at.
#[derive(Debug, Default)]
pub(super) struct NearTriangles {
    met: Vec<Met>,
    /// Per triangle: the query in which it was last met, and its place in `met`.
    places: Vec<(u32, u32)>,
    query: u32,
    /// Numbers of the triangles of a cell above the full order, each once.
    merged: Vec<u32>,
    /// The triangles of the cell: their boxes, and their places in `met`.
    of_cell: Vec<(NearBox, u32)>,
}

impl NearTriangles {
    /// Forgets all triangles.
    pub fn start(&mut self, object: &Object) {
        self.met.clear();
        self.query = self.query.wrapping_add(1);
        if self.query == 0 {
            self.places.fill((0, 0));
            self.query = 1;
        }
        if self.places.len() < object.triangle_count() {
            self.places.resize(object.triangle_count(), (0, 0));
        }
    }

    /// Looks at the triangles of a cell, each once, their boxes in this frame; gives the box of all.
    #[inline(always)]
    pub fn look_at(&mut self, cell: &Cell, (object, rows): (&Object, &Rows), frame: &NearFrame) -> NearBox {
        let matrix = object.matrix();
        let mut numbers = matrix.triangles_in(cell);
        let mut merged = std::mem::take(&mut self.merged);
        if usize::from(cell.rank) != matrix.lattice().cuts().len() {
            merged.clear();
            merged.extend_from_slice(numbers);
            merged.sort_unstable();
            merged.dedup();
            numbers = &merged;
        }
        let mut of_cell = std::mem::take(&mut self.of_cell);
        of_cell.clear();
        let mut all = NearBox::EMPTY;
        of_cell.extend(numbers.iter().map(|&number| {
            let place = self.place(number, object, rows, frame);
            let met = &mut self.met[place as usize];
            if met.generation != frame.generation {
                (met.corners, met.generation) = (frame.corners(&met.triangle), frame.generation);
                met.bounds = NearBox::of(&met.corners);
            }
            all = all.joined(&met.bounds);
            (met.bounds, place)
        }));
        self.of_cell = of_cell;
        self.merged = merged;
        all
    }

    /// Where the triangle is among those that were met.
    #[inline(always)]
    fn place(&mut self, number: u32, object: &Object, rows: &Rows, frame: &NearFrame) -> u32 {
        let (query, place) = self.places[number as usize];
        if query == self.query {
            return place;
        }
        let place = self.met.len() as u32;
        self.places[number as usize] = (self.query, place);
        let triangle = WorldTriangle::new(number, object, rows);
        let corners = frame.corners(&triangle);
        let bounds = NearBox::of(&corners);
        self.met.push(Met { triangle, corners, bounds, generation: frame.generation });
        place
    }

    /// The triangles looked at whose boxes are no farther from another box than the root of this.
    #[inline(always)]
    pub fn keep(&mut self, near: &NearBox, square: f32) {
        self.of_cell.retain(|(bounds, _)| bounds.gap(near) <= square);
    }

    /// The triangles looked at: their boxes and places.
    pub fn kept(&self) -> &[(NearBox, u32)] {
        &self.of_cell
    }

    /// The triangle at a place, and its corners in the frame it was last looked at in.
    #[inline(always)]
    pub fn at(&self, place: u32) -> (&WorldTriangle, &NearCorners) {
        let met = &self.met[place as usize];
        (&met.triangle, &met.corners)
    }
}
