//! The effect `penetration`: what it finds always clears, and is the shortest for convex bodies.

use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::contacts::Contacts;
use collided_kernel::effects::penetration::{MAX_TRIALS, Penetration, Separation, SurfaceTest, TOLERANCE, translated};
use collided_kernel::{Object, PolygonMesh, Rows, brute_force};
use collided_tests::contact_pairs::{Placed, triangle_pairs, world_triangles};
use collided_tests::hardcases::{Mesh, static_cases};
use collided_tests::meshes::{build, shipped};
use collided_tests::solids::{at, cuboid, octahedron, rows, sphere, tetrahedron};
use collided_tests::transforms::{direction, linear, placed, rotation};
use glam::DVec3;
use proptest::prelude::*;

/// The translation that parts the surfaces, found with the contact normals.
fn separate(a: Placed<'_>, b: Placed<'_>) -> Option<Penetration> {
    let mut contacts = Contacts::default();
    contacts.find(a, b, &triangle_pairs(a, b));
    let normals: Vec<[f64; 3]> = contacts.regions().iter().map(|region| region.normal).collect();
    let mut surfaces = SurfaceTest::default();
    Separation::default().find(a, b, &normals, &mut |rows| !surfaces.interferes(a, (b.0, rows)))
}

fn touch(a: Placed<'_>, b: Placed<'_>) -> bool {
    !brute_force::polygon_pairs(a.0, a.1, b.0, b.1).is_empty()
}

fn corners(body: Placed<'_>) -> Vec<DVec3> {
    let mut corners: Vec<[f64; 3]> = world_triangles(body).iter().flatten().map(|corner| corner.to_array()).collect();
    corners.sort_by(|p, q| p.partial_cmp(q).expect("corners are finite"));
    corners.dedup();
    corners.into_iter().map(DVec3::from).collect()
}

/// How deep the origin lies in the Minkowski difference of two convex bodies: over all planes through three of its points that
/// have all others on one side.
fn depth_of_convex(a: Placed<'_>, b: Placed<'_>) -> f64 {
    let (a, b) = (corners(a), corners(b));
    let difference: Vec<DVec3> = a.iter().flat_map(|p| b.iter().map(move |q| *p - *q)).collect();
    let mut depth = f64::INFINITY;
    for (i, o) in difference.iter().enumerate() {
        for (j, p) in difference.iter().enumerate().skip(i + 1) {
            for q in &difference[j + 1..] {
                let normal = (*p - *o).cross(*q - *o);
                if normal.length() < 1e-9 {
                    continue;
                }
                for outwards in [normal.normalize(), -normal.normalize()] {
                    let offset = outwards.dot(*o);
                    if offset < depth && difference.iter().all(|point| outwards.dot(*point) < offset + 1e-12) {
                        depth = offset;
                    }
                }
            }
        }
    }
    depth
}

fn is_shortest_that_clears(a: Placed<'_>, b: Placed<'_>) -> Result<(), TestCaseError> {
    let Some(found) = separate(a, b) else {
        prop_assert!(!touch(a, b));
        return Ok(());
    };
    prop_assert!(!touch(a, (b.0, &translated(b.1, found.translation_of_b))), "it does not clear: {:?}", found);
    let length = DVec3::from(found.translation_of_b).length();
    prop_assert!((found.depth - length).abs() <= 1e-15 * length);
    let optimum = depth_of_convex(a, b);
    prop_assert!(found.depth >= optimum - 1e-12, "{} is less than the optimum {optimum}", found.depth);
    prop_assert!(found.depth <= optimum * (1.0 + TOLERANCE) + 1e-12, "{} exceeds the optimum {optimum}", found.depth);
    Ok(())
}

fn convex_bodies() -> impl Strategy<Value = (Arc<Object>, Arc<Object>)> {
    let body = || prop_oneof![Just(cuboid([0.5, 0.7, 0.9])), Just(tetrahedron(0.8)), Just(octahedron(1.0))];
    (body(), body())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn of_convex_bodies_it_is_the_shortest((a, b) in convex_bodies(), turn in rotation(), shift in direction()) {
        is_shortest_that_clears((&a, &IDENTITY), (&b, &rows(&turn, shift.map(|x| 0.6 * x))))?;
    }

    #[test]
    fn of_real_meshes_it_clears(first in linear(), second in linear(), shift in direction()) {
        let (a, b) = (shipped("rob", None), shipped("low_poly_bunny", None));
        let (rows_a, rows_b) = (placed(&a, &first, [0.0; 3]), placed(&b, &second, shift.map(|x| 0.5 * x)));
        let (a, b) = ((&*a, &rows_a), (&*b, &rows_b));
        match separate(a, b) {
            None => prop_assert!(!touch(a, b)),
            Some(found) => {
                prop_assert!(!touch(a, (b.0, &translated(b.1, found.translation_of_b))), "it does not clear: {:?}", found);
            }
        }
    }

    #[test]
    fn the_surface_test_says_what_brute_force_says(first in linear(), second in linear(), shift in direction()) {
        let (a, b) = (shipped("rob", None), shipped("low_poly_bunny", None));
        let (rows_a, rows_b) = (placed(&a, &first, [0.0; 3]), placed(&b, &second, shift));
        let (a, b) = ((&*a, &rows_a), (&*b, &rows_b));
        prop_assert_eq!(SurfaceTest::default().interferes(a, b), touch(a, b));
    }
}

/// Cases in which numbers are so large or so far apart that no translation of that size can be written down.
fn may_have_no_way_out((object, rows): Placed<'_>) -> bool {
    object.triangles().is_empty()
        || world_triangles((object, rows)).iter().flatten().any(|p| p.abs().max_element() > 1e300)
}

#[test]
fn of_hard_cases_it_clears() {
    let mut seen = 0;
    for case in static_cases() {
        let Some(answer) = case.answer() else { continue };
        let object = |mesh: &Mesh| build(PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons), None);
        let (a, b) = (object(&case.a), object(&case.b));
        let (a, b) = ((&*a, &case.rows_a), (&*b, &case.rows_b));
        assert_eq!(SurfaceTest::default().interferes(a, b), answer.surface_contact, "{}", case.id);
        match separate(a, b) {
            None => assert!(!answer.surface_contact || may_have_no_way_out(a) || may_have_no_way_out(b), "{}", case.id),
            Some(found) => {
                let moved = translated(b.1, found.translation_of_b);
                assert!(answer.surface_contact && !touch(a, (b.0, &moved)), "{}: {found:?}", case.id);
                seen += 1;
            }
        }
    }
    assert!(seen > 100, "{seen}");
}

fn assert_depth(found: Option<Penetration>, expected: f64) {
    let found = found.expect("the bodies interfere");
    let excess = found.depth - expected;
    assert!(excess > -1e-15 && excess <= expected * TOLERANCE + 1e-14, "{found:?}, not {expected}");
}

#[test]
fn cubes_part_along_the_axis_of_least_overlap() {
    let cube = cuboid([0.5; 3]);
    for (shift, depth) in [([0.75, 0.25, 0.5], 0.25), ([0.0, -0.875, 0.1], 0.125), ([0.0, 0.0, 0.0], 1.0)] {
        assert_depth(separate((&cube, &IDENTITY), (&cube, &at(shift[0], shift[1], shift[2]))), depth);
    }
}

#[test]
fn a_touch_is_parted_by_next_to_nothing() {
    let cube = cuboid([0.5; 3]);
    for shift in [[1.0, 0.0, 0.0], [0.3, 1.0, 0.2], [1.0, 1.0, 1.0]] {
        let found = separate((&cube, &IDENTITY), (&cube, &at(shift[0], shift[1], shift[2]))).expect("they touch");
        assert!(found.depth > 0.0 && found.depth < 1e-13, "{found:?}");
    }
}

#[test]
fn spheres_part_along_the_line_of_their_middles() {
    let sphere = sphere(1.0, 8);
    let rows = at(0.9, 0.8, 0.6);
    let (a, b) = ((&*sphere, &IDENTITY), (&*sphere, &rows));
    let found = separate(a, b).expect("they interfere");
    let between = DVec3::new(0.9, 0.8, 0.6).length();
    // Faces lie a little inside the sphere: by less than a twenty-fifth of the radius here.
    assert!(found.depth <= 2.0 - between && found.depth > 2.0 * 0.96 - between, "{found:?}");
    assert!(!touch(a, (b.0, &translated(b.1, found.translation_of_b))));
}

#[test]
fn a_body_inside_another_is_moved_out_of_it() {
    let (large, small) = (cuboid([3.0; 3]), cuboid([0.5; 3]));
    let rows = at(1.0, 0.5, 0.0);
    let (a, b) = ((&*large, &IDENTITY), (&*small, &rows));
    let mut surfaces = SurfaceTest::default();
    let mut clear = |rows: &Rows| {
        let is_inside = rows.iter().all(|row| row[3].abs() < 3.0);
        !is_inside && !surfaces.interferes(a, (b.0, rows))
    };
    assert_depth(Separation::default().find(a, b, &[], &mut clear), 2.5);
    let swapped = Separation::default().find(b, a, &[], &mut |rows: &Rows| {
        let is_around = (0..3).all(|axis| (rows[axis][3] - [1.0, 0.5, 0.0][axis]).abs() < 3.0);
        !is_around && !SurfaceTest::default().interferes(b, (a.0, rows))
    });
    assert_depth(swapped, 2.5);
}

#[test]
fn a_way_out_through_an_opening_is_found_along_the_contact_normal() {
    // A table between tall walls: the block has sunk into its top by 0.1, the walls' tops are 5 away.
    let mut vertices = Vec::new();
    let mut polygons: Vec<Vec<u32>> = Vec::new();
    for (middle, half) in
        [([0.0, 0.0, -0.5], [2.0, 2.0, 0.5]), ([4.0, 0.0, 0.0], [0.5, 6.0, 6.0]), ([-4.0, 0.0, 0.0], [0.5, 6.0, 6.0])]
    {
        let part = cuboid(half);
        let first = vertices.len() as u32;
        vertices.extend(part.vertices().iter().map(|vertex| [0, 1, 2].map(|axis| vertex[axis] + middle[axis])));
        polygons.extend(part.triangles().iter().map(|triangle| triangle.map(|vertex| vertex + first).to_vec()));
    }
    let table = build(PolygonMesh::from_polygons(vertices, polygons), None);
    let block = cuboid([0.5; 3]);
    assert_depth(separate((&table, &IDENTITY), (&block, &at(0.0, 0.0, 0.4))), 0.1);
}

#[test]
fn what_is_clear_or_empty_is_left_where_it_is() {
    let cube = cuboid([0.5; 3]);
    assert_eq!(separate((&cube, &IDENTITY), (&cube, &at(1.5, 0.0, 0.0))), None);
    let empty = build(PolygonMesh::default(), None);
    let found = Separation::default().find((&cube, &IDENTITY), (&empty, &IDENTITY), &[], &mut |_| false);
    assert_eq!(found, None);
}

#[test]
fn the_number_of_exact_tests_is_capped() {
    let (a, b) = (shipped("spot", None), shipped("low_poly_bunny", None));
    let turn = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let (rows_a, rows_b) = (placed(&a, &turn, [0.0; 3]), placed(&b, &turn, [0.1; 3]));
    let (a, b) = ((&*a, &rows_a), (&*b, &rows_b));
    let (mut surfaces, mut tests) = (SurfaceTest::default(), 0);
    let found = Separation::default().find(a, b, &[], &mut |rows| {
        tests += 1;
        !surfaces.interferes(a, (b.0, rows))
    });
    // One at first, and up to the first that clears here two.
    assert!(found.is_some() && tests <= MAX_TRIALS + 3, "{tests}");
}
