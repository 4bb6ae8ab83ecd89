//! Pairs that have not moved are not tested again, and the report is the same as if they had been.

use std::sync::Arc;

use collided_kernel::effects::distance::DistanceSettings;
use collided_kernel::{Accuracy, BodyId, Effects, Interest, NoClock, Object, Report, Scene, Transforms};
use collided_protocol::step::Rows;
use collided_tests::{crowd, meshes};

const BODIES: usize = 60;

fn scene(object: &Arc<Object>, effects: Effects) -> Scene {
    scene_of(object, effects, BODIES)
}

fn scene_of(object: &Arc<Object>, effects: Effects, count: usize) -> Scene {
    let mut scene = Scene::new(effects);
    for _ in 0..count {
        scene.add_body(Arc::clone(object), None);
    }
    scene.set_accuracy(Accuracy {
        distance: DistanceSettings { up_to: 0.1, relative_tolerance: 0.0 },
        ..Accuracy::default()
    });
    scene
}

/// All that a report says, and how many voxels were compared for it.
fn summary(report: &Report<'_>) -> (String, u64) {
    let pairs: Vec<_> = report.pairs().iter().map(|pair| (pair, report.polygon_pairs(pair))).collect();
    let contacts = report.contacts();
    let contacts = (report.regions(), contacts.regions(), contacts.points(), contacts.segments());
    (format!("{pairs:?} {contacts:?} {:?}", report.distances()), report.counts().voxels_visited)
}

fn step(scene: &mut Scene, placed: &[Rows]) -> (String, u64) {
    summary(&scene.step(Transforms::Dense(placed), &NoClock).expect("the transforms are finite"))
}

#[test]
fn a_step_in_which_few_bodies_move_gives_the_report_of_a_new_scene() {
    let object = meshes::shipped("low_poly_bunny", None);
    let steps = crowd::moving_within(4.0, BODIES, 16, 7);
    let all = [Effects::POLYGON_PAIRS, Effects::CONTACTS, Effects::CONTAINMENT, Effects::DISTANCE];
    for effects in [Effects::INTERFERENCE, all.into_iter().fold(Effects::NONE, Effects::union)] {
        let mut long = scene(&object, effects);
        let mut placed = steps[0].clone();
        let mut saved = 0;
        for (number, moved) in steps.iter().enumerate() {
            // Three of the bodies move; the others are sent again where they are.
            for body in (number % 20..BODIES).step_by(20) {
                placed[body] = moved[body];
            }
            let (found, expected) = (step(&mut long, &placed), step(&mut scene(&object, effects), &placed));
            assert_eq!(found.0, expected.0, "step {number}");
            saved += usize::from(2 * found.1 < expected.1);
        }
        assert_eq!(saved, steps.len() - 1, "every step but the first compares less than half of the voxels");
    }
}

#[test]
fn what_changes_without_a_motion_is_seen() {
    let object = meshes::shipped("low_poly_bunny", None);
    let mut placed = crowd::moving_within(2.0, BODIES, 1, 8).remove(0);
    let mut long = scene(&object, Effects::INTERFERENCE);
    let before = step(&mut long, &placed);
    assert_eq!(step(&mut long, &placed), (before.0.clone(), 0), "nothing has moved");
    let rule = Interest::Effects(Effects::POLYGON_PAIRS);
    for scene in [&mut long, &mut scene(&object, Effects::INTERFERENCE)] {
        scene.set_interest(BodyId(0), BodyId(1), rule).expect("both are there");
    }
    let asks_more = step(&mut long, &placed);
    let mut fresh = scene(&object, Effects::INTERFERENCE);
    fresh.set_interest(BodyId(0), BodyId(1), rule).expect("both are there");
    assert_eq!(asks_more.0, step(&mut fresh, &placed).0);
    let other = meshes::shipped("spot", None);
    for scene in [&mut long, &mut fresh] {
        scene.replace_object(BodyId(5), Arc::clone(&other)).expect("it is there");
        scene.remove_body(BodyId(2)).expect("it is there");
    }
    placed.remove(2);
    let mut new = Scene::new(Effects::INTERFERENCE);
    let ids: Vec<BodyId> = (0..BODIES as u32)
        .map(|body| {
            new.add_body(if body == 5 { Arc::clone(&other) } else { Arc::clone(&object) }, None);
            BodyId(body)
        })
        .collect();
    new.remove_body(ids[2]).expect("it is there");
    new.set_interest(BodyId(0), BodyId(1), rule).expect("both are there");
    assert_eq!(step(&mut long, &placed).0, step(&mut new, &placed).0);
}

/// Stage 9 of pairs at rest is not done again; what it found is in each report.
#[test]
fn effects_of_bodies_at_rest_are_kept() {
    let object = meshes::shipped("low_poly_bunny", None);
    let all = [
        Effects::CONTACTS,
        Effects::CONTAINMENT,
        Effects::DISTANCE,
        Effects::PENETRATION,
        Effects::TIME_OF_CONTACT,
        Effects::RESPONSE,
    ];
    let effects = all.into_iter().fold(Effects::POLYGON_PAIRS, Effects::union);
    let placed = crowd::moving_within(1.5, 8, 2, 9);
    let mut scene = scene_of(&object, effects, 8);
    let everything = |scene: &mut Scene, placed: &[Rows]| {
        let report = scene.step(Transforms::Dense(placed), &NoClock).expect("the transforms are finite");
        let more = (report.penetrations(), report.times_of_contact(), report.impulses(), report.velocities());
        let searches = report.counts().distance_searches
            + report.counts().contact_pairs
            + report.counts().penetration_searches
            + report.counts().time_searches
            + report.counts().containment_tests;
        (format!("{} {more:?}", summary(&report).0), searches)
    };
    let arrived = |placed: &[Rows]| everything(&mut scene_of(&object, effects, 8), placed);
    let first = everything(&mut scene, &placed[0]);
    assert_eq!(first, arrived(&placed[0]));
    // The step that places bodies counts as one in which they moved.
    assert_eq!(everything(&mut scene, &placed[0]).0, first.0);
    assert_eq!(everything(&mut scene, &placed[0]), (first.0.clone(), 0));
    let mut one_moved = placed[0].clone();
    one_moved[3] = placed[1][3];
    everything(&mut scene, &one_moved);
    let (rested, fresh) = (everything(&mut scene, &one_moved), arrived(&one_moved));
    assert_eq!(rested.0, fresh.0);
    assert!(0 < rested.1 && rested.1 < fresh.1, "{} searches of {}", rested.1, fresh.1);
    let coarse = DistanceSettings { up_to: 0.1, relative_tolerance: 0.5 };
    scene.set_accuracy(Accuracy { distance: coarse, ..Accuracy::default() });
    assert_eq!(everything(&mut scene, &one_moved).1, fresh.1, "another accuracy asks for everything anew");
}
