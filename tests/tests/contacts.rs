//! The effect `contacts`: exact points, and the right pieces, regions and normals.

use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::contacts::{ContactRegion, Contacts, TrianglePair};
use collided_kernel::{Object, PolygonMesh, Relation};
use collided_tests::contact_pairs::{Placed, triangle_pairs, world_triangles};
use collided_tests::hardcases::static_cases;
use collided_tests::meshes::{build, shipped};
use collided_tests::oracle::{Triangle, are_corners_of_common_part};
use collided_tests::solids::{at, cuboid, octahedron, rows, sphere, tetrahedron};
use collided_tests::transforms::{direction, placed, rotation};
use collided_tests::triangle_pairs::{Pair, any_pair, grid_pair};
use glam::DVec3;
use proptest::prelude::*;

fn contacts(a: Placed<'_>, b: Placed<'_>) -> Contacts {
    let mut contacts = Contacts::default();
    contacts.find(a, b, &triangle_pairs(a, b));
    contacts
}

fn triangle(corners: &Triangle) -> Object {
    let mesh = PolygonMesh::from_polygons(corners.to_vec(), [[0, 1, 2]]);
    Object::build(mesh, Some(0), &()).expect("one triangle is an object")
}

/// Every position of the result, each once.
fn positions(contacts: &Contacts) -> Vec<[f64; 3]> {
    let points = contacts.points().iter().map(|point| point.position);
    let ends = contacts.segments().iter().flat_map(|segment| segment.ends);
    let mut all: Vec<[f64; 3]> = points.chain(ends).chain(contacts.corners().iter().copied()).collect();
    all.sort_by(|p, q| p.partial_cmp(q).expect("positions are finite"));
    all.dedup();
    all
}

fn one_region(contacts: &Contacts) -> &ContactRegion {
    let [region] = contacts.regions() else { panic!("{} regions", contacts.regions().len()) };
    region
}

/// How many points, segments and areas.
fn kinds(contacts: &Contacts) -> [usize; 3] {
    [contacts.points().len(), contacts.segments().len(), contacts.areas().len()]
}

fn exact_and_of_the_right_kind((a, b): &Pair) -> Result<(), TestCaseError> {
    let (first, second) = (triangle(a), triangle(b));
    let (a_placed, b_placed) = ((&first, &IDENTITY), (&second, &IDENTITY));
    let found = contacts(a_placed, b_placed);
    prop_assert!(are_corners_of_common_part(&positions(&found), a, b), "{:?}", positions(&found));
    let expected = triangle_pairs(a_placed, b_placed).first().map(|pair| pair.relation);
    let is_right = match (expected, kinds(&found)) {
        (None, kinds) => kinds == [0; 3],
        (Some(Relation::Touch), kinds) => kinds == [1, 0, 0] || kinds == [0, 1, 0],
        (Some(Relation::Coplanar), kinds) => kinds == [0, 0, 1],
        (Some(Relation::Cross), kinds) => kinds == [0, 1, 0],
    };
    prop_assert!(is_right, "{:?} gives {:?}", expected, kinds(&found));
    prop_assert_eq!(found.regions().len(), usize::from(expected.is_some()));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn small_grids_are_exact(pair in grid_pair(0, 3)) {
        exact_and_of_the_right_kind(&pair)?;
    }

    #[test]
    fn any_pair_is_exact(pair in any_pair()) {
        exact_and_of_the_right_kind(&pair)?;
    }
}

#[test]
fn one_cube_on_another_touches_in_a_square() {
    let cube = cuboid([0.5; 3]);
    for (shift, area, centre) in [(0.0, 1.0, 0.0), (0.25, 0.75, 0.125)] {
        let above = at(shift, 0.0, 1.0);
        let found = contacts((&cube, &IDENTITY), (&cube, &above));
        let region = one_region(&found);
        assert_eq!((region.area, region.length), (area, if shift == 0.0 { 0.0 } else { region.length }));
        assert_eq!(region.normal, [0.0, 0.0, 1.0]);
        let off = DVec3::from(region.centre).distance(DVec3::new(centre, 0.0, 0.5));
        assert!(off < 1e-15, "{:?}", region.centre);
        assert_eq!(kinds(&found)[0], 0, "every point is a corner of an area");
        let swapped = contacts((&cube, &above), (&cube, &IDENTITY));
        assert_eq!(one_region(&swapped).normal, [0.0, 0.0, -1.0]);
    }
}

#[test]
fn a_mirror_does_not_turn_normals_around() {
    let cube = cuboid([0.5; 3]);
    let mirror = [[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
    let found = contacts((&cube, &mirror), (&cube, &at(0.25, 0.125, 1.0)));
    assert_eq!(one_region(&found).normal, [0.0, 0.0, 1.0]);
}

#[test]
fn areas_run_counterclockwise_as_seen_against_their_normals() {
    let cube = cuboid([0.5; 3]);
    let found = contacts((&cube, &IDENTITY), (&cube, &at(0.25, 0.125, 1.0)));
    for area in found.areas() {
        let corners: Vec<DVec3> = found.corners()[area.corners.clone()].iter().copied().map(DVec3::from).collect();
        let turn = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        assert!(turn.dot(DVec3::from(area.normal)) > 0.0, "{corners:?}");
    }
}

#[test]
fn an_edge_on_a_face_touches_in_a_line() {
    let (floor, cube) = (cuboid([2.0, 2.0, 0.5]), cuboid([0.5; 3]));
    // Turned about x by 45 degrees, and √2 times as wide: one edge, of length 1, is the lowest and lies 1 below the middle.
    let on_edge = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, -1.0, 0.0], [0.0, 1.0, 1.0, 1.5]];
    let found = contacts((&floor, &IDENTITY), (&cube, &on_edge));
    let region = one_region(&found);
    assert!((region.length - 1.0).abs() < 1e-15, "{region:?}");
    assert_eq!((region.area, region.normal), (0.0, [0.0, 0.0, 1.0]));
    assert_eq!((kinds(&found)[0], kinds(&found)[2]), (0, 0));
}

#[test]
fn a_corner_touches_in_a_point_with_the_normal_of_the_face() {
    let (floor, point) = (cuboid([2.0, 2.0, 0.5]), octahedron(1.0));
    for (x, y) in [(0.25, 0.5), (0.5, 0.5), (0.0, 0.0)] {
        let rows = at(x, y, 1.5);
        let found = contacts((&floor, &IDENTITY), (&point, &rows));
        assert_eq!(kinds(&found), [1, 0, 0]);
        assert_eq!(found.points()[0].position, [x, y, 0.5]);
        assert_eq!(one_region(&found).normal, [0.0, 0.0, 1.0], "on a face or on its diagonal alike");
        let swapped = contacts((&point, &rows), (&floor, &IDENTITY));
        assert_eq!(one_region(&swapped).normal, [0.0, 0.0, -1.0]);
    }
}

#[test]
fn two_corners_touch_in_one_point() {
    let point = octahedron(1.0);
    let found = contacts((&point, &IDENTITY), (&point, &at(0.0, 2.0, 0.0)));
    assert_eq!((kinds(&found), one_region(&found).centre), ([1, 0, 0], [0.0, 1.0, 0.0]));
    let normal = DVec3::from(one_region(&found).normal);
    assert!(normal.distance(DVec3::Y) < 1e-15, "{normal}");
}

#[test]
fn two_edges_that_cross_touch_in_a_point_along_their_cross_product() {
    let tetrahedron = tetrahedron(1.0);
    // Its upper edge runs along (1, 1, 0), its lower one along (1, −1, 0).
    let found = contacts((&tetrahedron, &IDENTITY), (&tetrahedron, &at(0.0, 0.0, 2.0)));
    assert_eq!((kinds(&found), found.points()[0].position), ([1, 0, 0], [0.0, 0.0, 1.0]));
    let normal = DVec3::from(found.points()[0].normal);
    assert!(normal.distance(DVec3::Z) < 1e-15, "{normal}");
}

/// Whether every end of a segment ends exactly one other one.
fn is_closed_loop(contacts: &Contacts) -> bool {
    let ends: Vec<[f64; 3]> = contacts.segments().iter().flat_map(|segment| segment.ends).collect();
    ends.iter().all(|end| ends.iter().filter(|other| *other == end).count() == 2)
}

#[test]
fn cubes_that_cross_do_so_in_one_closed_loop() {
    let cube = cuboid([0.5; 3]);
    let found = contacts((&cube, &IDENTITY), (&cube, &at(0.5, 0.25, 0.75)));
    let region = one_region(&found);
    assert!(kinds(&found)[0] == 0 && kinds(&found)[2] == 0 && is_closed_loop(&found), "{found:?}");
    // Around the common box of 0.5 × 0.75 × 0.25, over six of its edges.
    assert_eq!(region.length, 2.0 * (0.5 + 0.75 + 0.25));
    assert!(DVec3::from(region.normal).dot(DVec3::new(0.5, 0.25, 0.75)) > 0.0);
}

#[test]
fn a_bar_through_a_plate_makes_two_regions() {
    let (plate, bar) = (cuboid([2.0, 2.0, 0.25]), cuboid([0.5, 0.5, 3.0]));
    let found = contacts((&plate, &IDENTITY), (&bar, &at(0.125, 0.25, 0.0)));
    let heights: Vec<f64> = found.regions().iter().map(|region| region.centre[2]).collect();
    assert!(is_closed_loop(&found) && heights == [-0.25, 0.25], "{heights:?}");
    assert!(found.regions().iter().all(|region| (region.length - 4.0).abs() < 1e-14), "{:?}", found.regions());
}

#[test]
fn identical_bodies_touch_over_their_whole_surface() {
    let cube = cuboid([0.5; 3]);
    let found = contacts((&cube, &IDENTITY), (&cube, &IDENTITY));
    let region = one_region(&found);
    assert_eq!((region.area, region.length, region.normal), (6.0, 0.0, [0.0; 3]));
    assert_eq!(kinds(&found), [0, 0, 12]);
}

#[test]
fn the_order_of_the_pairs_and_repetitions_do_not_matter() {
    let sphere = sphere(1.0, 6);
    let (a, b) = ((&*sphere, &IDENTITY), (&*sphere, &at(0.7, 0.3, 0.2)));
    let pairs = triangle_pairs(a, b);
    let mut contacts = Contacts::default();
    contacts.find(a, b, &pairs);
    let (regions, segments) = (contacts.regions().to_vec(), contacts.segments().to_vec());
    assert!(!segments.is_empty());
    let shuffled: Vec<TrianglePair> = pairs.iter().rev().chain(&pairs[..pairs.len() / 2]).copied().collect();
    contacts.find(a, b, &shuffled);
    assert_eq!((contacts.regions(), contacts.segments()), (&regions[..], &segments[..]));
}

/// The area that a square of the given half side about the origin has in common with a convex polygon in the plane.
fn area_in_square(polygon: Vec<[f64; 2]>, half: f64) -> f64 {
    let mut rest = polygon;
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
        let depth = |p: &[f64; 2]| half - sign * p[axis];
        let mut kept = Vec::new();
        for (i, p) in rest.iter().enumerate() {
            let q = &rest[(i + 1) % rest.len()];
            let (at_p, at_q) = (depth(p), depth(q));
            if at_p >= 0.0 {
                kept.push(*p);
            }
            if at_p * at_q < 0.0 {
                let part = at_p / (at_p - at_q);
                kept.push([0, 1].map(|axis| p[axis] + part * (q[axis] - p[axis])));
            }
        }
        rest = kept;
    }
    let next = |i: usize| rest[(i + 1) % rest.len()];
    let twice: f64 = rest.iter().enumerate().map(|(i, p)| p[0] * next(i)[1] - p[1] * next(i)[0]).sum();
    twice.abs() / 2.0
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn turned_cubes_on_each_other_have_their_true_area(angle in 0.0..1.6, x in -0.9..0.9, y in -0.9..0.9) {
        let (sin, cos) = f64::sin_cos(angle);
        let cube = cuboid([0.5; 3]);
        let above = [[cos, -sin, 0.0, x], [sin, cos, 0.0, y], [0.0, 0.0, 1.0, 1.0]];
        let found = contacts((&cube, &IDENTITY), (&cube, &above));
        let corner = |u: f64, v: f64| [cos * u - sin * v + x, sin * u + cos * v + y];
        let base = vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)];
        let expected = area_in_square(base, 0.5);
        let area: f64 = found.regions().iter().map(|region| region.area).sum();
        prop_assert!((area - expected).abs() < 1e-14, "{} and not {}", area, expected);
        prop_assert!(expected == 0.0 || one_region(&found).normal == [0.0, 0.0, 1.0]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_first_named_only_turns_the_normals(turn in rotation(), shift in direction()) {
        let (a, b) = (sphere(1.0, 4), cuboid([0.6, 0.5, 0.7]));
        let rows = rows(&turn, shift);
        let (a, b) = ((&*a, &IDENTITY), (&*b, &rows));
        let (found, swapped) = (contacts(a, b), contacts(b, a));
        prop_assert_eq!(found.regions().len(), swapped.regions().len());
        for (segment, other) in found.segments().iter().zip(swapped.segments()) {
            prop_assert_eq!(segment.ends, other.ends);
            let sum = DVec3::from(segment.normal) + DVec3::from(other.normal);
            prop_assert!(sum.length() < 1e-14, "{:?} {:?}", segment, other);
        }
    }
}

#[test]
fn hard_cases_have_contacts_exactly_when_they_interfere() {
    let mut seen = 0;
    for case in static_cases() {
        let Some(answer) = case.answer() else { continue };
        let object = |mesh: &collided_tests::hardcases::Mesh| {
            build(PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons), None)
        };
        let (a, b) = (object(&case.a), object(&case.b));
        let (a, b) = ((&*a, &case.rows_a), (&*b, &case.rows_b));
        let found = contacts(a, b);
        assert_eq!(!found.regions().is_empty(), answer.surface_contact, "{}", case.id);
        let relations: Vec<Relation> = triangle_pairs(a, b).iter().map(|pair| pair.relation).collect();
        let [points, segments, areas] = kinds(&found);
        assert_eq!(areas > 0, relations.contains(&Relation::Coplanar), "{}", case.id);
        assert!(segments > 0 || areas > 0 || !relations.contains(&Relation::Cross), "{}", case.id);
        assert!(points + segments + areas <= relations.len(), "{}", case.id);
        seen += 1;
    }
    assert!(seen > 200, "{seen}");
}

/// Distance of a point from a triangle, both near unit size.
fn distance(point: DVec3, [a, b, c]: &[DVec3; 3]) -> f64 {
    let segment = |p: DVec3, q: DVec3| {
        let along = q - p;
        let at = ((point - p).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        point.distance(p + along * if at.is_nan() { 0.0 } else { at })
    };
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(point - *p).dot(normal) > 0.0);
    let face = if inside { (point - *a).dot(normal).abs() } else { f64::INFINITY };
    face.min(segment(*a, *b)).min(segment(*b, *c)).min(segment(*c, *a))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_end_lies_on_both_surfaces_of_real_meshes(turn in rotation(), shift in direction()) {
        let (rob, bunny) = (shipped("rob", None), shipped("low_poly_bunny", None));
        let (rows_a, rows_b) = (placed(&rob, &turn, [0.0; 3]), placed(&bunny, &turn, shift.map(|x| 0.4 * x)));
        let (a, b) = ((&*rob, &rows_a), (&*bunny, &rows_b));
        let found = contacts(a, b);
        let surfaces = [world_triangles(a), world_triangles(b)];
        for position in positions(&found) {
            for surface in &surfaces {
                let nearest = surface.iter().map(|t| distance(DVec3::from(position), t)).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < 4e-15, "{:?} is {} away", position, nearest);
            }
        }
    }

    #[test]
    fn closed_meshes_that_cross_do_so_in_closed_loops(turn in rotation(), shift in direction()) {
        let (a, b) = (sphere(1.0, 5), cuboid([0.6, 0.5, 0.7]));
        let rows = rows(&turn, shift);
        let found = contacts((&a, &IDENTITY), (&b, &rows));
        prop_assert!(is_closed_loop(&found) && kinds(&found)[0] == 0);
    }
}
