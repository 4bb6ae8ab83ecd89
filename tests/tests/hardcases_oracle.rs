//! The oracle gives the expected answer on every hard case, so that the other tests may trust both.

use collided_tests::hardcases::{self, Answer, Case, TrianglePair};
use collided_tests::oracle::{self, Surface};

fn triangle_pairs(a: Surface<'_>, b: Surface<'_>) -> Vec<TrianglePair> {
    let number = |count: usize| (0..count as u32).collect::<Vec<_>>();
    let (each_a, each_b) = (number(a.triangles.len()), number(b.triangles.len()));
    oracle::polygon_pairs(Surface { polygon_of: &each_a, ..a }, Surface { polygon_of: &each_b, ..b })
        .into_iter()
        .map(|(a, b, relation)| TrianglePair(a, b, relation))
        .collect()
}

fn check(case: &Case, answer: &Answer) {
    let world_a = oracle::world_vertices(&case.rows_a, &case.a.vertices);
    let world_b = oracle::world_vertices(&case.rows_b, &case.b.vertices);
    let (a, b) = (case.a.surface(&world_a), case.b.surface(&world_b));
    assert_eq!(triangle_pairs(a, b), answer.triangle_pairs, "{}: {}", case.id, case.why);
    let pairs = oracle::polygon_pairs(a, b);
    assert_eq!(pairs, case.polygon_relations(answer), "{}", case.id);
    assert_eq!(oracle::strongest(&pairs), answer.relation, "{}", case.id);
    assert_eq!(!pairs.is_empty(), answer.surface_contact, "{}", case.id);
    let numbers: Vec<_> = pairs.iter().map(|&(a, b, _)| (a, b)).collect();
    assert_eq!(numbers, answer.polygon_pairs, "{}", case.id);
}

#[test]
fn every_valid_case_of_the_table_comes_out_as_expected() {
    let cases = hardcases::static_cases();
    let valid = cases.iter().filter_map(|case| Some((case, case.answer()?)));
    let checked = valid.inspect(|(case, answer)| check(case, answer)).count();
    assert_eq!((checked, cases.len()), (238, 246));
}

#[test]
fn cubes_that_other_libraries_get_wrong() {
    let cube = hardcases::unit_cube();
    for case in hardcases::cube_cases() {
        let world_a = oracle::world_vertices(&case.rows_a, &cube.vertices);
        let world_b = oracle::world_vertices(&case.rows_b, &cube.vertices);
        let pairs = oracle::polygon_pairs(cube.surface(&world_a), cube.surface(&world_b));
        assert_eq!(!pairs.is_empty(), case.surface_contact(), "{}", case.name);
    }
}

#[test]
fn triangles_that_other_libraries_get_wrong() {
    for (a, b) in hardcases::apart_triangles() {
        assert_eq!(oracle::triangles(&a, &b), oracle::Relation::None, "{a:?} with {b:?}");
        assert_eq!(oracle::triangles(&b, &a), oracle::Relation::None, "{b:?} with {a:?}");
    }
}
