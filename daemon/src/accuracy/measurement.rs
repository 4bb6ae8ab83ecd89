//! One row of the study: a setting, what it cost, and what it was worth.

use collided_kernel::Level;
use collided_protocol::Effect;

use super::statistics::Spread;
use super::units::{duration, power};

/// What is varied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    /// Verdicts refined to a level; for voxels, of this order.
    Level {
        /// The level.
        level: Level,
        /// The order, for [`Level::Voxels`].
        order: Option<u32>,
    },
    /// Exact verdicts with voxel matrices of this order.
    Matrix {
        /// The order M.
        order: u32,
        /// Whether each object has the order that the file or the kernel chooses; `order` is then the largest.
        chosen: bool,
    },
    /// Exact verdicts within a budget.
    Budget {
        /// Per step.
        nanoseconds: u64,
    },
    /// The effect `distance`.
    Distance {
        /// Relative.
        tolerance: f64,
    },
    /// The effect `time_of_contact`.
    TimeOfContact {
        /// A share of the step.
        tolerance: f64,
    },
    /// An effect alone, as the scene asks for it.
    Effect(Effect),
    /// The polygon tests alone, in this arithmetic.
    Arithmetic(Precision),
}

/// An arithmetic for the polygon tests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// World vertices rounded to f32.
    F32,
    /// Plain f64.
    F64,
    /// The kernel's.
    Exact,
}

/// Settings that are compared with each other: a table and, most of them, a plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Levels.
    Level,
    /// Budgets.
    Budget,
    /// Orders M of the voxel matrices.
    Matrix,
    /// Tolerances of `distance`.
    Distance,
    /// Tolerances of `time_of_contact`.
    TimeOfContact,
    /// Effects, each alone.
    Effect,
    /// Arithmetics.
    Arithmetic,
}

/// One row of the study.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    /// What was varied.
    pub setting: Setting,
    /// Threads that computed.
    pub threads: usize,
    /// How often the steps were repeated.
    pub repetitions: usize,
    /// Nanoseconds of a step, the mean over the steps; of polygon tests alone, of one of them.
    pub time: Spread,
    /// What the answers were worth.
    pub worth: Worth,
}

/// What answers are worth, beside the exact ones. Counts are sums over the steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Worth {
    /// Pairs of bodies that were to be decided.
    pub pairs: u64,
    /// Of these, pairs left open.
    pub open: u64,
    /// Of these, pairs about which something wrong was said.
    pub wrong: u64,
    /// Errors of values: relative for distances, shares of the step for times of contact.
    pub error: Option<Errors>,
    /// Bytes held by the voxel matrices' objects.
    pub memory: Option<u64>,
    /// Nanoseconds by which 99 of 100 steps do not overrun their budget.
    pub overrun: Option<f64>,
    /// The largest proven bound of how far open pairs are apart, in the scene's length unit.
    pub apart: Option<f64>,
    /// Polygon tests over all steps, and how many of them came out wrong.
    pub tests: Option<[u64; 2]>,
}

/// How far values are from the exact ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Half of the values are nearer.
    pub median: f64,
    /// No value is farther.
    pub largest: f64,
}

impl Family {
    /// In the order of the study.
    pub const ALL: [Family; 7] = [
        Family::Level,
        Family::Budget,
        Family::Matrix,
        Family::Distance,
        Family::TimeOfContact,
        Family::Effect,
        Family::Arithmetic,
    ];

    /// A name for files and columns.
    pub fn name(self) -> &'static str {
        match self {
            Family::Level => "level",
            Family::Budget => "budget",
            Family::Matrix => "matrix",
            Family::Distance => "distance",
            Family::TimeOfContact => "time_of_contact",
            Family::Effect => "effect",
            Family::Arithmetic => "arithmetic",
        }
    }
}

impl Setting {
    /// What it is compared with.
    pub fn family(self) -> Family {
        match self {
            Setting::Level { .. } => Family::Level,
            Setting::Matrix { .. } => Family::Matrix,
            Setting::Budget { .. } => Family::Budget,
            Setting::Distance { .. } => Family::Distance,
            Setting::TimeOfContact { .. } => Family::TimeOfContact,
            Setting::Effect(_) => Family::Effect,
            Setting::Arithmetic(_) => Family::Arithmetic,
        }
    }

    /// The name of its curve.
    pub fn curve(self) -> &'static str {
        match self {
            Setting::Level { level, .. } => level_name(level),
            Setting::Matrix { chosen: false, .. } => "the same order",
            Setting::Matrix { chosen: true, .. } => "orders as chosen",
            Setting::Budget { .. } => "budget",
            Setting::Distance { .. } => Effect::Distance.name(),
            Setting::TimeOfContact { .. } => Effect::TimeOfContact.name(),
            Setting::Effect(effect) => effect.name(),
            Setting::Arithmetic(precision) => precision.name(),
        }
    }

    /// What stands beside its point: the value that is varied; nothing where the curve has only one point.
    pub fn label(self) -> String {
        match self {
            Setting::Level { order: Some(order), .. } | Setting::Matrix { order, .. } => order.to_string(),
            Setting::Budget { nanoseconds } => duration(nanoseconds as f64),
            Setting::Distance { tolerance } | Setting::TimeOfContact { tolerance } => tolerance_label(tolerance),
            Setting::Level { order: None, .. } | Setting::Effect(_) | Setting::Arithmetic(_) => String::new(),
        }
    }

    /// The number that is varied, as programs read it: an order, microseconds or a tolerance.
    pub fn value(self) -> Option<f64> {
        match self {
            Setting::Level { order, .. } => order.map(f64::from),
            Setting::Matrix { order, .. } => Some(f64::from(order)),
            Setting::Budget { nanoseconds } => Some(nanoseconds as f64 / 1e3),
            Setting::Distance { tolerance } | Setting::TimeOfContact { tolerance } => Some(tolerance),
            Setting::Effect(_) | Setting::Arithmetic(_) => None,
        }
    }
}

/// 0 is as exact as f64 allows.
fn tolerance_label(tolerance: f64) -> String {
    if tolerance == 0.0 { "0".to_owned() } else { power(tolerance) }
}

impl Precision {
    /// The coarsest first.
    pub const ALL: [Precision; 3] = [Precision::F32, Precision::F64, Precision::Exact];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::F64 => "plain f64",
            Precision::Exact => "exact",
        }
    }
}

/// A level in the words of the protocol.
pub fn level_name(level: Level) -> &'static str {
    use collided_protocol::report::Level as Named;
    match level {
        Level::GlobalBoxes => Named::GlobalBoxes.name(),
        Level::Containers => Named::Containers.name(),
        Level::Voxels => Named::Voxels.name(),
        Level::Polygons => Named::Polygons.name(),
    }
}

impl Worth {
    /// The share of pairs left open; 0 where there are none to decide.
    pub fn open_share(&self) -> f64 {
        self.open as f64 / self.pairs.max(1) as f64
    }
}
