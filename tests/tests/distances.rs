//! The effect `distance` against all pairs of triangles, exact distances of integer triangles, and the hard cases.

use std::sync::Arc;

use collided_kernel::affine::world_vertex;
use collided_kernel::effects::distance::{Distance, DistanceSettings, Memory, distance};
use collided_kernel::global_boxes::GlobalBox;
use collided_kernel::{Effects, NoClock, Object, PolygonMesh, Scene, Transforms, brute_force};
use collided_protocol::step::Rows;
use collided_tests::exact_distance::{self, Square};
use collided_tests::transforms::{Linear, direction, linear, placed};
use collided_tests::{crowd, hardcases, meshes};
use proptest::array::uniform3;
use proptest::collection::vec;
use proptest::prelude::*;

const STILL: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
const EXACT: DistanceSettings = DistanceSettings { up_to: f64::INFINITY, relative_tolerance: 0.0 };

type Body<'a> = (&'a Object, &'a Rows);

fn exact(a: Body<'_>, b: Body<'_>) -> Option<Distance> {
    distance(a, b, EXACT, &mut Memory::default())
}

/// What rounding may make of a distance: the bound that `Distance` states.
fn rounding(a: Body<'_>, b: Body<'_>) -> f64 {
    let [first, second] =
        [a, b].map(|(object, rows)| GlobalBox::of(&object.container().expect("no object is empty"), rows));
    let sides = first.max.max(second.max) - first.min.min(second.min);
    66.0 * (f64::EPSILON / 2.0) * sides.element_sum()
}

fn corners(object: &Object, rows: &Rows, polygon: u32) -> Vec<[[f64; 3]; 3]> {
    let of_polygon = (0..object.triangle_count()).filter(|&triangle| object.polygon_of(triangle) == polygon);
    let corner = |vertex: u32| world_vertex(rows, object.vertices()[vertex as usize]).to_array();
    of_polygon.map(|triangle| object.triangles()[triangle].map(corner)).collect()
}

fn between(p: [f64; 3], q: [f64; 3]) -> f64 {
    let square = |axis: usize| (p[axis] - q[axis]).powi(2);
    (square(0) + square(1) + square(2)).sqrt()
}

/// The twin's answer to the bit, in both orders of naming, and an interval that holds it.
fn check(a: Body<'_>, b: Body<'_>, memory: &mut Memory) -> Result<(), TestCaseError> {
    let (value, [polygon_a, polygon_b]) = brute_force::distance(a.0, a.1, b.0, b.1).expect("no object is empty");
    let found = distance(a, b, EXACT, memory).expect("there is no limit");
    prop_assert_eq!((found.value, found.polygon_a, found.polygon_b), (value, polygon_a, polygon_b));
    let back = distance(b, a, EXACT, memory).expect("there is no limit");
    prop_assert_eq!(back.value.to_bits(), found.value.to_bits());
    prop_assert_eq!(back.lower.to_bits(), found.lower.to_bits());
    let rounding = rounding(a, b);
    prop_assert!(found.lower <= value && value - found.lower <= rounding, "{:?}, {}", found, rounding);
    let positions = found.on_a.iter().chain(&found.on_b).fold(0.0, |all, x| f64::max(all, x.abs()));
    prop_assert!((between(found.on_a, found.on_b) - value).abs() <= rounding + 8.0 * f64::EPSILON * positions);
    let interfering = !brute_force::polygon_pairs(a.0, a.1, b.0, b.1).is_empty();
    prop_assert_eq!(found.value == 0.0, interfering);
    check_limits(a, b, &found, memory)
}

fn check_limits(a: Body<'_>, b: Body<'_>, exact: &Distance, memory: &mut Memory) -> Result<(), TestCaseError> {
    for share in [0.5, 0.999, 1.0, 1.001, 2.0] {
        let up_to = exact.value * share;
        let found = distance(a, b, DistanceSettings { up_to, relative_tolerance: 0.0 }, memory);
        match found {
            Some(found) => prop_assert_eq!(&found, exact),
            None => prop_assert!(exact.value > up_to),
        }
        prop_assert_eq!(found.is_some(), exact.lower <= up_to);
    }
    for relative_tolerance in [1e-9, 0.01, 0.5, 1.0] {
        let found = distance(a, b, DistanceSettings { relative_tolerance, ..EXACT }, memory).expect("no limit");
        // The sum is rounded, too.
        let largest = (found.lower + relative_tolerance * found.value + rounding(a, b)) * (1.0 + f64::EPSILON);
        prop_assert!(found.lower <= exact.value && exact.value <= found.value && found.value <= largest, "{:?}", found);
        prop_assert_eq!(found.value == 0.0, exact.value == 0.0);
    }
    Ok(())
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, max_shrink_iters: 200, failure_persistence: None, ..ProptestConfig::default() }
}

fn small_mesh() -> impl Strategy<Value = PolygonMesh> {
    let vertices = vec(uniform3((-9..=9i32).prop_map(f64::from)), 5..9);
    (vertices, vec(vec(0..5u32, 3..=5), 1..8))
        .prop_map(|(vertices, polygons)| PolygonMesh::from_polygons(vertices, polygons))
}

/// Whole numbers, so that nothing is rounded.
fn whole_transform() -> impl Strategy<Value = Rows> {
    let entry = || prop_oneof![Just(0.0), Just(1.0), Just(-1.0), Just(2.0)];
    (uniform3(uniform3(entry())), uniform3((-30..=30i32).prop_map(f64::from)))
        .prop_map(|(linear, shift)| [0, 1, 2].map(|i| [linear[i][0], linear[i][1], linear[i][2], shift[i]]))
}

/// The least of all pairs of triangles, exactly.
fn truth(a: Body<'_>, b: Body<'_>) -> Square {
    let all = |(object, rows): Body<'_>| {
        (0..object.polygon_count() as u32).flat_map(|polygon| corners(object, rows, polygon)).collect::<Vec<_>>()
    };
    let (first, second) = (all(a), all(b));
    let pairs = first.iter().flat_map(|p| second.iter().map(move |q| exact_distance::triangles(p, q)));
    pairs.min_by(Square::compare).expect("no object is empty")
}

proptest! {
    #![proptest_config(config(600))]

    #[test]
    fn whole_numbers_as_exact_arithmetic(
        a in small_mesh(), b in small_mesh(), rows_a in whole_transform(), rows_b in whole_transform(), order in 0..=18u32,
    ) {
        let [a, b] = [a, b].map(|mesh| meshes::build(mesh, Some(order)));
        let (a, b) = ((&*a, &rows_a), (&*b, &rows_b));
        let found = exact(a, b).expect("no object is empty");
        let truth = truth(a, b);
        prop_assert_eq!(found.value == 0.0, truth.is_zero());
        let rounding = rounding(a, b);
        prop_assert!((found.value - truth.root()).abs() <= rounding, "{:?}, {}", found, truth.root());
        prop_assert!(found.lower <= truth.root() * (1.0 + f64::EPSILON));
        check(a, b, &mut Memory::default())?;
    }
}

proptest! {
    #![proptest_config(config(10))]

    #[test]
    fn real_meshes_at_random_poses(
        linear_a in linear(), linear_b in linear(), offset in direction(), reach in 0.0..3.0, order in 0..=18u32,
    ) {
        let [a, b] = ["rob", "low_poly_bunny"].map(|name| meshes::shipped(name, Some(order)));
        let rows_a = placed(&a, &linear_a, [0.0; 3]);
        let rows_b = placed(&b, &linear_b, offset.map(|x| x * reach));
        check((&*a, &rows_a), (&*b, &rows_b), &mut Memory::default())?;
    }
}

/// What is between two bodies, in sizes of theirs: as near as they are large, up to where world coordinates hardly tell their vertices apart.
fn far() -> impl Strategy<Value = f64> {
    (0.0..15.0).prop_map(|exponent| 10f64.powf(exponent))
}

proptest! {
    #![proptest_config(config(600))]

    #[test]
    fn small_meshes_far_apart(
        a in small_mesh(), b in small_mesh(), linear_a in linear(), linear_b in linear(), along in direction(), away in far(),
        both in prop_oneof![Just(0.0), far()], order in 0..=18u32,
    ) {
        let [a, b] = [a, b].map(|mesh| meshes::build(mesh, Some(order)));
        prop_assume!(meshes::longest_side(&a) > 0.0 && meshes::longest_side(&b) > 0.0, "a point has no size");
        let rows_a = placed(&a, &linear_a, [both, -both, 0.0]);
        let rows_b = placed(&b, &linear_b, [0, 1, 2].map(|axis| rows_a[axis][3] + along[axis] * away));
        check((&*a, &rows_a), (&*b, &rows_b), &mut Memory::default())?;
    }
}

proptest! {
    #![proptest_config(config(10))]

    #[test]
    fn real_meshes_far_apart(
        linear_a in linear(), linear_b in linear(), along in direction(), away in far(), order in 0..=18u32,
    ) {
        let [a, b] = ["rob", "low_poly_bunny"].map(|name| meshes::shipped(name, Some(order)));
        let rows_a = placed(&a, &linear_a, [0.0; 3]);
        let rows_b = placed(&b, &linear_b, along.map(|x| x * away));
        check((&*a, &rows_a), (&*b, &rows_b), &mut Memory::default())?;
    }
}

#[test]
fn every_order_gives_the_same_distance() {
    let turned: Linear = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
    let flattened: Linear = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.25, 0.0]];
    let mut memory = Memory::default();
    for (linear, offset) in [(turned, [1.1, 0.2, 0.3]), (flattened, [0.3, 0.2, 0.9]), (turned, [0.2, 0.1, 0.0])] {
        let all = (0..=18).map(|order| {
            let [a, b] = ["env", "spot"].map(|name| meshes::shipped(name, Some(order)));
            let rows = [placed(&a, &turned, [0.0; 3]), placed(&b, &linear, offset)];
            distance((&a, &rows[0]), (&b, &rows[1]), EXACT, &mut memory).expect("there is no limit")
        });
        let all: Vec<Distance> = all.collect();
        assert!(all.iter().all(|found| *found == all[0]), "{all:?}");
    }
}

#[test]
fn the_hard_cases_are_zero_where_they_interfere_and_nowhere_else() {
    let mut cases = 0;
    let mut memory = Memory::default();
    for case in hardcases::static_cases() {
        let Some(answer) = case.answer() else { continue };
        for order in [0, 3, 12] {
            let [a, b] = [&case.a, &case.b].map(|mesh| {
                let mesh = PolygonMesh::from_polygons(mesh.vertices.clone(), mesh.polygons.iter().map(Vec::as_slice));
                meshes::build(mesh, Some(order))
            });
            let (a, b) = ((&*a, &case.rows_a), (&*b, &case.rows_b));
            let Some(found) = distance(a, b, EXACT, &mut memory) else {
                assert!(a.0.container().is_none() || b.0.container().is_none(), "{}", case.id);
                continue;
            };
            assert_eq!(found.value == 0.0, answer.surface_contact, "{} at order {order}: {found:?}", case.id);
            assert!(found.lower <= found.value && found.value.is_finite(), "{} at order {order}: {found:?}", case.id);
            let back = distance(b, a, EXACT, &mut memory).map(|back| (back.value, back.lower));
            assert_eq!(back, Some((found.value, found.lower)), "{} at order {order}", case.id);
            if found.value == 0.0 {
                assert!(answer.polygon_pairs.first() == Some(&(found.polygon_a, found.polygon_b)), "{}", case.id);
            }
            cases += 1;
        }
    }
    assert!(cases > 600, "{cases}");
}

fn scaled(mesh: &PolygonMesh, factor: f64) -> PolygonMesh {
    PolygonMesh { vertices: mesh.vertices.iter().map(|vertex| vertex.map(|x| x * factor)).collect(), ..mesh.clone() }
}

#[test]
fn powers_of_two_scale_the_distance_exactly() {
    let mesh = meshes::read(&meshes::path("rob"));
    let plain = meshes::build(mesh.clone(), Some(9));
    let side = meshes::longest_side(&plain);
    let apart = |factor: f64| [[0.6, 0.8, 0.0, 1.5 * side * factor], [-0.8, 0.6, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let expected = exact((&plain, &STILL), (&plain, &apart(1.0))).expect("no limit");
    assert!(expected.value > 0.0);
    for exponent in [-980, -500, -120, 0, 120, 500, 1000] {
        let factor = 2f64.powi(exponent);
        let object = meshes::build(scaled(&mesh, factor), Some(9));
        let found = exact((&object, &STILL), (&object, &apart(factor))).expect("no limit");
        let expected = (expected.value * factor, expected.polygon_a, expected.polygon_b);
        assert_eq!((found.value, found.polygon_a, found.polygon_b), expected, "2^{exponent}");
        assert!(found.lower > 0.999 * found.value, "2^{exponent}: {found:?}");
    }
}

fn one_triangle(corners: [[f64; 3]; 3]) -> std::sync::Arc<Object> {
    meshes::build(PolygonMesh::from_polygons(corners.to_vec(), [[0, 1, 2]]), None)
}

#[test]
fn the_smallest_gaps_are_not_zero() {
    let flat = one_triangle([[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]]);
    for gap in [f64::from_bits(1), 1e-320, 1e-300, 1e-200, 1e-16] {
        let above = one_triangle([[0.0, 0.0, gap], [0.1, 0.0, 1.0], [0.0, 0.1, 1.0]]);
        let found = exact((&flat, &STILL), (&above, &STILL)).expect("no limit");
        assert!(found.value > 0.0 && found.value <= 1e-14, "{gap}: {found:?}");
    }
    let far = one_triangle([[1e300, 0.0, 0.0], [1e300, 1e300, 0.0], [1e300, 0.0, 1e300]]);
    let found = exact((&flat, &STILL), (&far, &STILL)).expect("no limit");
    assert!((found.value / 1e300 - 1.0).abs() < 1e-14, "{found:?}");
}

#[test]
fn needles_and_nearly_parallel_edges_are_measured_as_well_as_others() {
    // A crossing of two needles that are turned by `angle` and 1e-9 apart: the distance is exactly that.
    for angle in [1e-3, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12] {
        let first = one_triangle([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1e-9]]);
        let second = one_triangle([[-1.0, -angle, 1e-9], [1.0, angle, 1e-9], [0.0, 0.0, 2e-9]]);
        let found = exact((&first, &STILL), (&second, &STILL)).expect("no limit");
        assert!((found.value - 1e-9).abs() < 1e-14, "{angle}: {found:?}");
        assert!(found.value - found.lower < 1e-13, "{angle}: {found:?}");
    }
}

#[test]
fn an_empty_object_is_at_no_distance() {
    let empty = meshes::build(PolygonMesh::default(), None);
    let triangle = one_triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(exact((&empty, &STILL), (&triangle, &STILL)), None);
    assert_eq!(exact((&triangle, &STILL), (&empty, &STILL)), None);
}

/// A step takes the distance of bodies that interfere from their pairs of triangles, and searches that of others.
#[test]
fn a_step_gives_what_the_search_finds_whether_the_bodies_interfere_or_not() {
    let [spot, bunny] = ["spot", "low_poly_bunny"].map(|name| meshes::shipped(name, None));
    let size = meshes::longest_side(&spot) / meshes::longest_side(&bunny);
    let mut scene = Scene::new(Effects::DISTANCE);
    for object in [&spot, &bunny] {
        scene.add_body(Arc::clone(object), None);
    }
    let mut met = [0, 0];
    for pose in crowd::moving_within(0.7 * meshes::longest_side(&spot), 40, 1, 5).swap_remove(0) {
        let placed = [STILL, pose.map(|[x, y, z, shift]| [size * x, size * y, size * z, shift])];
        let report = scene.step(Transforms::Dense(&placed), &NoClock).expect("the transforms are finite");
        let expected = exact((&spot, &placed[0]), (&bunny, &placed[1])).expect("there is no limit");
        assert_eq!(report.distances(), [(0, expected)], "{placed:?}");
        met[usize::from(expected.value == 0.0)] += 1;
    }
    assert!(met[0] > 5 && met[1] > 5, "{met:?}");
}
