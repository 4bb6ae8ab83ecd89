//! Whether a step keeps to its budget, and what share of the pairs it decides within it.
//!
//! `cargo bench -p collided-tests --bench budgets`. A real daemon process with two threads; this process is the client, and measures
//! from writing the transforms to having the report. A step is late when it takes longer than its budget and 10 % of it, or 20 µs
//! if that is more. Wants a quiet machine, and says how quiet it was: an interruption of 40 µs or more makes a step late.

use std::time::{Duration, Instant};

use collided_client::{Accuracy, BodySpec, Effect, Rows, Scene, Verdict};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::{crowd, meshes};

const BODIES: usize = 1000;
/// Cubic units that each body of unit size has to itself.
const ROOM: f64 = 2.0;
const STEPS: usize = 50;
/// How often the steps are gone through for each budget.
const REPETITIONS: usize = 40;
const BUDGETS: [f64; 10] = [50.0, 100.0, 200.0, 300.0, 500.0, 1000.0, 2000.0, 3000.0, 5000.0, 50_000.0];

fn main() {
    // What a build has left to write keeps the processors busy later.
    rustix::fs::sync();
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon);
    let steps = steps();
    let open = full_counts(&mut scene, &steps);
    println!("{BODIES} bodies, {:.0} pairs with overlapping boxes a step", open);
    println!(" budget us |  median us   99 % us  longest us | allowed us  late % | complete %  decided %");
    for budget in BUDGETS {
        row(&mut scene, &steps, budget, open);
    }
    let [first, second] = interruptions();
    println!("interruptions of 40 us and more, a second: {first} and {second} on two processors");
}

/// How often two threads that only look at the clock, for a second, do not come to it for as long as 40 µs.
fn interruptions() -> [usize; 2] {
    const LONG: Duration = Duration::from_micros(40);
    let count = || {
        let (start, mut last, mut found) = (Instant::now(), Instant::now(), 0);
        while last - start < Duration::from_secs(1) {
            let now = Instant::now();
            found += usize::from(now - last >= LONG);
            last = now;
        }
        found
    };
    std::thread::scope(|scope| {
        [scope.spawn(count), scope.spawn(count)].map(|thread| thread.join().expect("it only counts"))
    })
}

fn scene(daemon: &DaemonProcess) -> Scene {
    let client = daemon.client();
    let path = meshes::path("low_poly_bunny");
    let bunny = client.database("bench").loading("bunny").file(path).expect("the mesh loads");
    let specs: Vec<BodySpec> = (0..BODIES).map(|body| BodySpec::new(body.to_string(), &bunny)).collect();
    let mut scene = client.scene("budgets").effects([Effect::Interference]).create().expect("a scene");
    scene.add_bodies(&specs).expect("bodies can be added");
    scene
}

fn steps() -> Vec<Vec<Rows>> {
    let size = meshes::longest_side(&meshes::shipped("low_poly_bunny", None));
    let fitted = |rows: &Rows| rows.map(|[x, y, z, shift]| [x, y, z, shift * size]);
    crowd::moving(BODIES, STEPS, ROOM, 1).iter().map(|step| step.iter().map(fitted).collect()).collect()
}

/// Pairs of bodies with overlapping boxes, the mean of all steps.
fn full_counts(scene: &mut Scene, steps: &[Vec<Rows>]) -> f64 {
    let pairs = steps.iter().map(|step| scene.step(step).expect("a step").counts().broad_pairs);
    pairs.sum::<u64>() as f64 / steps.len() as f64
}

fn row(scene: &mut Scene, steps: &[Vec<Rows>], budget: f64, pairs: f64) {
    scene.set_accuracy(Accuracy { budget_us: Some(budget), ..Accuracy::default() }).expect("a budget");
    let (mut times, mut complete, mut open) = (Vec::new(), 0, 0.0);
    for step in (0..REPETITIONS).flat_map(|_| steps) {
        let start = Instant::now();
        let report = scene.step(step).expect("a step");
        times.push(start.elapsed().as_secs_f64() * 1e6);
        if report.is_complete() {
            complete += 1;
            open += report.pairs().filter(|pair| pair.verdict() == Verdict::Possible).count() as f64;
        } else {
            open += pairs;
        }
    }
    times.sort_by(f64::total_cmp);
    let allowed = budget + f64::max(0.1 * budget, 20.0);
    let late = times.iter().filter(|&&time| time > allowed).count();
    let count = times.len();
    println!(
        "{budget:10} | {:10.1} {:9.1} {:11.1} | {allowed:10.0} {:7.2} | {:10.1} {:10.1}",
        times[count / 2],
        times[count * 99 / 100],
        times[count - 1],
        100.0 * late as f64 / count as f64,
        100.0 * f64::from(complete) / count as f64,
        100.0 * (1.0 - open / (pairs * count as f64)),
    );
}
