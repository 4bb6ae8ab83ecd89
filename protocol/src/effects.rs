//! The effects a scene may ask for.

use serde::{Deserialize, Serialize};

/// One thing that may be computed for a pair of bodies. A scene pays only for the effects it asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Effect {
    /// The verdict alone. Stops at the first proven polygon pair.
    Interference,
    /// Every interfering polygon pair, ordered, with its relation.
    PolygonPairs,
    /// Which body lies wholly inside the other, their surfaces apart. Such a pair is interfering too.
    Containment,
    /// The minimum distance and the two nearest points.
    Distance,
    /// Where the bodies meet: points, segments and areas, grouped into regions.
    Contacts,
    /// A translation that takes the bodies apart.
    Penetration,
    /// Over the step's motion, a bracket of the time at which the bodies first meet.
    TimeOfContact,
    /// For bodies with mass: impulses at the contacts, and the velocities after.
    Response,
}

impl Effect {
    /// Every effect of this protocol version.
    pub const ALL: [Effect; 8] = [
        Effect::Interference,
        Effect::PolygonPairs,
        Effect::Containment,
        Effect::Distance,
        Effect::Contacts,
        Effect::Penetration,
        Effect::TimeOfContact,
        Effect::Response,
    ];

    /// The name used in scene files, in JSON output and on the control channel.
    pub const fn name(self) -> &'static str {
        match self {
            Effect::Interference => "interference",
            Effect::PolygonPairs => "polygon_pairs",
            Effect::Containment => "containment",
            Effect::Distance => "distance",
            Effect::Contacts => "contacts",
            Effect::Penetration => "penetration",
            Effect::TimeOfContact => "time_of_contact",
            Effect::Response => "response",
        }
    }

    /// The effect of that [name](Effect::name); `None` when this protocol version has none.
    pub fn named(name: &str) -> Option<Effect> {
        Effect::ALL.into_iter().find(|effect| effect.name() == name)
    }
}

/// A set of effects, as it travels on the control channel: a list of names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Effects(u32);

impl Effects {
    /// No effect: such a pair is ignored.
    pub const NONE: Effects = Effects(0);

    /// This set and `effect`.
    #[must_use]
    pub const fn with(self, effect: Effect) -> Effects {
        Effects(self.0 | 1 << effect as u32)
    }

    /// Whether `effect` is in the set.
    pub const fn contains(self, effect: Effect) -> bool {
        self.0 & (1 << effect as u32) != 0
    }

    /// Whether the set is empty.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The effects of the set, in the order of [`Effect::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::ALL.into_iter().filter(move |&effect| self.contains(effect))
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        effects.into_iter().fold(Effects::NONE, Effects::with)
    }
}

impl From<Effect> for Effects {
    fn from(effect: Effect) -> Self {
        Effects::NONE.with(effect)
    }
}

impl Serialize for Effects {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for Effects {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Vec::<Effect>::deserialize(deserializer)?.into_iter().collect())
    }
}
