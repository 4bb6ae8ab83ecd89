//! What each effect costs, alone and together, and that what was not asked for costs nothing.
//!
//! `cargo bench -p collided-tests --bench effects` prints, for three scenes, the median time of a step and the stage counts of its
//! effects, and what a distance costs by what is between the bodies. In one process and one thread, without daemon or shared memory.

use std::sync::Arc;
use std::time::Instant;

use collided_kernel::effects::response::MassProperties;
use collided_kernel::{BodyId, Dynamics, Effects, NoClock, Object, Rows, Scene, StageCounts, Transforms};
use collided_tests::{crowd, meshes};

/// How often the steps of a scene are taken.
const ROUNDS: usize = 5;

/// The effects, alone and in the combinations that simulators, planners and assembly checks ask for.
const SETS: [(&str, &[Effects]); 11] = [
    ("interference", &[Effects::INTERFERENCE]),
    ("polygon_pairs", &[Effects::POLYGON_PAIRS]),
    ("containment", &[Effects::CONTAINMENT]),
    ("distance", &[Effects::DISTANCE]),
    ("contacts", &[Effects::CONTACTS]),
    ("penetration", &[Effects::PENETRATION]),
    ("time_of_contact", &[Effects::TIME_OF_CONTACT]),
    ("response", &[Effects::RESPONSE]),
    ("contacts + response", &[Effects::CONTACTS, Effects::RESPONSE]),
    ("interference + time_of_contact", &[Effects::INTERFERENCE, Effects::TIME_OF_CONTACT]),
    ("distance + contacts + containment", &[Effects::DISTANCE, Effects::CONTACTS, Effects::CONTAINMENT]),
];

/// Objects of the bodies, and where they are in each step.
struct Case {
    name: &'static str,
    objects: Vec<Arc<Object>>,
    steps: Vec<Vec<Rows>>,
}

/// 200 bunnies of unit size that turn and drift.
fn crowd_of_bunnies() -> Case {
    let bunny = meshes::shipped("low_poly_bunny", None);
    let size = 1.0 / meshes::longest_side(&bunny);
    let scaled = |rows: Rows| rows.map(|[x, y, z, t]| [size * x, size * y, size * z, t]);
    let steps = crowd::moving(200, 6, 4.0, 7);
    let steps = steps.into_iter().map(|step| step.into_iter().map(scaled).collect()).collect();
    Case { name: "200 bunnies", objects: vec![bunny; 200], steps }
}

/// Two meshes, the second one moving along a line, in `count` steps.
fn pair(name: &'static str, meshes: [&str; 2], from: [f64; 3], to: [f64; 3], count: usize) -> Case {
    let objects = meshes.map(|mesh| meshes::shipped(mesh, None)).to_vec();
    let at = |t: f64| [0, 1, 2].map(|axis| from[axis] + t * (to[axis] - from[axis]));
    let rows = |[x, y, z]: [f64; 3]| [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]];
    let steps = (0..count).map(|step| vec![rows([0.0; 3]), rows(at(step as f64 / (count - 1) as f64))]).collect();
    Case { name, objects, steps }
}

fn scene(case: &Case, effects: Effects) -> Scene {
    let mut scene = Scene::new(effects);
    let inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mass = MassProperties { mass: 1.0, centre: [0.0; 3], inertia };
    for object in &case.objects {
        let body: BodyId = scene.add_body(Arc::clone(object), None);
        let dynamics = Dynamics { mass, restitution: 0.0, friction: 0.5 };
        scene.set_dynamics(body, Some(dynamics)).expect("the body is there");
    }
    scene
}

/// Median microseconds of a step, and the counts of all steps of one round.
fn measure(case: &Case, effects: Effects) -> (f64, StageCounts) {
    let mut scene = scene(case, effects);
    let (mut times, mut counts) = (Vec::new(), StageCounts::default());
    for round in 0..ROUNDS {
        for rows in &case.steps {
            let start = Instant::now();
            let report = scene.step(Transforms::Dense(rows), &NoClock).expect("the transforms are finite");
            let time = start.elapsed().as_secs_f64() * 1e6;
            if round > 0 {
                times.push(time);
            } else {
                counts.add(report.counts());
            }
        }
    }
    times.sort_unstable_by(f64::total_cmp);
    (times[times.len() / 2], counts)
}

fn print(case: &Case) {
    println!("\n{}: {} steps, one thread\n", case.name, case.steps.len());
    println!("| effects | µs a step | containment | distance | contacts | penetration | time | response |");
    println!("|---|---|---|---|---|---|---|---|");
    for (name, effects) in SETS {
        let effects = effects.iter().fold(Effects::NONE, |all, &effect| all.union(effect));
        let (time, counts) = measure(case, effects);
        println!(
            "| {name} | {time:.1} | {} | {} | {} | {} | {} | {} |",
            counts.containment_tests,
            counts.distance_searches,
            counts.contact_pairs,
            counts.penetration_searches,
            counts.time_searches,
            counts.response_points,
        );
    }
}

/// What a distance costs, by what is between the bodies.
fn print_distances() {
    println!("\ntwo cows, 12 directions, one thread: distance\n\n| apart, in sizes | µs a step |\n|---|---|");
    for apart in [1e0, 1e2, 1e4, 1e6, 1e9] {
        let [from, to] = [[1.7, 0.3, 0.1], [0.4, -1.1, 1.5]].map(|place| place.map(|x| x * apart));
        let (time, _) = measure(&pair("", ["spot", "spot"], from, to, 12), Effects::DISTANCE);
        println!("| {apart:e} | {time:.1} |");
    }
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    pool.install(|| {
        print(&pair("rob moving over env", ["env", "rob"], [0.0, -400.0, 300.0], [0.0, 400.0, 300.0], 12));
        print(&pair("spot past spot", ["spot", "spot"], [1.2, 0.3, 0.1], [0.4, 0.1, 0.0], 12));
        print(&crowd_of_bunnies());
        print_distances();
    });
}
