//! The dial and the budget as client processes and scene files ask for them.

use std::time::Duration;

use collided_client::{Accuracy, BodyId, BodySpec, ClampedOrder, Effect, Error, ErrorCode, Level, Scene, Verdict};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::small_meshes::at;
use collided_tests::{crowd, meshes};

/// So many of the shipped low-poly bunny.
fn scene(daemon: &DaemonProcess, bodies: usize) -> Scene {
    let client = daemon.client();
    let path = meshes::path("low_poly_bunny");
    let object = client.database("parts").loading("bunny").order(12).file(path).expect("the mesh loads");
    let mut scene = client.scene("dial").effects([Effect::Interference]).create().expect("a scene");
    let specs: Vec<_> = (0..bodies).map(|body| BodySpec::new(format!("bunny {body}"), &object)).collect();
    scene.add_bodies(&specs).expect("bodies can be added");
    scene
}

fn level(level: Level) -> Accuracy {
    Accuracy { level: Some(level), ..Accuracy::default() }
}

#[test]
fn each_level_is_answered_at_that_level() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, 2);
    let transforms = [at(0.0, 0.0, 0.0), at(0.01, 0.0, 0.0)];
    for asked in [Level::GlobalBoxes, Level::Containers, Level::Voxels] {
        scene.set_accuracy(level(asked)).expect("a level");
        let report = scene.step(&transforms).expect("the step is good");
        let pair = report.pairs().next().expect("they meet");
        assert_eq!((pair.verdict(), pair.level()), (Verdict::Possible, asked));
        assert!(!pair.is_unfinished() && report.is_complete() && !report.is_clear());
        let bound = pair.bound().expect("what is possible has a bound");
        assert!(bound.apart_at_most > 0.0 && bound.deep_at_most > 0.0);
        assert_eq!(bound.orders, if asked == Level::Voxels { [12, 12] } else { [0, 0] });
    }
    let above = Accuracy { order: Some(99), ..level(Level::Voxels) };
    let clamped = vec![ClampedOrder { database: "parts".into(), object: "bunny".into(), asked: 99, order: 12 }];
    assert_eq!(scene.set_pair_accuracy(&[(BodyId(1), BodyId(0), Some(above))]).expect("clamped"), clamped);
    assert_eq!(scene.set_pair_accuracy(&[(BodyId(1), BodyId(0), None)]).expect("taken back"), []);
    assert_eq!(scene.set_accuracy(above).expect("clamped"), clamped);
    let report = scene.step(&transforms).expect("the step is good");
    assert_eq!(report.pairs().next().and_then(|pair| Some(pair.bound()?.orders)), Some([12, 12]), "no order above M");
    assert_eq!(scene.set_accuracy(Accuracy { order: Some(5), ..level(Level::Voxels) }).expect("an order"), []);
    scene.set_pair_accuracy(&[(BodyId(1), BodyId(0), Some(level(Level::Polygons)))]).expect("a pair of its own");
    let report = scene.step(&transforms).expect("the step is good");
    let pair = report.pairs().next().expect("they meet");
    assert_eq!((pair.verdict(), pair.level(), pair.bound()), (Verdict::Interfering, Level::Polygons, None));
}

#[test]
fn an_accuracy_out_of_range_is_refused_by_name_and_nothing_is_lost() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, 2);
    let bad = [
        (Accuracy { budget_us: Some(0.0), ..Accuracy::default() }, "budget_us is 0"),
        (Accuracy { budget_us: Some(-3.0), ..Accuracy::default() }, "budget_us is -3"),
        (Accuracy { order: Some(3), ..Accuracy::default() }, "order is 3, but the level is polygons"),
        (Accuracy { order: Some(3), ..level(Level::Containers) }, "the level is containers"),
        (Accuracy { distance_tolerance: Some(1.0), ..level(Level::Voxels) }, "distance_tolerance is 1"),
    ];
    scene.set_accuracy(level(Level::Containers)).expect("a level");
    let both = (BodyId(0), BodyId(1));
    for (accuracy, part) in bad {
        for refused in [scene.set_accuracy(accuracy), scene.set_pair_accuracy(&[(both.0, both.1, Some(accuracy))])] {
            let Err(Error::Refused(error)) = &refused else { panic!("{part}: {refused:?}") };
            assert!(error.code == ErrorCode::BadAccuracy && error.message.contains(part), "{error}");
        }
    }
    let budget = Accuracy { budget_us: Some(100.0), ..Accuracy::default() };
    let refused = scene.set_pair_accuracy(&[(both.0, both.1, Some(budget))]);
    let Err(Error::Refused(error)) = &refused else { panic!("{refused:?}") };
    assert!(error.message.contains("bunny 0") && error.message.contains("budget_us"), "{error}");
    let unknown = scene.set_pair_accuracy(&[(BodyId(0), BodyId(7), None)]);
    assert!(matches!(&unknown, Err(Error::Refused(error)) if error.code == ErrorCode::UnknownBody), "{unknown:?}");
    let report = scene.step(&[at(0.0, 0.0, 0.0), at(0.0, 0.0, 0.0)]).expect("the step is good");
    let pair = report.pairs().next().expect("they meet");
    assert_eq!(pair.level(), Level::Containers, "the last good accuracy holds");
}

#[test]
fn a_budget_too_small_for_the_boxes_says_so_and_a_large_one_changes_nothing() {
    const BODIES: usize = 400;
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, BODIES);
    let size = meshes::longest_side(&meshes::shipped("low_poly_bunny", None));
    let transforms: Vec<_> = crowd::moving(BODIES, 1, 1.0, 3)[0]
        .iter()
        .map(|rows| rows.map(|[x, y, z, shift]| [x, y, z, shift * size]))
        .collect();
    let mut step = |budget_us: Option<f64>| {
        scene.set_accuracy(Accuracy { budget_us, ..Accuracy::default() }).expect("a budget");
        scene.step(&transforms).expect("the step is good")
    };
    let full = step(None);
    let generous = step(Some(Duration::from_secs(60).as_micros() as f64));
    assert_eq!(full.result_bytes(), generous.result_bytes());
    assert!(full.is_complete() && full.pairs().len() > 100);
    let short = step(Some(1e-3));
    assert!(!short.is_complete() && !short.is_clear());
    let wrong = short.pairs().filter(|pair| pair.verdict() == Verdict::Clear).count();
    assert_eq!(wrong, 0, "what was not looked at is not clear");
}
