//! Where an instance is found, and what its iceoryx2 services are called.
//!
//! The daemon of instance `i` keeps the directory `$XDG_RUNTIME_DIR/collided/i`, else `/tmp/collided-<uid>/i`, mode 0700:
//! [`LOCK_FILE`], [`RENDEZVOUS_FILE`] and [`SOCKET_FILE`]. The iceoryx2 root of the present epoch stands in `/tmp`, under a
//! short name: iceoryx2 puts sockets there, and the system limits their paths to 108 bytes.

use serde::{Deserialize, Serialize};

/// The instance of those who do not name one.
pub const DEFAULT_INSTANCE: &str = "default";
/// Held locked by the living daemon; holds its pid as text.
pub const LOCK_FILE: &str = "lock";
/// A [`Rendezvous`] as JSON; readable without iceoryx2. Written last, so that what it names is ready.
pub const RENDEZVOUS_FILE: &str = "daemon.json";
/// The control channel.
pub const SOCKET_FILE: &str = "control";

/// What a client must know before it can speak to the daemon.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rendezvous {
    /// Different for every start of a daemon.
    pub epoch: String,
    /// The daemon's process id.
    pub pid: u32,
    /// Oldest protocol version that the daemon understands.
    pub protocol_min: u32,
    /// Newest protocol version that the daemon understands.
    pub protocol_max: u32,
    /// The daemon's iceoryx2 version; must equal the client's.
    pub iceoryx2: String,
    /// iceoryx2 `global.prefix` of this epoch.
    pub iceoryx2_prefix: String,
    /// iceoryx2 `global.root_path` of this epoch.
    pub iceoryx2_root: String,
    /// The daemon's own version.
    pub version: String,
}

/// Name of the request-response service that carries the steps of a scene.
pub fn step_service(scene: u32) -> String {
    format!("collided/v{}/scene/{scene}/step", crate::PROTOCOL_VERSION)
}

/// Name of the event service that wakes the daemon when a step was sent.
pub fn wake_service(scene: u32) -> String {
    format!("collided/v{}/scene/{scene}/wake", crate::PROTOCOL_VERSION)
}

/// Name of the event service that wakes the client when a report was sent.
pub fn reply_service(scene: u32) -> String {
    format!("collided/v{}/scene/{scene}/reply", crate::PROTOCOL_VERSION)
}

/// Name of the one-shot publish-subscribe service through which a mesh is uploaded from a client's memory.
pub fn upload_service(upload: u32) -> String {
    format!("collided/v{}/upload/{upload}", crate::PROTOCOL_VERSION)
}
