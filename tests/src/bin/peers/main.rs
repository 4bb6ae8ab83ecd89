//! Ours and parry on the same work, in one process, in turns; and the files that other programs need to do the same work.
//!
//! Prints one JSON object: of each library the microseconds and the answer of each pose, motion, step or build.
//! `tests/others/peers.py` runs it, beside other libraries if they are there, and prints the table.

mod daemon;
mod generated;
mod ours;
mod parry;
mod turns;
mod work;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use turns::Limits;

/// Run ours and parry on the same work, in turns.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// One kind of question to two meshes, over many poses
    Pair {
        /// What is asked
        question: Question,
        #[command(flatten)]
        meshes: Meshes,
        /// Poses: .npy, (n, 2, 3, 4) f64, rows of [R|t] for A, then B
        #[arg(long)]
        poses: PathBuf,
        /// Look at the first poses only that the question is about: interfering ones for polygon pairs, others for distance
        #[arg(long)]
        count: Option<usize>,
        #[command(flatten)]
        limits: Limits,
    },
    /// All poses of two meshes in one message to a daemon with two threads, beside parry, pose by pose, in this process
    Batch {
        #[command(flatten)]
        meshes: Meshes,
        /// Poses, as for pairs
        #[arg(long)]
        poses: PathBuf,
        #[command(flatten)]
        limits: Limits,
    },
    /// Steps through shared memory to a daemon with two threads, beside raw iceoryx2 of the same shape
    SharedMemory {
        /// How many of each shape
        #[arg(long, default_value_t = 500)]
        steps: usize,
    },
    /// Times of contact of two meshes
    TimeOfContact {
        #[command(flatten)]
        meshes: Meshes,
        /// Motions: .npy, (n, 2, 2, 3, 4) f64, rows of [R|t] for A at the start and the end, then B
        #[arg(long)]
        motions: PathBuf,
        /// Turn the bodies rigidly about their frames' origins; parry keeps A where it starts
        #[arg(long)]
        rigid: bool,
        #[command(flatten)]
        limits: Limits,
    },
    /// Steps of many bodies of one mesh
    Crowd {
        /// The mesh
        #[arg(long)]
        mesh: PathBuf,
        /// Steps: .npy, (steps, bodies, 3, 4) f64
        #[arg(long)]
        steps: PathBuf,
        /// Threads to use
        #[arg(long, default_value_t = 1)]
        threads: usize,
        #[command(flatten)]
        limits: Limits,
    },
    /// Build times, and memory held
    Build {
        /// The mesh
        #[arg(long)]
        mesh: PathBuf,
        /// Cut each triangle in four, so many times over
        #[arg(long, default_value_t = 0)]
        subdivide: u32,
        /// Threads to use
        #[arg(long, default_value_t = 2)]
        threads: usize,
        #[command(flatten)]
        limits: Limits,
    },
    /// Write a mesh as u32 vertex and triangle counts, f64 positions, u32 corners; little-endian
    Export {
        /// The mesh
        #[arg(long)]
        mesh: PathBuf,
        /// Cut each triangle in four, so many times over
        #[arg(long, default_value_t = 0)]
        subdivide: u32,
        /// The file to write
        #[arg(long)]
        out: PathBuf,
    },
    /// Write poses, motions or steps: the same on every machine
    Generate {
        /// What to write
        what: Generated,
        #[command(flatten)]
        meshes: Meshes,
        /// How many poses, motions or bodies
        #[arg(long, default_value_t = 1000)]
        count: usize,
        /// The .npy file to write
        #[arg(long)]
        out: PathBuf,
    },
}

/// What is asked of each pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Question {
    /// Whether they interfere, with nothing known of the pose before
    Boolean,
    /// Whether they interfere, each pose a step from the one before
    Smooth,
    /// All interfering polygon pairs
    PolygonPairs,
    /// The minimum distance and the nearest points
    Distance,
}

/// What can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Generated {
    /// A third each apart, near and interfering
    Poses,
    /// B passes A in small steps
    Smooth,
    /// B moves straight towards A, into it or past it
    Lin,
    /// The same, turning
    Rot,
    /// Ten steps of turning and drifting bodies
    Crowd,
}

#[derive(Args)]
struct Meshes {
    /// First mesh
    #[arg(long)]
    mesh_a: PathBuf,
    /// Second mesh; the first one again unless given
    #[arg(long)]
    mesh_b: Option<PathBuf>,
}

impl Meshes {
    fn paths(&self) -> [&PathBuf; 2] {
        [&self.mesh_a, self.mesh_b.as_ref().unwrap_or(&self.mesh_a)]
    }
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    match run(&Arguments::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("peers: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(command: &Command) -> Result<(), AnyError> {
    match command {
        Command::Pair { question, meshes, poses, count, limits } => {
            work::pair(*question, meshes.paths(), poses, *count, limits)
        }
        Command::Batch { meshes, poses, limits } => daemon::batch(meshes.paths(), poses, limits),
        Command::SharedMemory { steps } => daemon::shared_memory(*steps),
        Command::TimeOfContact { meshes, motions, rigid, limits } => {
            work::time_of_contact(meshes.paths(), motions, *rigid, limits)
        }
        Command::Crowd { mesh, steps, threads, limits } => work::crowd(mesh, steps, *threads, limits),
        Command::Build { mesh, subdivide, threads, limits } => work::build(mesh, *subdivide, *threads, limits),
        Command::Export { mesh, subdivide, out } => generated::export(mesh, *subdivide, out),
        Command::Generate { what, meshes, count, out } => generated::generate(*what, meshes.paths(), *count, out),
    }
}
