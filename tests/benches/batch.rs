//! A batch of candidate poses through shared memory, beside single steps with the same poses.
//!
//! `cargo bench -p collided-tests --bench batch`. A real daemon process with two threads; this process is the client. A third of the
//! candidates is apart, a third nearly touches, a third interferes: along random directions, at 1.5, 1.02 and 0.9 times the way to contact.

use collided_client::{Batch, BodyId, Client, Effect, IDENTITY, Rows, Scene, Verdict};
use collided_kernel::Effects;
use collided_tests::crowd;
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::kernel_pair::KernelPair;
use collided_tests::meshes;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const CANDIDATES: usize = 1000;
/// Of the way to contact: apart, near and in each other.
const WAYS: [f64; 3] = [1.5, 1.02, 0.9];
const MESHES: [&str; 2] = ["spot", "low_poly_bunny"];

/// A direction away from the first mesh, a turn of the second, and how far apart the two are in contact, nearly.
struct Approach {
    turned: Rows,
    direction: [f64; 3],
    contact: f64,
}

impl Approach {
    fn at(&self, way: f64) -> Rows {
        [0, 1, 2].map(|row| {
            let [x, y, z, _] = self.turned[row];
            [x, y, z, way * self.direction[row]]
        })
    }
}

/// Bisects the way to contact; both meshes begin about the origin.
fn approach(pair: &mut KernelPair, size: f64, seed: u64) -> Approach {
    let rows = crowd::moving_within(2.0, 1, 1, seed).remove(0).remove(0);
    let direction = rows.map(|row| row[3] - 1.0);
    let turned = rows.map(|[x, y, z, _]| [size * x, size * y, size * z, 0.0]);
    let mut approach = Approach { turned, direction, contact: 0.0 };
    let (mut inside, mut outside) = (0.0, 64.0);
    for _ in 0..20 {
        approach.contact = 0.5 * (inside + outside);
        let rows = approach.at(approach.contact);
        let interferes = pair.step(IDENTITY, rows).expect("the transforms are finite").interfering;
        *(if interferes { &mut inside } else { &mut outside }) = approach.contact;
    }
    approach
}

fn candidates() -> Vec<Rows> {
    let [fixed, moved] = MESHES.map(|name| meshes::shipped(name, None));
    let size = meshes::longest_side(&fixed) / meshes::longest_side(&moved);
    let mut pair = KernelPair::new(&fixed, &moved, Effects::INTERFERENCE);
    let at = |number: usize| {
        let approach = approach(&mut pair, size, number as u64);
        approach.at(WAYS[number % WAYS.len()] * approach.contact)
    };
    (0..CANDIDATES).map(at).collect()
}

fn scene(client: &Client) -> (Scene, BodyId) {
    let objects = MESHES.map(|name| client.database("bench").load(name, meshes::path(name)).expect("the mesh loads"));
    let mut scene = client.scene("bench").effects([Effect::Interference]).create().expect("a scene");
    let bodies = objects.map(|object| scene.add_body(object.name(), &object).expect("a body"));
    scene.step(&[IDENTITY; 2]).expect("the step is good");
    (scene, bodies[1])
}

fn batches(criterion: &mut Criterion) {
    let daemon = DaemonProcess::start();
    let (mut scene, body) = scene(&daemon.client());
    let rows = candidates();
    let batch = Batch { bodies: &[body], candidates: &rows, stop_at: None };
    let found: Vec<_> = scene.step_batch(&batch).expect("an answer").verdicts().collect();
    let hits = found.iter().filter(|verdict| **verdict == Some(Verdict::Interfering)).count();
    assert!((CANDIDATES / 4..CANDIDATES / 2).contains(&hits), "{hits} candidates interfere");
    let mut group = criterion.benchmark_group("candidates");
    group.throughput(Throughput::Elements(CANDIDATES as u64)).sample_size(20);
    group.bench_function("one_batch", |bencher| {
        bencher.iter(|| scene.step_batch(&batch).expect("an answer").first_clear())
    });
    group.bench_function("single_steps", |bencher| {
        bencher.iter(|| {
            let hits = rows.iter().filter(|rows| !scene.step_sparse(&[(body, **rows)]).expect("an answer").is_clear());
            hits.count()
        });
    });
}

criterion_group!(benches, batches);
criterion_main!(benches);
