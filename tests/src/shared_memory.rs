//! Steps through shared memory, to a real daemon process with two threads, beside raw iceoryx2 of the same shape, in turns.

use std::time::{Duration, Instant};

use collided_client::{BodySpec, Client, Effect, Rows, Scene, StageTimes};
use collided_protocol::report::PairRecord;
use collided_protocol::step::{ROWS_WORDS, Word};
use serde::Serialize;

use crate::daemon_process::DaemonProcess;
use crate::meshes;
use crate::raw_iceoryx2::{Raw, Waiting};

const MESH: &str = "low_poly_bunny";

/// A step, and what of it is measured.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// What a table says of it.
    pub name: &'static str,
    /// At most this multiple of raw iceoryx2 is asked; `None`: nothing is.
    pub asked: Option<f64>,
    /// Bodies, each of which has a transform.
    pub bodies: usize,
    /// Pairs that the report lists.
    pub pairs: usize,
    /// Whether each step moves all bodies, instead of leaving them where they are.
    pub moving: bool,
    /// Blocked: both sides have fallen asleep before each step.
    pub waiting: Waiting,
    /// Whether what the kernel takes is left out.
    pub outside: bool,
}

const WHOLE: Shape = Shape {
    name: "a step without pairs, 1 body, spinning",
    asked: Some(1.3),
    bodies: 1,
    pairs: 0,
    moving: false,
    waiting: Waiting::Spinning,
    outside: false,
};

const OUTSIDE: Shape = Shape {
    name: "1,000 transforms in, 100 pairs out, outside the kernel",
    asked: Some(1.2),
    bodies: 1000,
    pairs: 100,
    outside: true,
    ..WHOLE
};

/// What is measured.
pub const SHAPES: [Shape; 5] = [
    WHOLE,
    Shape { name: "a step without pairs, 1 body, blocked", waiting: Waiting::Blocked, ..WHOLE },
    Shape { name: "a step without pairs, 1,000 bodies, spinning", asked: None, bodies: 1000, ..WHOLE },
    OUTSIDE,
    Shape { name: "1,000 bodies moved, 100 pairs out, outside the kernel", asked: None, moving: true, ..OUTSIDE },
];

/// Medians of the steps of a shape, in one round.
#[derive(Debug, Clone, Serialize)]
pub struct Measured {
    /// [`Shape::name`].
    pub name: &'static str,
    /// [`Shape::asked`].
    pub asked: Option<f64>,
    /// Of raw iceoryx2, in microseconds.
    pub raw: f64,
    /// Of the daemon, in microseconds.
    pub ours: f64,
    /// What of it, or besides where the kernel is left out, the kernel takes.
    pub kernel: f64,
}

/// A daemon and its client.
pub struct Bench {
    client: Client,
    _daemon: DaemonProcess,
}

impl Default for Bench {
    fn default() -> Self {
        Bench::new()
    }
}

impl Bench {
    /// Starts a daemon.
    ///
    /// # Panics
    /// When it does not become ready.
    pub fn new() -> Bench {
        let daemon = DaemonProcess::start_with(&["--threads", "2"]);
        let client = daemon.client();
        client.database("bench").load("bunny", meshes::path(MESH)).expect("the mesh loads");
        Bench { client, _daemon: daemon }
    }

    /// Steps of raw iceoryx2, then as many of the daemon; none of the two runs while the other is measured.
    ///
    /// # Panics
    /// When a step fails.
    pub fn round(&self, shape: &Shape, steps: usize) -> Measured {
        let raw = raw(shape, steps);
        let [ours, kernel] = self.ours(shape, steps);
        Measured { name: shape.name, asked: shape.asked, raw, ours, kernel }
    }

    /// Medians of so many steps of the daemon: what is measured, and what the kernel takes.
    fn ours(&self, shape: &Shape, steps: usize) -> [f64; 2] {
        let (mut scene, size) = self.scene(shape);
        let places = [0.0, 1e-3].map(|shift| places(shape, size, if shape.moving { shift } else { 0.0 }));
        let mut turn = places.iter().cycle();
        medians_of(steps, || {
            rest(shape);
            let rows = turn.next().expect("a cycle has no end");
            let start = Instant::now();
            let report = scene.step(rows).expect("a report");
            let listed = report.pairs().map(|pair| pair.verdict() as usize).sum::<usize>();
            let whole = start.elapsed();
            assert_eq!(listed, shape.pairs, "each pair interferes");
            let kernel = in_kernel(report.times());
            [if shape.outside { whole.saturating_sub(kernel) } else { whole }, kernel]
        })
    }

    /// Bodies of unit size.
    fn scene(&self, shape: &Shape) -> (Scene, f64) {
        let bunny = self.client.database("bench").get("bunny").expect("it was loaded");
        let specs: Vec<BodySpec> = (0..shape.bodies).map(|body| BodySpec::new(body.to_string(), &bunny)).collect();
        let mut scene = self.client.scene("bench").effects([Effect::Interference]).create().expect("a scene");
        scene.add_bodies(&specs).expect("bodies can be added");
        (scene, 1.0 / meshes::longest_side(&meshes::shipped(MESH, Some(0))))
    }
}

/// Bodies in a row, no two with overlapping boxes but for the first ones, which stand in each other two by two.
fn places(shape: &Shape, size: f64, shift: f64) -> Vec<Rows> {
    let at = |body: usize| {
        let (place, aside) = if body < 2 * shape.pairs { (body / 2, 0.1 * (body % 2) as f64) } else { (body, 0.0) };
        let x = 3.0 * place as f64 + aside + shift;
        [[size, 0.0, 0.0, x], [0.0, size, 0.0, 0.0], [0.0, 0.0, size, 0.0]]
    };
    (0..shape.bodies).map(at).collect()
}

fn raw(shape: &Shape, steps: usize) -> f64 {
    let words: Vec<Word> = vec![1; shape.bodies * ROWS_WORDS];
    let raw = Raw::start(shape.waiting, words.len(), shape.pairs * size_of::<PairRecord>() / size_of::<Word>());
    let [whole] = medians_of(steps, || {
        rest(shape);
        let start = Instant::now();
        std::hint::black_box(raw.round_trip(std::hint::black_box(&words)));
        [start.elapsed()]
    });
    whole
}

/// So long that both sides have fallen asleep.
fn rest(shape: &Shape) {
    if shape.waiting == Waiting::Blocked {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// In microseconds, after a tenth as many steps that are not measured.
fn medians_of<const N: usize>(steps: usize, mut step: impl FnMut() -> [Duration; N]) -> [f64; N] {
    for _ in 0..steps / 10 {
        step();
    }
    let times: Vec<[Duration; N]> = (0..steps).map(|_| step()).collect();
    std::array::from_fn(|what| {
        let mut times: Vec<Duration> = times.iter().map(|times| times[what]).collect();
        times.sort_unstable();
        times[steps / 2].as_secs_f64() * 1e6
    })
}

fn in_kernel(times: &StageTimes) -> Duration {
    let StageTimes { boxes, broad_phase, interest, voxels, polygon_pairs, polygon_tests, effects, .. } = *times;
    Duration::from_nanos(boxes + broad_phase + interest + voxels + polygon_pairs + polygon_tests + effects)
}
