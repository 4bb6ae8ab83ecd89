//! A cue ball breaks a rack of six: the daemon gives the velocities after each impact, this program moves the balls.
//! Start `collided serve`, then `cargo run -p collided-client --example billiard_break`.

use std::f64::consts::PI;

use collided_client::{
    BodySpec, Client, Dynamics, Effect, Error, Mass, Mesh, Rows, StepInput, Velocity, rotation, then, translation,
};

/// Metres, kilograms and seconds.
const RADIUS: f64 = 0.028;
const MASS: f64 = 0.17;
const TIME_STEP: f64 = 0.0005;
const STEPS: usize = 200;
const NAMES: [&str; BALLS] = ["cue", "1", "2", "3", "4", "5", "6"];
const BALLS: usize = 7;
const STACKS: u32 = 12;
const SLICES: u32 = 24;

fn main() -> Result<(), Error> {
    let client = Client::connect()?;
    let (vertices, counts, corners) = sphere();
    let mesh = Mesh { vertices: &vertices, corner_counts: &counts, corners: &corners };
    let ball = client.database("billiard").loading("ball").replace(true).mesh(&mesh)?;
    let mut scene = client.scene("billiard break").effects([Effect::Response]).create()?;
    scene.add_bodies(&NAMES.map(|name| BodySpec::new(name, &ball)))?;
    let inertia = 0.4 * MASS * RADIUS * RADIUS;
    let inertia = [[inertia, 0.0, 0.0], [0.0, inertia, 0.0], [0.0, 0.0, inertia]];
    let mass = Mass::Given { mass: MASS, centre: [0.0; 3], inertia };
    let dynamics = Some(Dynamics { mass, restitution: 0.95, friction: 0.0 });
    let bodies = scene.bodies().to_vec();
    scene.set_dynamics(&bodies.iter().map(|&body| (body, dynamics)).collect::<Vec<_>>())?;

    let mut poses = rack();
    let mut velocities = [Velocity::default(); BALLS];
    velocities[0].linear = [5.0, 0.0, 0.0];
    tell("before", &velocities);
    for step in 0..STEPS {
        poses.iter_mut().zip(&velocities).for_each(|(pose, velocity)| advance(pose, velocity));
        let transforms: Vec<_> = bodies.iter().copied().zip(poses).collect();
        let given: Vec<_> = bodies.iter().copied().zip(velocities).collect();
        let input =
            StepInput { transforms: &transforms, velocities: &given, delta_time: TIME_STEP, ..StepInput::default() };
        let report = scene.step_with(&input)?;
        for pair in report.pairs().filter(|pair| pair.impulses().iter().any(|found| found.impulse_on_b != [0.0; 3])) {
            let [a, b] = [pair.a(), pair.b()].map(|body| NAMES[body.0 as usize]);
            println!("{:6.1} ms: {a} and {b} collide", 1e3 * TIME_STEP * (step + 1) as f64);
        }
        for after in report.velocities() {
            velocities[after.body as usize] = Velocity { linear: after.linear, angular: after.angular };
        }
    }
    tell("after", &velocities);
    Ok(())
}

fn tell(when: &str, velocities: &[Velocity]) {
    let momentum: [f64; 3] = std::array::from_fn(|axis| velocities.iter().map(|ball| MASS * ball.linear[axis]).sum());
    let moving = velocities.iter().filter(|ball| ball.linear != [0.0; 3]).count();
    println!("{when}: {moving} of {BALLS} balls move, momentum {momentum:?} kg m/s");
}

/// The cue ball, and three rows of balls, nearly touching.
fn rack() -> [Rows; BALLS] {
    let places = [(-6.0, 0.1), (0.0, 0.0), (1.0, -1.0), (1.0, 1.0), (2.0, -2.0), (2.0, 0.0), (2.0, 2.0)];
    let apart = 1.002 * RADIUS;
    places.map(|(x, y)| translation([x * apart * 3f64.sqrt(), y * apart, 0.0]))
}

/// Moves and turns a ball for one step.
fn advance(pose: &mut Rows, Velocity { linear, angular }: &Velocity) {
    let centre = pose.map(|row| row[3]);
    let speed = angular.iter().map(|part| part * part).sum::<f64>().sqrt();
    let about_itself = then(pose, &translation(centre.map(|part| -part)));
    let turned = then(&about_itself, &rotation(*angular, speed * TIME_STEP));
    *pose = then(&turned, &translation([0, 1, 2].map(|axis| centre[axis] + TIME_STEP * linear[axis])));
}

/// Vertices, corner counts and corners of a ball: rings of quadrilaterals between two poles of triangles.
fn sphere() -> (Vec<[f64; 3]>, Vec<u32>, Vec<u32>) {
    let ring = |stack: u32| {
        let (across, z) = (PI * f64::from(stack) / f64::from(STACKS)).sin_cos();
        let around = (0..SLICES).map(|slice| (2.0 * PI * f64::from(slice) / f64::from(SLICES)).sin_cos());
        around.map(move |(sin, cos)| [across * cos, across * sin, z].map(|part| RADIUS * part))
    };
    let mut vertices: Vec<[f64; 3]> = (1..STACKS).flat_map(ring).collect();
    let (top, bottom) = (vertices.len() as u32, vertices.len() as u32 + 1);
    vertices.extend([[0.0, 0.0, RADIUS], [0.0, 0.0, -RADIUS]]);
    let at = |ring: u32, slice: u32| ring * SLICES + slice % SLICES;
    let band = |(ring, slice)| [at(ring, slice), at(ring + 1, slice), at(ring + 1, slice + 1), at(ring, slice + 1)];
    let mut corners: Vec<u32> =
        (0..STACKS - 2).flat_map(|ring| (0..SLICES).map(move |s| (ring, s))).flat_map(band).collect();
    let mut counts = vec![4; corners.len() / 4];
    for slice in 0..SLICES {
        corners.extend([top, at(0, slice), at(0, slice + 1)]);
        corners.extend([bottom, at(STACKS - 2, slice + 1), at(STACKS - 2, slice)]);
        counts.extend([3, 3]);
    }
    (vertices, counts, corners)
}
