//! Report out: what the daemon writes into shared memory once, and a client reads there.
//!
//! The payload, a slice of 64-bit words, is the **result section**: for the same scene and transforms it has the same bytes,
//! whatever the thread count and the order of the voxel matrices. Stage counts and times stand in the header, apart.
//! When `status` is not [`STATUS_OK`] the payload is a [`WireError`](crate::WireError) as JSON, `error_bytes` long.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};

/// [`ReportHeader::status`] of a step that was answered; any other value is an [`ErrorCode`](crate::ErrorCode).
pub const STATUS_OK: u32 = 0;

/// Bit of [`ReportHeader::flags`]: a cap on impacts or iterations ended the response before it was as exact as it should be.
pub const FLAG_RESPONSE_CAPPED: u32 = 1;
/// [`ReportHeader::flags`]: the budget was used up before all pairs that matter were found; every pair that is not listed is open too.
pub const FLAG_INCOMPLETE: u32 = 2;

/// Section of [`PairRecord`]s: the pairs not proven clear, and those of which an effect has something to say, ordered by
/// (a, b), a < b.
pub const SECTION_PAIRS: usize = 0;
/// Section of [`PolygonPairRecord`]s: those of the first pair, then those of the second, each ordered by (a, b).
pub const SECTION_POLYGON_PAIRS: usize = 1;
/// Section of the answer to a batch: one byte for each candidate, a [`Verdict`] or [`NOT_LOOKED_AT`]. It has no other section.
pub const SECTION_CANDIDATES: usize = 13;
/// A candidate behind the one at which the batch was to stop.
pub const NOT_LOOKED_AT: u8 = 255;
/// How many sections a header has room for: these, those of [`effect_records`](crate::effect_records), and two to come.
pub const SECTION_COUNT: usize = 16;

/// Where a section stands in the payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
pub struct Section {
    /// First word of the section.
    pub first_word: u32,
    /// How many records it has.
    pub count: u32,
}

/// How many things each stage of the step looked at. Not part of the deterministic result section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
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
    /// Pairs of polygon pieces (triangles) taken from these.
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

/// How long each stage took, in nanoseconds of a monotonic clock. Stages that run in parallel add up over the threads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
pub struct StageTimes {
    /// Transforms read and checked, and global bounding boxes.
    pub boxes: u64,
    /// Broad phase.
    pub broad_phase: u64,
    /// Interest matrix.
    pub interest: u64,
    /// Containers, interference submatrices and voxel pairs, summed over the threads.
    pub voxels: u64,
    /// Polygon pairs taken from voxel pairs, summed over the threads.
    pub polygon_pairs: u64,
    /// Exact polygon tests, summed over the threads.
    pub polygon_tests: u64,
    /// Stage 9 of pairs and bodies, and results ordered and merged.
    pub effects: u64,
    /// Report written into shared memory.
    pub report: u64,
    /// The whole step inside the daemon, wall time.
    pub total: u64,
}

/// The user header of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("collided.ReportHeader")]
pub struct ReportHeader {
    /// [`crate::PROTOCOL_VERSION`] of the daemon.
    pub protocol: u32,
    /// [`STATUS_OK`], or an [`ErrorCode`](crate::ErrorCode).
    pub status: u32,
    /// The step's own number, carried back.
    pub sequence: u64,
    /// How many steps this scene has answered before this one.
    pub step: u64,
    /// Number of this part of the report, from 0.
    pub part: u32,
    /// How many parts the report has; 1 in this version.
    pub part_count: u32,
    /// Length of the JSON error in the payload, in bytes; 0 when `status` is [`STATUS_OK`].
    pub error_bytes: u32,
    /// 1 and the id of a body whose inertia, where it stands, is not positive definite: there is no response then. Else 0.
    pub response_fault: u32,
    /// 1 and the id of a body that this step is the first to place, though a pair of it asks for `time_of_contact`: it counts as
    /// still in this step. The lowest id of several. Else 0.
    pub time_fault: u32,
    /// [`FLAG_RESPONSE_CAPPED`], or 0. Bits of later versions are for readers of this one to pass over.
    pub flags: u32,
    /// Where each section stands, by its `SECTION_` number.
    pub sections: [Section; SECTION_COUNT],
    /// How many things each stage looked at.
    pub counts: StageCounts,
    /// How long each stage took.
    pub times: StageTimes,
}

/// What is known of a pair of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Verdict {
    /// Proven: no point in common. Such pairs are not listed unless an effect has something to say of them.
    Clear = 0,
    /// Proven: at least one point in common.
    Interfering = 1,
    /// Not ruled out at the accuracy, or within the time, that was asked for.
    Possible = 2,
}

/// How far a verdict was, or is to be, refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
pub enum Level {
    /// Global bounding boxes.
    GlobalBoxes = 0,
    /// Transformed containers.
    Containers = 1,
    /// Voxels.
    Voxels = 2,
    /// Exact polygon tests.
    Polygons = 3,
}

impl Level {
    /// All levels, the coarsest first.
    pub const ALL: [Level; 4] = [Level::GlobalBoxes, Level::Containers, Level::Voxels, Level::Polygons];
}

/// How two polygons, or two bodies, meet. Given with the effect `polygon_pairs`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Relation {
    /// Not asked for, or the surfaces do not meet.
    None = 0,
    /// They share a point, but neither cross nor overlap in a plane.
    Touch = 1,
    /// They lie in one plane and overlap in positive area.
    Coplanar = 2,
    /// Their relative interiors meet, not in one plane.
    Cross = 3,
}

/// Which of two bodies lies inside the other, their surfaces apart. Given with the effect `containment`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Containment {
    /// Not asked for, or neither.
    None = 0,
    /// The whole of `a` is inside `b`.
    AInB = 1,
    /// The whole of `b` is inside `a`.
    BInA = 2,
    /// Some connected parts of `a` are inside `b`, others are not.
    APartlyInB = 3,
    /// Some connected parts of `b` are inside `a`, others are not.
    BPartlyInA = 4,
    /// Not known: `b` is within the container of `a`, whose surface is open.
    UnknownAOpen = 5,
    /// Not known: `a` is within the container of `b`, whose surface is open.
    UnknownBOpen = 6,
    /// Not known: `b` is within the container of `a`, whose polygons disagree about which side is out.
    UnknownAInconsistent = 7,
    /// Not known: `a` is within the container of `b`, whose polygons disagree about which side is out.
    UnknownBInconsistent = 8,
}

impl Containment {
    /// Why it is not known; `None` when it is.
    pub const fn reason(self) -> Option<&'static str> {
        match self {
            Containment::UnknownAOpen => {
                Some("the object of body a is open: some edges have a polygon on one side only")
            }
            Containment::UnknownBOpen => {
                Some("the object of body b is open: some edges have a polygon on one side only")
            }
            Containment::UnknownAInconsistent => {
                Some("neighbouring polygons of body a disagree about which side is out")
            }
            Containment::UnknownBInconsistent => {
                Some("neighbouring polygons of body b disagree about which side is out")
            }
            _ => None,
        }
    }
}

macro_rules! codes {
    ($type:ident { $($variant:ident = $name:literal),+ $(,)? }) => {
        impl $type {
            /// The value of a code read from the wire; `None` for a code of a later version.
            pub const fn from_code(code: u8) -> Option<Self> {
                $(if code == $type::$variant as u8 { return Some($type::$variant); })+
                None
            }

            /// The name used in JSON output.
            pub const fn name(self) -> &'static str {
                match self { $($type::$variant => $name),+ }
            }
        }
    };
}

codes!(Verdict { Clear = "clear", Interfering = "interfering", Possible = "possible" });
codes!(Level { GlobalBoxes = "global_boxes", Containers = "containers", Voxels = "voxels", Polygons = "polygons" });
codes!(Relation { None = "none", Touch = "touch", Coplanar = "coplanar", Cross = "cross" });
codes!(Containment {
    None = "none",
    AInB = "a_in_b",
    BInA = "b_in_a",
    APartlyInB = "a_partly_in_b",
    BPartlyInA = "b_partly_in_a",
    UnknownAOpen = "unknown",
    UnknownBOpen = "unknown",
    UnknownAInconsistent = "unknown",
    UnknownBInconsistent = "unknown",
});

/// [`PairRecord::flags`]: the budget was used up before all was done that the pair asks for; effects that are missing were not
/// computed.
pub const PAIR_UNFINISHED: u32 = 1;

/// One pair of bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct PairRecord {
    /// Id of the first body; `a < b`.
    pub a: u32,
    /// Id of the second body.
    pub b: u32,
    /// A [`Verdict`].
    pub verdict: u8,
    /// A [`Level`].
    pub level: u8,
    /// A [`Relation`].
    pub relation: u8,
    /// A [`Containment`].
    pub containment: u8,
    /// The pair's first record in [`SECTION_POLYGON_PAIRS`].
    pub first_polygon_pair: u32,
    /// How many records it has there.
    pub polygon_pair_count: u32,
    /// [`PAIR_UNFINISHED`], or 0.
    pub flags: u32,
}

/// One pair of interfering polygons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub struct PolygonPairRecord {
    /// Polygon of body `a`, by the caller's number.
    pub a: u32,
    /// Polygon of body `b`, by the caller's number.
    pub b: u32,
    /// A [`Relation`], in 4 bytes.
    pub relation: u32,
}

const _: () = assert!(size_of::<PairRecord>() == 24);
const _: () = assert!(size_of::<PolygonPairRecord>() == 12);
const _: () = assert!(size_of::<StageCounts>() == 128);
const _: () = assert!(size_of::<StageTimes>() == 72);
const _: () = assert!(size_of::<ReportHeader>() == 376);
