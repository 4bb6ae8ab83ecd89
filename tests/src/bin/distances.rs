//! Times the effect `distance` over the poses of a file whose bodies are apart, and compares it with the brute-force twin.
//!
//! Timed as the other libraries are: the better of two calls for each pose. Exit status 1 when a distance differs from the twin.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use collided_kernel::effects::distance::{Distance, DistanceSettings, Memory, distance};
use collided_kernel::{Object, brute_force};
use collided_protocol::step::Rows;
use collided_tests::npy;
use collided_tests::two_meshes::TwoMeshes;

/// Run poses of two meshes through the effect distance.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    meshes: TwoMeshes,
    /// Poses: .npy, (n, 2, 3, 4) f64, rows of [R|t] for A then B
    #[arg(long)]
    poses: PathBuf,
    /// The first so many poses whose bodies are apart
    #[arg(long, default_value_t = 100)]
    count: usize,
    /// The first so many poses whose bodies interfere, instead
    #[arg(long)]
    interfering: bool,
    /// Larger distances are not wanted
    #[arg(long, default_value_t = f64::INFINITY)]
    up_to: f64,
    /// Relative tolerance
    #[arg(long, default_value_t = 0.0)]
    tolerance: f64,
    /// Repeat all this many times, for a profiler
    #[arg(long, default_value_t = 1)]
    repeat: usize,
    /// Compare this many poses with the brute-force twin
    #[arg(long, default_value_t = 0)]
    twin: usize,
    /// Write the distances here: {"idx": [...], "value": [...]}
    #[arg(long)]
    json: Option<PathBuf>,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("distances: {error}");
            ExitCode::from(2)
        }
    }
}

struct Timed {
    pose: usize,
    rows: [Rows; 2],
    found: Option<Distance>,
    time: Duration,
}

/// How many poses differ from the twin.
fn run(arguments: &Arguments) -> Result<usize, Box<dyn std::error::Error>> {
    let poses = npy::read_pose_pairs(&arguments.poses)?;
    let [a, b] = arguments.meshes.build();
    let mut memory = Memory::default();
    let mut all = Vec::new();
    for _ in 0..arguments.repeat.max(1) {
        all = time_all(arguments, &a, &b, &poses, &mut memory);
    }
    print_times(&all);
    if let Some(path) = &arguments.json {
        let indices: Vec<usize> = all.iter().map(|timed| timed.pose).collect();
        let values: Vec<Option<f64>> = all.iter().map(|timed| timed.found.map(|found| found.value)).collect();
        std::fs::write(path, serde_json::json!({ "idx": indices, "value": values }).to_string())?;
    }
    Ok(compare_with_twin(arguments.twin, &a, &b, &all))
}

fn time_all(arguments: &Arguments, a: &Object, b: &Object, poses: &[[Rows; 2]], memory: &mut Memory) -> Vec<Timed> {
    let near = DistanceSettings { up_to: 0.0, relative_tolerance: 0.0 };
    let settings = DistanceSettings { up_to: arguments.up_to, relative_tolerance: arguments.tolerance };
    let mut all = Vec::new();
    for (pose, rows) in poses.iter().enumerate() {
        let touching = distance((a, &rows[0]), (b, &rows[1]), near, memory);
        if touching.is_some_and(|found| found.value == 0.0) != arguments.interfering {
            continue;
        }
        let timed = [(); 2].map(|()| {
            let start = Instant::now();
            let found = distance((a, &rows[0]), (b, &rows[1]), settings, memory);
            (found, start.elapsed())
        });
        let [(found, first), (_, second)] = timed;
        all.push(Timed { pose, rows: *rows, found, time: first.min(second) });
        if all.len() == arguments.count {
            break;
        }
    }
    all
}

fn print_times(all: &[Timed]) {
    let mut times: Vec<f64> = all.iter().map(|timed| timed.time.as_secs_f64() * 1e6).collect();
    times.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| times.get((times.len() as f64 * share) as usize).copied().unwrap_or_default();
    let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
    let largest = times.last().copied().unwrap_or_default();
    println!("{} poses, µs: median {:.1}, mean {mean:.1}, p95 {:.1}, max {largest:.1}", times.len(), at(0.5), at(0.95));
}

fn compare_with_twin(count: usize, a: &Object, b: &Object, all: &[Timed]) -> usize {
    let differs = |timed: &&Timed| {
        let twin = brute_force::distance(a, &timed.rows[0], b, &timed.rows[1]);
        let found = timed.found.map(|found| (found.value, [found.polygon_a, found.polygon_b]));
        if found != twin {
            println!("pose {}: {found:?}, the twin has {twin:?}", timed.pose);
        }
        found != twin
    };
    all.iter().take(count).filter(differs).count()
}
