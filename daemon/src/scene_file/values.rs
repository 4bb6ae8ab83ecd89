//! Values that scene files write in ways serde does not know by itself.

use std::collections::HashSet;
use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};

/// A number; NaN and the infinities may be written as strings, which JSON has no other way for.
#[derive(Clone, Copy)]
pub(super) struct Number(pub f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberVisitor)
    }
}

struct NumberVisitor;

impl Visitor<'_> for NumberVisitor {
    type Value = Number;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number, \"NaN\", \"Infinity\" or \"-Infinity\"")
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Number, E> {
        Ok(Number(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Number, E> {
        Ok(Number(value as f64))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Number, E> {
        Ok(Number(value as f64))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Number, E> {
        match value {
            "NaN" => Ok(Number(f64::NAN)),
            "Infinity" => Ok(Number(f64::INFINITY)),
            "-Infinity" => Ok(Number(f64::NEG_INFINITY)),
            _ => Err(E::invalid_value(serde::de::Unexpected::Str(value), &self)),
        }
    }
}

/// A table from names to values. A name that stands twice is refused; serde's own maps take the last one silently.
pub(super) struct Entries<T>(pub Vec<(String, T)>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Entries<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(EntriesVisitor(PhantomData))
    }
}

struct EntriesVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for EntriesVisitor<T> {
    type Value = Entries<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Entries<T>, M::Error> {
        let mut names = Names::default();
        let mut entries = Vec::new();
        while let Some(name) = names.next(&mut map)? {
            entries.push((name, map.next_value()?));
        }
        Ok(Entries(entries))
    }
}

/// The names of a table, each allowed once.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    fn next<'de, M: MapAccess<'de>>(&mut self, map: &mut M) -> Result<Option<String>, M::Error> {
        let Some(name) = map.next_key::<String>()? else { return Ok(None) };
        match self.0.insert(name.clone()) {
            true => Ok(Some(name)),
            false => Err(M::Error::custom(format!("the name \"{name}\" stands twice in one table"))),
        }
    }
}

/// Rows of numbers, of any shape.
pub(super) type Table = Vec<Vec<Number>>;

/// A rigid motion. What is left out is zero, but for the axis.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Motion {
    pub axis: Option<Vec<Number>>,
    pub centre: Option<Vec<Number>>,
    pub angle: Option<Number>,
    pub translate: Option<Vec<Number>>,
}

/// A velocity. What is left out is zero.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Velocity {
    pub linear: Option<Vec<Number>>,
    pub angular: Option<Vec<Number>>,
}

/// A step: transforms by body, or these under `poses` beside `motion`, `velocities` and `delta_time`.
///
/// A body may bear one of these four names: its transform is a list, which none of the four is.
#[derive(Default)]
pub(super) struct Step {
    pub transforms: Vec<(String, Table)>,
    pub poses: Option<Entries<Table>>,
    pub motion: Option<Entries<Motion>>,
    pub velocities: Option<Entries<Velocity>>,
    pub delta_time: Option<Number>,
}

impl<'de> Deserialize<'de> for Step {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(StepVisitor)
    }
}

struct StepVisitor;

impl<'de> Visitor<'de> for StepVisitor {
    type Value = Step;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a step: a table from bodies to transforms")
    }

    fn visit_map<M: MapAccess<'de>>(self, mut map: M) -> Result<Step, M::Error> {
        let mut names = Names::default();
        let mut step = Step::default();
        while let Some(name) = names.next(&mut map)? {
            let transform = match name.as_str() {
                "poses" => map.next_value::<TransformOr<_>>()?.or_into(&mut step.poses),
                "motion" => map.next_value::<TransformOr<_>>()?.or_into(&mut step.motion),
                "velocities" => map.next_value::<TransformOr<_>>()?.or_into(&mut step.velocities),
                "delta_time" => map.next_value::<TransformOr<_>>()?.or_into(&mut step.delta_time),
                _ => Some(map.next_value()?),
            };
            step.transforms.extend(transform.map(|transform| (name, transform)));
        }
        Ok(step)
    }
}

/// A transform, which is a list, or a value of another kind, which is none.
enum TransformOr<T> {
    Transform(Table),
    Other(T),
}

impl<T> TransformOr<T> {
    /// The transform; any other value goes to `other`.
    fn or_into(self, other: &mut Option<T>) -> Option<Table> {
        match self {
            TransformOr::Transform(transform) => Some(transform),
            TransformOr::Other(value) => {
                *other = Some(value);
                None
            }
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for TransformOr<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TransformOrVisitor(PhantomData))
    }
}

struct TransformOrVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for TransformOrVisitor<T> {
    type Value = TransformOr<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("\"poses\", \"motion\" and \"velocities\" as tables and \"delta_time\" as a number")
    }

    fn visit_seq<S: SeqAccess<'de>>(self, seq: S) -> Result<Self::Value, S::Error> {
        Table::deserialize(SeqAccessDeserializer::new(seq)).map(TransformOr::Transform)
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(TransformOr::Other)
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        T::deserialize(value.into_deserializer()).map(TransformOr::Other)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        T::deserialize(value.into_deserializer()).map(TransformOr::Other)
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        T::deserialize(value.into_deserializer()).map(TransformOr::Other)
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Self::Value, E> {
        T::deserialize(value.into_deserializer()).map(TransformOr::Other)
    }
}
