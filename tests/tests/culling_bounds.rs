//! Every stage that discards, attacked at the edge of its decision: pairs that share a point by construction, by as little as
//! rounding leaves. Each bound stands in the file of its stage; `docs/robustness.md` names them.

use std::cell::Cell;
use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::{Effects, Object, PolygonMesh};
use collided_protocol::step::Rows;
use collided_tests::kernel_pair::{KernelPair, Outcome, brute_force};
use collided_tests::meshes;
use collided_tests::touching_bodies::{COPIES, Touching, points_at, touching};
use collided_tests::triangle_pairs::{nudged, scaled};
use collided_tests::triangles_on_planes::on_planes;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

const ORDERS: [u32; 8] = [0, 1, 2, 6, 7, 12, 18, 30];

/// Whatever the orders of the two matrices and whoever is named first: what the twin finds.
fn check(bodies: &Touching, must_meet: bool) -> Result<(), TestCaseError> {
    let objects = ORDERS.map(|order| bodies.meshes.clone().map(|mesh| meshes::build(mesh, Some(order))));
    let [a, b] = &objects[0];
    let expected = brute_force([a, b], bodies.rows.each_ref());
    if must_meet {
        prop_assert!(expected.polygon_pairs.len() >= COPIES * COPIES, "the bodies share a point by construction");
    }
    for (order, (same, other)) in ORDERS.iter().zip(objects.iter().zip(objects.iter().rev())) {
        for (a, b) in [(&same[0], &same[1]), (&same[0], &other[1])] {
            prop_assert_eq!(&step(a, b, bodies.rows), &expected, "order {}", order);
            let [rows_a, rows_b] = bodies.rows;
            prop_assert_eq!(&step(b, a, [rows_b, rows_a]).swapped(), &expected, "order {}, swapped", order);
        }
    }
    Ok(())
}

fn step(a: &Arc<Object>, b: &Arc<Object>, [rows_a, rows_b]: [Rows; 2]) -> Outcome {
    KernelPair::new(a, b, Effects::POLYGON_PAIRS).step(rows_a, rows_b).expect("no vertex overflows")
}

/// Checks `cases` values, each of which says whether plain f64 without a bound would have lost its contact: at least `lost`
/// percent must say so, or the values are not at the edge.
fn attack<T: std::fmt::Debug>(
    values: impl Strategy<Value = T>,
    cases: u32,
    lost: u32,
    check: impl Fn(T) -> Result<bool, TestCaseError>,
) {
    let (tried, at_the_edge) = (Cell::new(0), Cell::new(0));
    let result = TestRunner::new(config(cases)).run(&values, |value| {
        tried.set(tried.get() + 1);
        at_the_edge.set(at_the_edge.get() + u32::from(check(value)?));
        Ok(())
    });
    result.unwrap_or_else(|error| panic!("{error}"));
    let (tried, found) = (tried.get(), at_the_edge.get());
    println!("plain f64 loses {found} of {tried}");
    assert!(100 * found >= lost * tried, "only {found} of {tried} are within rounding of being discarded");
}

fn attack_touching(bodies: impl Strategy<Value = Touching>, cases: u32, lost: u32) {
    attack(bodies, cases, lost, |bodies| check(&bodies, true).map(|()| bodies.plain_f64_loses_it()));
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig { cases, failure_persistence: None, max_global_rejects: 100 * cases, ..ProptestConfig::default() }
}

#[test]
fn bodies_that_touch_at_one_point() {
    attack_touching(touching(Just(0), Just(0)), 300, 5);
}

#[test]
fn bodies_that_touch_at_one_point_at_every_scale() {
    attack_touching(touching(-1000..=1000i32, -960..=960i32), 300, 5);
}

#[test]
fn bodies_of_a_few_subnormal_units_that_touch() {
    attack_touching(touching(-1074..=-1000i32, prop_oneof![Just(0), -1074..=0i32, 0..=300i32]), 300, 3);
}

#[test]
fn bodies_as_large_as_f64_that_touch() {
    attack_touching(touching(900..=1022i32, prop_oneof![Just(0), 900..=1022i32]), 200, 3);
}

/// The voxels are closed: a point on a plane is in both, and the triangle that has it is in the list of each.
#[test]
fn a_triangle_is_in_every_voxel_that_holds_a_point_of_it() {
    attack(on_planes(), 800, 4, |case| {
        let object = meshes::build(case.mesh(), Some(18));
        let lattice = object.matrix().lattice();
        let mut lost = false;
        for order in 1..=object.order() {
            let (occupied, voxels) = (object.matrix().occupied_at(order), case.voxels(lattice, order));
            for voxel in &voxels {
                prop_assert!(occupied.contains(voxel), "{:?} of order {}", voxel, order);
            }
            lost |= case.plain_f64_loses_one(lattice, order, &voxels);
        }
        Ok(lost)
    });
}

/// What the twin finds for a body and one of points, by each of the orders, whoever is named first.
fn check_points(mesh: &PolygonMesh, point: [f64; 3], orders: &[u32]) -> Result<(), TestCaseError> {
    for &order in orders {
        let [a, b] = [mesh.clone(), points_at(&[point; COPIES])].map(|mesh| meshes::build(mesh, Some(order)));
        let expected = brute_force([&a, &b], [&IDENTITY; 2]);
        prop_assert!(expected.polygon_pairs.len() >= COPIES, "the point is in a polygon by construction");
        prop_assert_eq!(&step(&a, &b, [IDENTITY; 2]), &expected, "order {}", order);
        prop_assert_eq!(&step(&b, &a, [IDENTITY; 2]).swapped(), &expected, "order {}, swapped", order);
    }
    Ok(())
}

/// Halved seven times, the side of a voxel of this container would be subnormal and rounded, and its planes would move past
/// the points.
#[test]
fn points_between_planes_that_halving_would_move() {
    let unit = |count: f64| scaled(count, -1074);
    let half = 2f64.powi(58) + 2f64.powi(6);
    for at in [1.0, 3.0, 17.0, -1.0, -5.0] {
        let points = [-half, half, at, at + 1.0].map(|x| [unit(x), 0.0, 0.0]);
        check_points(&points_at(&points), points[2], &ORDERS).unwrap_or_else(|error| panic!("{at}: {error}"));
    }
}

/// Differences of these coordinates overflow, and every axis of the triangles is NaN: they are in every voxel of their boxes,
/// so that only low orders are small enough to build.
#[test]
fn triangles_whose_edges_overflow() {
    let m = f64::MAX;
    let vertices = vec![[-m, -m, 0.75 * m], [m, m, -0.75 * m], [0.5 * m, -m, m], [-m, m, -m]];
    let mesh = PolygonMesh::from_polygons(vertices, [[0, 1, 2], [0, 3, 1]]);
    for point in [[0.0; 3], [0.5 * m, -m, m], [0.5 * m, 0.5 * m, -0.375 * m]] {
        check_points(&mesh, point, &ORDERS[..5]).unwrap_or_else(|error| panic!("{point:?}: {error}"));
    }
}

proptest! {
    #![proptest_config(config(200))]

    #[test]
    fn bodies_a_few_ulp_from_touching(
        bodies in touching(-1000..=1000i32, -960..=960i32), axis in 0..3usize, steps in -3..=3i8
    ) {
        let mut moved = bodies;
        moved.rows[1][axis][3] = nudged(moved.rows[1][axis][3], steps);
        check(&moved, false)?;
    }

    #[test]
    fn contacts_on_the_planes_between_voxels(case in on_planes()) {
        check_points(&case.mesh(), case.point, &ORDERS)?;
    }
}
