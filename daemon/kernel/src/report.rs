//! Stage 10: what a step found.

use std::ops::Range;

use crate::effects::containment::Containment;
use crate::scene::BodyId;

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
    /// Of these, pairs that the interest matrix keeps.
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
    /// Results ordered and merged.
    pub effects: u64,
}

/// What a step found: a view into the scene's memory.
#[derive(Debug, Clone, Copy)]
pub struct Report<'s> {
    pub(crate) pairs: &'s [PairResult],
    pub(crate) polygon_pairs: &'s [PolygonPair],
    pub(crate) counts: &'s StageCounts,
    pub(crate) times: &'s StageTimes,
}

impl<'s> Report<'s> {
    /// The pairs not proven clear, and those of which an effect has something to say, ordered by `(a, b)`, `a < b`.
    pub fn pairs(&self) -> &'s [PairResult] {
        self.pairs
    }

    /// The polygon pairs of a pair of this report, ordered by `(a, b)`; none unless asked for.
    pub fn polygon_pairs(&self, pair: &PairResult) -> &'s [PolygonPair] {
        &self.polygon_pairs[pair.polygon_pairs.clone()]
    }

    /// Number of polygon pairs over all pairs.
    pub fn polygon_pair_count(&self) -> usize {
        self.polygon_pairs.len()
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
