//! Runs all motions of a file through the kernel, and checks the times of contact by a scan of exact static tests.
//!
//! Exit status 1 when a bracket is wrong: a static contact before it, none soon after it, or one in a motion proven
//! free.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
use collided_kernel::motion::Motion;
use collided_kernel::{Effects, Object};
use collided_protocol::step::Rows;
use collided_tests::ccd::{self, Measured, MeasuredCase};
use collided_tests::kernel_pair::KernelPair;
use collided_tests::npy::{self, NpyError};
use collided_tests::two_meshes::TwoMeshes;

/// Run motions of two meshes through the kernel, and check the times of contact by a scan of exact static tests.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    meshes: TwoMeshes,
    /// Motions: .npy, (n, 2, 2, 3, 4) f64, rows of [R|t] for A at the start and the end, then B
    #[arg(long, required_unless_present = "measured")]
    motions: Option<PathBuf>,
    /// Rigid motions with known first contacts, of the form of tests/data/ccd/measured_ccd_env_rob.json; brackets are compared with these
    #[arg(long, conflicts_with_all = ["motions", "rigid"])]
    measured: Option<PathBuf>,
    /// Turn the bodies rigidly about their frames' origins, rather than moving every vertex straight
    #[arg(long)]
    rigid: bool,
    /// Width of the brackets, as a share of the motion
    #[arg(long, default_value_t = 1e-6)]
    tolerance: f64,
    /// Static tests per motion, evenly spread over the time that is proven free
    #[arg(long, default_value_t = 0)]
    scan: u32,
    /// How often to run all motions; times are those of the fastest run of each
    #[arg(long, default_value_t = 1)]
    repeat: u32,
    /// Print every bracket
    #[arg(long)]
    print: bool,
}

type AnyError = Box<dyn std::error::Error + Send + Sync>;

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("motions: {error}");
            ExitCode::from(2)
        }
    }
}

/// How many brackets are wrong.
fn run(arguments: &Arguments) -> Result<usize, AnyError> {
    let objects = arguments.meshes.build();
    let measured = arguments.measured.as_deref().map(Measured::read).transpose()?;
    let known = measured.map_or_else(Vec::new, |measured| measured.cases);
    let motions = match &arguments.motions {
        Some(path) => read_motions(path, arguments.rigid)?,
        None => known.iter().map(MeasuredCase::motions).collect(),
    };
    let (found, times) = run_all(arguments, &objects, &motions);
    print_times(&found, times);
    let mut wrong = 0;
    for (number, (motions, found)) in motions.iter().zip(&found).enumerate() {
        if arguments.print {
            println!("motion {number}: {found:?}");
        }
        let unlike_known = known.get(number).and_then(|known| known.fault(*found, arguments.tolerance));
        if let Some(fault) = unlike_known.or(fault(arguments, &objects, motions, *found)?) {
            println!("motion {number}: {found:?}, but {fault}");
            wrong += 1;
        }
    }
    println!("{wrong} of {} brackets are wrong", motions.len());
    Ok(wrong)
}

fn read_motions(path: &Path, rigid: bool) -> Result<Vec<[Motion; 2]>, NpyError> {
    let motion = |[from, to]: [Rows; 2]| if rigid { ccd::turning(from, to) } else { Motion::Linear { from, to } };
    Ok(npy::read_motion_pairs(path)?.into_iter().map(|pair| pair.map(motion)).collect())
}

fn run_all(
    arguments: &Arguments,
    [a, b]: &[Arc<Object>; 2],
    motions: &[[Motion; 2]],
) -> (Vec<TimeOfContact>, Vec<Duration>) {
    let settings = TimeSettings { tolerance: arguments.tolerance, ..TimeSettings::default() };
    let mut memory = Memory::default();
    let mut time = |[motion_a, motion_b]: &[Motion; 2]| {
        let start = Instant::now();
        let found = time_of_contact((a, motion_a), (b, motion_b), settings, &mut memory);
        (found, start.elapsed())
    };
    let fastest = |motions: &[Motion; 2]| {
        let mut best = time(motions);
        for _ in 1..arguments.repeat {
            best.1 = best.1.min(time(motions).1);
        }
        best
    };
    motions.iter().map(fastest).unzip()
}

fn print_times(found: &[TimeOfContact], mut times: Vec<Duration>) {
    let count = |is: fn(&TimeOfContact) -> bool| found.iter().filter(|found| is(found)).count();
    let contacts = count(|found| matches!(found, TimeOfContact::Contact { .. }));
    let open = count(|found| matches!(found, TimeOfContact::Possible { .. }));
    times.sort_unstable();
    let median = times.get(times.len() / 2).copied().unwrap_or_default();
    let longest = times.last().copied().unwrap_or_default();
    let mean = times.iter().sum::<Duration>() / (times.len().max(1) as u32);
    println!("{contacts} contacts, {open} possible in {} motions", found.len());
    println!("{mean:.1?} a motion, median {median:.1?}, longest {longest:.1?}");
}

/// What a scan of static tests says against a bracket.
fn fault(
    arguments: &Arguments,
    [a, b]: &[Arc<Object>; 2],
    motions: &[Motion; 2],
    found: TimeOfContact,
) -> Result<Option<String>, AnyError> {
    if arguments.scan == 0 {
        return Ok(None);
    }
    let mut pair = KernelPair::new(a, b, Effects::INTERFERENCE);
    let mut touch = |t: f64| Ok::<_, AnyError>(pair.step(motions[0].at(t), motions[1].at(t))?.interfering);
    let (free_until, contact) = match found {
        TimeOfContact::Free => (1.0, None),
        TimeOfContact::Possible { lo, .. } => (lo, None),
        TimeOfContact::Contact { lo, hi } => (lo, Some(hi)),
    };
    for step in 0..arguments.scan {
        let t = free_until * f64::from(step) / f64::from(arguments.scan);
        if touch(t)? {
            return Ok(Some(format!("the static test sees a contact at {t}")));
        }
    }
    let Some(hi) = contact else { return Ok(None) };
    // A contact of an instant may fall between two f64 times: its neighbourhood is looked at.
    for step in 0..=8 {
        if touch((hi + f64::from(step) * arguments.tolerance).min(1.0))? {
            return Ok(None);
        }
    }
    Ok(Some("the static test sees no contact soon after it".into()))
}
