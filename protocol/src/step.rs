//! Transforms in: what a client writes into shared memory for one step, and the daemon reads there.
//!
//! The payload is a slice of 64-bit words. A **dense** step holds one [`Rows`] per living body, in ascending order of body
//! id. A **sparse** step holds `transform_count` body ids (`u32`, two to a word, the last word filled with zero), then as
//! many [`Rows`]; bodies that are not named keep their last transform.

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

/// An affine transform, row-major: three rows of (rotation, scale, shear | translation), in the caller's length unit.
/// Body frame to world: `world = ((m0*x + m1*y) + m2*z) + m3` per row, in f64, rounded to nearest, no FMA.
pub type Rows = [[f64; 4]; 3];

/// The element of a step's and of a report's payload.
pub type Word = u64;

/// How many words one [`Rows`] takes.
pub const ROWS_WORDS: usize = size_of::<Rows>() / size_of::<Word>();

/// [`StepHeader::kind`]: one transform per living body, in ascending order of id.
pub const STEP_DENSE: u32 = 0;
/// [`StepHeader::kind`]: ids, then transforms.
pub const STEP_SPARSE: u32 = 1;

/// [`StepHeader::motion`]: the affine matrix is interpolated linearly from the last step's transform to this one's.
pub const MOTION_LINEAR: u32 = 0;

/// The user header of a step request.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("collided.StepHeader")]
pub struct StepHeader {
    /// [`crate::PROTOCOL_VERSION`] of the sender.
    pub protocol: u32,
    /// [`STEP_DENSE`] or [`STEP_SPARSE`].
    pub kind: u32,
    /// The client's number for this step; the report carries it back.
    pub sequence: u64,
    /// How many transforms follow.
    pub transform_count: u32,
    /// Candidate poses in a batch; 1 in this version.
    pub candidate_count: u32,
    /// The motion kind; [`MOTION_LINEAR`] in this version.
    pub motion: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// The time between the last step and this one, in the caller's time unit; zero when unknown.
    pub delta_time: f64,
}

const _: () = assert!(size_of::<StepHeader>() == 40);
const _: () = assert!(ROWS_WORDS == 12);

/// How many words the ids of a sparse step with `transform_count` transforms take.
pub const fn id_words(transform_count: usize) -> usize {
    transform_count.div_ceil(2)
}

/// How many words the payload of a step takes.
pub const fn step_words(kind: u32, transform_count: usize) -> usize {
    let ids = if kind == STEP_SPARSE { id_words(transform_count) } else { 0 };
    ids + transform_count * ROWS_WORDS
}
