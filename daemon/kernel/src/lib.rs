//! The geometry of `collided`: objects, voxel matrices, and exact interference reports.
//!
//! No I/O, IPC, clock, logging or unsafe code. The files are the pipeline, in order:
//!
//! | built once per object | |
//! |---|---|
//! | [`mesh`], `triangulation`, [`topology`], [`object`] | polygons, cut into triangles; what they are as a surface |
//! | [`container`] | the object's box and its halving |
//! | `grid`, `polygon_box`, `voxel_lists`, [`voxel_matrix`], `cells`, `cell_boxes` | which polygons occupy which voxel |
//! | `cell_shapes` | how thin the surface is in a cell |
//!
//! | each step | |
//! |---|---|
//! | 1. [`scene`], [`accuracy`], [`transforms`], `places`, [`motion`], `path` | transforms in |
//! | 2. [`global_boxes`] | global bounding boxes |
//! | 3. [`broad_phase`] | overlapping boxes |
//! | 4. [`interest`] | the pairs that matter |
//! | 5. `submatrix` | containers and interference submatrices |
//! | 6. `voxel_pairs` | pairs of voxels that reach each other |
//! | `open_bound` | what is known of pairs that are not refined further |
//! | 7. `polygon_pairs` | pairs of polygons |
//! | 8. [`polygon_test`], [`predicates`] | exact polygon tests |
//! | 9. [`effects`] | the effects asked for, a file for each |
//! | 10. [`report`] | report out |
//!
//! [`batch`]: stages 1 to 8 for many candidate poses at once, a verdict for each.
//!
//! `instructions` lets stages 5 to 7 use the vector instructions that the processor has.
//!
//! [`brute_force`] holds the twins of the accelerated stages, [`candidates`](mod@candidates) runs stages 5 to 7 of one pair alone.
#![forbid(unsafe_code)]

pub mod affine;
pub mod motion;
pub mod mesh;
mod triangulation;
pub mod topology;
pub mod object;
pub mod container;
mod grid;
mod polygon_box;
mod voxel_lists;
pub mod voxel_matrix;
mod cell_shapes;
mod cells;
mod cell_boxes;

pub mod scene;
pub mod accuracy;
pub mod transforms;
mod places;
mod path;
pub mod global_boxes;
pub mod broad_phase;
pub mod interest;
mod submatrix;
mod voxel_pairs;
mod open_bound;
mod polygon_pairs;
pub mod candidates;
pub mod polygon_test;
pub mod predicates;
mod double;
mod instructions;
pub mod effects;
pub mod report;

pub mod batch;
pub mod step;
pub mod workforce;
pub mod brute_force;

pub use accuracy::{Accuracy, Budget};
pub use affine::Rows;
pub use batch::{BatchInput, BatchReport};
pub use container::{Container, MAX_ORDER};
pub use effects::Effects;
pub use effects::containment::Containment;
pub use glam;
pub use interest::{GroupId, Interest};
pub use mesh::PolygonMesh;
pub use motion::{Motion, MotionError};
pub use object::{Object, ObjectError, Progress};
pub use report::{Level, OpenBound, PairResult, PolygonPair, Relation, Report, StageCounts, StageTimes, Verdict};
pub use scene::{BodyId, Dynamics, Scene, UnknownBody};
pub use step::{Clock, CostPerPair, NoClock};
pub use transforms::{RigidMotion, StepError, StepInput, Transforms};
pub use workforce::Workforce;
