//! The commands of the `collided` program that talk to a running daemon, `serve`, and `accuracy`.

use std::time::Duration;

use collided_client::Client;
use collided_protocol::names::DEFAULT_INSTANCE;

pub mod accuracy;
pub mod list;
pub mod load;
pub mod serve;
pub mod status;
pub mod unload;

/// What a command comes to: its exit status, or the reason of trouble (status 2).
pub type Outcome = Result<std::process::ExitCode, Box<dyn std::error::Error>>;

/// A person at a terminal would rather be told that no daemon runs than wait for one.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// Which daemon a command talks to.
#[derive(Debug, Clone, clap::Args)]
pub struct Connection {
    /// The daemon's instance
    #[arg(long, default_value = DEFAULT_INSTANCE)]
    pub instance: String,
}

impl Connection {
    /// Connects to the running daemon.
    ///
    /// # Errors
    /// As [`ClientBuilder::connect`](collided_client::ClientBuilder::connect).
    pub fn connect(&self) -> Result<Client, collided_client::Error> {
        Client::builder().instance(&self.instance).name("collided").timeout(CONNECT_TIMEOUT).connect()
    }
}

/// `bytes` for people.
fn human_bytes(bytes: u64) -> indicatif::HumanBytes {
    indicatif::HumanBytes(bytes)
}
