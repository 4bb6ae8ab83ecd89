//! How the time of a step, builds and memory grow, and where a step's time goes: the tables and plots of docs/performance.md.
//!
//! `cargo run --release -p collided-tests --bin scaling` prints the tables and writes the plots. In one process, without
//! daemon or shared memory.

mod bodies;
mod figure;
mod near;
mod orders;
mod stages;
mod triangles;

use std::path::PathBuf;

use clap::Parser;
use collided::accuracy::machine;

/// Measure how times and memory grow with bodies, triangles and orders.
#[derive(Parser)]
struct Arguments {
    /// Folder of the plots
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/performance"))]
    out: PathBuf,
    /// End each curve after a few points
    #[arg(long)]
    quick: bool,
}

fn main() -> std::io::Result<()> {
    let Arguments { out, quick } = Arguments::parse();
    std::fs::create_dir_all(&out)?;
    machine::describe().iter().for_each(|(what, value)| println!("* {what}: {value}"));
    for (name, plot) in
        bodies::measure(quick).into_iter().chain(triangles::measure(quick)).chain(orders::measure(quick))
    {
        std::fs::write(out.join(name).with_extension("svg"), collided::accuracy::plot::draw(&plot))?;
    }
    stages::measure();
    Ok(())
}
