//! What can go wrong on the client's side of the wire.

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use collided_protocol::limits::{MAX_REPORTS_HELD, MAX_STEPS_IN_FLIGHT};
use collided_protocol::{ErrorCode, WireError};

/// Every error of this crate.
///
/// Its `Debug` is its `Display`, as in `anyhow`: a `main` that returns it prints the reason and the remedy, and exits with 1.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No daemon of that instance answered in time.
    #[error(
        "no daemon of instance {instance:?} answered at {directory} within {waited:.1?} ({reason}); \
         start one with `collided serve --instance {instance}`, or set the same XDG_RUNTIME_DIR for both",
        directory = directory.display()
    )]
    NoDaemon {
        /// The instance that was looked for.
        instance: String,
        /// The rendezvous directory where it was looked for.
        directory: PathBuf,
        /// How long.
        waited: Duration,
        /// What the last attempt met.
        reason: String,
    },
    /// The daemon died or shut down. Everything it held is gone; connect again.
    #[error("the daemon is gone: it was ended or it died; start it and connect again")]
    DaemonGone,
    /// The daemon refused a request or a step. Nothing was changed.
    #[error("{0}")]
    Refused(#[source] WireError),
    /// The protocol ranges of this crate and the daemon do not overlap.
    #[error(
        "the daemon speaks protocol {daemon_min} to {daemon_max}, this client {client_min} to {client_max}; \
         use client and daemon of the same release"
    )]
    ProtocolMismatch {
        /// Oldest version of the daemon.
        daemon_min: u32,
        /// Newest version of the daemon.
        daemon_max: u32,
        /// Oldest version of this crate.
        client_min: u32,
        /// Newest version of this crate.
        client_max: u32,
    },
    /// Daemon and client were built with different iceoryx2 versions.
    #[error(
        "the daemon was built with iceoryx2 {daemon}, this client with {client}: their shared memory differs; \
         build both with the same version"
    )]
    Iceoryx2Mismatch {
        /// Version of the daemon.
        daemon: String,
        /// Version of this crate.
        client: String,
    },
    /// The answer did not come in time. A step's report may still be collected from its [`Pending`](crate::Pending).
    #[error("no answer within {waited:.1?}; wait longer, or ask for less")]
    Deadline {
        /// How long was waited.
        waited: Duration,
    },
    /// As many steps as a scene may have were sent and are not answered.
    #[error(
        "{MAX_STEPS_IN_FLIGHT} steps of this scene are under way, which is the limit; collect one before sending the next"
    )]
    TooManyInFlight,
    /// As many reports as a scene may have are held.
    #[error(
        "{MAX_REPORTS_HELD} reports of this scene are held, which is the limit; drop one before sending the next step"
    )]
    TooManyReportsHeld,
    /// The report of this step was already collected.
    #[error("the report of this step was already collected; send another step")]
    AlreadyCollected,
    /// The host has not enough shared memory for a message.
    #[error("a message needs {needed} bytes of shared memory and only {free} are free; enlarge /dev/shm, or send less")]
    OutOfSharedMemory {
        /// Bytes needed, the reserve included.
        needed: u64,
        /// Bytes free.
        free: u64,
    },
    /// The daemon sent something that this crate cannot read.
    #[error("the daemon's answer cannot be read: {0}; use client and daemon of the same release")]
    BadReply(String),
    /// The shared memory or the socket failed.
    #[error("{0}")]
    Transport(#[from] TransportError),
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl Error {
    /// The daemon's code, when the daemon refused.
    pub fn code(&self) -> Option<ErrorCode> {
        match self {
            Error::Refused(wire) => Some(wire.code),
            _ => None,
        }
    }
}

/// A failure of the socket or of the shared memory below the protocol.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action}: {cause}")]
pub struct TransportError {
    action: &'static str,
    cause: String,
}

impl TransportError {
    /// What was being done, and what the layer below said.
    pub fn new(action: &'static str, cause: impl std::fmt::Display) -> Self {
        TransportError { action, cause: cause.to_string() }
    }
}
