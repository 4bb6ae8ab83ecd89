//! `collided serve`: the daemon from its start to its orderly end.

use std::io::{Write, stderr};
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::thread;

use collided_client::TransportError;
use collided_client::transport;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::budget::Budget;
use crate::cleaner::Cleaner;
use crate::control;
use crate::rendezvous::{Claim, ClaimError};
use crate::settings::Settings;
use crate::state::Daemon;

/// Why the daemon could not start.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The instance could not be taken.
    #[error(transparent)]
    Claim(#[from] ClaimError),
    /// iceoryx2 could not be set up.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The workers could not be started.
    #[error("cannot start {threads} worker threads: {cause}; ask for fewer with --threads")]
    Workers {
        /// How many.
        threads: usize,
        /// What the system said.
        cause: rayon::ThreadPoolBuildError,
    },
    /// The system refused a signal handler, a thread, or the control socket.
    #[error("cannot {action}: {cause}")]
    System {
        /// What was being done.
        action: &'static str,
        /// What the system said.
        cause: std::io::Error,
    },
}

fn system(action: &'static str) -> impl FnOnce(std::io::Error) -> ServeError {
    move |cause| ServeError::System { action, cause }
}

/// Serves until SIGTERM, SIGINT or SIGHUP, and leaves nothing behind.
///
/// # Errors
/// All of [`ServeError`], before anybody was served.
pub fn run(settings: &Settings) -> Result<(), ServeError> {
    // Before anything is made that a signal would leave behind.
    let mut signals = Signals::new([SIGTERM, SIGINT, SIGHUP]).map_err(system("handle signals"))?;
    let claim = Claim::take(&settings.instance)?;
    let daemon = start(settings, &claim)?;
    let listener = UnixListener::bind(claim.socket()).map_err(system("open the control socket"))?;
    thread::scope(|scope| {
        scope.spawn(|| control::accept(&daemon, &listener));
        let published = claim.publish().map_err(ServeError::from);
        if published.is_ok() {
            let directory = claim.directory().display();
            // Nobody may be listening; that is no reason not to serve.
            let _ =
                writeln!(stderr(), "ready: instance {}, {} threads, {directory}", settings.instance, settings.threads);
            signals.forever().next();
        }
        daemon.shut_down();
        // Wakes the accepting thread; when the queue is full, it is awake.
        let _ = UnixStream::connect(claim.socket());
        published
    })
    // The node goes with the daemon, before the claim removes what iceoryx2 may have left.
    .inspect(|()| drop(daemon))
}

fn start(settings: &Settings, claim: &Claim) -> Result<Arc<Daemon>, ServeError> {
    let threads = settings.threads;
    let budget = Budget::new(threads).map_err(|cause| ServeError::Workers { threads, cause })?;
    let node = Arc::new(transport::create_node(&claim.rendezvous())?);
    let cleaner = Cleaner::start(Arc::clone(&node)).map_err(system("start the cleaning thread"))?;
    Ok(Arc::new(Daemon::new(budget, node, cleaner, claim.epoch().to_owned())))
}
