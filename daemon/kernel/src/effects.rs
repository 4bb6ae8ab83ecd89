//! Stage 9: the effects a scene may ask for, and the results ordered for the report.

pub mod contacts;
pub mod containment;
pub mod distance;
pub mod penetration;
pub mod response;
pub mod time_of_contact;

use rayon::prelude::*;

use crate::report::{PolygonPair, Relation};
use crate::workforce::Workforce;
use contacts::TrianglePair;

/// A set of effects. What is not asked for is not computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub struct Effects(u32);

impl Effects {
    /// No effect: the pair is ignored.
    pub const NONE: Effects = Effects(0);
    /// The verdict. Stops at the first proven polygon pair.
    pub const INTERFERENCE: Effects = Effects(1);
    /// Every interfering polygon pair with its relation.
    pub const POLYGON_PAIRS: Effects = Effects(2);
    /// Which body lies wholly inside the other, surfaces apart. Such a pair is interfering too.
    pub const CONTAINMENT: Effects = Effects(4);

    /// The minimum distance and the nearest points.
    pub const DISTANCE: Effects = Effects(8);
    /// Where the bodies meet.
    pub const CONTACTS: Effects = Effects(16);
    /// A translation that takes the bodies apart.
    pub const PENETRATION: Effects = Effects(32);
    /// When the bodies first meet within the step.
    pub const TIME_OF_CONTACT: Effects = Effects(64);
    /// Impulses, and the velocities after.
    pub const RESPONSE: Effects = Effects(128);

    /// The effects of both sets.
    #[must_use]
    pub const fn union(self, other: Effects) -> Effects {
        Effects(self.0 | other.0)
    }

    /// Whether every effect of `other` is in this set.
    pub const fn contains(self, other: Effects) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether an effect is in both sets.
    pub const fn meets(self, other: Effects) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// A pair of interfering polygons of the `pair`-th pair of bodies, as a worker found it. The order of the fields is the order
/// of the report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Found {
    pub pair: u32,
    pub a: u32,
    pub b: u32,
    pub relation: Relation,
}

/// A pair of interfering triangles of the `pair`-th pair of bodies, for the effects that look at where the surfaces meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Touching {
    pub pair: u32,
    pub triangles: TrianglePair,
}

/// Orders what the workers found, so that nothing of how they shared the work can be observed, and keeps each polygon pair
/// once, with its strongest relation.
pub(crate) fn order(found: &mut Vec<Found>, workforce: &(impl Workforce + ?Sized)) {
    /// Fewer are sorted sooner than another thread wakes up.
    const WORTH_SHARING: usize = 1 << 14;
    if found.len() < WORTH_SHARING {
        found.sort_unstable();
    } else {
        workforce.share(&mut || found.par_sort_unstable());
    }
    found.dedup_by(|next, kept| {
        let same = (next.pair, next.a, next.b) == (kept.pair, kept.a, kept.b);
        if same {
            kept.relation = kept.relation.max(next.relation);
        }
        same
    });
}

impl From<&Found> for PolygonPair {
    fn from(&Found { a, b, relation, .. }: &Found) -> Self {
        PolygonPair { a, b, relation }
    }
}
