//! A daemon process of one's own, for commands that need no running one.

use std::io::{self, PipeWriter, Read};
use std::process::{ChildStderr, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use collided_client::Client;
use collided_protocol::names::Rendezvous;

use crate::own_process::{Interrupt, OwnProcess};
use crate::rendezvous;

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
///
/// It reads its lifeline, a pipe that nothing is ever written into, and ends when the last process that holds the other end
/// has ended, however that came about.
pub struct PrivateDaemon {
    process: OwnProcess,
    /// Dropped after the process has ended.
    remains: Remains,
    said: Option<JoinHandle<String>>,
    lifeline: PipeWriter,
}

/// What a daemon may leave that had to be killed, or whose clients were at work when it ended. Removed when dropped.
struct Remains {
    instance: String,
    /// What the daemon published; known when it was connected to.
    published: Option<Rendezvous>,
}

impl Drop for Remains {
    fn drop(&mut self) {
        rendezvous::remove_remains(&self.instance, self.published.as_ref());
    }
}

impl PrivateDaemon {
    /// Starts the process; [`PrivateDaemon::connect`] waits until it is ready. `interrupt` asks it to end, which cuts off
    /// whoever waits for it; `None` where its clients are to end first.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub fn start(interrupt: Option<&Interrupt>) -> Result<PrivateDaemon, PrivateDaemonError> {
        static STARTED: AtomicU32 = AtomicU32::new(0);
        let number = STARTED.fetch_add(1, Ordering::Relaxed);
        let instance = format!("private-{}-{number}", std::process::id());
        let start = || {
            let (read_end, lifeline) = io::pipe()?;
            let mut command = OwnProcess::command()?;
            command.args(["serve", "--while-stdin-open", "--instance", &instance]);
            command.stdin(read_end).stdout(Stdio::null()).stderr(Stdio::piped());
            Ok((OwnProcess::spawn(&mut command, interrupt)?, lifeline))
        };
        let (mut process, lifeline) = start().map_err(PrivateDaemonError::Start)?;
        let said = process.child().stderr.take().map(|stderr| std::thread::spawn(move || read_all(stderr)));
        let remains = Remains { instance, published: None };
        Ok(PrivateDaemon { process, remains, said, lifeline })
    }

    /// Its instance name.
    pub fn instance(&self) -> &str {
        &self.remains.instance
    }

    /// The end of the lifeline that keeps it alive, for a client process that it is to outlive.
    ///
    /// # Errors
    /// When the system has no descriptor left.
    pub fn lifeline(&self) -> io::Result<Stdio> {
        self.lifeline.try_clone().map(Stdio::from)
    }

    /// Connects a client of this process, called `name`; waits until the daemon is ready.
    ///
    /// # Errors
    /// When the daemon ends or does not answer.
    pub fn connect(&mut self, name: &str) -> Result<Client, PrivateDaemonError> {
        let patience = Instant::now() + START_TIMEOUT;
        loop {
            let client = Client::builder().instance(self.instance()).name(name).timeout(CONNECT_SLICE);
            let error = match client.connect() {
                Ok(client) => {
                    self.remains.published = rendezvous::published(self.instance());
                    return Ok(client);
                }
                Err(error) => error,
            };
            if let Some(status) = self.process.try_wait().map_err(PrivateDaemonError::Start)? {
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
