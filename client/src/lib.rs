//! Client of the `collided` daemon: publish transforms, read interference reports in place.
//!
//! A [`Client`] is a connection to the daemon of one instance. A [`Database`] holds objects (meshes with their voxel
//! matrices) for all clients; a [`Scene`] places them as bodies and answers steps. A step's transforms are written into
//! shared memory once and read there by the daemon; the [`Report`] is read where the daemon wrote it, and given back
//! when it is dropped.
//!
//! ```no_run
//! use collided_client::{Client, Effect, IDENTITY, translation};
//!
//! # fn main() -> Result<(), collided_client::Error> {
//! let client = Client::connect()?;
//! let bunny = client.database("parts").load("bunny", "bunny.obj")?;
//! let mut scene = client.scene("cell").effects([Effect::PolygonPairs]).create()?;
//! scene.add_body("a", &bunny)?;
//! scene.add_body("b", &bunny)?;
//! let report = scene.step(&[IDENTITY, translation([0.5, 0.0, 0.0])])?;
//! for pair in report.pairs() {
//!     println!("{} and {}: {}", pair.a(), pair.b(), pair.verdict().name());
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Nothing waits for ever: each call has a deadline, and a daemon that dies is reported as [`Error::DaemonGone`].

mod batch;
mod connect;
mod database;
mod effect_results;
mod error;
mod scene;
mod step;
mod transform;
mod upload;

// Public so that tests can have any words read as a report, without a daemon; the API of it stands below.
#[doc(hidden)]
pub mod report;

// Shared with the daemon, which is the other side of the same wire; not part of the API.
#[doc(hidden)]
pub mod frame;
#[doc(hidden)]
pub mod instance;
#[doc(hidden)]
pub mod transport;

pub use batch::{Batch, BatchReport};
pub use collided_protocol::control::{
    Accuracy, ClampedOrder, ClientStatus, Dynamics, Mass, ObjectInfo, Reply, Request, SceneStatus, Status,
};
pub use collided_protocol::effect_records::{
    BoundRecord, ContactPointRecord, ContactSegmentRecord, DistanceRecord, ImpulseRecord, PenetrationRecord,
};
pub use collided_protocol::report::{Containment, Level, Relation, StageCounts, StageTimes, Verdict};
pub use collided_protocol::step::{Rows, VelocityRecord};
pub use collided_protocol::{Effect, Effects, ErrorCode, WireError};
pub use connect::{Client, ClientBuilder};
pub use database::{Database, Loading, Mesh, Object};
pub use effect_results::{ContactRegion, TimeOfContact};
pub use error::{Error, TransportError};
pub use report::{Pair, PolygonPair, Report};
pub use scene::{BodyId, BodySpec, Interest, Scene, SceneBuilder};
pub use step::{Pending, RigidMotion, StepInput, Velocity};
pub use transform::{IDENTITY, rotation, then, translation};
