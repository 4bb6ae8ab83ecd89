//! The stages of a step that a report has times of, in their order.

use collided_kernel::StageTimes;

/// A name, and the time in nanoseconds.
pub type Stage = (&'static str, fn(&StageTimes) -> u64);

/// All of them.
pub const STAGES: [Stage; 7] = [
    ("1–2 boxes", |times| times.boxes),
    ("3 broad phase", |times| times.broad_phase),
    ("4 interest", |times| times.interest),
    ("5–6 voxels", |times| times.voxels),
    ("7 polygon pairs", |times| times.polygon_pairs),
    ("8 polygon tests", |times| times.polygon_tests),
    ("9 effects", |times| times.effects),
];
