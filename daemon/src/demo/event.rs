//! What a client process of the demonstration tells: JSON, one event a line.

use std::collections::BTreeSet;

use collided_client::StageTimes;
use serde::{Deserialize, Serialize};

/// One event.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// An object is being loaded.
    Load {
        /// Its name.
        object: String,
        /// What is being done.
        stage: String,
        /// Done so far, in the stage's own unit.
        done: u64,
        /// When `done` reaches this the stage ends; 0 when not known.
        total: u64,
    },
    /// A step was answered.
    Step(Step),
    /// All steps were answered.
    Done(Best),
}

/// What the report of a step says, and when it came.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Step {
    /// Its number, from 0.
    pub step: u64,
    /// Interfering pairs of bodies.
    pub pairs: u64,
    /// Interfering pairs of polygons.
    pub polygon_pairs: u64,
    /// From sending the transforms to having the report, in nanoseconds.
    pub round_trip: u64,
    /// How long each stage took in the daemon, in nanoseconds.
    #[serde(with = "Times")]
    pub times: StageTimes,
}

/// The step with the most interfering pairs of polygons.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Best {
    /// Its number.
    pub step: u64,
    /// Interfering pairs of bodies.
    pub pairs: u64,
    /// Interfering pairs of polygons.
    pub polygon_pairs: u64,
    /// Numbers of the interfering polygons of each body.
    pub interfering: Vec<BTreeSet<u32>>,
}

/// The names of the stage times.
#[derive(Serialize, Deserialize)]
#[serde(remote = "StageTimes")]
struct Times {
    boxes: u64,
    broad_phase: u64,
    interest: u64,
    voxels: u64,
    polygon_pairs: u64,
    polygon_tests: u64,
    effects: u64,
    report: u64,
    total: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_survive_their_line() {
        let best =
            Best { step: 7, pairs: 1, polygon_pairs: 2, interfering: vec![BTreeSet::from([4, 9]), BTreeSet::new()] };
        let times = StageTimes { boxes: 1, total: 9, ..StageTimes::default() };
        for event in [
            Event::Load { object: "rob".into(), stage: "build".into(), done: 3, total: 0 },
            Event::Step(Step { step: 1, pairs: 2, polygon_pairs: 3, round_trip: 4, times }),
            Event::Done(best),
        ] {
            let line = serde_json::to_string(&event).unwrap();
            assert!(!line.contains('\n'));
            assert_eq!(serde_json::from_str::<Event>(&line).unwrap(), event);
        }
    }
}
