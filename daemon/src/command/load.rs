//! `collided load`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::{Connection, Outcome, human_bytes};
use crate::load_bar::LoadBar;

/// Loads a mesh file into a running daemon.
#[derive(Debug, Clone, clap::Args)]
pub struct Args {
    /// The database
    pub database: String,
    /// The mesh file: .obj, .stl, .ply or .off
    pub file: PathBuf,
    /// The object's name [default: the file's name without its ending]
    #[arg(long)]
    pub name: Option<String>,
    /// Order M of the voxel matrix, 0 to 30 [default: chosen from the polygons]
    #[arg(long)]
    pub order: Option<u32>,
    /// Replace an object of that name
    #[arg(long)]
    pub replace: bool,
    /// Which daemon
    #[command(flatten)]
    pub connection: Connection,
}

/// Loads the object, with a progress bar on a terminal, and prints what it has become.
///
/// # Errors
/// No daemon, or it refuses.
pub fn run(args: &Args) -> Outcome {
    let name = match &args.name {
        Some(name) => name.clone(),
        None => default_name(&args.file)?,
    };
    let database = args.connection.connect()?.database(&args.database);
    let bar = LoadBar::new(&name);
    let mut loading = database.loading(&name).replace(args.replace).on_progress(bar.observer());
    if let Some(order) = args.order {
        loading = loading.order(order);
    }
    let object = loading.file(&args.file);
    drop(bar);
    let object = object?;
    let info = object.info();
    writeln!(
        std::io::stdout(),
        "{}/{name}: {} polygons, order {}, {} voxels, {}",
        args.database,
        info.polygons,
        info.order,
        info.occupied_voxels,
        human_bytes(info.memory)
    )?;
    Ok(ExitCode::SUCCESS)
}

fn default_name(file: &Path) -> Result<String, String> {
    let stem = file.file_stem().and_then(|stem| stem.to_str());
    let remedy = || format!("{} has no name that an object could have; give one with --name", file.display());
    stem.map(str::to_owned).ok_or_else(remedy)
}
