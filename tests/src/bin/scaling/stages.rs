//! Where a step's time goes, by the report's own times.

use collided::accuracy::units::duration;
use collided::budget::Budget;
use collided_kernel::{Clock, Effects, StageTimes, Transforms};
use collided_tests::meshes;
use collided_tests::stages::STAGES;

use crate::bodies;
use crate::figure::{print_head, print_row};
use crate::near::{Poses, verdicts};

const BODIES: usize = 1000;
const APPROACHES: usize = 100;

pub fn measure() {
    let budget = Budget::new(1).expect("a thread can be started");
    let clock = budget.slot();
    print_head(&[&["steps, one thread"], &STAGES.map(|(name, _)| name)[..], &["all"]].concat());
    print("1,000 bunnies move, verdicts", &crowd(Effects::INTERFERENCE, &clock));
    print("1,000 bunnies move, polygon pairs", &crowd(Effects::POLYGON_PAIRS, &clock));
    let cow = meshes::shipped("spot", None);
    let poses = Poses::random(&cow, APPROACHES);
    print("two cows just apart, verdict", &verdicts(&cow, &poses.apart, &clock).1);
    print("two cows just in each other, verdict", &verdicts(&cow, &poses.hit, &clock).1);
}

fn crowd(effects: Effects, clock: &dyn Clock) -> Vec<StageTimes> {
    let mut scene = bodies::scene(BODIES, effects);
    let steps = bodies::steps(BODIES);
    let mut step = |rows| *scene.step(Transforms::Dense(rows), clock).expect("good transforms").times();
    steps.iter().map(|rows| step(rows)).skip(1).collect()
}

/// Mean of each stage, and its share of all.
fn print(name: &str, times: &[StageTimes]) {
    let mean = |stage: fn(&StageTimes) -> u64| times.iter().map(stage).sum::<u64>() as f64 / times.len() as f64;
    let means = STAGES.map(|(_, stage)| mean(stage));
    let all: f64 = means.iter().sum();
    let cell = |time: &f64| format!("{} ({:.0} %)", duration(*time), 100.0 * time / all);
    let cells = means.iter().map(cell);
    print_row([name.to_owned()].into_iter().chain(cells).chain([duration(all)]));
}
