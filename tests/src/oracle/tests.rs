//! Hand-made cases: every kind of meeting once, and every kind of degenerate triangle.

use super::Relation::{Coplanar, Cross, None, Touch};
use super::*;

const CORNER: Triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

/// Holds for both orders of the triangles and all orders of their corners.
#[track_caller]
fn check(a: Triangle, b: Triangle, expected: Relation) {
    for [i, j, k] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
        let turned = [a[i], a[j], a[k]];
        assert_eq!(triangles(&turned, &b), expected, "{turned:?} with {b:?}");
        assert_eq!(triangles(&b, &turned), expected, "{b:?} with {turned:?}");
    }
}

fn point(p: [f64; 3]) -> Triangle {
    [p, p, p]
}

#[test]
fn an_edge_through_the_inside_crosses() {
    check(CORNER, [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], Cross);
}

#[test]
fn edges_through_each_other_at_one_point_cross_nothing() {
    check(CORNER, [[2.0, 0.0, -1.0], [2.0, 0.0, 1.0], [2.0, -3.0, 0.0]], Touch);
}

#[test]
fn a_corner_on_the_inside_touches() {
    check(CORNER, [[1.0, 1.0, 0.0], [1.0, 0.0, 3.0], [2.0, 0.0, 3.0]], Touch);
}

#[test]
fn an_edge_on_the_inside_from_one_side_touches() {
    check(CORNER, [[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.0, 1.0, 3.0]], Touch);
}

#[test]
fn a_fold_along_a_common_edge_touches() {
    check(CORNER, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]], Touch);
}

#[test]
fn a_common_edge_in_one_plane_touches_from_outside_and_overlaps_from_inside() {
    check(CORNER, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, -4.0, 0.0]], Touch);
    check(CORNER, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0]], Coplanar);
}

#[test]
fn a_corner_that_pierces_by_one_ulp_crosses_and_short_by_one_ulp_misses() {
    let reaching = |z: f64| [[1.0, 1.0, z], [1.0, 0.5, 3.0], [2.0, 0.5, 3.0]];
    check(CORNER, reaching(-f64::from_bits(1)), Cross);
    check(CORNER, reaching(0.0), Touch);
    check(CORNER, reaching(f64::from_bits(1)), None);
}

#[test]
fn identical_triangles_are_coplanar() {
    check(CORNER, CORNER, Coplanar);
}

#[test]
fn a_star_is_coplanar_though_no_corner_is_inside() {
    let up = [[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [3.0, 5.0, 0.0]];
    check(up, [[0.0, 3.5, 0.0], [6.0, 3.5, 0.0], [3.0, -1.5, 0.0]], Coplanar);
}

#[test]
fn parallel_planes_are_apart() {
    check(CORNER, CORNER.map(|[x, y, z]| [x, y, z + f64::EPSILON]), None);
}

#[test]
fn boxes_may_overlap_where_triangles_do_not() {
    check(CORNER, [[3.0, 3.0, -1.0], [3.0, 3.0, 1.0], [2.5, 2.5, 0.0]], None);
}

#[test]
fn points_touch_what_they_are_on() {
    check(CORNER, point([1.0, 1.0, 0.0]), Touch);
    check(CORNER, point([2.0, 2.0, 0.0]), Touch);
    check(CORNER, point([0.0, 4.0, 0.0]), Touch);
    check(CORNER, point([2.0, f64::from_bits(2.0f64.to_bits() + 1), 0.0]), None);
    check(CORNER, point([1.0, 1.0, f64::from_bits(1)]), None);
    check(point([1.0, 2.0, 3.0]), point([1.0, 2.0, 3.0]), Touch);
    check(point([1.0, 2.0, 3.0]), point([1.0, 2.0, 4.0]), None);
}

#[test]
fn segments_touch_and_never_cross() {
    let segment = |p: [f64; 3], q: [f64; 3]| [p, q, [0, 1, 2].map(|i| p[i] / 2.0 + q[i] / 2.0)];
    let upright = segment([1.0, 1.0, -1.0], [1.0, 1.0, 1.0]);
    check(CORNER, upright, Touch);
    check(CORNER, segment([3.0, 3.0, -1.0], [3.0, 3.0, 1.0]), None);
    check(CORNER, segment([1.0, 1.0, 0.0], [9.0, 1.0, 0.0]), Touch);
    check(CORNER, segment([3.0, 3.0, 0.0], [9.0, 1.0, 0.0]), None);
    check(upright, segment([0.0, 1.0, 0.5], [2.0, 1.0, 0.5]), Touch);
    check(upright, segment([0.0, 1.5, 0.5], [2.0, 1.5, 0.5]), None);
    check(upright, segment([1.0, 1.0, 0.5], [1.0, 1.0, 3.0]), Touch);
    check(upright, segment([1.0, 1.0, 2.0], [1.0, 1.0, 3.0]), None);
    check(upright, point([1.0, 1.0, 0.25]), Touch);
    check(upright, point([1.0, 1.0, 1.25]), None);
}

#[test]
fn huge_and_tiny_coordinates_are_exact_together() {
    let huge = [[-1e300, -1e300, 0.0], [1e300, 0.0, 0.0], [0.0, 1e300, 0.0]];
    let tip = f64::from_bits(1);
    check(huge, [[0.0, 0.0, tip], [tip, 0.0, -tip], [0.0, 1e-300, 1e300]], Cross);
    check(huge, [[0.0, 0.0, tip], [tip, 0.0, tip], [0.0, 1e-300, 1e300]], None);
}

#[test]
fn a_polygon_has_the_strongest_relation_of_its_triangles() {
    let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
    let needle = [[2.0, 1.0, -1.0], [2.0, 1.0, 1.0], [2.0, 2.0, 1.0]];
    let a = Surface { vertices: &square, triangles: &[[0, 1, 2], [0, 2, 3]], polygon_of: &[7, 7] };
    let b = Surface { vertices: &needle, triangles: &[[0, 1, 2]], polygon_of: &[3] };
    assert_eq!(polygon_pairs(a, b), [(7, 3, Cross)]);
    assert_eq!(strongest(&polygon_pairs(b, a)), Cross);
    assert_eq!(strongest(&[]), None);
}

#[test]
fn world_vertices_are_rounded_at_every_operation() {
    let third = 1.0 / 3.0;
    let rows = [[third, 0.0, 0.0, 0.0], [0.1, 0.2, 0.0, 0.0], [1.0, 1.0, 1.0, 1e16]];
    assert_eq!(world_vertices(&rows, &[[3.0, 1.0, 0.5]])[0], [1.0, 0.1 * 3.0 + 0.2, 1e16 + 4.0]);
}
