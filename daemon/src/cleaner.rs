//! Clears up the iceoryx2 files of dead clients, on a thread of its own: it takes milliseconds, which no step should wait.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use collided_client::transport::Service;
use iceoryx2::prelude::Node;

/// A dying process closes its socket some time before the locks by which iceoryx2 knows that it is dead.
const PAUSES: [Duration; 3] = [Duration::from_millis(20), Duration::from_millis(100), Duration::from_millis(500)];

/// Tells the cleaning thread that a client is gone. The thread is ended, and waited for, when this is dropped: it must not
/// be at work while the daemon removes its last files.
pub struct Cleaner {
    gone: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Cleaner {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system has no thread left.
    pub fn start(node: Arc<Node<Service>>) -> std::io::Result<Cleaner> {
        let (gone, told) = channel();
        let thread = thread::Builder::new().name("cleaner".to_owned()).spawn(move || clean(&node, &told))?;
        Ok(Cleaner { gone: Some(gone), thread: Some(thread) })
    }

    /// A client has disconnected.
    pub fn client_gone(&self) {
        if let Some(gone) = &self.gone {
            // A thread that has panicked can clean no more; the daemon's end and the next start still do.
            let _ = gone.send(());
        }
    }
}

impl Drop for Cleaner {
    fn drop(&mut self) {
        drop(self.gone.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the cleaning thread has panicked");
        }
    }
}

/// After each departure: cleans up now, and again after each pause.
fn clean(node: &Node<Service>, told: &Receiver<()>) {
    while told.recv().is_ok() {
        let mut pauses = PAUSES.iter();
        loop {
            told.try_iter().for_each(drop);
            clean_up(node);
            let Some(&pause) = pauses.next() else { break };
            match told.recv_timeout(pause) {
                Ok(()) => pauses = PAUSES.iter(),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }
}

fn clean_up(node: &Node<Service>) {
    let state = node.try_cleanup_dead_nodes();
    if state.cleanups + state.failed_cleanups > 0 {
        tracing::info!(cleaned = state.cleanups, failed = state.failed_cleanups, "cleaned up after dead clients");
    }
}
