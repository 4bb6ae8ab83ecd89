//! The dial: how far verdicts are refined, how exactly effects are computed, and what a step may cost.

use crate::effects::distance::DistanceSettings;
use crate::effects::time_of_contact::TimeSettings;
use crate::report::Level;

/// How exactly a scene, or a pair of its bodies, is answered.
///
/// `level` and `order` are about the verdict, and so about the effects that rest on exact polygon tests: a pair that is not refined
/// to [`Level::Polygons`] is never proven interfering by its surfaces, only clear or possible. Distances and times of contact have
/// tolerances of their own and are computed at every level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Where refinement ends. What is not proven clear there is possible.
    pub level: Level,
    /// With [`Level::Voxels`], the order of the voxels that are compared, at most each object's own; `None`: each object's own.
    pub order: Option<u32>,
    /// Of `distance`.
    pub distance: DistanceSettings,
    /// Of `time_of_contact`.
    pub time: TimeSettings,
}

impl Default for Accuracy {
    fn default() -> Self {
        Accuracy {
            level: Level::Polygons,
            order: None,
            distance: DistanceSettings::default(),
            time: TimeSettings::default(),
        }
    }
}

/// What a step may cost. When it is used up, what is not decided is reported as possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Budget {
    /// Whatever it takes.
    #[default]
    Unlimited,
    /// Time by the caller's [`Clock`](crate::Clock), from the beginning of the step.
    Nanoseconds(u64),
    /// Units of work: a pair of boxes, voxels or triangles that is compared is one, a pair of bodies 16. The same work on every
    /// machine, as long as one thread does it.
    Work(u64),
}
