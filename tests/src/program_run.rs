//! A run of a program to its end: status and text.

use std::process::{Command, Output, Stdio};

/// What a run has given.
#[derive(Debug)]
pub struct ProgramRun {
    /// Exit status; `None` when a signal ended it.
    pub status: Option<i32>,
    /// What it printed.
    pub stdout: String,
    /// What it complained of.
    pub stderr: String,
}

impl ProgramRun {
    /// Runs a command that reads nothing.
    ///
    /// # Panics
    /// When the program cannot be run, or prints what is not text.
    pub fn of(command: &mut Command) -> ProgramRun {
        let Output { status, stdout, stderr } = command.stdin(Stdio::null()).output().expect("the program runs");
        let text = |bytes| String::from_utf8(bytes).expect("the output is text");
        ProgramRun { status: status.code(), stdout: text(stdout), stderr: text(stderr) }
    }

    /// Asserts that it ended with trouble, and that the reason has all of `parts`.
    ///
    /// # Panics
    /// When that is not so.
    pub fn is_trouble(&self, parts: &[&str]) {
        assert_eq!(self.status, Some(2), "{}", self.stderr);
        for part in parts {
            assert!(self.stderr.contains(part), "{}does not say {part}", self.stderr);
        }
    }
}
