//! Orders of the voxel matrix up to the largest.

use std::sync::Arc;

use collided::accuracy::plot::Unit;
use collided::accuracy::units::duration;
use collided_kernel::{MAX_ORDER, NoClock, Object};
use collided_tests::meshes;
use rayon::ThreadPoolBuilder;

use crate::figure::{Figure, Series, nanoseconds, print_head, print_row};
use crate::near::{Poses, verdicts};

const APPROACHES: usize = 5;
const CURVES: [&str; 3] = ["build, 2 threads", "verdict, near", "verdict, hit"];

pub fn measure(quick: bool) -> Vec<Figure> {
    let mesh = meshes::read(&meshes::path("spot"));
    let poses = Poses::random(&meshes::build(mesh.clone(), None), APPROACHES);
    let [one, two] =
        [1, 2].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started"));
    print_head(&["order", "voxels", CURVES[0], CURVES[1], CURVES[2], "bytes a triangle"]);
    let mut rows = Vec::new();
    for order in (if quick { 18 } else { 0 }..=MAX_ORDER).step_by(3) {
        let copy = mesh.clone();
        let built = two.install(|| nanoseconds(|| Object::build(copy, Some(order), &())));
        let (build, Ok(object)) = built else {
            println!("order {order} takes too much memory");
            break;
        };
        let object = Arc::new(object);
        let [near, hit] = one.install(|| [&poses.apart, &poses.hit].map(|poses| verdicts(&object, poses, &NoClock).0));
        let times = vec![build, near, hit];
        let cells: Vec<String> = times.iter().map(|&time| duration(time)).collect();
        let each = format!("{:.0}", object.memory_bytes() as f64 / object.triangle_count() as f64);
        print_row([vec![order.to_string(), object.occupied_voxels().to_string()], cells, vec![each]].concat());
        rows.push((f64::from(order), times));
    }
    let series = Series {
        title: "Orders of the cow's voxel matrix, 5,856 triangles",
        counted: ("order M", Unit::Count),
        shown: ("time", Unit::Time),
        curves: &CURVES,
    };
    vec![("orders", series.plot(&rows))]
}
