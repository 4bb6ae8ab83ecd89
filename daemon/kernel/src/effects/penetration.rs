//! Effect `penetration`: a translation of one body after which the pair is clear.
//!
//! Directions to move along are the normals of the contact regions, the axes of the world and of both containers, the line of
//! the containers' middles, the face normals of both bodies and the cross products of their edges, each both ways
//! (`directions.rs`). Along each, the extents of the two bodies say how far the second must go to have left the first behind;
//! from there the search goes down, every candidate being tried with the exact test at the rows that the translation gives.
//! So what is found always clears.
//!
//! # How good it is
//! Two convex bodies are apart after the shortest translation along a face normal of either, or along a cross product of
//! their edges: their Minkowski difference is a convex polyhedron with just these normals, and the shortest way out of it is
//! at right angles to a face (Cameron and Culley 1986, "Determining the minimum translational distance between two convex
//! polyhedra", ICRA). Where all of these directions are looked at, that is where their number times the number of vertices
//! is at most [`MAX_PROJECTIONS`], the depth of a convex pair exceeds the optimum by no more than [`TOLERANCE`] of it and
//! what rounding moves the vertices by (a few times 2^-50 of their magnitude). With more faces, every n-th is looked at:
//! then the depth is that of the best of these. For bodies that are not convex there is no bound: a pair may be clear
//! nearer by than where it was looked, since it can become clear and interfere again on the way.
//!
//! The work is capped: at most [`MAX_TRIALS`] exact tests after the first that clears, which is mostly the first one tried.

mod directions;
mod surface_test;

use glam::DVec3;

use crate::affine::{Rows, magnitude};
use crate::object::Object;
use directions::{Candidate, Directions};
pub use surface_test::SurfaceTest;

/// How far above the shortest translation that clears along its direction a depth may be, relative to it.
pub const TOLERANCE: f64 = 1.0 / (1 << 20) as f64;

/// The most exact tests that are spent on making a translation shorter.
pub const MAX_TRIALS: u32 = 512;

/// The most positions that are projected on directions.
pub const MAX_PROJECTIONS: usize = 1 << 22;

/// The most triangles of a body that directions are taken from; of more, every n-th.
pub const MAX_FACES: usize = 1 << 16;

/// Directions along which the exact test is tried below the bound of the extents, the most promising first.
const MAX_RAYS: usize = 24;

/// Below the shortest translation so far, it is tried at this many halvings of it.
const HALVINGS: i32 = 7;

/// A translation after which the pair is clear. World frame, the scene's length unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penetration {
    /// To be added to the last column of the second body's rows; see [`translated`].
    pub translation_of_b: [f64; 3],
    /// Its length.
    pub depth: f64,
}

/// The rows with a translation added to the last column, rounded to nearest.
pub fn translated(rows: &Rows, translation: [f64; 3]) -> Rows {
    [0, 1, 2].map(|axis| {
        let [x, y, z, shift] = rows[axis];
        [x, y, z, shift + translation[axis]]
    })
}

/// The search. Its memory serves one pair after the other.
#[derive(Debug, Default)]
pub struct Separation {
    directions: Directions,
}

impl Separation {
    /// The shortest translation found after which `is_clear` says that the second body, at the rows it is given, is clear
    /// of the first one: surfaces and, for closed bodies, insides. `contact_normals` are those of the contact regions, or
    /// none.
    ///
    /// `None` when the pair is clear as it is, when a body is empty, or when no translation clears before numbers overflow.
    ///
    /// ```
    /// use collided_kernel::affine::IDENTITY;
    /// use collided_kernel::effects::penetration::{Separation, SurfaceTest};
    /// use collided_kernel::{Object, PolygonMesh};
    ///
    /// let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// let object = Object::build(PolygonMesh::from_polygons(corners, [[0, 1, 2]]), None, &()).expect("a good mesh");
    /// let placed = (&object, &IDENTITY);
    /// let mut surfaces = SurfaceTest::default();
    /// let mut is_clear = |rows: &_| !surfaces.interferes(placed, (&object, rows));
    /// let found = Separation::default().find(placed, placed, &[], &mut is_clear).expect("it lies on itself");
    /// assert!(found.depth < 1e-14);
    /// ```
    pub fn find(
        &mut self,
        a: (&Object, &Rows),
        b: (&Object, &Rows),
        contact_normals: &[[f64; 3]],
        is_clear: &mut dyn FnMut(&Rows) -> bool,
    ) -> Option<Penetration> {
        if is_clear(b.1) {
            return None;
        }
        let candidates = self.directions.candidates(a, b, contact_normals);
        let mut trials = Trials { b, is_clear, left: MAX_TRIALS };
        let mut by_extents = candidates.by_extents().take(MAX_RAYS);
        let mut best = by_extents.find_map(|candidate| trials.beyond(candidate, candidates.noise))?;
        for candidate in candidates.promising().take(MAX_RAYS) {
            if let Some(shorter) = trials.along(candidate.direction, best.1, candidates.noise) {
                best = shorter;
            }
        }
        // Without −0, which reads like a mistake.
        let translation = best.0 * best.1 + DVec3::ZERO;
        Some(Penetration { translation_of_b: translation.to_array(), depth: translation.length() })
    }
}

/// A unit vector and how far along it.
type Shift = (DVec3, f64);

/// The exact test at translated rows, and how often it may still be asked.
struct Trials<'t> {
    b: (&'t Object, &'t Rows),
    is_clear: &'t mut dyn FnMut(&Rows) -> bool,
    left: u32,
}

impl Trials<'_> {
    fn clears(&mut self, direction: DVec3, distance: f64) -> bool {
        let rows = translated(self.b.1, (direction * distance).to_array());
        magnitude(&rows, self.b.0.reach()).is_finite() && (self.is_clear)(&rows)
    }

    /// A little beyond where the extents part, and farther where rounding wants it.
    fn beyond(&mut self, candidate: &Candidate, noise: f64) -> Option<Shift> {
        /// After so many doublings of the smallest step, the step is larger than all.
        const DOUBLINGS: i32 = 64;
        let mut step = noise.max(f64::MIN_POSITIVE);
        for _ in 0..DOUBLINGS {
            let distance = candidate.reach.max(0.0) + step;
            if !distance.is_finite() {
                return None;
            }
            if self.clears(candidate.direction, distance) {
                return Some((candidate.direction, distance));
            }
            step *= 2.0;
        }
        None
    }

    /// A distance that clears along a direction and is shorter than `limit`, by at least the tolerance.
    fn along(&mut self, direction: DVec3, limit: f64, noise: f64) -> Option<Shift> {
        let mut below = 0.0;
        let fractions = (1..=HALVINGS).rev().map(|halvings| limit * 0.5f64.powi(halvings));
        for distance in fractions.chain([limit * (1.0 - TOLERANCE)]) {
            if self.left == 0 {
                return None;
            }
            self.left -= 1;
            if self.clears(direction, distance) {
                return Some((direction, self.bisect(direction, below, distance, noise)));
            }
            below = distance;
        }
        None
    }

    /// Between a distance that does not clear and one that does: one that does, near one that does not.
    fn bisect(&mut self, direction: DVec3, mut below: f64, mut above: f64, noise: f64) -> f64 {
        while self.left > 0 && above - below > (TOLERANCE / 2.0 * above).max(noise) {
            self.left -= 1;
            let middle = below + (above - below) / 2.0;
            if self.clears(direction, middle) {
                above = middle;
            } else {
                below = middle;
            }
        }
        above
    }
}
