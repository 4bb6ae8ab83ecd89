//! What the tests of `collided` share: an exact oracle, the hard cases, and processes to test with.

pub mod ccd;
pub mod ccd_queries;
pub mod crowd;
pub mod contact_pairs;
pub mod solids;
pub mod client_process;
pub mod daemon_process;
pub mod derived_meshes;
pub mod exact_distance;
pub mod fuzz_targets;
pub mod hardcases;
pub mod kernel_pair;
pub mod meshes;
pub mod near_contact;
pub mod npy;
pub mod oracle;
pub mod plain_f64;
pub mod program_run;
pub mod small_meshes;
pub mod stages;
pub mod touching_bodies;
pub mod transforms;
pub mod triangle_pairs;
pub mod triangles_on_planes;
pub mod two_meshes;
