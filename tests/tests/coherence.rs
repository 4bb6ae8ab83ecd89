//! What a scene remembers from step to step never shows in its report: each step gives what a new scene gives.

use std::sync::Arc;

use collided_kernel::{
    BodyId, Effects, Interest, Motion, NoClock, Object, PolygonMesh, Report, RigidMotion, Scene, StageCounts,
    StepInput, Transforms,
};
use collided_protocol::step::Rows;
use collided_tests::crowd::{self, Random};
use collided_tests::{meshes, solids};

/// What a report says of the ends of the motions, and the work it took.
fn summary(report: &Report<'_>) -> (String, StageCounts) {
    let pairs: Vec<_> = report.pairs().iter().map(|pair| (pair, report.polygon_pairs(pair))).collect();
    let contacts = report.contacts();
    let contacts = (report.regions(), contacts.regions(), contacts.points(), contacts.segments());
    let effects = (report.distances(), report.penetrations());
    (format!("{pairs:?} {contacts:?} {effects:?}"), *report.counts())
}

fn step(scene: &mut Scene, placed: &[Rows]) -> (String, StageCounts) {
    summary(&scene.step(Transforms::Dense(placed), &NoClock).expect("the transforms are finite"))
}

fn scene(objects: &[Arc<Object>], effects: Effects) -> Scene {
    let mut scene = Scene::new(effects);
    for object in objects {
        scene.add_body(Arc::clone(object), None);
    }
    scene
}

/// Two triangles at the ends of a long box, so that boxes overlap while surfaces are apart. The first lies in the plane z = 0.
fn bracket() -> Arc<Object> {
    let corners =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [8.0, 8.0, 8.0], [7.0, 8.0, 8.0], [8.0, 7.0, 9.0]];
    let mesh = PolygonMesh::from_polygons(corners.to_vec(), [[0, 1, 2], [3, 4, 5]]);
    Arc::new(Object::build(mesh, None, &()).expect("the mesh is good"))
}

/// Steps one scene along, and each time a new one to the same place; says in how many steps a pair whose boxes overlap was not looked at.
fn walk(objects: &[Arc<Object>], effects: Effects, poses: impl IntoIterator<Item = Vec<Rows>>) -> usize {
    let mut long = scene(objects, effects);
    let mut skipped = 0;
    for (number, placed) in poses.into_iter().enumerate() {
        let (found, expected) = (step(&mut long, &placed), step(&mut scene(objects, effects), &placed));
        assert_eq!(found.0, expected.0, "step {number}: {placed:?}");
        let work = |counts: &StageCounts| (counts.container_pairs, counts.voxels_visited, counts.exact_tests);
        skipped += usize::from(work(&found.1) == (0, 0, 0) && work(&expected.1) != (0, 0, 0));
    }
    skipped
}

/// Rows of a scale per axis and a place.
fn placed(scale: [f64; 3], at: [f64; 3]) -> Rows {
    [[scale[0], 0.0, 0.0, at[0]], [0.0, scale[1], 0.0, at[1]], [0.0, 0.0, scale[2], at[2]]]
}

/// Ten bodies between the poses of a crowd: small steps, then middling and large ones.
fn mixed_steps(seed: u64) -> impl Iterator<Item = Vec<Rows>> {
    let ways = crowd::moving_within(2.0, 10, 10, seed);
    (0..ways.len() - 1).flat_map(move |number| {
        let ends = [ways[number].clone(), ways[number + 1].clone()];
        let parts = [24, 6, 1][number % 3];
        (0..parts).map(move |part| between(&ends, f64::from(part) / f64::from(parts)))
    })
}

fn between([from, to]: &[Vec<Rows>; 2], t: f64) -> Vec<Rows> {
    let entry = |(from, to): (f64, f64)| from + t * (to - from);
    let row = |(from, to): ([f64; 4], [f64; 4])| [0, 1, 2, 3].map(|column| entry((from[column], to[column])));
    from.iter().zip(to).map(|(from, to)| [0, 1, 2].map(|at| row((from[at], to[at])))).collect()
}

#[test]
fn bodies_in_steps_of_all_sizes_are_reported_as_in_a_new_scene() {
    let (bunny, spot) = (meshes::shipped("low_poly_bunny", None), meshes::shipped("spot", None));
    let objects: Vec<_> = (0..10).map(|body| Arc::clone(if body % 4 == 0 { &spot } else { &bunny })).collect();
    for (effects, seed) in [
        (Effects::INTERFERENCE, 3),
        (Effects::INTERFERENCE.union(Effects::CONTAINMENT), 4),
        (Effects::POLYGON_PAIRS.union(Effects::CONTACTS), 5),
    ] {
        walk(&objects, effects, mixed_steps(seed));
    }
}

/// So many bodies that their outlines, their paths and what is known of their pairs are shared out.
#[test]
fn a_crowd_in_small_steps_by_two_threads_is_reported_as_in_a_new_scene_by_one() {
    let pools = [1, 2].map(|threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool"));
    let bunny = meshes::shipped("low_poly_bunny", None);
    let size = 1.0 / meshes::longest_side(&bunny);
    let objects = vec![bunny; 400];
    let fitted = |rows: &Rows| rows.map(|[x, y, z, shift]| [size * x, size * y, size * z, shift]);
    let moved =
        |number: usize| crowd::moving_within(7.0, objects.len(), 5, 8).swap_remove(number).iter().map(fitted).collect();
    let (first, mut last): (Vec<Rows>, Vec<Rows>) = (moved(0), moved(4));
    // The first bodies rest, so that whoever took others for them would take those for resting.
    last[..70].copy_from_slice(&first[..70]);
    let ends = [first, last];
    let mut long = scene(&objects, Effects::INTERFERENCE);
    let mut skipped = 0;
    for part in 0..16 {
        let placed = between(&ends, 0.02 * f64::from(part));
        let (found, counts) = pools[1].install(|| step(&mut long, &placed));
        let mut new = scene(&objects, Effects::INTERFERENCE);
        let (expected, all) = pools[0].install(|| step(&mut new, &placed));
        assert_eq!(found, expected, "step {part}");
        assert!(all.broad_pairs > 1000 && all.container_pairs > 500, "{all:?}");
        skipped += all.container_pairs - counts.container_pairs;
    }
    assert!(skipped > 1000, "{skipped} pairs were decided by what was known of them");
}

#[test]
fn a_pair_in_small_steps_is_seldom_tested() {
    let bunny = meshes::shipped("low_poly_bunny", None);
    let (objects, size) = ([Arc::clone(&bunny), Arc::clone(&bunny)], meshes::longest_side(&bunny));
    let way = |part: i32| 1.2 * size * (f64::from(part) / 400.0 - 1.0);
    let pose = |part: i32| vec![solids::at(0.0, 0.0, 0.0), solids::at(way(part), 0.5 * size, 0.1 * size)];
    let poses: Vec<_> = (0..800).map(pose).collect();
    let skipped = walk(&objects, Effects::INTERFERENCE, poses.clone());
    let mut long = scene(&objects, Effects::INTERFERENCE);
    let (mut by_witness, mut interfering) = (0, 0);
    for placed in &poses {
        let (_, counts) = step(&mut long, placed);
        interfering += counts.interfering_pairs;
        by_witness += u64::from(counts.interfering_pairs == 1 && counts.container_pairs == 0);
    }
    // The first look at the containers proves most of the others.
    assert!(skipped > 30, "only {skipped} steps were skipped");
    assert!(interfering > 100 && 2 * by_witness > interfering, "{by_witness} of {interfering} by the witness");
}

/// Bodies that close in by exactly what they are apart, in equal parts, and then go through: with other places, scales, numbers of parts.
#[test]
fn bodies_that_close_in_by_their_gap_are_found_touching() {
    let objects = [bracket(), bracket()];
    let mut skipped = 0;
    for unit in [1.0, 1e-150, 1e150, f64::MIN_POSITIVE] {
        for far in [0.0, 0.1, 3e5] {
            for parts in [64, 100, 333] {
                let rows = |z: f64| placed([unit; 3], [far * unit, 0.0, (far + z) * unit]);
                let poses = (0..=parts + 3).map(|part| {
                    let left = 0.5 * (1.0 - f64::from(part) / f64::from(parts));
                    vec![rows(-0.5 * left), rows(0.5 * left)]
                });
                skipped += walk(&objects, Effects::INTERFERENCE, poses);
            }
        }
    }
    assert!(skipped > 500, "only {skipped} steps were skipped");
}

/// Only one corner comes near, by a scale of its own along one axis, and by shear.
#[test]
fn bodies_that_are_stretched_onto_each_other_are_found_touching() {
    let objects = [bracket(), bracket()];
    let mut skipped = 0;
    for parts in [64, 250] {
        let stretched =
            |part: i32| placed([1.0, 1.0, 1.0 + 0.25 * f64::from(part) / f64::from(parts)], [0.0, 0.0, 0.0]);
        let poses = (0..=parts).map(|part| vec![stretched(part), placed([1.0; 3], [0.25, 0.125, 1.0])]);
        skipped += walk(&objects, Effects::INTERFERENCE, poses);
        let sheared = |part: i32| {
            let mut rows = placed([1.0; 3], [0.0, 0.0, -0.5]);
            rows[2][0] = 0.5 * f64::from(part) / f64::from(parts);
            rows
        };
        let poses = (0..=parts).map(|part| vec![sheared(part), placed([1.0; 3], [0.0; 3])]);
        skipped += walk(&objects, Effects::INTERFERENCE, poses);
    }
    assert!(skipped > 100, "only {skipped} steps were skipped");
}

/// The last digits decide: from a clear pose on, steps of random size down to one ulp, towards the other body and back.
#[test]
fn steps_of_an_ulp_are_seen() {
    let objects = [bracket(), bracket()];
    let mut random = Random::new(11);
    for round in 0..40 {
        let far = [0.0, 1.0, 1e8][round % 3];
        let (mut z, steps) = (far + 0.25 * random.unit(), 60);
        let poses: Vec<_> = (0..steps)
            .map(|_| {
                let apart = z - far;
                z = match (4.0 * random.unit()) as u32 {
                    0 => z.next_down(),
                    1 => z - apart * random.unit().min(0.9),
                    2 => z + 1e-3 * random.unit(),
                    _ => z - 1e-2 * apart,
                };
                vec![placed([1.0; 3], [0.0, 0.0, far]), placed([1.0; 3], [0.25, 0.125, z])]
            })
            .chain([vec![placed([1.0; 3], [0.0, 0.0, far]), placed([1.0; 3], [0.25, 0.125, far])]])
            .collect();
        walk(&objects, Effects::INTERFERENCE, poses);
    }
}

#[test]
fn turning_bodies_are_reported_as_in_a_new_scene() {
    let objects = [bracket(), bracket()];
    let mut long = scene(&objects, Effects::INTERFERENCE);
    let mut now = [placed([1.0; 3], [0.0; 3]), placed([1.0; 3], [0.0, 0.0, 0.5])];
    for part in 0..80 {
        let (axis, centre, translate) = ([0.0, 0.0, 1.0], [4.0, 4.0, 0.0], [0.0, 0.0, -0.01]);
        let angle = 0.005 * f64::from(part % 7);
        let report = if part == 0 {
            long.step(Transforms::Dense(&now), &NoClock)
        } else {
            now[1] = Motion::Rigid { from: now[1], axis, centre, angle, translate }.end();
            let transforms = Transforms::Sparse { bodies: &[], rows: &[] };
            let turn = RigidMotion { axis, centre, angle, translate };
            long.step(StepInput { transforms, rigid: &[(BodyId(1), turn)], velocities: &[] }, &NoClock)
        };
        let found = summary(&report.expect("the motion is good"));
        assert_eq!(found.0, step(&mut scene(&objects, Effects::INTERFERENCE), &now).0, "step {part}");
    }
}

/// A pair that is farther apart than it moves in a step does not meet in it, and is not searched.
#[test]
fn times_of_contact_are_those_of_a_scene_that_has_seen_but_the_start() {
    let objects = [bracket(), bracket()];
    let effects = Effects::INTERFERENCE.union(Effects::TIME_OF_CONTACT);
    let mut long = scene(&objects, effects);
    let pose = |part: i32| {
        let mut turned = placed([1.0; 3], [0.25, 0.125, 0.25 - 0.002 * f64::from(part)]);
        turned[0][1] = 0.001 * f64::from(part);
        // Every so often it jumps through the other one and back within two steps.
        turned[2][3] -= if part % 40 == 39 { 0.5 } else { 0.0 };
        [placed([1.0; 3], [0.0; 3]), turned]
    };
    let times = |report: &Report<'_>| (format!("{:?}", report.times_of_contact()), report.counts().time_searches);
    let (mut searched, mut met) = (0, 0);
    long.step(Transforms::Dense(&pose(0)), &NoClock).expect("the transforms are finite");
    for part in 1..150 {
        let mut fresh = scene(&objects, effects);
        fresh.step(Transforms::Dense(&pose(part - 1)), &NoClock).expect("the transforms are finite");
        let expected = times(&fresh.step(Transforms::Dense(&pose(part)), &NoClock).expect("the transforms are finite"));
        let found = times(&long.step(Transforms::Dense(&pose(part)), &NoClock).expect("the transforms are finite"));
        assert_eq!((found.0.clone(), expected.1), (expected.0, 1), "step {part}");
        (searched, met) = (searched + found.1, met + u64::from(found.0 != "[]"));
    }
    assert!(met > 2 && searched < 110, "{met} meetings, {searched} searches of 149");
}

#[test]
fn what_changes_between_steps_is_not_remembered() {
    let (bunny, spot) = (meshes::shipped("low_poly_bunny", None), meshes::shipped("spot", None));
    let mut objects = vec![Arc::clone(&bunny); 10];
    let mut long = scene(&objects, Effects::INTERFERENCE);
    let mut removed = None;
    let mut effects = Effects::INTERFERENCE;
    let mut rule = Interest::Default;
    for (number, mut placed) in mixed_steps(6).enumerate() {
        match number % 16 {
            3 => {
                let body = number / 16 % 4;
                objects[body] = Arc::clone(if number % 32 == 3 { &spot } else { &bunny });
                long.replace_object(BodyId(body as u32), Arc::clone(&objects[body])).expect("it is there");
            }
            7 => {
                rule = Interest::Effects([Effects::POLYGON_PAIRS, Effects::CONTAINMENT][number / 16 % 2]);
                long.set_interest(BodyId(0), BodyId(1), rule).expect("both are there");
            }
            11 => {
                effects = [Effects::INTERFERENCE.union(Effects::CONTAINMENT), Effects::INTERFERENCE][number / 16 % 2];
                long.set_effects(effects);
            }
            13 if removed.is_none() => {
                removed = Some(5);
                long.remove_body(BodyId(5)).expect("it is there");
            }
            _ => {}
        }
        let mut fresh = scene(&objects, effects);
        fresh.set_interest(BodyId(0), BodyId(1), rule).expect("both are there");
        if let Some(body) = removed {
            fresh.remove_body(BodyId(body)).expect("it is there");
            placed.remove(body as usize);
        }
        assert_eq!(step(&mut long, &placed).0, step(&mut fresh, &placed).0, "step {number}");
    }
}
