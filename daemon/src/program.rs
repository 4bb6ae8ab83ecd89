//! The command line of the `collided` program. Here, and not in its `main`, so that tests start the same program.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::{check, command, demo, settings};

/// A zero-copy shared-memory collision daemon: exact interference reports for every process of a host.
#[derive(Parser)]
#[command(name = "collided", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run the daemon
    Serve(settings::Args),
    /// Show the whole thing: a private daemon, two client processes, real meshes
    Demo(demo::Args),
    /// Check scene files
    Check(check::Args),
    /// Show what accuracy costs in time on a scene
    Accuracy(command::accuracy::Args),
    /// Load a mesh file into the running daemon
    Load(command::load::Args),
    /// List the objects of the running daemon
    List(command::list::Args),
    /// Remove an object from the running daemon
    Unload(command::unload::Args),
    /// Tell what the running daemon is doing
    Status(command::status::Args),
    /// One of the two clients of the demo
    #[command(hide = true)]
    DemoClient(demo::client::Args),
}

/// Trouble: as with `diff`, 0 and 1 are answers.
const TROUBLE: u8 = 2;

/// Runs the command that the arguments of this process name. Returns the process's exit status.
pub fn run() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Serve(args) => command::serve::run(args),
        Command::Demo(args) => demo::run(args),
        Command::Check(args) => check::run(args),
        Command::Accuracy(args) => command::accuracy::run(&args),
        Command::Load(args) => command::load::run(&args),
        Command::List(args) => command::list::run(&args),
        Command::Unload(args) => command::unload::run(&args),
        Command::Status(args) => command::status::run(&args),
        Command::DemoClient(args) => demo::client::run(args),
    };
    outcome.unwrap_or_else(|error| {
        eprintln!("collided: {error}");
        ExitCode::from(TROUBLE)
    })
}
