//! The effect `containment` against the oracle: solids in solids, voids, several parts, mirrors, flattened bodies; and meshes
//! that bound no volume.

use std::sync::Arc;

use collided_kernel::{Containment, Effects, Object, PolygonMesh};
use collided_protocol::step::Rows;
use collided_tests::hardcases::unit_cube;
use collided_tests::kernel_pair::{KernelPair, Outcome};
use collided_tests::meshes;
use collided_tests::oracle::{self, Surface};
use collided_tests::small_meshes::at;
use collided_tests::transforms::linear;
use proptest::array::uniform3;
use proptest::prelude::*;
use proptest::sample::select;

const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// Boxes between two corners, seen from outside, or from inside when they are voids.
fn boxes(boxes: &[([i32; 3], [i32; 3], bool)]) -> PolygonMesh {
    let cube = unit_cube();
    let (mut vertices, mut polygons) = (Vec::new(), Vec::new());
    for &(min, max, is_void) in boxes {
        let first = vertices.len() as u32;
        let corner = |unit: &[f64; 3]| [0, 1, 2].map(|i| f64::from(if unit[i] == 0.0 { min[i] } else { max[i] }));
        vertices.extend(cube.vertices.iter().map(corner));
        polygons.extend(cube.triangles.iter().map(|&[a, b, c]| {
            let turned = if is_void { [a, c, b] } else { [a, b, c] };
            turned.map(|vertex| first + vertex)
        }));
    }
    PolygonMesh::from_polygons(vertices, &polygons)
}

fn cube(min: i32, max: i32) -> PolygonMesh {
    boxes(&[([min; 3], [max; 3], false)])
}

fn tetrahedron() -> PolygonMesh {
    let vertices = vec![[-6.0, -6.0, -6.0], [9.0, -5.0, -6.0], [-6.0, 9.0, -5.0], [-5.0, -6.0, 9.0]];
    PolygonMesh::from_polygons(vertices, [[0u32, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
}

/// Every one of these is closed.
fn solids() -> Vec<PolygonMesh> {
    vec![
        cube(-8, 8),
        boxes(&[([-8; 3], [8; 3], true)]),
        boxes(&[([-8; 3], [8; 3], false), ([-5; 3], [5; 3], true)]),
        boxes(&[([-8, -8, -8], [-1, 8, 8], false), ([1, -8, -8], [8, 8, 8], false)]),
        boxes(&[([-8; 3], [8; 3], false), ([-4; 3], [9; 3], false)]),
        boxes(&[([-1; 3], [1; 3], false)]),
        boxes(&[([-3, -1, -1], [-2, 1, 1], false), ([2, -1, -1], [3, 1, 1], false)]),
        boxes(&[([0, 0, -1], [0, 0, 1], false)]),
        tetrahedron(),
    ]
}

fn solid() -> impl Strategy<Value = (Arc<Object>, u32)> {
    (select(solids()), select(vec![0, 1, 3, 6, 7, 12]))
        .prop_map(|(mesh, order)| (meshes::build(mesh, Some(order)), order))
}

fn transform() -> impl Strategy<Value = Rows> {
    let whole = uniform3(uniform3(select(vec![-1.0, 0.0, 0.0, 1.0, 2.0])));
    let turns = select(vec![[[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]], [[0., 1., 0.], [0., 0., 1.], [-1., 0., 0.]]]);
    let shift = uniform3((-3..=3i32).prop_map(f64::from));
    (prop_oneof![3 => turns, 1 => whole, 2 => linear()], shift)
        .prop_map(|(linear, shift)| [0, 1, 2].map(|i| [linear[i][0], linear[i][1], linear[i][2], shift[i]]))
}

/// How many of the vertices of `inner` are inside `outer`, and of how many.
fn inside(outer: Surface<'_>, inner: &[[f64; 3]]) -> (usize, usize) {
    let within = inner.iter().filter(|&&vertex| oracle::winding_number(outer, vertex) != 0).count();
    (within, inner.len())
}

/// What the oracle says of two closed meshes whose vertices are all used: by every vertex of either.
fn expected(objects: [&Object; 2], rows: [Rows; 2]) -> Containment {
    let polygon_of = objects.map(|object| (0..object.triangle_count() as u32).collect::<Vec<_>>());
    let vertices = [0, 1].map(|i| oracle::world_vertices(&rows[i], objects[i].vertices()));
    let [a, b] = [0, 1].map(|i| Surface {
        vertices: &vertices[i],
        triangles: objects[i].triangles(),
        polygon_of: &polygon_of[i],
    });
    if !oracle::polygon_pairs(a, b).is_empty() {
        return Containment::None;
    }
    match (inside(b, a.vertices), inside(a, b.vertices)) {
        ((within, all), _) if within == all => Containment::AInB,
        (_, (within, all)) if within == all => Containment::BInA,
        ((1.., _), _) => Containment::APartlyInB,
        (_, (1.., _)) => Containment::BPartlyInA,
        _ => Containment::None,
    }
}

fn found(objects: [&Arc<Object>; 2], rows: [Rows; 2]) -> Outcome {
    let mut pair = KernelPair::new(objects[0], objects[1], Effects::CONTAINMENT);
    pair.step(rows[0], rows[1]).expect("the transforms are finite")
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 800, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn solids_in_solids(
        (a, _) in solid(), (b, _) in solid(), rows_a in transform(), rows_b in transform(), together in any::<bool>(),
    ) {
        let rows = [rows_a, if together { rows_a } else { rows_b }];
        let expected = expected([&a, &b], rows);
        let there = found([&a, &b], rows);
        prop_assert_eq!(there.containment, expected);
        prop_assert!(!expected.is_proven() || there.interfering);
        let back = found([&b, &a], [rows[1], rows[0]]).swapped();
        prop_assert_eq!(there, back);
    }
}

#[test]
fn the_random_cases_are_of_every_kind() {
    let objects: Vec<_> = solids().into_iter().map(|mesh| meshes::build(mesh, None)).collect();
    let mut kinds = std::collections::HashSet::new();
    for a in &objects {
        for b in &objects {
            let shifts = [0.0, 9.0].map(|x| found([a, b], [at(x, 0.0, 0.0), IDENTITY]).containment);
            kinds.extend(shifts);
        }
    }
    use Containment::{AInB, APartlyInB, BInA, BPartlyInA};
    for kind in [Containment::None, AInB, BInA, APartlyInB, BPartlyInA] {
        assert!(kinds.contains(&kind), "{kind:?} is missing in {kinds:?}");
    }
}

#[test]
fn an_outer_mesh_that_bounds_no_volume_leaves_containment_unknown_and_the_verdict_clear() {
    let inner = meshes::build(cube(-1, 1), None);
    let whole = cube(-8, 8);
    let polygons: Vec<Vec<u32>> = whole.polygons().map(<[u32]>::to_vec).collect();
    let open = PolygonMesh::from_polygons(whole.vertices.clone(), &polygons[..11]);
    let mut turned = polygons.clone();
    turned[4].reverse();
    let turned = PolygonMesh::from_polygons(whole.vertices.clone(), &turned);
    for (mesh, reason) in [(open, Containment::UnknownBOpen), (turned, Containment::UnknownBInconsistent)] {
        let outer = meshes::build(mesh, None);
        let outcome = found([&inner, &outer], [IDENTITY; 2]);
        assert_eq!((outcome.interfering, outcome.containment), (false, reason));
        let outside = found([&inner, &outer], [IDENTITY, at(40.0, 0.0, 0.0)]);
        assert_eq!(outside, Outcome::of(Vec::new()), "what is outside the container of an open mesh is not inside it");
    }
}

#[test]
fn an_open_mesh_may_be_inside() {
    let inner = meshes::build(
        PolygonMesh::from_polygons(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], [[0u32, 1, 2]]),
        None,
    );
    let outer = meshes::build(cube(-8, 8), None);
    assert_eq!(found([&inner, &outer], [IDENTITY; 2]).containment, Containment::AInB);
}

#[test]
fn a_real_mesh_around_a_small_one() {
    let outer = meshes::shipped("spot", None);
    let container = outer.container().expect("spot has polygons");
    let inner = meshes::build(cube(-1, 1), None);
    let polygon_of: Vec<u32> = (0..outer.triangle_count() as u32).collect();
    let surface = Surface { vertices: outer.vertices(), triangles: outer.triangles(), polygon_of: &polygon_of };
    let mut kinds = [0; 3];
    for place in (0..343u32).step_by(9) {
        let along = |axis: usize, steps: u32| {
            let part = f64::from(place / steps % 7 + 1) / 8.0;
            container.min[axis] + part * (container.max[axis] - container.min[axis])
        };
        let size = 1e-3;
        let (x, y, z) = (along(0, 1), along(1, 7), along(2, 49));
        let rows = [[size, 0.0, 0.0, x], [0.0, size, 0.0, y], [0.0, 0.0, -size, z]];
        let outcome = found([&inner, &outer], [rows, IDENTITY]);
        if outcome.interfering && outcome.containment == Containment::None {
            kinds[2] += 1;
            continue;
        }
        let is_inside = oracle::winding_number(surface, [x, y, z]) != 0;
        let expected = if is_inside { Containment::AInB } else { Containment::None };
        assert_eq!(outcome.containment, expected, "at {x} {y} {z}");
        kinds[usize::from(is_inside)] += 1;
    }
    assert!(kinds[0] > 5 && kinds[1] > 5, "{kinds:?}: outside, inside, through the surface");
}

#[test]
fn scales_where_products_overflow_or_vanish() {
    let (inner, outer) = (meshes::build(cube(-1, 1), None), meshes::build(cube(-8, 8), None));
    for power in [-1050, -700, -300, 0, 300, 1000] {
        let scale = 2f64.powi(power / 2) * 2f64.powi(power - power / 2);
        let rows = [[scale, 0.0, 0.0, 0.0], [0.0, -scale, 0.0, 0.0], [0.0, 0.0, scale, 0.0]];
        assert_eq!(found([&inner, &outer], [rows; 2]).containment, Containment::AInB, "2^{power}");
        let beside = [[scale, 0.0, 0.0, 10.0 * scale], rows[1], rows[2]];
        assert_eq!(found([&inner, &outer], [beside, rows]).containment, Containment::None, "2^{power}");
    }
}
