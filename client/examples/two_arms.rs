//! Two robot arms of three links each sweep past each other while a controller asks at 1 kHz which links interfere.
//! Start `collided serve`, then `cargo run --release -p collided-client --example two_arms`.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::time::{Duration, Instant};

use collided_client::{
    BodyId, BodySpec, Client, Effect, Error, Mesh, Rows, Scene, Verdict, rotation, then, translation,
};

const LINKS: usize = 3;
const NAMES: [&str; 2 * LINKS] = ["left 0", "left 1", "left 2", "right 0", "right 1", "right 2"];
/// Where the shoulders are on the x axis; links have length 1.
const SHOULDERS: [f64; 2] = [-2.25, 2.25];
/// How far the arms swing to either side, in radians.
const SWING: f64 = 0.5;
const STEPS: u32 = 1000;
const PERIOD: Duration = Duration::from_millis(1);

fn main() -> Result<(), Error> {
    let client = Client::connect()?;
    let mut scene = cell(&client)?;
    let mut interfering: BTreeMap<(BodyId, BodyId), (u32, u32)> = BTreeMap::new();
    let mut in_time = 0;
    let start = Instant::now();
    for step in 0..STEPS {
        let deadline = start + (step + 1) * PERIOD;
        let report = scene.step(&poses(f64::from(step) / f64::from(STEPS)))?;
        for pair in report.pairs().filter(|pair| pair.verdict() == Verdict::Interfering) {
            interfering.entry((pair.a(), pair.b())).or_insert((step, 0)).1 += 1;
        }
        in_time += u32::from(Instant::now() <= deadline);
        std::thread::sleep(deadline.saturating_duration_since(Instant::now()));
    }
    println!("{in_time} of {STEPS} steps met the deadline of {PERIOD:?}");
    for ((a, b), (first, count)) in interfering {
        let [a, b] = [a, b].map(|body| NAMES[body.0 as usize]);
        println!("{a} and {b} interfere in {count} steps, first in step {first}");
    }
    Ok(())
}

/// Neighbouring links of an arm always meet at their joint: an arm is a group, and pairs within it are ignored.
fn cell(client: &Client) -> Result<Scene, Error> {
    let vertices =
        [0.0, 1.0].map(|x| [[x, -0.05, -0.05], [x, 0.05, -0.05], [x, 0.05, 0.05], [x, -0.05, 0.05]]).concat();
    let faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let mesh = Mesh { vertices: &vertices, corner_counts: &[4; 6], corners: faces.as_flattened() };
    let link = client.database("two arms").loading("link").replace(true).mesh(&mesh)?;
    let mut scene = client.scene("two arms").effects([Effect::Interference]).create()?;
    let spec = |(body, name)| BodySpec::new(name, &link).group(["left", "right"][body / LINKS]);
    let specs: Vec<BodySpec> = NAMES.into_iter().enumerate().map(spec).collect();
    scene.add_bodies(&specs)?;
    Ok(scene)
}

/// Transforms of all links at a time from 0 to 1: the left arm starts up and the right one down, and both swing there and back.
fn poses(time: f64) -> [Rows; 2 * LINKS] {
    let shoulder = SWING * (TAU * time).cos();
    let arms = [arm(SHOULDERS[0], shoulder), arm(SHOULDERS[1], PI + shoulder)];
    std::array::from_fn(|body| arms[body / LINKS][body % LINKS])
}

/// The links of an arm, stretched out, from shoulder to hand.
fn arm(shoulder: f64, angle: f64) -> [Rows; LINKS] {
    let mut joint = [shoulder, 0.0];
    std::array::from_fn(|_| {
        let link = then(&rotation([0.0, 0.0, 1.0], angle), &translation([joint[0], joint[1], 0.0]));
        joint = [joint[0] + link[0][0], joint[1] + link[1][0]];
        link
    })
}
