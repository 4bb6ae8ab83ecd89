//! Runs all poses of a file through the kernel, two bodies in one scene, and compares them with the brute-force twin.
//!
//! Exit status 1 when a verdict or a polygon pair differs between the effects or from the twin.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use collided_kernel::{Effects, Object, brute_force};
use collided_protocol::step::Rows;
use collided_tests::kernel_pair::{self, KernelPair, Outcome};
use collided_tests::npy;
use collided_tests::two_meshes::TwoMeshes;

/// Run poses of two meshes through the kernel, and compare polygon pairs with the brute-force twin.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    meshes: TwoMeshes,
    /// Poses: .npy, (n, 2, 3, 4) f64, rows of [R|t] for A then B
    #[arg(long)]
    poses: PathBuf,
    /// Compare this many poses, evenly spread, with the brute-force twin
    #[arg(long, default_value_t = 0)]
    twin: usize,
    /// Worker threads
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Write the verdicts here: {"idx": [...], "exact": [0 or 1, ...]}
    #[arg(long)]
    json: Option<PathBuf>,
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match with_threads(&arguments) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("poses: {error}");
            ExitCode::from(2)
        }
    }
}

fn with_threads(arguments: &Arguments) -> Result<usize, AnyError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build()?;
    pool.install(|| run(arguments))
}

/// How many poses differ.
fn run(arguments: &Arguments) -> Result<usize, AnyError> {
    let poses = npy::read_pose_pairs(&arguments.poses)?;
    let [a, b] = arguments.meshes.build();
    let verdicts = run_all("interference", Effects::INTERFERENCE, &a, &b, &poses)?;
    let outcomes = run_all("polygon_pairs", Effects::POLYGON_PAIRS, &a, &b, &poses)?;
    let differ = verdicts.iter().zip(&outcomes).filter(|(v, o)| v.interfering != o.interfering).count();
    println!("{differ} verdicts differ between the two effects");
    if let Some(path) = &arguments.json {
        write_verdicts(path, &verdicts)?;
    }
    Ok(differ + compare_with_twin(arguments.twin, &a, &b, &poses, &outcomes))
}

fn run_all(
    name: &str,
    effects: Effects,
    a: &Arc<Object>,
    b: &Arc<Object>,
    poses: &[[Rows; 2]],
) -> Result<Vec<Outcome>, AnyError> {
    let mut pair = KernelPair::new(a, b, effects);
    let (mut outcomes, mut times) = (Vec::new(), Vec::new());
    for &[rows_a, rows_b] in poses {
        let start = Instant::now();
        outcomes.push(pair.step(rows_a, rows_b)?);
        times.push(start.elapsed());
    }
    print_times(name, &outcomes, times);
    Ok(outcomes)
}

fn print_times(name: &str, outcomes: &[Outcome], mut times: Vec<Duration>) {
    times.sort_unstable();
    let hits = outcomes.iter().filter(|outcome| outcome.interfering).count();
    let median = times.get(times.len() / 2).copied().unwrap_or_default();
    let total: Duration = times.iter().sum();
    println!("{name}: {hits} of {} poses interfere; median {median:.1?} a pose, {total:.1?} in all", outcomes.len());
}

fn compare_with_twin(sample: usize, a: &Object, b: &Object, poses: &[[Rows; 2]], outcomes: &[Outcome]) -> usize {
    let count = sample.min(poses.len());
    let differs = |&pose: &usize| {
        let [rows_a, rows_b] = &poses[pose];
        let found = brute_force::polygon_pairs(a, rows_a, b, rows_b);
        let twin = found.iter().map(|found| (found.a, found.b, kernel_pair::relation(Some(found.relation))));
        let differs = !twin.eq(outcomes[pose].polygon_pairs.iter().copied());
        if differs {
            println!("pose {pose}: {} polygon pairs, the twin has {}", outcomes[pose].polygon_pairs.len(), found.len());
        }
        differs
    };
    let different = (0..count).map(|i| i * poses.len() / count).filter(differs).count();
    println!("{different} of {count} poses differ from the twin");
    different
}

fn write_verdicts(path: &Path, outcomes: &[Outcome]) -> Result<(), AnyError> {
    let exact: Vec<u32> = outcomes.iter().map(|outcome| outcome.interfering.into()).collect();
    let indices: Vec<usize> = (0..outcomes.len()).collect();
    Ok(std::fs::write(path, serde_json::json!({ "idx": indices, "exact": exact }).to_string())?)
}
