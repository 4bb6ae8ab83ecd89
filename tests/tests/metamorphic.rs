//! Answers that follow from one another: the input is changed in a way whose effect on the answer is known, whatever the
//! answer is. Each changed input runs in another way too: some order of the voxel matrices, one thread or two, either body first.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::{Arc, LazyLock};

use collided_kernel::{Effects, Object, PolygonMesh};
use collided_protocol::report::Relation;
use collided_protocol::step::Rows;
use collided_tests::derived_meshes::{self, Derived, in_pieces, in_triangles};
use collided_tests::hardcases::{self, Case};
use collided_tests::kernel_pair::{self, KernelPair, Outcome};
use collided_tests::small_meshes::small_mesh;
use collided_tests::transforms::linear;
use collided_tests::{meshes, oracle};
use proptest::array::{uniform3, uniform4};
use proptest::prelude::*;
use proptest::sample::select;
use rayon::ThreadPool;

static POOLS: LazyLock<[ThreadPool; 2]> = LazyLock::new(kernel_pair::pools);

/// Orders of the voxel matrices that are quickly built of any hard case.
const ORDERS: Range<u32> = 0..17;

type Point = [f64; 3];

/// How a step is run: the answer must not depend on it.
#[derive(Debug, Clone, Copy)]
struct Way {
    order: u32,
    two_threads: bool,
    swapped: bool,
}

impl Way {
    /// The ways one after another, without end: neighbours differ in everything.
    fn all() -> impl Iterator<Item = Way> {
        let swapped = [false, false, true, true];
        let way = move |(order, (number, swapped))| Way { order, two_threads: number % 2 == 1, swapped };
        ORDERS.cycle().zip(swapped.into_iter().enumerate().cycle()).map(way)
    }
}

fn step([a, b]: &[Arc<Object>; 2], [rows_a, rows_b]: &[Rows; 2], way: Way) -> Outcome {
    let run = |effects| {
        let outcome = if way.swapped {
            KernelPair::new(b, a, effects).step(*rows_b, *rows_a)
        } else {
            KernelPair::new(a, b, effects).step(*rows_a, *rows_b)
        };
        outcome.expect("the transforms are finite, and so are the world vertices")
    };
    let pool = &POOLS[usize::from(way.two_threads)];
    let (outcome, alone) = pool.install(|| (run(Effects::POLYGON_PAIRS), run(Effects::INTERFERENCE)));
    assert_eq!(outcome.interfering, alone.interfering, "{way:?}");
    assert!(outcome.polygon_pairs.is_sorted_by(|p, q| (p.0, p.1) < (q.0, q.1)), "{way:?}: {outcome:?}");
    if way.swapped { outcome.swapped() } else { outcome }
}

/// Two meshes and where they are.
#[derive(Debug, Clone)]
struct Input {
    meshes: [PolygonMesh; 2],
    rows: [Rows; 2],
}

impl Input {
    fn of(case: &Case) -> Input {
        let mesh = |mesh: &hardcases::Mesh| PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons);
        Input { meshes: [mesh(&case.a), mesh(&case.b)], rows: [case.rows_a, case.rows_b] }
    }

    fn with_rows(&self, change: impl Fn(&Rows) -> Rows) -> Input {
        Input { meshes: self.meshes.clone(), rows: self.rows.each_ref().map(change) }
    }

    fn objects(&self, order: Option<u32>) -> [Arc<Object>; 2] {
        self.meshes.clone().map(|mesh| meshes::build(mesh, order))
    }

    fn outcome(&self, way: Way) -> Outcome {
        step(&self.objects(Some(way.order)), &self.rows, way)
    }

    /// What everything else is compared with.
    fn plain_outcome(&self) -> Outcome {
        step(&self.objects(None), &self.rows, Way { order: 0, two_threads: false, swapped: false })
    }

    fn world(&self) -> Vec<Point> {
        let world = |i: usize| oracle::world_vertices(&self.rows[i], &self.meshes[i].vertices);
        [world(0), world(1)].concat()
    }
}

/// The valid hard cases, with the answer that the changed ones are compared with.
fn hard_cases() -> Vec<(String, Input, Outcome)> {
    let valid = hardcases::static_cases().into_iter().filter(|case| case.answer().is_some());
    let with_answer = |case: Case| {
        let input = Input::of(&case);
        let outcome = input.plain_outcome();
        (case.id, input, outcome)
    };
    valid.map(with_answer).collect()
}

/// The 48 ways to exchange and to reverse the axes: the axis that each new one is, and its direction.
fn signed_axes() -> impl Iterator<Item = [(usize, f64); 3]> {
    const PERMUTATIONS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let signed = |signs: usize| {
        let sign = move |axis: usize| if signs >> axis & 1 == 1 { -1.0 } else { 1.0 };
        PERMUTATIONS.map(|axes| [0, 1, 2].map(|i| (axes[i], sign(i))))
    };
    (0..8).flat_map(signed)
}

/// The world's axes exchanged and reversed: rounding to nearest is symmetric, so the world vertices follow exactly.
fn turned(rows: &Rows, axes: &[(usize, f64); 3]) -> Rows {
    axes.map(|(axis, sign)| rows[axis].map(|entry| sign * entry))
}

/// Powers of two for the three axes; what is scaled by them may leave the range of f64.
const SCALES: [[i32; 3]; 9] =
    [[1; 3], [-1; 3], [200; 3], [-200; 3], [900; 3], [-900; 3], [-3, 5, 0], [40, -40, 7], [300, -300, -600]];

fn power_of_two(exponent: i32) -> f64 {
    2f64.powi(exponent)
}

/// The world's axes stretched, each by its power of two.
fn stretched(rows: &Rows, exponents: [i32; 3]) -> Rows {
    [0, 1, 2].map(|i| rows[i].map(|entry| entry * power_of_two(exponents[i])))
}

/// The object in another length unit, and the transform that undoes it.
fn in_other_unit(input: &Input, exponent: i32) -> Input {
    let (there, back) = (power_of_two(exponent), power_of_two(-exponent));
    let mut changed = input.with_rows(|rows| rows.map(|[x, y, z, t]| [x * back, y * back, z * back, t]));
    changed.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices).flatten().for_each(|x| *x *= there);
    changed
}

/// Whether every coordinate of `scaled` is that of `world` times a power of two, nothing lost to either end of the range.
fn is_stretched_exactly(world: &[Point], scaled: &[Point], exponents: [i32; 3]) -> bool {
    let exact = |axis: usize, from: f64, to: f64| {
        from * power_of_two(exponents[axis]) == to && to * power_of_two(-exponents[axis]) == from
    };
    world.iter().zip(scaled).all(|(from, to)| (0..3).all(|axis| exact(axis, from[axis], to[axis])))
}

/// The world moved, in the last operation of each coordinate.
fn moved(rows: &Rows, by: Point) -> Rows {
    [0, 1, 2].map(|i| {
        let [x, y, z, t] = rows[i];
        [x, y, z, t + by[i]]
    })
}

/// Whether every coordinate of `there` is that of `world` plus `by`, without rounding (Knuth's two-sum has no error then).
fn is_moved_exactly(world: &[Point], there: &[Point], by: Point) -> bool {
    let exact = |from: f64, by: f64, to: f64| {
        let virtual_by = to - from;
        from + by == to && from - (to - virtual_by) == 0.0 && by - virtual_by == 0.0
    };
    world.iter().zip(there).all(|(from, to)| (0..3).all(|axis| exact(from[axis], by[axis], to[axis])))
}

/// An input made of derived meshes, with what its polygons come from.
fn derive(input: &Input, change: impl Fn(&PolygonMesh) -> Derived) -> (Input, [Vec<u32>; 2]) {
    let [a, b] = input.meshes.each_ref().map(change);
    (Input { meshes: [a.mesh, b.mesh], rows: input.rows }, [a.origin, b.origin])
}

/// What must be found of meshes whose polygons are copies of the original ones.
fn of_copies(original: &Outcome, origin: &[Vec<u32>; 2]) -> Outcome {
    let relation: BTreeMap<_, _> = original.polygon_pairs.iter().map(|&(a, b, relation)| ((a, b), relation)).collect();
    let pairs_of = |(a, &of_a): (u32, &u32)| {
        let pair = |(b, &of_b): (u32, &u32)| Some((a, b, *relation.get(&(of_a, of_b))?));
        (0..).zip(&origin[1]).filter_map(pair).collect::<Vec<_>>()
    };
    Outcome::of((0..).zip(&origin[0]).flat_map(pairs_of).collect())
}

/// What was found of the parts of polygons, told of the polygons.
fn of_wholes(parts: &Outcome, origin: &[Vec<u32>; 2]) -> Outcome {
    let mut strongest = BTreeMap::new();
    for &(a, b, found) in &parts.polygon_pairs {
        let relation = strongest.entry((origin[0][a as usize], origin[1][b as usize])).or_insert(found);
        *relation = found.max(*relation);
    }
    Outcome::of(strongest.into_iter().map(|((a, b), relation)| (a, b, relation)).collect())
}

/// A change of a mesh, and what it is called.
type Copying<'a> = (&'a str, &'a dyn Fn(&PolygonMesh) -> Derived);

/// All changes of the meshes that leave every polygon what it is.
fn check_copies(name: &str, input: &Input, expected: &Outcome, keys: &[u32], ways: &mut impl Iterator<Item = Way>) {
    let renumbered = |mesh: &PolygonMesh| derived_meshes::renumbered(mesh, keys);
    let changes: [Copying<'_>; 3] = [
        ("renumbered", &renumbered),
        ("without shared vertices", &derived_meshes::without_shared_vertices),
        ("doubled", &derived_meshes::doubled),
    ];
    for ((change, copying), way) in changes.into_iter().zip(ways.by_ref()) {
        let (changed, origin) = derive(input, copying);
        assert_eq!(changed.outcome(way), of_copies(expected, &origin), "{name}, {change}, {way:?}");
    }
    let (changed, origin) = derive(input, in_triangles);
    let way = ways.next().expect("there are ways without end");
    assert_eq!(of_wholes(&changed.outcome(way), &origin), *expected, "{name} in triangles, {way:?}");
}

/// Scales of the world and of the object's unit; the number of those that lose nothing.
fn check_scales(name: &str, input: &Input, expected: &Outcome, ways: &mut impl Iterator<Item = Way>) -> usize {
    let world = input.world();
    let mut exact = 0;
    for (exponents, way) in SCALES.into_iter().zip(ways) {
        let scaled = input.with_rows(|rows| stretched(rows, exponents));
        if is_stretched_exactly(&world, &scaled.world(), exponents) {
            exact += 1;
            assert_eq!(scaled.outcome(way), *expected, "{name}, world by 2^{exponents:?}, {way:?}");
        }
        let [exponent, ..] = exponents;
        let scaled = in_other_unit(input, exponent);
        let vertices = |input: &Input| [&*input.meshes[0].vertices, &*input.meshes[1].vertices].concat();
        let lossless = is_stretched_exactly(&vertices(input), &vertices(&scaled), [exponent; 3]);
        if lossless && scaled.world() == world {
            exact += 1;
            assert_eq!(scaled.outcome(way), *expected, "{name}, unit by 2^{exponent}, {way:?}");
        }
    }
    exact
}

/// Translations of the world; the number of those that lose nothing.
fn check_moves(name: &str, input: &Input, expected: &Outcome, ways: &mut impl Iterator<Item = Way>) -> usize {
    const MOVES: [Point; 4] = [[1.0, 0.0, 0.0], [-2.0, 0.5, 16.0], [1024.0, -0.125, 3.0], [0.0, -65536.0, 65536.0]];
    let world = input.world();
    let mut exact = 0;
    for (by, way) in MOVES.into_iter().zip(ways) {
        let there = input.with_rows(|rows| moved(rows, by));
        if is_moved_exactly(&world, &there.world(), by) {
            exact += 1;
            assert_eq!(there.outcome(way), *expected, "{name}, moved by {by:?}, {way:?}");
        }
    }
    exact
}

#[test]
fn hard_cases_with_the_axes_of_the_world_exchanged_and_reversed() {
    for ((name, input, expected), way) in hard_cases().iter().zip(Way::all()) {
        let objects = input.objects(Some(way.order));
        for axes in signed_axes() {
            let rows = input.rows.each_ref().map(|rows| turned(rows, &axes));
            assert_eq!(step(&objects, &rows, way), *expected, "{name}, {axes:?}, {way:?}");
        }
    }
}

#[test]
fn hard_cases_at_every_order() {
    for (name, input, expected) in &hard_cases() {
        for way in Way::all().take(ORDERS.len()) {
            assert_eq!(input.outcome(way), *expected, "{name}, {way:?}");
        }
    }
}

/// Up to the last order; matrices of meshes with much area would be large there.
#[test]
fn thin_hard_cases_at_the_finest_orders() {
    const THIN: [&str; 6] = [
        "ee-diag",
        "deg-point-point",
        "deg-seg-seg-cross",
        "deg-seg-seg-collinear-gap",
        "subnormal-cross",
        "subnormal-miss",
    ];
    let mut cases = hard_cases();
    cases.retain(|(name, ..)| THIN.contains(&name.as_str()));
    assert_eq!(cases.len(), THIN.len());
    for (name, input, expected) in &cases {
        for (order, way) in (ORDERS.end..=30).zip(Way::all()) {
            let way = Way { order, ..way };
            assert_eq!(input.outcome(way), *expected, "{name}, {way:?}");
        }
    }
}

#[test]
fn hard_cases_scaled_by_powers_of_two() {
    let mut ways = Way::all();
    let cases = hard_cases();
    let exact = cases.iter().map(|(name, input, expected)| check_scales(name, input, expected, &mut ways));
    let exact: usize = exact.sum();
    println!("{exact} of {} scales lose nothing", 2 * SCALES.len() * cases.len());
    assert!(exact > 3 * SCALES.len() * cases.len() / 2);
}

#[test]
fn hard_cases_moved_as_far_as_nothing_is_rounded() {
    let mut ways = Way::all();
    let cases = hard_cases();
    let exact = cases.iter().map(|(name, input, expected)| check_moves(name, input, expected, &mut ways));
    let exact: usize = exact.sum();
    println!("{exact} of {} moves lose nothing", 4 * cases.len());
    assert!(exact > cases.len());
}

#[test]
fn hard_cases_with_other_numbers_copies_and_cuts() {
    let mut ways = Way::all();
    for (name, input, expected) in &hard_cases() {
        check_copies(name, input, expected, &[3, 1, 4, 1, 5], &mut ways);
    }
}

#[test]
fn real_meshes_changed_in_every_exact_way() {
    let [spot, bunny] = ["spot", "low_poly_bunny"].map(|name| meshes::read(&meshes::path(name)));
    let still = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let placed = [[0.5, 0.1, 0.0, 0.2], [0.0, 0.4, 0.2, 0.1], [0.1, 0.0, 0.6, 0.3]];
    let input = Input { meshes: [spot, bunny], rows: [still, placed] };
    let expected = input.plain_outcome();
    assert!(expected.polygon_pairs.len() > 50);
    // Order 0 compares every polygon with every other.
    let mut ways = Way::all().filter(|way| way.order >= 6);
    let objects = input.objects(None);
    for (axes, way) in signed_axes().zip(ways.by_ref()) {
        let rows = input.rows.each_ref().map(|rows| turned(rows, &axes));
        assert_eq!(step(&objects, &rows, way), expected, "{axes:?}, {way:?}");
    }
    assert!(check_scales("real meshes", &input, &expected, &mut ways) > SCALES.len());
    check_copies("real meshes", &input, &expected, &[3, 1, 4, 1, 5], &mut ways);
}

fn way() -> impl Strategy<Value = Way> {
    (ORDERS, any::<bool>(), any::<bool>()).prop_map(|(order, two_threads, swapped)| Way { order, two_threads, swapped })
}

fn any_rows() -> impl Strategy<Value = Rows> {
    (linear(), uniform3((-4..=4).prop_map(|x| f64::from(x) / 2.0)))
        .prop_map(|(linear, shift)| [0, 1, 2].map(|i| [linear[i][0], linear[i][1], linear[i][2], shift[i]]))
}

/// Few bits each, so that no world coordinate of a small mesh is rounded.
fn grid_rows() -> impl Strategy<Value = Rows> {
    uniform3(uniform4(select(vec![-1.0, 0.0, 0.0, 0.5, 1.0, 2.0, -0.25])))
}

fn small_input<S: Strategy<Value = Rows>>(rows: fn() -> S) -> impl Strategy<Value = Input> {
    (small_mesh(), small_mesh(), rows(), rows()).prop_map(|(a, b, rows_a, rows_b)| {
        let mut meshes = [a, b];
        // Multiples of 6 have halves and thirds.
        meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices).flatten().for_each(|x| *x *= 6.0);
        Input { meshes, rows: [rows_a, rows_b.map(|[x, y, z, t]| [x, y, z, 6.0 * t])] }
    })
}

fn integer_map() -> impl Strategy<Value = [[f64; 3]; 3]> {
    let entries = uniform3(uniform3((-2..=2i32).prop_map(f64::from)));
    let determinant = |[a, b, c]: &[Point; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    entries.prop_filter("the map is singular", move |rows| determinant(rows) != 0.0)
}

/// The world mapped after the body is placed in it.
fn mapped(rows: &Rows, map: &[[f64; 3]; 3]) -> Rows {
    map.map(|by| [0, 1, 2, 3].map(|j| by[0] * rows[0][j] + by[1] * rows[1][j] + by[2] * rows[2][j]))
}

/// The axes of the objects' own frames exchanged and reversed, and those of the transforms with them.
fn in_other_frame(input: &Input, axes: &[(usize, f64); 3]) -> Input {
    let other = |point: &Point| axes.map(|(axis, sign)| sign * point[axis]);
    let mut changed = input.with_rows(|rows| {
        rows.map(|[x, y, z, t]| {
            let [x, y, z] = other(&[x, y, z]);
            [x, y, z, t]
        })
    });
    changed.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| *vertex = other(vertex));
    changed
}

/// Cuts keep the verdict and the pairs of wholes. A relation stays as it is, but for `cross`: where the surfaces cross in
/// nothing but the cut, the parts touch.
fn check_pieces(input: &Input, expected: &Outcome, way: Way) {
    let (changed, origin) = derive(input, in_pieces);
    let found = of_wholes(&changed.outcome(way), &origin);
    let numbers = |outcome: &Outcome| outcome.polygon_pairs.iter().map(|&(a, b, _)| (a, b)).collect::<Vec<_>>();
    assert_eq!(numbers(&found), numbers(expected), "in pieces, {way:?}");
    for (found, expected) in found.polygon_pairs.iter().zip(&expected.polygon_pairs) {
        assert!(found.2 == expected.2 || expected.2 == Relation::Cross, "{found:?}, not {expected:?}, {way:?}");
    }
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, max_shrink_iters: 500, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config(300))]

    #[test]
    fn small_meshes_under_any_transform(
        input in small_input(any_rows),
        axes in select(signed_axes().collect::<Vec<_>>()),
        keys in uniform4(any::<u32>()),
        way in way(),
    ) {
        let expected = input.plain_outcome();
        prop_assert_eq!(&input.with_rows(|rows| turned(rows, &axes)).outcome(way), &expected);
        let mut ways = Way::all().skip(way.order as usize);
        prop_assert!(check_scales("small meshes", &input, &expected, &mut ways) > SCALES.len());
        check_copies("small meshes", &input, &expected, &keys, &mut ways);
    }

    #[test]
    fn small_meshes_where_nothing_is_rounded(
        input in small_input(grid_rows),
        axes in select(signed_axes().collect::<Vec<_>>()),
        map in integer_map(),
        by in uniform3((-9..=9i32).prop_map(|x| f64::from(x) * 0.75)),
        way in way(),
    ) {
        let expected = input.plain_outcome();
        let there = input.with_rows(|rows| moved(rows, by));
        prop_assert!(is_moved_exactly(&input.world(), &there.world(), by));
        prop_assert_eq!(&there.outcome(way), &expected);
        prop_assert_eq!(&input.with_rows(|rows| mapped(rows, &map)).outcome(way), &expected);
        check_pieces(&input, &expected, way);
        // How a polygon of more corners is cut may depend on its frame: triangles have nothing to be cut.
        let (triangles, _) = derive(&input, in_triangles);
        prop_assert_eq!(in_other_frame(&triangles, &axes).outcome(way), triangles.plain_outcome());
    }
}
