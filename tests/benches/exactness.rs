//! What exactness costs per pair of triangles: the kernel's test beside the same test in plain f64, on the same input.
//!
//! `cargo bench -p collided-tests --bench exactness`. Each pair has overlapping boxes, as all that reach the exact test do.

use collided_kernel::glam::DVec3;
use collided_kernel::polygon_test::{triangles, triangles_in};
use collided_tests::crowd::Random;
use collided_tests::plain_f64::PlainF64;
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

/// Corners a few ulp off a slanted plane.
fn near_plane(random: &mut Random) -> [f64; 3] {
    let [x, y, noise] = cube(random);
    [x, y, 0.3 * x + 0.7 * y + (noise - 0.5) * 1e-15]
}

fn exactness(criterion: &mut Criterion) {
    let inputs = [
        ("random", pairs(cube)),
        ("near_coplanar", pairs(near_plane)),
        ("integer_grid", pairs(|random| cube(random).map(|x| (8.0 * x).floor()))),
        ("coplanar", pairs(|random| [random.unit(), random.unit(), 0.5])),
        (
            "coplanar_slanted",
            pairs(|random| {
                let [x, y, _] = cube(random).map(|x| (1024.0 * x).floor());
                [x, y, 3.0 * x + 5.0 * y]
            }),
        ),
    ];
    for (name, pairs) in &inputs {
        let mut group = criterion.benchmark_group(*name);
        let mut cycle = pairs.iter().cycle();
        group.bench_function("exact", |bencher| bencher.iter(|| cycle.next().map(|[a, b]| triangles(a, b))));
        let mut cycle = pairs.iter().cycle();
        group.bench_function("plain_f64", |bencher| {
            bencher.iter(|| cycle.next().map(|[a, b]| triangles_in(PlainF64, a, b)));
        });
    }
}

criterion_group!(benches, exactness);
criterion_main!(benches);
