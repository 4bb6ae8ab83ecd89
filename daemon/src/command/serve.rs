//! `collided serve`.

use std::process::ExitCode;

use tracing_subscriber::EnvFilter;

use super::Outcome;
use crate::serve;
use crate::settings::Args;

/// Runs the daemon until SIGTERM or SIGINT.
///
/// # Errors
/// Settings that cannot be used, and [`serve::ServeError`].
pub fn run(args: Args) -> Outcome {
    let settings = args.settings()?;
    let filter = EnvFilter::try_new(&settings.log)
        .map_err(|error| format!("the log filter {:?} cannot be used: {error}; try `info`", settings.log))?;
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).init();
    serve::run(&settings)?;
    Ok(ExitCode::SUCCESS)
}
