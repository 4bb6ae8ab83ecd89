//! The shape of a scene file, before its names are resolved.

use serde::Deserialize;

use super::values::{Entries, Number, Step, Table, Velocity};

/// A scene file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Document {
    pub objects: Entries<Object>,
    pub bodies: Vec<Body>,
    /// The verdict alone when left out.
    pub effects: Option<Vec<String>>,
    #[serde(default)]
    pub interest: Vec<Rule>,
    #[serde(default)]
    pub accuracy: Accuracy,
    pub steps: Vec<Step>,
}

/// An object: a mesh file, or vertices and polygons.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Object {
    pub mesh: Option<String>,
    pub vertices: Option<Table>,
    /// Wider than the indices that a mesh can have, so that one out of range is refused by name.
    pub polygons: Option<Vec<Vec<i64>>>,
    pub order: Option<u32>,
}

/// A body.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    pub name: String,
    pub object: String,
    pub group: Option<String>,
    pub dynamics: Option<Dynamics>,
    /// At first; a step may bring another one.
    pub velocity: Option<Velocity>,
}

/// Mass, for the effect `response`: with centre and inertia, or by density, or static.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Dynamics {
    pub mass: Option<Number>,
    pub centre: Option<Vec<Number>>,
    pub inertia: Option<Table>,
    pub density: Option<Number>,
    #[serde(default, rename = "static")]
    pub is_static: bool,
    pub restitution: Option<Number>,
    pub friction: Option<Number>,
}

/// A pair of bodies with a rule of its own.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Rule {
    pub pair: [String; 2],
    pub effects: Option<Vec<String>>,
    #[serde(default)]
    pub ignore: bool,
    pub accuracy: Option<Accuracy>,
}

/// How exact the answers shall be.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct Accuracy {
    pub level: Option<String>,
    pub order: Option<u32>,
    pub distance_tolerance: Option<Number>,
    pub distance_up_to: Option<Number>,
    pub time_tolerance: Option<Number>,
    pub iterations: Option<u32>,
    pub budget_us: Option<Number>,
}

pub(super) fn from_json(text: &str) -> Result<Document, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

pub(super) fn from_toml(text: &str) -> Result<Document, String> {
    toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())
}
