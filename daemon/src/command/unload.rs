//! `collided unload`.

use std::process::ExitCode;

use super::{Connection, Outcome};

/// Removes an object from a running daemon.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The database
    pub database: String,
    /// The object
    pub object: String,
    /// Which daemon
    #[command(flatten)]
    pub connection: Connection,
}

/// Removes the object.
///
/// # Errors
/// No daemon, or it refuses.
pub fn run(args: &Args) -> Outcome {
    args.connection.connect()?.database(&args.database).unload(&args.object)?;
    Ok(ExitCode::SUCCESS)
}
