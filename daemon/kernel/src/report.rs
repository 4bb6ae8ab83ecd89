//! Stage 10: what a step found.

use std::ops::Range;

use crate::effects::contacts::Contacts;
use crate::effects::containment::Containment;
use crate::effects::distance::Distance;
use crate::effects::penetration::Penetration;
use crate::effects::response::{Impulse, Velocity};
use crate::effects::time_of_contact::FirstContact;
use crate::scene::BodyId;
use crate::step::{Results, StepResponse};

/// How two polygons, or two bodies, meet; the weakest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Relation {
    /// They share a point, but neither cross nor overlap in a plane.
    Touch,
    /// They lie in one plane and overlap in positive area.
    Coplanar,
    /// The relative interiors of two triangles of positive area, not in one plane, meet.
    Cross,
}

/// What is known of a pair of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// Proven: no point in common.
    Clear,
    /// Proven: at least one point in common.
    Interfering,
    /// Not ruled out at the accuracy, or within the time, that was asked for.
    Possible,
}

/// How far a verdict was refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Level {
    /// Global bounding boxes.
    GlobalBoxes,
    /// Transformed containers.
    Containers,
    /// Voxels.
    Voxels,
    /// Exact polygon tests.
    Polygons,
}

/// How far from contact, or how deep in it, a pair that is left possible can be. World lengths; both hold up to the rounding of
/// world vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpenBound {
    /// Orders of the voxels of `a` and of `b` that reach each other; 0 are the containers.
    pub orders: [u32; 2],
    /// The surfaces are nowhere farther from each other than this at their nearest: they meet, or the gap is at most this.
    pub apart_at_most: f64,
    /// However deep they are in each other, a translation of this length takes them apart.
    pub deep_at_most: f64,
}

/// One pair of bodies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairResult {
    /// The body with the smaller id.
    pub a: BodyId,
    /// The body with the larger id.
    pub b: BodyId,
    /// What is known.
    pub verdict: Verdict,
    /// How far it was refined.
    pub level: Level,
    /// Whether the budget was used up before all was done that the pair asks for: effects that are missing were not computed.
    pub unfinished: bool,
    /// The strongest relation of their polygons; given with [`Effects::POLYGON_PAIRS`](crate::Effects::POLYGON_PAIRS).
    pub relation: Option<Relation>,
    /// Which body is inside the other; given with [`Effects::CONTAINMENT`](crate::Effects::CONTAINMENT).
    pub containment: Option<Containment>,
    pub(crate) polygon_pairs: Range<usize>,
}

/// One pair of interfering polygons, by the caller's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PolygonPair {
    /// Polygon of body `a`.
    pub a: u32,
    /// Polygon of body `b`.
    pub b: u32,
    /// The strongest relation of their triangles.
    pub relation: Relation,
}

/// How many things each stage looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StageCounts {
    /// Global bounding boxes computed.
    pub boxes: u64,
    /// Pairs of bodies whose global bounding boxes overlap.
    pub broad_pairs: u64,
    /// Of these, and of those that an effect looks at from farther away, pairs that the interest matrix keeps.
    pub interest_pairs: u64,
    /// Of these, pairs whose containers reach each other.
    pub container_pairs: u64,
    /// Pairs of voxels, of any order, that were compared.
    pub voxels_visited: u64,
    /// Pairs of voxels of the full order that reach each other.
    pub voxel_pairs: u64,
    /// Pairs of triangles taken from these.
    pub polygon_candidates: u64,
    /// Of these, pairs that went to the exact test.
    pub exact_tests: u64,
    /// Pairs of bodies, their surfaces apart, of which it was asked whether one is inside the other.
    pub containment_tests: u64,
    /// Pairs of bodies of which the minimum distance was sought.
    pub distance_searches: u64,
    /// Pairs of bodies whose regions of contact were found.
    pub contact_pairs: u64,
    /// Pairs of bodies for which a separating translation was sought.
    pub penetration_searches: u64,
    /// Pairs of bodies whose first contact over the motion was sought.
    pub time_searches: u64,
    /// Points at which impulses were computed.
    pub response_points: u64,
    /// Interfering pairs of bodies.
    pub interfering_pairs: u64,
    /// Interfering pairs of polygons in the report.
    pub polygon_pairs: u64,
}

/// How long each stage took, in nanoseconds of the caller's clock. Stages 5 to 8 add up over the threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StageTimes {
    /// Transforms read and checked, and global bounding boxes.
    pub boxes: u64,
    /// Broad phase.
    pub broad_phase: u64,
    /// Interest matrix.
    pub interest: u64,
    /// Containers, interference submatrices and voxel pairs.
    pub voxels: u64,
    /// Polygon pairs taken from voxel pairs.
    pub polygon_pairs: u64,
    /// Exact polygon tests.
    pub polygon_tests: u64,
    /// Stage 9 of pairs and bodies, and results ordered and merged.
    pub effects: u64,
}

impl StageCounts {
    /// Adds what another thread, or another step, has counted.
    pub fn add(&mut self, other: &StageCounts) {
        let StageCounts { boxes, broad_pairs, interest_pairs, container_pairs, voxels_visited, .. } = *other;
        let StageCounts { voxel_pairs, polygon_candidates, exact_tests, containment_tests, .. } = *other;
        let StageCounts { distance_searches, contact_pairs, penetration_searches, time_searches, .. } = *other;
        let StageCounts { response_points, interfering_pairs, polygon_pairs, .. } = *other;
        self.boxes += boxes;
        self.broad_pairs += broad_pairs;
        self.interest_pairs += interest_pairs;
        self.container_pairs += container_pairs;
        self.voxels_visited += voxels_visited;
        self.voxel_pairs += voxel_pairs;
        self.polygon_candidates += polygon_candidates;
        self.exact_tests += exact_tests;
        self.containment_tests += containment_tests;
        self.distance_searches += distance_searches;
        self.contact_pairs += contact_pairs;
        self.penetration_searches += penetration_searches;
        self.time_searches += time_searches;
        self.response_points += response_points;
        self.interfering_pairs += interfering_pairs;
        self.polygon_pairs += polygon_pairs;
    }
}

/// What a step found: a view into the scene's memory. Records of an effect name a pair by its place in [`pairs`](Self::pairs),
/// and come in the order of the pairs.
#[derive(Debug, Clone, Copy)]
pub struct Report<'s> {
    pub(crate) results: &'s Results,
    pub(crate) response: &'s StepResponse,
    pub(crate) counts: &'s StageCounts,
    pub(crate) times: &'s StageTimes,
    pub(crate) is_complete: bool,
}

impl<'s> Report<'s> {
    /// The pairs not proven clear, and those of which an effect has something to say, ordered by `(a, b)`, `a < b`.
    pub fn pairs(&self) -> &'s [PairResult] {
        &self.results.pairs
    }

    /// The polygon pairs of a pair of this report, ordered by `(a, b)`; none unless asked for.
    pub fn polygon_pairs(&self, pair: &PairResult) -> &'s [PolygonPair] {
        &self.results.polygon_pairs[pair.polygon_pairs.clone()]
    }

    /// Number of polygon pairs over all pairs.
    pub fn polygon_pair_count(&self) -> usize {
        self.results.polygon_pairs.len()
    }

    /// How far apart, or how deep in each other, the pairs left possible can be.
    pub fn bounds(&self) -> &'s [(u32, OpenBound)] {
        &self.results.bounds
    }

    /// Whether the budget was enough to find the pairs that matter; if not, every pair that is not listed is open too.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Minimum distances.
    pub fn distances(&self) -> &'s [(u32, Distance)] {
        &self.results.distances
    }

    /// Times of first contact, of pairs that are not proven free over the whole step.
    pub fn times_of_contact(&self) -> &'s [(u32, FirstContact)] {
        &self.results.times
    }

    /// Regions of contact: which of [`contacts`](Self::contacts) are of a pair.
    pub fn regions(&self) -> &'s [(u32, Range<usize>)] {
        &self.results.regions
    }

    /// The regions of all pairs, those of one pair together.
    pub fn contacts(&self) -> &'s Contacts {
        &self.results.contacts
    }

    /// Translations that take pairs apart.
    pub fn penetrations(&self) -> &'s [(u32, Penetration)] {
        &self.results.penetrations
    }

    /// Impulses at contacts.
    pub fn impulses(&self) -> &'s [(u32, Impulse)] {
        &self.response.impulses
    }

    /// Velocities after, of the bodies with mass that an impulse has reached; ascending.
    pub fn velocities(&self) -> &'s [(BodyId, Velocity)] {
        &self.response.velocities
    }

    /// A body whose inertia, where it stands, is not positive definite: there is no response then.
    pub fn response_fault(&self) -> Option<BodyId> {
        self.response.fault
    }

    /// Whether a cap on impacts or iterations ended the response before it was as exact as it should be.
    pub fn response_was_capped(&self) -> bool {
        self.response.capped
    }

    /// The first body that this step is the first to place, of the bodies of pairs that ask for
    /// [`Effects::TIME_OF_CONTACT`](crate::Effects::TIME_OF_CONTACT): without an earlier step it has no motion, and counts as still.
    pub fn time_fault(&self) -> Option<BodyId> {
        self.results.time_fault
    }

    /// How many things each stage looked at.
    pub fn counts(&self) -> &'s StageCounts {
        self.counts
    }

    /// How long each stage took.
    pub fn times(&self) -> &'s StageTimes {
        self.times
    }
}
