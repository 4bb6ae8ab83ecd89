//! `collided status`.

use std::io::Write;
use std::process::ExitCode;
use std::time::Duration;

use collided_client::Status;

use super::{Connection, Outcome, human_bytes};

/// Tells what a running daemon is doing.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// One JSON object instead of text
    #[arg(long)]
    pub json: bool,
    /// Which daemon
    #[command(flatten)]
    pub connection: Connection,
}

/// Prints the status.
///
/// # Errors
/// No daemon.
pub fn run(args: &Args) -> Outcome {
    let status = args.connection.connect()?.status()?;
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&status)?)?;
    } else {
        print(&mut out, &args.connection.instance, &status)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(out: &mut impl Write, instance: &str, status: &Status) -> std::io::Result<()> {
    let uptime = indicatif::HumanDuration(Duration::from_secs_f64(status.uptime_seconds));
    writeln!(out, "collided {}, instance {instance}, process {}, up {uptime}", status.version, status.pid)?;
    writeln!(out, "{} threads, {} objects, {}", status.threads, status.objects, human_bytes(status.object_memory))?;
    for client in &status.clients {
        writeln!(out, "client {:?}, process {}", client.name, client.pid)?;
    }
    for scene in &status.scenes {
        let (id, name, owner) = (scene.scene, &scene.name, scene.owner);
        writeln!(out, "scene {id} {name:?} of process {owner}: {} bodies, {} steps", scene.bodies, scene.steps)?;
    }
    Ok(())
}
