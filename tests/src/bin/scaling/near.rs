//! Two copies of an object where there is most to do: just apart, and just in each other.

use std::sync::Arc;

use collided_kernel::affine::IDENTITY;
use collided_kernel::{Accuracy, Clock, Effects, Object, Rows, Scene, StageTimes, Transforms};
use collided_tests::meshes;
use collided_tests::near_contact::Approach;

use crate::figure::{median, nanoseconds};

/// How far from contact, as a share of the object's longest side.
const GAP: f64 = 1e-3;
const REPETITIONS: usize = 3;

/// Where the second copy is.
pub struct Poses {
    pub apart: Vec<Rows>,
    pub hit: Vec<Rows>,
}

impl Poses {
    pub fn random(object: &Arc<Object>, count: usize) -> Poses {
        let size = meshes::longest_side(object);
        let approaches = Approach::random([object, object], 1.0, 4.0 * size, count, 5);
        let at =
            |out: fn(&Approach, f64) -> f64| approaches.iter().map(|near| near.at(out(near, GAP * size))).collect();
        Poses { apart: at(|near, gap| near.clear + gap), hit: at(|near, gap| near.meets - gap) }
    }
}

/// Median nanoseconds of a verdict, with nothing known of the pose before; and the stages of all of them.
pub fn verdicts(object: &Arc<Object>, poses: &[Rows], clock: &dyn Clock) -> (f64, Vec<StageTimes>) {
    let mut scene = Scene::new(Effects::INTERFERENCE);
    [object, object].into_iter().for_each(|object| {
        scene.add_body(Arc::clone(object), None);
    });
    let mut stages = Vec::new();
    let mut verdict = |rows: &Rows| {
        scene.set_accuracy(Accuracy::default());
        let rows = [IDENTITY, *rows];
        let (time, report) = nanoseconds(|| scene.step(Transforms::Dense(&rows), clock).expect("good transforms"));
        stages.push(*report.times());
        time
    };
    let mut times: Vec<f64> = poses.iter().map(&mut verdict).collect();
    for _ in 1..REPETITIONS {
        for (rows, fastest) in poses.iter().zip(&mut times) {
            *fastest = fastest.min(verdict(rows));
        }
    }
    (median(times), stages)
}
