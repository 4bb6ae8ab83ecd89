//! Effect `contacts`: where two bodies touch, grouped into contact regions.
//!
//! Each interfering pair of triangles meets in a point, a segment or, in one plane, an area. Which features meet is told by
//! exact predicates (`meeting.rs`); every coordinate is the f64 nearest to the exact one (`position.rs`), so the error is at
//! most half an ulp per coordinate. A corner of a triangle keeps its bits.
//!
//! # Pieces
//! One exact point has the same bits from whichever triangles it is found, so pieces are compared by their bits, and each is
//! there once: a point that ends a segment or is a corner of an area is not listed as a point, a segment that is a side of an
//! area not as a segment. Areas are cut as the triangles of both bodies are and do not overlap, so they add up to
//! the true area, where a body's own polygons do not overlap each other.
//!
//! # Regions
//! Pieces that have an end or a corner in common are one region, and so on through all pieces. Triangles that share
//! edges and corners meet the other body in pieces that share ends; in a mesh with T-junctions one contact may come out as
//! several regions. Regions are ordered by their lowest point (by x, then y, then z), and do not depend on the order of the
//! pairs.
//!
//! # Normals
//! Of unit length, pointing from `a` to `b`; the zero vector where none is defined. They are computed in plain f64 from the
//! corners of the triangles, so those of triangles without measurable area are noise or zero.
//! * Area: the face normal of `a`'s triangle, as its corners run in the object (outwards in a consistently oriented mesh, also
//!   where the transform is a mirror).
//! * Crossing triangles: the middle between the face normals of `a` and, reversed, `b`.
//! * Touching triangles: the face normal of the body whose feature has more dimensions (a face before an edge, an edge
//!   before a corner), where the other triangle lies on one side of it; for two edges that cross, their cross product;
//!   else, for equals, the middle between both face normals. All are turned so that `b`'s triangle lies in front of `a`'s
//!   face, `a`'s behind `b`'s; where it lies in the plane, rounding apart, the face's outside is its front.
//! * A piece found from several pairs of triangles: the middle of what they give.
//! * A region: the average over its areas by area, or else its segments by length, or else its points.

mod meeting;
mod normal;
mod position;
mod regions;

use std::ops::Range;

use glam::DVec3;

use crate::affine::{Rows, world_vertex};
use crate::object::Object;
use crate::predicates::{AnyRange, Arithmetic, Tame, is_tame};
use crate::report::Relation;
use meeting::Meeting;
pub(super) use normal::unit;
use regions::Pieces;

/// Two triangles that interfere, by their numbers in [`Object::triangles`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrianglePair {
    /// Triangle of the first body.
    pub a: u32,
    /// Triangle of the second body.
    pub b: u32,
    /// How they meet, as [`triangles`](crate::polygon_test::triangles) says.
    pub relation: Relation,
}

/// Contact that hangs together. World frame, the scene's length unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRegion {
    /// Its points, in [`Contacts::points`].
    pub points: Range<usize>,
    /// Its segments, in [`Contacts::segments`].
    pub segments: Range<usize>,
    /// Its areas, in [`Contacts::areas`].
    pub areas: Range<usize>,
    /// The centroid of the areas; without areas, of the segments; without these, of the points.
    pub centre: [f64; 3],
    /// Unit vector from the first body to the second; zero where the pieces' normals cancel out or are not defined.
    pub normal: [f64; 3],
    /// Sum of the segments' lengths.
    pub length: f64,
    /// Sum of the areas.
    pub area: f64,
}

/// A point of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    /// World position.
    pub position: [f64; 3],
    /// Unit vector from the first body to the second, or zero.
    pub normal: [f64; 3],
}

/// A segment of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSegment {
    /// World positions of its ends, the lower one (by x, then y, then z) first.
    pub ends: [[f64; 3]; 2],
    /// Unit vector from the first body to the second, or zero.
    pub normal: [f64; 3],
}

/// A convex polygon in which two triangles of one plane overlap.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactArea {
    /// World positions of its corners, in [`Contacts::corners`], counterclockwise as seen against the normal.
    pub corners: Range<usize>,
    /// Unit vector from the first body to the second, or zero.
    pub normal: [f64; 3],
}

/// The contact regions of one pair of bodies. Its memory serves one pair after the other.
#[derive(Debug, Default)]
pub struct Contacts {
    pairs: Vec<TrianglePair>,
    pieces: Pieces,
    regions: Vec<ContactRegion>,
    points: Vec<ContactPoint>,
    segments: Vec<ContactSegment>,
    areas: Vec<ContactArea>,
    corners: Vec<[f64; 3]>,
}

impl Contacts {
    /// Finds the regions of two placed objects from all pairs of their triangles that interfere, in any order, repeated or not.
    ///
    /// # Panics
    /// When a triangle number is out of range.
    ///
    /// ```
    /// use collided_kernel::affine::IDENTITY;
    /// use collided_kernel::effects::contacts::{Contacts, TrianglePair};
    /// use collided_kernel::{Object, PolygonMesh, Relation};
    ///
    /// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// let object = Object::build(PolygonMesh::from_polygons(corners, [[0, 1, 2]]), None, &()).expect("a good mesh");
    /// let mut contacts = Contacts::default();
    /// let pair = TrianglePair { a: 0, b: 0, relation: Relation::Coplanar };
    /// contacts.find((&object, &IDENTITY), (&object, &IDENTITY), &[pair]);
    /// assert_eq!(contacts.regions()[0].area, 0.5);
    /// ```
    pub fn find(&mut self, a: (&Object, &Rows), b: (&Object, &Rows), pairs: &[TrianglePair]) {
        self.clear();
        self.pairs.extend_from_slice(pairs);
        self.pairs.sort_unstable();
        self.pairs.dedup_by_key(|pair| (pair.a, pair.b));
        let mirrored = [a.1, b.1].map(is_mirror);
        for pair in &self.pairs {
            let (first, second) = (world_triangle(a, pair.a), world_triangle(b, pair.b));
            let meeting = Meeting::of(&first, &second);
            let normal = normal::of_piece(pair.relation, &meeting, mirrored, &first, &second);
            self.pieces.add(&meeting, normal);
        }
        self.group();
    }

    /// Appends regions of another pair, after this one's.
    pub(crate) fn append(&mut self, other: &Contacts, regions: Range<usize>) {
        for region in &other.regions[regions] {
            let points = extend(&mut self.points, &other.points[region.points.clone()]);
            let segments = extend(&mut self.segments, &other.segments[region.segments.clone()]);
            let first_area = self.areas.len();
            for area in &other.areas[region.areas.clone()] {
                let corners = extend(&mut self.corners, &other.corners[area.corners.clone()]);
                self.areas.push(ContactArea { corners, normal: area.normal });
            }
            self.regions.push(ContactRegion { points, segments, areas: first_area..self.areas.len(), ..*region });
        }
    }

    pub(crate) fn clear(&mut self) {
        self.pairs.clear();
        self.pieces.clear();
        self.regions.clear();
        self.points.clear();
        self.segments.clear();
        self.areas.clear();
        self.corners.clear();
    }

    /// The regions, ordered by their lowest point.
    pub fn regions(&self) -> &[ContactRegion] {
        &self.regions
    }

    /// The points of all regions.
    pub fn points(&self) -> &[ContactPoint] {
        &self.points
    }

    /// The segments of all regions.
    pub fn segments(&self) -> &[ContactSegment] {
        &self.segments
    }

    /// The areas of all regions.
    pub fn areas(&self) -> &[ContactArea] {
        &self.areas
    }

    /// The corners of all areas.
    pub fn corners(&self) -> &[[f64; 3]] {
        &self.corners
    }
}

/// Appends elements; says where they stand.
fn extend<T: Copy>(to: &mut Vec<T>, from: &[T]) -> Range<usize> {
    let first = to.len();
    to.extend_from_slice(from);
    first..to.len()
}

fn world_triangle((object, rows): (&Object, &Rows), number: u32) -> [DVec3; 3] {
    object.triangles()[number as usize].map(|vertex| world_vertex(rows, object.vertices()[vertex as usize]))
}

/// Whether a transform exchanges inside and outside.
fn is_mirror(rows: &Rows) -> bool {
    let columns = [0, 1, 2].map(|axis| DVec3::new(rows[0][axis], rows[1][axis], rows[2][axis]));
    let [x, y, z] = columns;
    let side =
        if is_tame(&columns) { Tame.orient3d(DVec3::ZERO, x, y, z) } else { AnyRange.orient3d(DVec3::ZERO, x, y, z) };
    side < 0
}
