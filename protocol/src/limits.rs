//! Every capacity, by name. Reaching one is an error that names it, never silent.

/// The largest order M of a voxel matrix: the container halved 30 times, 2^30 voxels.
pub const MAX_ORDER: u32 = 30;

/// The longest name of an instance, in bytes: it is part of a socket path, which the system limits to 108.
pub const MAX_INSTANCE_NAME: usize = 32;

/// The longest name of a database, object, body, scene or group, in bytes.
pub const MAX_NAME: usize = 256;

/// The largest control message, in bytes: bodies, interest rules and listings travel in these, meshes do not.
pub const MAX_CONTROL_MESSAGE: usize = 64 << 20;

/// The most bodies in a scene.
pub const MAX_BODIES: u32 = 1 << 20;

/// The most transforms in a batch, those of all candidates together: 96 MiB.
pub const MAX_BATCH_TRANSFORMS: u64 = 1 << 20;

/// The most vertices, polygons or corners of one object.
pub const MAX_MESH_ELEMENTS: u64 = 1 << 30;

/// The most words (8 bytes) in one part of a mesh uploaded through shared memory: 8 MiB.
pub const MAX_UPLOAD_PART_WORDS: usize = 1 << 20;

/// The most words (8 bytes) in one report: 2 GiB.
pub const MAX_REPORT_WORDS: usize = 1 << 28;

/// Steps that a client may have sent and not yet collected, per scene.
pub const MAX_STEPS_IN_FLIGHT: usize = 2;

/// Reports of a scene that a client may hold at once; the next step is refused until one is dropped.
pub const MAX_REPORTS_HELD: usize = 4;

/// Shared memory that must stay free on the host after a scene or an upload is created, in bytes. Segments are sparse:
/// a write beyond what the host has is a bus error, so it is refused before.
pub const MIN_FREE_SHARED_MEMORY: u64 = 16 << 20;
