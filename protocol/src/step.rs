//! Transforms in: what a client writes into shared memory for one step, and the daemon reads there.
//!
//! The payload is a slice of 64-bit words. A **dense** step holds one [`Rows`] per living body, in ascending order of body
//! id. A **sparse** step holds `transform_count` body ids (`u32`, two to a word, the last word filled with zero), then as
//! many [`Rows`]; bodies that are not named keep their last transform.
//!
//! A **batch** moves no body: it holds `transform_count` body ids, filled up as those of a sparse step, then as many [`Rows`] for each of
//! `candidate_count` candidates, and nothing else.
//!
//! Behind the transforms of a step stand `rigid_count` [`RigidRecord`]s, of bodies that turn within the step, and `velocity_count`
//! [`VelocityRecord`]s, which the effect `response` takes.

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

/// [`StepHeader::kind`]: ids, then their transforms in each candidate. The answer has a verdict for each, and no body moves.
pub const STEP_BATCH: u32 = 2;

/// [`StepHeader::stop_at`]: every candidate is looked at.
pub const STOP_NEVER: u32 = 0;

/// [`StepHeader::motion`]: the affine matrix of a body without a [`RigidRecord`] is interpolated linearly from the last step's
/// transform to this one's.
pub const MOTION_LINEAR: u32 = 0;

/// The user header of a step request.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable, ZeroCopySend)]
#[repr(C)]
#[type_name("collided.StepHeader")]
pub struct StepHeader {
    /// [`crate::PROTOCOL_VERSION`] of the sender.
    pub protocol: u32,
    /// [`STEP_DENSE`], [`STEP_SPARSE`] or [`STEP_BATCH`].
    pub kind: u32,
    /// The client's number for this step; the report carries it back.
    pub sequence: u64,
    /// How many transforms follow; in a batch, for each candidate.
    pub transform_count: u32,
    /// Candidate poses in a batch; 1 in a step.
    pub candidate_count: u32,
    /// The motion kind; [`MOTION_LINEAR`] in this version.
    pub motion: u32,
    /// How many [`RigidRecord`]s follow the transforms; only in a sparse step.
    pub rigid_count: u32,
    /// The time between the last step and this one, in the caller's time unit; zero when unknown.
    pub delta_time: f64,
    /// How many [`VelocityRecord`]s follow; 0 in a batch.
    pub velocity_count: u32,
    /// Of a batch: [`STOP_NEVER`], or 1 plus the code of a [`Verdict`](crate::report::Verdict); candidates behind the first one of it need
    /// not be looked at. Else zero.
    pub stop_at: u32,
    /// When the client began to write the step, in nanoseconds of the host's monotonic clock; zero when unknown. A budget counts from then on.
    pub began: u64,
    /// 1 plus the number of the processor that the client runs on, zero when unknown. The daemon keeps off it while both are awake.
    pub processor: u32,
    /// Zero in this version.
    pub reserved: u32,
}

/// A body that moves rigidly from its last transform, and has none in this step: at the time t from 0 to 1 its vertices are at
/// `centre + t·translate + Rot(axis, angle·t)·(v − centre)`, v being where they were. The transform at t = 1 is the start of the
/// next step.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct RigidRecord {
    /// The body.
    pub body: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Direction of the axis, of any length but zero.
    pub axis: [f64; 3],
    /// A point on the axis at t = 0.
    pub centre: [f64; 3],
    /// In radians, counterclockwise seen against the axis; may exceed π.
    pub angle: f64,
    /// How far the centre moves.
    pub translate: [f64; 3],
}

/// How fast a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct VelocityRecord {
    /// The body.
    pub body: u32,
    /// Zero in this version.
    pub reserved: u32,
    /// Of its centre of mass, in the caller's units of length and time.
    pub linear: [f64; 3],
    /// In radians over the caller's time unit, about the world's axes.
    pub angular: [f64; 3],
}

const RIGID_WORDS: usize = size_of::<RigidRecord>() / size_of::<Word>();
const VELOCITY_WORDS: usize = size_of::<VelocityRecord>() / size_of::<Word>();

const _: () = assert!(size_of::<StepHeader>() == 64);
const _: () = assert!(RIGID_WORDS == 11 && VELOCITY_WORDS == 7);
const _: () = assert!(ROWS_WORDS == 12);

/// How many words `transform_count` ids take.
pub const fn id_words(transform_count: usize) -> usize {
    transform_count.div_ceil(2)
}

/// How many words the payload of a step takes, motions and velocities included.
pub const fn payload_words(kind: u32, transform_count: usize, rigid_count: usize, velocity_count: usize) -> usize {
    step_words(kind, transform_count) + rigid_count * RIGID_WORDS + velocity_count * VELOCITY_WORDS
}

/// How many words the payload of a batch takes.
pub const fn batch_words(body_count: usize, candidate_count: usize) -> usize {
    id_words(body_count) + body_count * candidate_count * ROWS_WORDS
}

/// How many words the ids and transforms of a step take.
pub const fn step_words(kind: u32, transform_count: usize) -> usize {
    let ids = if kind == STEP_SPARSE { id_words(transform_count) } else { 0 };
    ids + transform_count * ROWS_WORDS
}
