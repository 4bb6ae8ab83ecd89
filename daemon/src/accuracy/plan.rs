//! What is run, and how often.

use std::time::Duration;

use collided_kernel::Level;
use collided_protocol::Effect;

use super::measurement::{Precision, Setting};
use super::scene::StudyScene;

/// How thorough a study is.
#[derive(Debug, Clone)]
pub struct Plan {
    /// How often the steps are repeated for each setting, at most.
    pub repetitions: usize,
    /// A setting is repeated no more once it has taken so long.
    pub patience: Duration,
    /// Which thread counts.
    pub threads: &'static [usize],
    /// Every how many-th order and decade.
    pub stride: usize,
}

/// Tolerances of a study: ten decades.
const DECADES: i32 = 10;

/// The tolerance of `time_of_contact` that others are compared with: two decades below the last one.
pub const TIGHTEST_TIME: f64 = 1e-12;

/// The tolerance of `distance` that others are compared with: as exact as f64 allows.
pub const TIGHTEST_DISTANCE: f64 = 0.0;

/// Matrices are tried up to so many orders beyond the largest one that the scene has.
const BEYOND: u32 = 6;

/// The shortest budget, in nanoseconds.
const FIRST_BUDGET: u64 = 1_000;
/// Up to ten seconds.
const DECADES_OF_BUDGETS: u32 = 7;
/// Budgets that most scenes need.
const USUAL_BUDGETS: usize = 9;

impl Plan {
    /// A study that takes a minute at most, as a rule.
    pub fn thorough(repetitions: usize) -> Plan {
        Plan { repetitions, patience: Duration::from_millis(200), threads: &[1, 2], stride: 1 }
    }

    /// A study that takes seconds.
    pub fn quick(repetitions: usize) -> Plan {
        Plan { repetitions, patience: Duration::from_millis(50), threads: &[1, 2], stride: 3 }
    }

    /// Levels, the orders of voxels from 0 to the largest that the scene has.
    pub fn levels(&self, scene: &StudyScene) -> Vec<Setting> {
        let plain = |level| Setting::Level { level, order: None };
        let voxels = self.orders(0, scene.largest_order());
        let voxels = voxels.map(|order| Setting::Level { level: Level::Voxels, order: Some(order) });
        let coarse = [Level::GlobalBoxes, Level::Containers].map(plain);
        coarse.into_iter().chain(voxels).chain([plain(Level::Polygons)]).collect()
    }

    /// Orders from `first` to `last`, the last one always.
    fn orders(&self, first: u32, last: u32) -> impl Iterator<Item = u32> {
        (first..last).step_by(self.stride).chain([last])
    }

    /// Orders of voxel matrices, from the chosen one down, and from there up.
    pub fn matrices(&self, scene: &StudyScene) -> [Vec<u32>; 2] {
        let chosen = scene.largest_order();
        let last = (chosen + BEYOND).min(collided_kernel::MAX_ORDER);
        let mut down: Vec<u32> = (0..=chosen).rev().step_by(self.stride).collect();
        if down.last() != Some(&0) {
            down.push(0);
        }
        [down, (chosen + 1..=last).step_by(self.stride).collect()]
    }

    /// Budgets 1, 2, 5, 10, … microseconds up to ten seconds, in nanoseconds; every other one of a study that strides.
    pub fn budgets(&self) -> impl Iterator<Item = u64> + use<> {
        let decades = (0..DECADES_OF_BUDGETS).map(|decade| FIRST_BUDGET * 10u64.pow(decade));
        decades.flat_map(|decade| [1, 2, 5].map(|factor| factor * decade)).step_by(self.stride.min(2))
    }

    /// Tolerances of an effect that has one, the tightest first, if the scene asks for it.
    pub fn tolerances(&self, scene: &StudyScene, effect: Effect) -> Vec<Setting> {
        let decades = (1..=DECADES).rev().step_by(self.stride).map(|decade| 10f64.powi(-decade));
        match effect {
            _ if !scene.asks(effect) => Vec::new(),
            Effect::Distance => [TIGHTEST_DISTANCE]
                .into_iter()
                .chain(decades)
                .map(|tolerance| Setting::Distance { tolerance })
                .collect(),
            Effect::TimeOfContact => [TIGHTEST_TIME]
                .into_iter()
                .chain(decades)
                .map(|tolerance| Setting::TimeOfContact { tolerance })
                .collect(),
            _ => Vec::new(),
        }
    }

    /// The effects of the scene, each alone.
    pub fn effects(&self, scene: &StudyScene) -> Vec<Setting> {
        scene.effects().iter().map(Setting::Effect).collect()
    }
}

impl Plan {
    /// How many settings there are, at most; of the budgets, which end when one is enough, as many as is usual.
    pub fn settings(&self, scene: &StudyScene) -> usize {
        let [down, up] = self.matrices(scene);
        let tolerances = [Effect::Distance, Effect::TimeOfContact].map(|effect| self.tolerances(scene, effect).len());
        let each = self.levels(scene).len()
            + USUAL_BUDGETS
            + down.len()
            + up.len()
            + 1
            + tolerances[0]
            + tolerances[1]
            + self.effects(scene).len();
        self.threads.len() * each + Precision::ALL.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_one_two_and_five_of_each_decade() {
        let budgets: Vec<u64> = Plan::thorough(1).budgets().collect();
        assert_eq!(budgets[..5], [1_000, 2_000, 5_000, 10_000, 20_000]);
        assert_eq!(budgets.last(), Some(&5_000_000_000));
        assert!(Plan::quick(1).budgets().eq(budgets.into_iter().step_by(2)));
    }

    #[test]
    fn the_last_order_is_always_tried() {
        let orders = |plan: Plan| plan.orders(0, 16).collect::<Vec<_>>();
        assert_eq!(orders(Plan::quick(1)), [0, 3, 6, 9, 12, 15, 16]);
        assert_eq!(orders(Plan::thorough(1)).len(), 17);
    }
}
