//! Client processes to test with: each steps a scene of its own until it is told to end.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

use serde::{Deserialize, Serialize};

use crate::daemon_process::{DaemonProcess, await_end, program, read_all};

/// What a stepping client has seen, as it prints it when it ends.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Steps that were answered with a report.
    pub steps: u64,
    /// The different numbers of polygon pairs in these reports, ascending.
    pub polygon_pairs: Vec<usize>,
    /// The error that ended it, as its `Debug` text begins: `DaemonGone`, `Refused(…`.
    pub error: Option<String>,
}

/// A client process that places one object twice, and steps.
#[derive(Debug)]
pub struct SteppingClient {
    child: Child,
    stdout: BufReader<ChildStdout>,
    /// The id of its scene.
    pub scene: u32,
}

impl SteppingClient {
    /// Starts a client that places `object` of `database` twice at the identity, and waits until it has made its first step.
    ///
    /// # Panics
    /// When it does not come so far.
    pub fn start(daemon: &DaemonProcess, database: &str, object: &str) -> SteppingClient {
        SteppingClient::start_with(daemon, database, object, 0.0)
    }

    /// As [`SteppingClient::start`], with the second body moved so far along z.
    ///
    /// # Panics
    /// When it does not come so far.
    pub fn start_with(daemon: &DaemonProcess, database: &str, object: &str, above: f64) -> SteppingClient {
        let mut command = Command::new(program("stepping_client"));
        command.arg(daemon.directory()).args([database, object, &above.to_string()]);
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the client can be started");
        let mut stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
        let mut line = String::new();
        stdout.read_line(&mut line).expect("the client's stdout can be read");
        let scene = line.trim().parse().expect("the client prints its scene's id after its first step");
        SteppingClient { child, stdout, scene }
    }

    /// Its process id.
    pub fn pid(&self) -> i32 {
        self.child.id() as i32
    }

    /// Kills it, as `kill -9` does.
    ///
    /// # Panics
    /// When it cannot be killed.
    pub fn kill(mut self) {
        self.child.kill().expect("the client can be killed");
        self.child.wait().expect("the client can be waited for");
    }

    /// Tells it to end. Returns what it has seen.
    ///
    /// # Panics
    /// When it ends with an error status.
    pub fn finish(mut self) -> Summary {
        drop(self.child.stdin.take());
        self.await_summary()
    }

    /// Waits until it has ended by itself. Returns what it has seen.
    ///
    /// # Panics
    /// When it ends with an error status.
    pub fn await_summary(&mut self) -> Summary {
        let summary = read_all(&mut self.stdout);
        assert!(await_end(&mut self.child).success(), "the client failed: {summary}");
        serde_json::from_str(&summary).expect("the client prints a summary at its end")
    }
}

impl Drop for SteppingClient {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
