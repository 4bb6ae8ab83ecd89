//! What crosses between a `collided` daemon and its clients: wire structs, names, limits and codes. No logic.
//!
//! Two channels connect a client with the daemon of its instance (see `docs/architecture.md`):
//!
//! * the **control channel**, a unix socket in the rendezvous directory, carries [`control`] messages: databases, scenes,
//!   bodies, interest, status. Its end of file is how each side learns that the other one is gone;
//! * the **step channel**, one iceoryx2 request-response service per scene, carries transforms in ([`step`]) and the
//!   interference report out ([`report`]). Both are written once, in shared memory, and read where they stand.

pub mod control;
pub mod effect_records;
pub mod effects;
pub mod error;
pub mod limits;
pub mod names;
pub mod report;
pub mod step;

pub use effects::{Effect, Effects};
pub use error::{ErrorCode, WireError};

/// The version of everything in this crate. It stands in every service name, in the rendezvous file and in every header;
/// a daemon and a client whose ranges do not overlap refuse each other by name.
pub const PROTOCOL_VERSION: u32 = 1;

/// The oldest version that this crate still understands.
pub const PROTOCOL_VERSION_MIN: u32 = 1;

/// The iceoryx2 version that both sides must have, to the letter: its shared-memory layout is not stable across versions.
pub const ICEORYX2_VERSION: &str = "0.10.0";
