//! Clears up the iceoryx2 files of dead clients, on a thread of its own: it takes milliseconds, which no step should wait.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Duration;

use collided_client::transport::Service;
use iceoryx2::prelude::Node;

/// A dying process closes its socket some time before the locks by which iceoryx2 knows that it is dead.
const ATTEMPTS: [Duration; 4] =
    [Duration::ZERO, Duration::from_millis(20), Duration::from_millis(100), Duration::from_millis(500)];

/// Tells the cleaning thread that a client is gone. The thread ends when this is dropped.
pub struct Cleaner {
    gone: Sender<()>,
}

impl Cleaner {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub fn start(node: Arc<Node<Service>>) -> std::io::Result<Cleaner> {
        let (gone, told) = channel();
        thread::Builder::new().name("cleaner".to_owned()).spawn(move || clean(&node, &told))?;
        Ok(Cleaner { gone })
    }

    /// A client has disconnected.
    pub fn client_gone(&self) {
        // Without the thread, which then is ending with the daemon, nobody needs to know.
        let _ = self.gone.send(());
    }
}

fn clean(node: &Node<Service>, told: &Receiver<()>) {
    while told.recv().is_ok() {
        for delay in ATTEMPTS {
            thread::sleep(delay);
            while told.try_recv().is_ok() {}
            let state = node.try_cleanup_dead_nodes();
            if state.cleanups + state.failed_cleanups > 0 {
                tracing::info!(
                    cleaned = state.cleanups,
                    failed = state.failed_cleanups,
                    "cleaned up after dead clients"
                );
            }
        }
    }
}
