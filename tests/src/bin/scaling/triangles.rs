//! Triangles up to more than four million: the cow, each triangle cut in four over and over. Its shape stays the same.

use std::sync::Arc;

use collided::accuracy::plot::Unit;
use collided::accuracy::units::duration;
use collided_kernel::{NoClock, Object, PolygonMesh};
use collided_tests::derived_meshes::subdivided;
use collided_tests::meshes;
use rayon::ThreadPoolBuilder;

use crate::figure::{Figure, Series, nanoseconds, print_head, print_row};
use crate::near::{Poses, verdicts};

/// 4⁵ times the triangles.
const SUBDIVISIONS: u32 = 5;
/// Meshes that build faster than this, in triangles, are built three times.
const SMALL: usize = 1_000_000;
const APPROACHES: usize = 20;
const CURVES: [&str; 4] = ["build, 1 thread", "build, 2 threads", "verdict, near", "verdict, hit"];

struct Measured {
    triangles: f64,
    times: Vec<f64>,
    bytes: f64,
}

pub fn measure(quick: bool) -> Vec<Figure> {
    let mesh = meshes::read(&meshes::path("spot"));
    let poses = Poses::random(&meshes::build(mesh.clone(), None), APPROACHES);
    print_head(&["triangles", "order", CURVES[0], CURVES[1], CURVES[2], CURVES[3], "bytes a triangle"]);
    let all = 0..=if quick { 1 } else { SUBDIVISIONS };
    let rows: Vec<Measured> = all.map(|times| of_mesh(&subdivided(&mesh, times), &poses)).collect();
    let over = |title, shown, curves, numbers: fn(&Measured) -> Vec<f64>| {
        let rows: Vec<_> = rows.iter().map(|row| (row.triangles, numbers(row))).collect();
        Series { title, counted: ("triangles", Unit::Power), shown, curves }.plot(&rows)
    };
    let time = ("time", Unit::Time);
    vec![
        ("triangles", over("Build, and verdicts near contact", time, &CURVES, |row| row.times.clone())),
        ("memory", over("Memory held", ("bytes", Unit::Power), &["memory"], |row| vec![row.bytes])),
    ]
}

fn of_mesh(mesh: &PolygonMesh, poses: &Poses) -> Measured {
    let builds = [1, 2].map(|threads| build(mesh, threads));
    let [(one, object), (two, _)] = &builds;
    let pool = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    let [near, hit] = pool.install(|| [&poses.apart, &poses.hit].map(|poses| verdicts(object, poses, &NoClock).0));
    let (triangles, bytes) = (object.triangle_count(), object.memory_bytes());
    let times = vec![*one, *two, near, hit];
    let cells: Vec<String> = times.iter().map(|&time| duration(time)).collect();
    let each = format!("{:.0}", bytes as f64 / triangles as f64);
    print_row([vec![triangles.to_string(), object.order().to_string()], cells, vec![each]].concat());
    Measured { triangles: triangles as f64, times, bytes: bytes as f64 }
}

/// Nanoseconds of the fastest build, and what was built.
fn build(mesh: &PolygonMesh, threads: usize) -> (f64, Arc<Object>) {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
    let once = || {
        let mesh = mesh.clone();
        pool.install(|| nanoseconds(|| meshes::build(mesh, None)))
    };
    let mut best = once();
    for _ in 0..if mesh.polygon_count() < SMALL { 2 } else { 0 } {
        let (time, _) = once();
        best.0 = best.0.min(time);
    }
    best
}
