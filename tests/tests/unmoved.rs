//! Pairs that have not moved are not tested again, and the report is the same as if they had been.

use std::sync::Arc;

use collided_kernel::effects::distance::DistanceSettings;
use collided_kernel::{Accuracy, BodyId, Effects, Interest, NoClock, Object, Report, Scene, Transforms};
use collided_protocol::step::Rows;
use collided_tests::{crowd, meshes};

const BODIES: usize = 60;

fn scene(object: &Arc<Object>, effects: Effects) -> Scene {
    let mut scene = Scene::new(effects);
    for _ in 0..BODIES {
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
