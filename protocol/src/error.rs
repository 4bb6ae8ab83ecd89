//! The one error that crosses the wire, on either channel.

use serde::{Deserialize, Serialize};

/// What went wrong, as a number (`status` of a [report header](crate::report::ReportHeader)) and as a name (JSON).
///
/// New codes are only ever added at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
#[repr(u32)]
pub enum ErrorCode {
    /// The protocol ranges of client and daemon do not overlap.
    ProtocolMismatch = 1,
    /// Client and daemon were built with different iceoryx2 versions.
    Iceoryx2Mismatch = 2,
    /// A control message that is not JSON, lacks a field, has an unknown field, or came out of turn.
    BadMessage = 3,
    /// A message, a mesh or a report beyond a limit of [`crate::limits`].
    LimitExceeded = 4,
    /// The mesh file is not there or cannot be read.
    MeshUnreadable = 5,
    /// The mesh file does not follow its format.
    MeshMalformed = 6,
    /// A polygon names a vertex that the mesh does not have.
    IndexOutOfRange = 7,
    /// A polygon with fewer than 3 corners.
    TooFewCorners = 8,
    /// NaN or infinity in a vertex.
    NonFiniteVertex = 9,
    /// NaN or infinity in a transform.
    NonFiniteTransform = 10,
    /// A finite transform that carries a finite vertex beyond the range of f64.
    WorldOverflow = 11,
    /// The order asked for is beyond [`crate::limits::MAX_ORDER`].
    OrderOutOfRange = 12,
    /// The voxel matrix at the order asked for would not fit the limit.
    MatrixTooLarge = 13,
    /// No such database.
    UnknownDatabase = 14,
    /// No such object in the database.
    UnknownObject = 15,
    /// The database has an object of that name, and replacing it was not asked for.
    DuplicateObject = 16,
    /// The object cannot be unloaded: bodies of living scenes use it.
    ObjectInUse = 17,
    /// No such scene, or it was dropped, or another client owns it.
    UnknownScene = 18,
    /// No such body in the scene, or it was removed.
    UnknownBody = 19,
    /// The scene has a body of that name.
    DuplicateBody = 20,
    /// A name that is empty, too long, or has characters that a name cannot have.
    BadName = 21,
    /// The number of transforms does not fit the scene's bodies, or one body is named twice in a step.
    BadStep = 22,
    /// Not enough shared memory or memory on the host.
    OutOfMemory = 23,
    /// The daemon is shutting down.
    ShuttingDown = 24,
    /// An effect that the daemon does not compute.
    UnknownEffect = 25,
    /// Something failed inside the daemon; the message says what. Worth a bug report.
    Internal = 26,
    /// A motion within a step that is none: a number that is not finite, an axis of length zero.
    BadMotion = 27,
    /// An accuracy setting out of its range.
    BadAccuracy = 28,
    /// Mass, inertia, restitution, friction or a velocity out of range, or density given for a mesh that is not closed.
    BadDynamics = 29,
}

/// An error as it crosses the wire: what, where, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireError {
    /// What kind of error.
    pub code: ErrorCode,
    /// What and where: the object or body, the index, the value, the limit.
    pub message: String,
    /// What the reader can do about it.
    pub remedy: String,
}

impl WireError {
    /// An error with its message and its remedy.
    pub fn new(code: ErrorCode, message: impl Into<String>, remedy: impl Into<String>) -> Self {
        WireError { code, message: message.into(), remedy: remedy.into() }
    }
}

impl std::fmt::Display for WireError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}; {}", self.message, self.remedy)
    }
}

impl std::error::Error for WireError {}
