//! `collided demo-client`: one of the client processes of the demonstration.
//!
//! An ordinary client: it loads its meshes into the daemon from its own memory, makes a scene, and steps it at the rate
//! of a simulator. What it learns it tells on its standard output.

use std::collections::BTreeSet;
use std::error::Error;
use std::io::{Stdout, Write};
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use collided_client::{Client, Effect, Mesh, Object, Report};

use super::event::{Best, Event, Step};
use super::scenes::{self, Scene};

/// Time from one step to the next: 60 a second.
const PERIOD: Duration = Duration::from_nanos(1_000_000_000 / 60);
/// How long the daemon may take to be there.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// One of the clients of the demonstration.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Instance of the daemon.
    #[arg(long)]
    instance: String,
    /// Name of the scene.
    #[arg(long)]
    scene: String,
    /// Number of steps.
    #[arg(long)]
    steps: u64,
}

/// Runs the command.
///
/// # Errors
/// When the daemon refuses something or is gone, or nobody reads the events.
pub fn run(args: Args) -> Result<ExitCode, Box<dyn Error>> {
    let scene = Scene::named(&args.scene).ok_or_else(|| format!("the demo has no scene \"{}\"", args.scene))?;
    let client = Client::builder().instance(args.instance).name(scene.name).timeout(CONNECT_TIMEOUT).connect()?;
    let mut events = Events { output: std::io::stdout() };
    let objects = load(&client, scene, &mut events)?;
    let mut world = client.scene(scene.name).effects([Effect::Interference, Effect::PolygonPairs]).create()?;
    for (body, object) in scene.bodies.iter().zip(&objects) {
        world.add_body(body.name, object)?;
    }
    let best = step_all(&mut world, scene, args.steps, &mut events)?;
    events.tell(&Event::Done(best))?;
    Ok(ExitCode::SUCCESS)
}

/// The object of each body; those of one mesh share it.
fn load(client: &Client, scene: &Scene, events: &mut Events) -> Result<Vec<Object>, Box<dyn Error>> {
    let database = client.database(scene.name);
    let mut loaded: Vec<(scenes::Mesh, Object)> = Vec::new();
    for body in scene.bodies {
        if loaded.iter().any(|(mesh, _)| *mesh == body.mesh) {
            continue;
        }
        let (name, polygons) = (body.mesh.name(), body.mesh.polygons()?);
        let mut failed = None;
        let loading = database.loading(name).on_progress(|stage, done, total| {
            let (object, stage) = (name.to_owned(), stage.to_owned());
            failed = events.tell(&Event::Load { object, stage, done, total }).err().or(failed.take());
        });
        let object = loading.mesh(&Mesh {
            vertices: &polygons.vertices,
            corner_counts: &polygons.corner_counts,
            corners: &polygons.corners,
        })?;
        failed.map_or(Ok(()), Err)?;
        loaded.push((body.mesh, object));
    }
    let of_body =
        |body: &scenes::Body| loaded.iter().find(|(mesh, _)| *mesh == body.mesh).map(|(_, object)| object.clone());
    Ok(scene.bodies.iter().filter_map(of_body).collect())
}

fn step_all(
    world: &mut collided_client::Scene,
    scene: &Scene,
    steps: u64,
    events: &mut Events,
) -> Result<Best, Box<dyn Error>> {
    let mut best = Best { step: 0, pairs: 0, polygon_pairs: 0, interfering: vec![BTreeSet::new(); scene.bodies.len()] };
    let begin = Instant::now();
    for step in 0..steps {
        let transforms: Vec<_> = scene.transforms(step, steps).collect();
        let sent = Instant::now();
        let report = world.step(&transforms)?;
        let round_trip = sent.elapsed().as_nanos() as u64;
        let (pairs, polygon_pairs) = (report.pairs().len() as u64, report.polygon_pair_count() as u64);
        if polygon_pairs > best.polygon_pairs {
            best = Best { step, pairs, polygon_pairs, interfering: interfering(&report, world.bodies()) };
        }
        events.tell(&Event::Step(Step { step, pairs, polygon_pairs, round_trip, times: *report.times() }))?;
        let next = begin + PERIOD.mul_f64((step + 1) as f64);
        thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    Ok(best)
}

/// Numbers of the interfering polygons of each body. `bodies` ascend.
fn interfering(report: &Report, bodies: &[collided_client::BodyId]) -> Vec<BTreeSet<u32>> {
    let mut polygons = vec![BTreeSet::new(); bodies.len()];
    for pair in report.pairs() {
        let [a, b] = [pair.a(), pair.b()].map(|id| bodies.partition_point(|&body| body < id));
        for polygon_pair in pair.polygon_pairs() {
            polygons[a].insert(polygon_pair.a);
            polygons[b].insert(polygon_pair.b);
        }
    }
    polygons
}

/// Where events are told.
struct Events {
    output: Stdout,
}

impl Events {
    fn tell(&mut self, event: &Event) -> std::io::Result<()> {
        let mut line = serde_json::to_vec(event)?;
        line.push(b'\n');
        self.output.write_all(&line)?;
        self.output.flush()
    }
}
