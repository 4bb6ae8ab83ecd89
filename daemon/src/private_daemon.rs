//! A daemon process of one's own, for commands that need no running one.

use std::io::{self, Read};
use std::process::{ChildStderr, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use collided_client::Client;

use crate::own_process::{Interrupt, OwnProcess};

/// How long a daemon may take to be ready.
const START_TIMEOUT: Duration = Duration::from_secs(10);
/// How long one attempt to connect waits before the process is looked at again.
const CONNECT_SLICE: Duration = Duration::from_millis(100);

/// Why there is no private daemon.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PrivateDaemonError {
    /// The system did not let the process be started.
    #[error("a private daemon cannot be started: {0}; check the limits on processes and memory")]
    Start(#[source] io::Error),
    /// The process ended before anybody could connect.
    #[error("the private daemon ended at once, {status}; it said: {said}")]
    Ended {
        /// How it ended.
        status: std::process::ExitStatus,
        /// What it wrote to its standard error.
        said: String,
    },
    /// The process runs, but cannot be connected to.
    #[error("the private daemon does not answer: {0}")]
    Connect(#[source] collided_client::Error),
}

/// A daemon process under an instance name that nobody else uses. Ended when dropped, with all that it holds.
pub struct PrivateDaemon {
    process: OwnProcess,
    instance: String,
    said: Option<JoinHandle<String>>,
}

impl PrivateDaemon {
    /// Starts the process; [`PrivateDaemon::connect`] waits until it is ready.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub fn start(interrupt: &Interrupt) -> Result<PrivateDaemon, PrivateDaemonError> {
        static STARTED: AtomicU32 = AtomicU32::new(0);
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let instance = format!("private-{}-{number}", std::process::id());
        let start = || {
            let mut command = OwnProcess::command()?;
            command.args(["serve", "--instance", &instance]);
            command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
            OwnProcess::spawn(&mut command, interrupt)
        };
        let mut process = start().map_err(PrivateDaemonError::Start)?;
        let said = process.child().stderr.take().map(|stderr| std::thread::spawn(move || read_all(stderr)));
        Ok(PrivateDaemon { process, instance, said })
    }

    /// Its instance name.
    pub fn instance(&self) -> &str {
        &self.instance
    }

    /// Connects a client of this process, called `name`; waits until the daemon is ready.
    ///
    /// # Errors
    /// When the daemon ends or does not answer.
    pub fn connect(&mut self, name: &str) -> Result<Client, PrivateDaemonError> {
        let patience = Instant::now() + START_TIMEOUT;
        loop {
            let client = Client::builder().instance(&self.instance).name(name).timeout(CONNECT_SLICE);
            let error = match client.connect() {
                Ok(client) => return Ok(client),
                Err(error) => error,
            };
            if let Some(status) = self.process.child().try_wait().map_err(PrivateDaemonError::Start)? {
                let said = self.said.take().and_then(|said| said.join().ok()).unwrap_or_default();
                return Err(PrivateDaemonError::Ended { status, said: said.trim().to_owned() });
            }
            if !matches!(error, collided_client::Error::NoDaemon { .. }) || Instant::now() > patience {
                return Err(PrivateDaemonError::Connect(error));
            }
        }
    }

    /// Ends the daemon and waits until it is gone.
    ///
    /// # Errors
    /// When the system does not let it be waited for.
    pub fn end(self) -> io::Result<()> {
        self.process.end().map(drop)
    }
}

/// What a daemon writes to its standard error until it ends.
fn read_all(mut stderr: ChildStderr) -> String {
    let mut bytes = Vec::new();
    // What came before a failure is still worth telling.
    let _ = stderr.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}
