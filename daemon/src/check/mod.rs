//! `collided check`: scene files through a private daemon, or the running one.

mod error;
mod json;
mod objects;
mod output;
mod table;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use collided_client::{BodyId, BodySpec, ClampedOrder, Client, Report, Scene, StepInput};
use collided_protocol::names::DEFAULT_INSTANCE;

use crate::own_process::{INTERRUPTED, Interrupt};
use crate::private_daemon::PrivateDaemon;
use crate::scene_file::{SceneFile, Step};
use error::CheckError;
use objects::Objects;
use output::{Output, PairEffects, StepResult};

/// What the client calls itself in `collided status`.
const CLIENT_NAME: &str = "collided check";
/// How long one step may take. There is nobody who waits for a step of a file in real time.
const STEP_DEADLINE: Duration = Duration::from_secs(3600);

/// Checks scene files.
///
/// Exit status: 0 no pair interferes in any step or at any asked time of contact, 1 some pair does, or may, 2 trouble, with the
/// reason on stderr.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scene files, TOML or JSON by their ending.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// How results are printed.
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
    /// Use the running daemon instead of a private one.
    #[arg(long)]
    connect: bool,
    /// Instance of the running daemon.
    #[arg(long, requires = "connect", value_name = "NAME", default_value = DEFAULT_INSTANCE)]
    instance: String,
}

/// How results are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// An aligned table for people.
    Table,
    /// One JSON object a line, a line a step.
    Json,
}

/// What is known of all steps so far; the exit status is the greatest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    Clear,
    Interfering,
    Trouble,
}

/// Runs the command.
///
/// # Errors
/// When there is no daemon. Trouble with a single scene is printed, and the next one is checked.
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    let interrupt = Interrupt::install()?;
    let outcome = check_all(&args, &interrupt);
    if interrupt.is_raised() {
        return Ok(ExitCode::from(INTERRUPTED));
    }
    Ok(ExitCode::from(outcome? as u8))
}

fn check_all(args: &Args, interrupt: &Interrupt) -> Result<Outcome, Box<dyn Error>> {
    if args.connect {
        let client = Client::builder().instance(&args.instance).name(CLIENT_NAME).connect()?;
        return check_scenes(&client, args, interrupt);
    }
    let mut daemon = PrivateDaemon::start(Some(interrupt))?;
    let outcome = {
        let client = daemon.connect(CLIENT_NAME)?;
        check_scenes(&client, args, interrupt)
    };
    daemon.end()?;
    outcome
}

fn check_scenes(client: &Client, args: &Args, interrupt: &Interrupt) -> Result<Outcome, Box<dyn Error>> {
    let mut output: Box<dyn Output> = match args.format {
        Format::Table => Box::new(table::Table::new(std::io::stdout())),
        Format::Json => Box::new(json::Json::new(std::io::stdout())),
    };
    let mut worst = Outcome::Clear;
    for path in &args.scenes {
        match check_scene(client, path, output.as_mut(), interrupt) {
            Ok(outcome) => worst = worst.max(outcome),
            Err(error) if error.ends_the_run() => return Err(error.into()),
            Err(error) => {
                eprintln!("collided: {error}");
                worst = Outcome::Trouble;
            }
        }
    }
    Ok(worst)
}

fn check_scene(
    client: &Client,
    path: &Path,
    output: &mut dyn Output,
    interrupt: &Interrupt,
) -> Result<Outcome, CheckError> {
    let file = SceneFile::read(path)?;
    let objects = Objects::load(client, path, &file)?;
    let (mut scene, bodies, clamped) = create(client, &file, &objects)
        .map_err(|source| CheckError::Scene { path: path.to_owned(), source: source.into() })?;
    for ClampedOrder { object, asked, order, .. } in clamped {
        let path = path.display();
        eprintln!(
            "collided: {path}: accuracy: order {asked} is above order {order} of object \"{object}\", which counts"
        );
    }
    let effects = PairEffects::of(&file);
    output.begin(path, &file)?;
    let mut outcome = Outcome::Clear;
    for (index, step) in file.steps.iter().enumerate() {
        if interrupt.is_raised() {
            return Err(CheckError::Interrupted);
        }
        let report = take(&mut scene, &bodies, step).map_err(|source| CheckError::Step {
            path: path.to_owned(),
            step: index,
            source: source.into(),
        })?;
        let result = StepResult { path, index, file: &file, bodies: &bodies, effects: &effects, report: &report };
        if result.is_interfering() {
            outcome = Outcome::Interfering;
        }
        output.step(&result)?;
    }
    output.end()?;
    Ok(outcome)
}

fn take(scene: &mut Scene, bodies: &[BodyId], step: &Step) -> Result<Report, collided_client::Error> {
    let transforms: Vec<_> = step.poses.iter().map(|pose| (bodies[pose.body], pose.rows)).collect();
    let rigid: Vec<_> = step.motions.iter().map(|&(body, motion)| (bodies[body], motion)).collect();
    let velocities: Vec<_> = step.velocities.iter().map(|&(body, velocity)| (bodies[body], velocity)).collect();
    let (transforms, rigid, velocities) = (&transforms[..], &rigid[..], &velocities[..]);
    scene.step_with(&StepInput { transforms, rigid, velocities, delta_time: step.delta_time })
}

/// The scene of a file in the daemon, its bodies in the order of the file, and the objects that have no voxels of an order asked for.
fn create(
    client: &Client,
    file: &SceneFile,
    objects: &Objects,
) -> Result<(Scene, Vec<BodyId>, Vec<ClampedOrder>), collided_client::Error> {
    let mut scene = client.scene("check").effects(file.effects.iter()).create()?;
    scene.set_deadline(STEP_DEADLINE);
    let specs: Vec<BodySpec> = file
        .bodies
        .iter()
        .map(|body| {
            let spec = BodySpec::new(body.name.as_str(), objects.get(body.object));
            match &body.group {
                Some(group) => spec.group(group.as_str()),
                None => spec,
            }
        })
        .collect();
    let bodies = scene.add_bodies(&specs)?;
    let rules: Vec<_> = file.interest.iter().map(|rule| (bodies[rule.a], bodies[rule.b], rule.interest)).collect();
    scene.set_interest(&rules)?;
    let mut clamped = scene.set_accuracy(file.accuracy)?;
    let accuracies: Vec<_> =
        file.interest.iter().filter_map(|rule| Some((bodies[rule.a], bodies[rule.b], Some(rule.accuracy?)))).collect();
    clamped.extend(scene.set_pair_accuracy(&accuracies)?);
    let dynamics: Vec<_> = file.dynamics.iter().map(|&(body, dynamics)| (bodies[body], Some(dynamics))).collect();
    scene.set_dynamics(&dynamics)?;
    Ok((scene, bodies, clamped))
}
