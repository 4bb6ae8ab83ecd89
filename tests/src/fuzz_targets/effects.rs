//! Every effect, every level and a motion, for two objects whose exact report is known.

use std::sync::Arc;

use collided_kernel::effects::time_of_contact::{TimeOfContact, TimeSettings};
use collided_kernel::{Accuracy, Effects, Level, NoClock, Object, Scene, Transforms, Verdict};
use collided_protocol::step::Rows;

const ALL: [Effects; 6] = [
    Effects::CONTAINMENT,
    Effects::DISTANCE,
    Effects::CONTACTS,
    Effects::PENETRATION,
    Effects::TIME_OF_CONTACT,
    Effects::POLYGON_PAIRS,
];

/// The orders of voxels at which verdicts are asked for.
const ORDERS: [u32; 4] = [0, 2, 7, 12];

fn scene(objects: [&Arc<Object>; 2], effects: Effects, accuracy: Accuracy) -> Scene {
    let mut scene = Scene::new(effects);
    for object in objects {
        scene.add_body(Arc::clone(object), None);
    }
    scene.set_accuracy(accuracy);
    scene
}

/// Moves the second body from `before` to where it is, with every effect asked for: what they say of whether the surfaces meet is
/// what is known.
///
/// # Panics
/// When it is not.
pub(super) fn effects_agree(objects: [&Arc<Object>; 2], rows: [Rows; 2], before: Rows, interfering: bool) {
    let all = ALL.into_iter().fold(Effects::NONE, Effects::union);
    // Huge and tiny maps may graze each other over the whole step: such a search is cut short.
    let time = TimeSettings { iterations: 1 << 12, ..TimeSettings::default() };
    let mut scene = scene(objects, all, Accuracy { time, ..Accuracy::default() });
    scene.step(Transforms::Dense(&[rows[0], before]), &NoClock).expect("both are finite");
    let report = scene.step(Transforms::Dense(&rows), &NoClock).expect("both are finite");
    for (_, distance) in report.distances() {
        assert_eq!(distance.value == 0.0, interfering, "{distance:?}");
        assert!(distance.lower <= distance.value, "{distance:?}");
    }
    assert_eq!(report.regions().iter().any(|(_, regions)| !regions.is_empty()), interfering);
    for (_, first) in report.times_of_contact() {
        let (lo, hi) = match first.time {
            TimeOfContact::Contact { lo, hi } | TimeOfContact::Possible { lo, hi, .. } => (lo, hi),
            TimeOfContact::Free => panic!("what is free is not listed"),
        };
        assert!((0.0..=1.0).contains(&lo) && lo <= hi && hi <= 1.0, "{first:?}");
    }
    // A motion ends where rounded positions decide: a contact there may be reached a few ulp beyond the motion's end.
    let meets = report.pairs().iter().any(|pair| pair.verdict == Verdict::Interfering);
    assert!(meets >= interfering, "the surfaces meet");
}

/// No level says anything wrong.
///
/// # Panics
/// When one does.
pub(super) fn levels_are_right(objects: [&Arc<Object>; 2], rows: [Rows; 2], interfering: bool) {
    let voxels = ORDERS.map(|order| Accuracy { level: Level::Voxels, order: Some(order), ..Accuracy::default() });
    let coarse = [Level::GlobalBoxes, Level::Containers].map(|level| Accuracy { level, ..Accuracy::default() });
    for accuracy in coarse.into_iter().chain(voxels) {
        let mut scene = scene(objects, Effects::INTERFERENCE, accuracy);
        let report = scene.step(Transforms::Dense(&rows), &NoClock).expect("they are finite");
        let verdict = report.pairs().first().map_or(Verdict::Clear, |pair| pair.verdict);
        assert!(verdict == Verdict::Possible || (verdict, interfering) == (Verdict::Clear, false), "{accuracy:?}");
        assert_eq!(report.bounds().len(), usize::from(verdict == Verdict::Possible));
    }
}
