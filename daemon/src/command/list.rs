//! `collided list`.

use std::io::Write;
use std::process::ExitCode;

use collided_client::ObjectInfo;

use super::{Connection, Outcome, human_bytes};

/// Lists the objects of a running daemon.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// Only this database
    pub database: Option<String>,
    /// One JSON object a line instead of a table
    #[arg(long)]
    pub json: bool,
    /// Which daemon
    #[command(flatten)]
    pub connection: Connection,
}

/// Prints the objects, ordered by database, then name.
///
/// # Errors
/// No daemon, or no such database.
pub fn run(args: &Args) -> Outcome {
    let client = args.connection.connect()?;
    let objects = match &args.database {
        Some(database) => client.database(database).list()?,
        None => client.list()?,
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        for object in &objects {
            writeln!(out, "{}", serde_json::to_string(object)?)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    print_table(&mut out, &objects)?;
    Ok(ExitCode::SUCCESS)
}

fn print_table(out: &mut impl Write, objects: &[ObjectInfo]) -> std::io::Result<()> {
    let widest = |name: fn(&ObjectInfo) -> &str, least: usize| {
        objects.iter().map(|object| name(object).chars().count()).fold(least, usize::max)
    };
    let (database, object) = (widest(|o| &o.database, 8), widest(|o| &o.object, 6));
    writeln!(
        out,
        "{:database$}  {:object$}  {:>9}  {:>9}  {:>5}  {:>9}  {:>11}  {:>8}  {:>6}",
        "DATABASE", "OBJECT", "VERTICES", "POLYGONS", "ORDER", "VOXELS", "MEMORY", "REVISION", "BODIES"
    )?;
    for o in objects {
        let memory = human_bytes(o.memory).to_string();
        writeln!(
            out,
            "{:database$}  {:object$}  {:>9}  {:>9}  {:>5}  {:>9}  {memory:>11}  {:>8}  {:>6}",
            o.database, o.object, o.vertices, o.polygons, o.order, o.occupied_voxels, o.revision, o.bodies
        )?;
    }
    Ok(())
}
