//! Whole steps through shared memory, beside raw iceoryx2 of the same shape in the same run.
//!
//! `cargo bench -p collided-tests --bench shared_memory`. A real daemon process with two threads; this process is the client.
//! The raw twin is a request-response service between two threads that spin: 96 kB of transforms in, 100 records out.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use collided_client::{BodySpec, Client, Effect, Scene, transport};
use collided_protocol::names::Rendezvous;
use collided_protocol::report::{PairRecord, ReportHeader, StageTimes};
use collided_protocol::step::{ROWS_WORDS, Rows, StepHeader, Word};
use collided_protocol::{ICEORYX2_VERSION, PROTOCOL_VERSION};
use collided_tests::crowd;
use collided_tests::daemon_process::{DaemonProcess, RuntimeDirectory, shared_files};
use collided_tests::meshes;
use criterion::{Criterion, criterion_group, criterion_main};
use iceoryx2::port::client::Client as RawPort;
use iceoryx2::prelude::*;

const BODIES: usize = 1000;
/// Cubic units that each body of unit size has to itself.
const ROOM: f64 = 4.0;
const RECORDS: usize = 100;
const REPLY_WORDS: usize = RECORDS * size_of::<PairRecord>() / size_of::<Word>();

type RawClient = RawPort<ipc_threadsafe::Service, [Word], StepHeader, [Word], ReportHeader>;

/// The floor: requests of transforms, answered at once by a spinning thread.
struct Raw {
    client: RawClient,
    stop: Arc<AtomicBool>,
    server: Option<JoinHandle<()>>,
    epoch: Rendezvous,
    _node: Node<ipc_threadsafe::Service>,
    _root: RuntimeDirectory,
}

impl Raw {
    fn start() -> Raw {
        let root = RuntimeDirectory::new();
        let epoch = own_epoch(&root);
        let node = transport::create_node(&epoch).expect("an iceoryx2 node");
        let service = node
            .service_builder(&transport::service_name("raw").expect("a service name"))
            .request_response::<[Word], [Word]>()
            .request_user_header::<StepHeader>()
            .response_user_header::<ReportHeader>()
            .create()
            .expect("a service");
        let server = service.server_builder().initial_max_slice_len(REPLY_WORDS).create().expect("a server");
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let answering = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                if let Some(active) = server.receive().expect("requests can be received") {
                    let sum = active.payload().iter().fold(0, |sum: Word, word| sum.wrapping_add(*word));
                    let reply = active.loan_slice_uninit(REPLY_WORDS).expect("memory for a reply");
                    reply.write_from_fn(|_| sum).send().expect("a reply can be sent");
                }
                std::hint::spin_loop();
            }
        });
        let client = service.client_builder().initial_max_slice_len(BODIES * ROWS_WORDS).create().expect("a client");
        Raw { client, stop, server: Some(answering), epoch, _node: node, _root: root }
    }

    fn round_trip(&self, words: &[Word]) -> Word {
        let request = self.client.loan_slice_uninit(words.len()).expect("memory for a request");
        let pending = request.write_from_slice(words).send().expect("a request can be sent");
        loop {
            if let Some(response) = pending.receive().expect("replies can be received") {
                return response.payload().iter().fold(0, |sum: Word, word| sum.wrapping_add(*word));
            }
            std::hint::spin_loop();
        }
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(server) = self.server.take() {
            server.join().expect("the raw server ends");
        }
        shared_files(&self.epoch).iter().for_each(|file| drop(std::fs::remove_file(file)));
    }
}

/// Names of its own for iceoryx2's files, as each daemon has them.
fn own_epoch(root: &RuntimeDirectory) -> Rendezvous {
    Rendezvous {
        epoch: "raw".to_owned(),
        pid: std::process::id(),
        protocol_min: PROTOCOL_VERSION,
        protocol_max: PROTOCOL_VERSION,
        iceoryx2: ICEORYX2_VERSION.to_owned(),
        iceoryx2_prefix: format!("raw-{}-", std::process::id()),
        iceoryx2_root: root.path().to_string_lossy().into_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
    }
}

fn raw(criterion: &mut Criterion) {
    let raw = Raw::start();
    let mut group = criterion.benchmark_group("raw_iceoryx2_spinning");
    for (name, transforms) in [("1_transform_in", 1), ("1000_transforms_in", BODIES)] {
        let words = vec![1; transforms * ROWS_WORDS];
        group.bench_function(name, |bencher| bencher.iter(|| raw.round_trip(&words)));
    }
}

/// Bodies made of the shipped low-poly bunny, scaled to unit size.
fn scene(client: &Client, bodies: usize) -> (Scene, f64) {
    let path = meshes::path("low_poly_bunny");
    let bunny = client.database("bench").loading("bunny").replace(true).file(path).expect("the mesh loads");
    let specs: Vec<BodySpec> = (0..bodies).map(|body| BodySpec::new(body.to_string(), &bunny)).collect();
    let mut scene = client.scene("bench").effects([Effect::Interference]).create().expect("a scene");
    scene.add_bodies(&specs).expect("bodies");
    (scene, 1.0 / meshes::longest_side(&meshes::shipped("low_poly_bunny", Some(0))))
}

fn scaled(size: f64, step: &[Rows]) -> Vec<Rows> {
    step.iter().map(|rows| rows.map(|[x, y, z, t]| [size * x, size * y, size * z, t])).collect()
}

/// Bodies so far apart that no boxes overlap: what is left is transport, transforms and boxes.
fn apart(bodies: usize) -> Vec<Rows> {
    let at = |body: usize| [[1.0, 0.0, 0.0, 9.0 * body as f64], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    (0..bodies).map(at).collect()
}

fn in_kernel(times: &StageTimes) -> u64 {
    times.boxes
        + times.broad_phase
        + times.interest
        + times.voxels
        + times.polygon_pairs
        + times.polygon_tests
        + times.effects
}

fn steps(criterion: &mut Criterion) {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut group = criterion.benchmark_group("step_through_shared_memory");
    for (name, bodies) in [("1_body", 1), ("1000_bodies_apart", BODIES)] {
        let (mut scene, size) = scene(&client, bodies);
        let rows = scaled(size, &apart(bodies));
        group.bench_function(name, |bencher| bencher.iter(|| scene.step(&rows).expect("a report").pairs().len()));
        group.bench_function(format!("{name}/outside_the_kernel"), |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| outside_the_kernel(&mut scene, &rows)).sum());
        });
        group.bench_function(format!("{name}/after_1_ms_of_rest"), |bencher| {
            bencher.iter_custom(|count| (0..count).map(|_| after_rest(&mut scene, &rows)).sum());
        });
    }
    let (mut scene, size) = scene(&client, BODIES);
    let moves: Vec<Vec<Rows>> = crowd::moving(BODIES, 20, ROOM, 7).iter().map(|step| scaled(size, step)).collect();
    let mut moves = moves.iter().cycle();
    group.sample_size(20).bench_function("1000_bodies_moving", |bencher| {
        bencher.iter(|| moves.next().map(|rows| scene.step(rows).expect("a report").pairs().len()));
    });
}

fn outside_the_kernel(scene: &mut Scene, rows: &[Rows]) -> Duration {
    let start = Instant::now();
    let report = scene.step(rows).expect("a report");
    start.elapsed().saturating_sub(Duration::from_nanos(in_kernel(report.times())))
}

/// A step to a daemon that has fallen asleep: both sides block and are woken.
fn after_rest(scene: &mut Scene, rows: &[Rows]) -> Duration {
    std::thread::sleep(Duration::from_millis(1));
    let start = Instant::now();
    drop(scene.step(rows).expect("a report"));
    start.elapsed()
}

criterion_group!(benches, raw, steps);
criterion_main!(benches);
