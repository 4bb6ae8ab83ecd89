//! What each stage of the kernel costs: object builds, the stages of a step, exact tests, and whole steps.
//!
//! `cargo bench -p collided-tests --bench stages`. In one process, without daemon or shared memory.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use collided_kernel::{Clock, Effects, Object, Rows, Scene, StageTimes, Transforms, Workforce, polygon_test};
use collided_tests::crowd::{self, Random};
use collided_tests::meshes;
use collided_tests::stages::STAGES;
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::DVec3;

/// Cubic units that each body of unit size has to itself.
const ROOM: f64 = 4.0;

struct Monotonic(Instant);

impl Workforce for Monotonic {}

impl Clock for Monotonic {
    fn nanoseconds(&self) -> u64 {
        self.0.elapsed().as_nanos() as u64
    }
}

/// Bodies, and the moves of each step, over and over.
struct Crowd {
    scene: Scene,
    steps: Vec<Vec<Rows>>,
    next: usize,
    clock: Monotonic,
}

impl Crowd {
    fn new(count: usize, effects: Effects) -> Crowd {
        let bunny = meshes::shipped("low_poly_bunny", None);
        let size = 1.0 / meshes::longest_side(&bunny);
        let scaled = |rows: Rows| rows.map(|[x, y, z, t]| [size * x, size * y, size * z, t]);
        let steps = crowd::moving(count, 20, ROOM, 7);
        let steps = steps.into_iter().map(|step| step.into_iter().map(scaled).collect()).collect();
        let mut scene = Scene::new(effects);
        (0..count).for_each(|_| {
            scene.add_body(Arc::clone(&bunny), None);
        });
        Crowd { scene, steps, next: 0, clock: Monotonic(Instant::now()) }
    }

    fn step(&mut self) -> StageTimes {
        self.next = (self.next + 1) % self.steps.len();
        let report = self.scene.step(Transforms::Dense(&self.steps[self.next]), &self.clock);
        *black_box(report.expect("good transforms")).times()
    }
}

/// A pool of so many threads, as the daemon has.
fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
}

fn object_build(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("object_build");
    for name in meshes::SHIPPED {
        for threads in [1, 2] {
            let (pool, mesh) = (pool(threads), meshes::read(&meshes::path(name)));
            group.bench_function(BenchmarkId::new(name, threads), |bencher| {
                bencher.iter(|| pool.install(|| Object::build(mesh.clone(), None, &())));
            });
        }
    }
}

/// The stages of one step of 1,000 moving bodies, each by the report's own times. Stages 5 to 8 are in one thread here.
fn stages(criterion: &mut Criterion) {
    let pool = pool(1);
    let mut group = criterion.benchmark_group("stage_of_1000_bodies");
    group.sample_size(20);
    for (name, time) in STAGES {
        let mut crowd = Crowd::new(1000, Effects::POLYGON_PAIRS);
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| pool.install(|| stage_time(&mut crowd, time, count)));
        });
    }
}

/// The time that `count` steps spend in a stage, by the mean of at most ten: a step takes much longer than most of its stages.
fn stage_time(crowd: &mut Crowd, time: fn(&StageTimes) -> u64, count: u64) -> Duration {
    let steps = count.min(10);
    let spent: u64 = (0..steps).map(|_| time(&crowd.step())).sum();
    Duration::from_nanos(spent * count / steps)
}

fn steps(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("step");
    group.sample_size(20);
    for count in [1000, 5000] {
        for threads in [1, 2] {
            let (pool, mut crowd) = (pool(threads), Crowd::new(count, Effects::INTERFERENCE));
            group.bench_function(BenchmarkId::new(format!("{count}_bodies"), threads), |bencher| {
                bencher.iter(|| pool.install(|| crowd.step()));
            });
        }
    }
}

/// One exact test, on the inputs that cost least and most.
fn exact_tests(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("exact_test");
    let mut random = Random::new(3);
    let mut input = |name, coordinate: &mut dyn FnMut(&mut Random, usize) -> f64| {
        let mut triangle = || [0; 3].map(|_| DVec3::from([0, 1, 2].map(|axis| coordinate(&mut random, axis))));
        let pairs: Vec<_> = (0..1024).map(|_| (triangle(), triangle())).collect();
        group.bench_function(name, |bencher| {
            let mut pairs = pairs.iter().cycle();
            bencher.iter(|| pairs.next().map(|(a, b)| polygon_test::triangles(black_box(a), black_box(b))));
        });
    };
    input("random", &mut |random, _| random.unit());
    input("grid_of_8", &mut |random, _| (8.0 * random.unit()).floor());
    input("coplanar", &mut |random, axis| if axis == 2 { 0.5 } else { random.unit() });
}

criterion_group!(benches, object_build, stages, steps, exact_tests);
criterion_main!(benches);
