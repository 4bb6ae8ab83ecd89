//! The automatic order of voxel matrices: time and memory of each shipped mesh at every order, and what the automatic choice costs
//! over the best order.
//!
//! `cargo run --release -p collided-tests --bin orders`. Poses are near contact, where there is most to do: two copies of the mesh, from
//! random directions, a little apart and a little in each other. With `time_of_contact` one copy moves from each to the next.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::Parser;
use collided::accuracy::statistics::Spread;
use collided::accuracy::units::duration;
use collided_kernel::affine::IDENTITY;
use collided_kernel::voxel_matrix::automatic_order;
use collided_kernel::{Accuracy, Effects, NoClock, Object, Scene, Transforms};
use collided_protocol::step::Rows;
use collided_tests::meshes;
use collided_tests::near_contact::Approach;

/// Sweep the orders of the voxel matrices of the shipped meshes.
#[derive(Parser)]
struct Arguments {
    /// Approaches per mesh; two poses each
    #[arg(long, default_value_t = 20)]
    approaches: usize,
    /// How often each pose is run
    #[arg(long, default_value_t = 9)]
    repetitions: usize,
    /// The effect that is asked for
    #[arg(long, value_enum, default_value_t = Asked::Interference)]
    effect: Asked,
    /// What the meshes meet instead of their own copies: this mesh at the order chosen for it, scaled to their size
    #[arg(long, value_name = "MESH")]
    against: Option<PathBuf>,
    /// Other mesh files instead of the shipped ones
    meshes: Vec<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Asked {
    /// The verdict
    Interference,
    /// All interfering polygon pairs
    PolygonPairs,
    /// The minimum distance
    Distance,
    /// The first contact on the way from pose to pose
    TimeOfContact,
}

impl Asked {
    fn effects(self) -> Effects {
        match self {
            Asked::Interference => Effects::INTERFERENCE,
            Asked::PolygonPairs => Effects::POLYGON_PAIRS,
            Asked::Distance => Effects::DISTANCE,
            Asked::TimeOfContact => Effects::TIME_OF_CONTACT,
        }
    }
}

/// Of a mesh at one order.
struct Swept {
    order: u32,
    /// Nanoseconds of a pose.
    time: f64,
    memory: usize,
}

/// An order that takes so many times the least time is the last one in its direction.
const HOPELESS: f64 = 8.0;

fn main() {
    let arguments = Arguments::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    let shipped = || meshes::SHIPPED.iter().map(|name| meshes::path(name)).collect();
    let files: Vec<PathBuf> = if arguments.meshes.is_empty() { shipped() } else { arguments.meshes.clone() };
    pool.install(|| files.iter().for_each(|file| print(file, &arguments)));
}

fn print(file: &Path, arguments: &Arguments) {
    let mesh = meshes::read(file);
    let chosen = meshes::build(mesh.clone(), None);
    let size = meshes::longest_side(&chosen);
    let other = arguments.against.as_ref().map(|file| meshes::build(meshes::read(file), None));
    let met = other.as_ref().unwrap_or(&chosen);
    let scale = size / meshes::longest_side(met);
    let approaches = Approach::random([&chosen, met], scale, 4.0 * size, arguments.approaches, 5);
    let gap = 1e-3 * size;
    let poses: Vec<Rows> =
        approaches.iter().flat_map(|near| [near.at(near.clear + gap), near.at(near.meets - gap)]).collect();
    let order = chosen.order();
    assert_eq!(order, automatic_order(chosen.triangle_count()), "f64 can split these meshes as often as is asked");
    let sweep = |orders: &mut dyn Iterator<Item = u32>| {
        let (mut swept, mut least): (Vec<Swept>, f64) = (Vec::new(), f64::INFINITY);
        for order in orders {
            let object = meshes::build(mesh.clone(), Some(order));
            let time = time([&object, other.as_ref().unwrap_or(&object)], &poses, arguments);
            least = least.min(time.time);
            swept.push(time);
            if swept.last().is_some_and(|last| last.time > HOPELESS * least) {
                break;
            }
        }
        swept
    };
    let mut swept = sweep(&mut (0..=order).rev());
    swept.reverse();
    swept.extend(sweep(&mut (order + 1..=order + 8)));
    print_table(file, &chosen, &swept);
}

fn time(objects: [&Arc<Object>; 2], poses: &[Rows], arguments: &Arguments) -> Swept {
    let mut scene = Scene::new(arguments.effect.effects());
    objects.into_iter().for_each(|object| {
        scene.add_body(Arc::clone(object), None);
    });
    let mut pass = || {
        let timed = poses.iter().map(|rows| {
            // What is remembered of the last pose is forgotten.
            scene.set_accuracy(Accuracy::default());
            let start = Instant::now();
            scene.step(Transforms::Dense(&[IDENTITY, *rows]), &NoClock).expect("good transforms");
            start.elapsed().as_nanos() as f64
        });
        timed.collect::<Vec<f64>>()
    };
    pass();
    let times: Vec<Vec<f64>> = (0..arguments.repetitions).map(|_| pass()).collect();
    let time = Spread::mean_of_columns(&times).expect("there are poses").median;
    Swept { order: objects[0].order(), time, memory: objects[0].memory_bytes() }
}

fn print_table(file: &Path, chosen: &Object, swept: &[Swept]) {
    let best = swept.iter().min_by(|a, b| a.time.total_cmp(&b.time)).expect("some order was run");
    println!("{}: {} triangles", file.file_stem().unwrap_or_default().display(), chosen.triangle_count());
    println!("{:>6} {:>9} {:>9} {:>12}", "order", "a pose", "of best", "bytes");
    for Swept { order, time, memory } in swept {
        let mark = if *order == chosen.order() { "  chosen" } else { "" };
        println!("{order:>6} {:>9} {:>9.2} {memory:>12}{mark}", duration(*time), time / best.time);
    }
    let ours = swept.iter().find(|row| row.order == chosen.order()).expect("the chosen order was run");
    let over = 100.0 * (ours.time / best.time - 1.0);
    println!("order {} is chosen: {over:.0} % over the best order, {}\n", ours.order, best.order);
}
