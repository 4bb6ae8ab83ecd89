//! `collided serve`.

use std::io::{self, IsTerminal};
use std::process::ExitCode;
use std::thread;

use rustix::process::{Resource, Rlimit, Signal, getpid, getrlimit, kill_process, setrlimit};
use tracing_subscriber::EnvFilter;

use super::Outcome;
use crate::serve;
use crate::settings::Args;

/// Runs the daemon until SIGTERM or SIGINT.
///
/// # Errors
/// Settings that cannot be used, and [`serve::ServeError`].
pub fn run(args: Args) -> Outcome {
    let while_stdin_open = args.while_stdin_open;
    let settings = args.settings()?;
    let filter = EnvFilter::try_new(&settings.log)
        .map_err(|error| format!("the log filter {:?} cannot be used: {error}; try `info`", settings.log))?;
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal())
        // Telling a closed stderr of its failures would panic the thread that logs.
        .log_internal_errors(false)
        .init();
    raise_descriptor_limit();
    if while_stdin_open {
        thread::Builder::new().name("lifeline".to_owned()).spawn(end_with_stdin)?;
    }
    serve::run(&settings)?;
    Ok(ExitCode::SUCCESS)
}

/// A scene takes some fifteen descriptors. The limit that shells set is low for the sake of programs that use `select`.
fn raise_descriptor_limit() {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    if let Err(error) = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }) {
        tracing::warn!(%error, "the limit on open descriptors cannot be raised");
    }
}

/// Waits for the end of standard input, and then has this process end as by a signal: before the daemon handles signals,
/// that is at once, with nothing made yet; from then on in order.
fn end_with_stdin() {
    // A failure to read is an end as well.
    let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
    let _ = kill_process(getpid(), Signal::TERM);
}
