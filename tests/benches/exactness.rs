//! What exactness costs per pair of triangles: the kernel's test beside the same test in plain f64, on the same input.
//!
//! `cargo bench -p collided-tests --bench exactness`; the last table holds the quotients. Each pair has overlapping boxes, as all that reach the exact test do.

use std::hint::black_box;
use std::time::Instant;

use collided::accuracy::arithmetic::PlainF64;
use collided_kernel::Relation;
use collided_kernel::glam::DVec3;
use collided_kernel::polygon_test::{triangles, triangles_in};
use collided_tests::crowd::Random;
use criterion::{Criterion, criterion_group, criterion_main};

type Pair = [[DVec3; 3]; 2];

const PAIRS: usize = 1 << 12;

/// Pairs with overlapping boxes, of triangles whose corners `corner` makes.
fn pairs(mut corner: impl FnMut(&mut Random) -> [f64; 3]) -> Vec<Pair> {
    let mut random = Random::new(5);
    let mut triangle = || [0; 3].map(|_| DVec3::from(corner(&mut random)));
    let mut pairs = std::iter::repeat_with(|| [triangle(), triangle()]);
    pairs.by_ref().filter(boxes_overlap).take(PAIRS).collect()
}

fn boxes_overlap([a, b]: &Pair) -> bool {
    let low = |t: &[DVec3; 3]| t[0].min(t[1]).min(t[2]);
    let high = |t: &[DVec3; 3]| t[0].max(t[1]).max(t[2]);
    low(a).cmple(high(b)).all() && low(b).cmple(high(a)).all()
}

fn cube(random: &mut Random) -> [f64; 3] {
    [random.unit(), random.unit(), random.unit()]
}

/// Corners up to half of `off` beside a slanted plane; the triangles themselves are of size 1.
fn beside_a_plane(off: f64) -> Vec<Pair> {
    pairs(|random| {
        let [x, y, noise] = cube(random);
        [x, y, 0.3 * x + 0.7 * y + (noise - 0.5) * off]
    })
}

fn grid(points: f64) -> Vec<Pair> {
    pairs(|random| cube(random).map(|x| (points * x).floor()))
}

/// A plane on which every corner lies exactly.
fn slanted(random: &mut Random) -> [f64; 3] {
    let [x, y, _] = cube(random).map(|x| (1024.0 * x).floor());
    [x, y, 3.0 * x + 5.0 * y]
}

fn inputs() -> Vec<(String, Vec<Pair>)> {
    let mut inputs = vec![
        ("random".into(), pairs(cube)),
        ("integer_grid_8".into(), grid(8.0)),
        ("integer_grid_3".into(), grid(3.0)),
        ("coplanar".into(), pairs(|random| [random.unit(), random.unit(), 0.5])),
        ("coplanar_slanted".into(), pairs(slanted)),
    ];
    // From far off the plane to an ulp or two, where the rounding of the corners is what puts them beside it.
    for exponent in [-2, -4, -6, -8, -10, -12, -13, -14, -15, -16] {
        inputs.push((format!("near_coplanar_1e{exponent}"), beside_a_plane(10f64.powi(exponent))));
    }
    inputs.push(("near_coplanar_off_grid".into(), pairs(off_grid)));
    inputs
}

/// Beside the same plane by 1e-15, with x of very different magnitudes: two pairs of three have a coordinate with bits
/// below the grid of fixed length.
fn off_grid(random: &mut Random) -> [f64; 3] {
    let [x, y, noise] = cube(random);
    let x = x.powi(4);
    [x, y, 0.3 * x + 0.7 * y + (noise - 0.5) * 1e-15]
}

fn exactness(criterion: &mut Criterion) {
    for (name, pairs) in &inputs() {
        let mut group = criterion.benchmark_group(name);
        let mut cycle = pairs.iter().cycle();
        group.bench_function("exact", |bencher| bencher.iter(|| cycle.next().map(|[a, b]| triangles(a, b))));
        let mut cycle = pairs.iter().cycle();
        group.bench_function("plain_f64", |bencher| {
            bencher.iter(|| cycle.next().map(|[a, b]| triangles_in(PlainF64, a, b)));
        });
    }
    print_ratios();
}

/// So few pairs take less than a time slice: on a shared machine a longer run is interrupted more often than a short one, and
/// the slower test would look slower than it is.
const CHUNK: usize = 64;

const ROUNDS: usize = 60;

/// The quotients that count: both tests in turn on each chunk, the fastest of all rounds of each chunk, summed.
fn print_ratios() {
    println!("{:24} {:>9} {:>9} {:>6}", "fastest of all rounds", "exact ns", "plain ns", "ratio");
    for (name, pairs) in inputs() {
        let mut fastest = vec![[f64::INFINITY; 2]; PAIRS.div_ceil(CHUNK)];
        for _ in 0..ROUNDS {
            for (chunk, [exact, plain]) in pairs.chunks(CHUNK).zip(&mut fastest) {
                *exact = exact.min(nanoseconds(chunk, triangles));
                *plain = plain.min(nanoseconds(chunk, |a, b| triangles_in(PlainF64, a, b)));
            }
        }
        let each = |which: usize| fastest.iter().map(|chunk| chunk[which]).sum::<f64>() / PAIRS as f64;
        println!("{name:24} {:9.1} {:9.1} {:6.2}", each(0), each(1), each(0) / each(1));
    }
}

fn nanoseconds(pairs: &[Pair], test: impl Fn(&[DVec3; 3], &[DVec3; 3]) -> Option<Relation>) -> f64 {
    let start = Instant::now();
    for [a, b] in pairs {
        black_box(test(black_box(a), b));
    }
    start.elapsed().as_nanos() as f64
}

criterion_group!(benches, exactness);
criterion_main!(benches);
