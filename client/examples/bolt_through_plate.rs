//! Two thin bolts, one of them spinning, fly through a thin plate within one step: at its end they are past the plate, and
//! only the time of contact tells that they went through.
//! Start `collided serve`, then `cargo run -p collided-client --example bolt_through_plate`.

use std::f64::consts::PI;

use collided_client::{Client, Effect, Error, Mesh, RigidMotion, StepInput, translation};

const THICKNESS: f64 = 1.0 / 64.0;
/// Height of the bolts' tips at the start, and how far they fly.
const START: f64 = 5.0;
const FLIGHT: f64 = 12.0;
/// Seconds.
const STEP: f64 = 0.001;

fn main() -> Result<(), Error> {
    let client = Client::connect()?;
    let parts = client.database("bolt through plate");
    let faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let cuboid = |name: &str, half: f64, height: f64| {
        let ring = |z: f64| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
        let vertices = [ring(0.0), ring(height)].concat();
        let mesh = Mesh { vertices: &vertices, corner_counts: &[4; 6], corners: faces.as_flattened() };
        parts.loading(name).replace(true).mesh(&mesh)
    };
    let (plate, bolt) = (cuboid("plate", 2.0, THICKNESS)?, cuboid("bolt", 0.0625, 1.0)?);

    let mut scene = client.scene("bolt through plate").effects([Effect::TimeOfContact]).create()?;
    scene.add_body("plate", &plate)?;
    let straight = scene.add_body("straight", &bolt)?;
    let spinning = scene.add_body("spinning", &bolt)?;
    let names = ["plate", "straight", "spinning"];
    // The first step only places the bodies.
    scene.step(&[translation([0.0, 0.0, 0.0]), translation([-1.0, 0.0, START]), translation([1.0, 0.0, START])])?;

    // Five turns about the bolt's own axis.
    let spin = RigidMotion {
        centre: [1.0, 0.0, START],
        angle: 10.0 * PI,
        translate: [0.0, 0.0, -FLIGHT],
        ..RigidMotion::default()
    };
    let step = StepInput {
        transforms: &[(straight, translation([-1.0, 0.0, START - FLIGHT]))],
        rigid: &[(spinning, spin)],
        delta_time: STEP,
        ..StepInput::default()
    };
    let report = scene.step_with(&step)?;
    for pair in report.pairs() {
        let Some(time) = pair.time_of_contact() else { continue };
        let (from, to) = (time.free_until(), time.at_the_latest());
        let [a, b] = [pair.a(), pair.b()].map(|body| names[body.0 as usize]);
        println!("{a} and {b}: {} at the end of the step", pair.verdict().name());
        println!("  first contact between {from} and {to} of the step");
        println!("  that is after {:.3} µs, the tip at {:.6}", 1e6 * STEP * from, START - FLIGHT * from);
    }
    Ok(())
}
