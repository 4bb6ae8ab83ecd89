//! What is asked of the kernel: steps of a scene.

use std::sync::Arc;

use collided_kernel::effects::time_of_contact::TimeOfContact;
use collided_kernel::motion::Motion;
use collided_kernel::{
    Accuracy, BodyId, Effects, NoClock, Object, Report, RigidMotion, Scene, StepInput, Transforms, Verdict,
};
use collided_protocol::step::Rows;
use collided_tests::ccd;

use crate::turns::{Timed, timed};

/// A time of contact that is only possible.
const POSSIBLE: f64 = -1.0;

/// Two bodies.
pub struct Pair {
    scene: Scene,
}

impl Pair {
    pub fn new([a, b]: [&Arc<Object>; 2], effects: Effects) -> Pair {
        let mut scene = Scene::new(effects);
        [a, b].into_iter().for_each(|object| {
            scene.add_body(Arc::clone(object), None);
        });
        Pair { scene }
    }

    /// What the scene remembers of earlier poses: of their pairs, nothing is left.
    pub fn forget(&mut self) {
        self.scene.set_accuracy(Accuracy::default());
    }

    /// A step, timed, and a number of its report, read while the clock runs.
    pub fn step<'i>(&mut self, input: impl Into<StepInput<'i>>, answer: fn(&Report<'_>) -> f64) -> Timed {
        let input = input.into();
        timed(|| answer(&self.scene.step(input, &NoClock).expect("good transforms")))
    }

    /// Places both bodies without asking anything, then moves them.
    pub fn time_of_contact(&mut self, [a, b]: &[[Rows; 2]; 2], rigid: bool) -> Timed {
        self.scene.set_effects(Effects::NONE);
        self.step(Transforms::Dense(&[a[0], b[0]]), |_| 0.0);
        self.scene.set_effects(Effects::TIME_OF_CONTACT);
        self.forget();
        match ccd::turning(b[0], b[1]) {
            Motion::Rigid { axis, centre, angle, translate, .. } if rigid => {
                let turn = RigidMotion { axis, centre, angle, translate };
                let transforms = Transforms::Sparse { bodies: &[0], rows: &[a[1]] };
                let input = StepInput { transforms, rigid: &[(BodyId(1), turn)], velocities: &[] };
                self.step(input, first_contact)
            }
            _ => self.step(Transforms::Dense(&[a[1], b[1]]), first_contact),
        }
    }
}

/// 1 where two bodies interfere.
pub fn interfering(report: &Report<'_>) -> f64 {
    f64::from(report.pairs().iter().any(|pair| pair.verdict == Verdict::Interfering))
}

/// 0: the boxes are apart; 1: they overlap, the bodies are apart; 2: the bodies interfere.
pub fn class(report: &Report<'_>) -> f64 {
    interfering(report) + f64::from(report.counts().broad_pairs > 0)
}

pub fn polygon_pairs(report: &Report<'_>) -> f64 {
    report.polygon_pair_count() as f64
}

pub fn distance(report: &Report<'_>) -> f64 {
    report.distances().first().map_or(f64::NAN, |(_, found)| found.value)
}

pub fn interfering_pairs(report: &Report<'_>) -> f64 {
    report.counts().interfering_pairs as f64
}

/// The end of the bracket, [`FREE`](crate::parry::FREE) when there is none.
fn first_contact(report: &Report<'_>) -> f64 {
    match report.times_of_contact().first().map(|(_, first)| first.time) {
        None | Some(TimeOfContact::Free) => crate::parry::FREE,
        Some(TimeOfContact::Contact { hi, .. }) => hi,
        Some(TimeOfContact::Possible { .. }) => POSSIBLE,
    }
}

/// Many bodies of one object.
pub struct Crowd {
    scene: Scene,
}

impl Crowd {
    pub fn new(object: &Arc<Object>, rows: &[Rows]) -> Crowd {
        let mut scene = Scene::new(Effects::INTERFERENCE);
        rows.iter().for_each(|_| {
            scene.add_body(Arc::clone(object), None);
        });
        scene.step(Transforms::Dense(rows), &NoClock).expect("good transforms");
        Crowd { scene }
    }

    /// Interfering pairs of bodies, after those of `moved` have gone to their new places.
    pub fn step(&mut self, rows: &[Rows], moved: &[u32], new: &[Rows]) -> f64 {
        let all = moved.len() == rows.len();
        let transforms = if all { Transforms::Dense(rows) } else { Transforms::Sparse { bodies: moved, rows: new } };
        interfering_pairs(&self.scene.step(transforms, &NoClock).expect("good transforms"))
    }
}
