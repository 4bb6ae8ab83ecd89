//! Bodies up to 20,000.

use std::sync::Arc;

use collided::accuracy::plot::Unit;
use collided::accuracy::units::duration;
use collided_kernel::{Effects, NoClock, Rows, Scene, Transforms};
use collided_tests::{crowd, meshes};
use rayon::ThreadPoolBuilder;

use crate::figure::{Figure, Series, median, nanoseconds, print_head, print_row};

const COUNTS: [usize; 6] = [100, 300, 1_000, 3_000, 10_000, 20_000];
/// The first places the bodies.
const STEPS: usize = 8;
/// Cubic units that each body of unit size has to itself.
const ROOM: f64 = 4.0;
const CURVES: [&str; 4] = ["all move, 1 thread", "all move, 2 threads", "1 % moves, 1 thread", "at rest, 1 thread"];

/// Steps of bunnies of unit size.
pub fn steps(count: usize) -> Vec<Vec<Rows>> {
    let size = 1.0 / meshes::longest_side(&meshes::shipped("low_poly_bunny", Some(0)));
    let scaled = |rows: Rows| rows.map(|[x, y, z, at]| [size * x, size * y, size * z, at]);
    let steps = crowd::moving(count, STEPS, ROOM, 7);
    steps.into_iter().map(|step| step.into_iter().map(scaled).collect()).collect()
}

pub fn scene(count: usize, effects: Effects) -> Scene {
    let bunny = meshes::shipped("low_poly_bunny", None);
    let mut scene = Scene::new(effects);
    (0..count).for_each(|_| {
        scene.add_body(Arc::clone(&bunny), None);
    });
    scene
}

#[derive(Clone, Copy)]
enum Moving {
    All,
    Few,
    None,
}

pub fn measure(quick: bool) -> Vec<Figure> {
    let counts = &COUNTS[..if quick { 2 } else { COUNTS.len() }];
    print_head(&["bodies", CURVES[0], CURVES[1], CURVES[2], CURVES[3], "interfering pairs"]);
    let row = |&count: &usize| {
        let steps = steps(count);
        let ways = [(Moving::All, 1), (Moving::All, 2), (Moving::Few, 1), (Moving::None, 1)];
        let measured = ways.map(|(moving, threads)| step_time(&steps, moving, threads));
        let cells = measured.map(|(time, _)| duration(time));
        print_row([vec![count.to_string()], cells.to_vec(), vec![measured[0].1.to_string()]].concat());
        (count as f64, measured.map(|(time, _)| time).to_vec())
    };
    let rows: Vec<_> = counts.iter().map(row).collect();
    let series = Series {
        title: "Time of a step: bunnies of 696 triangles, verdicts",
        counted: ("bodies", Unit::Power),
        shown: ("time of a step, median", Unit::Time),
        curves: &CURVES,
    };
    vec![("bodies", series.plot(&rows))]
}

/// Median nanoseconds of a step, and interfering pairs of the last one.
fn step_time(steps: &[Vec<Rows>], moving: Moving, threads: usize) -> (f64, u64) {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    let mut scene = scene(steps[0].len(), Effects::INTERFERENCE);
    let mut pairs = 0;
    let mut step = |number: usize| {
        let rows = &steps[number];
        let few: Vec<u32> = (0..rows.len() as u32).skip(number % 100).step_by(100).collect();
        let few_rows: Vec<Rows> = few.iter().map(|&body| rows[body as usize]).collect();
        let transforms = match moving {
            _ if number == 0 => Transforms::Dense(rows),
            Moving::All => Transforms::Dense(rows),
            Moving::Few => Transforms::Sparse { bodies: &few, rows: &few_rows },
            Moving::None => Transforms::Sparse { bodies: &[], rows: &[] },
        };
        let (time, report) = nanoseconds(|| scene.step(transforms, &NoClock).expect("good transforms"));
        pairs = report.counts().interfering_pairs;
        time
    };
    let times: Vec<f64> = pool.install(|| (0..steps.len()).map(&mut step).skip(1).collect());
    (median(times), pairs)
}
