//! The hard cases of `data/hardcases`: two meshes, two transforms, and the exact answer.

use std::collections::BTreeMap;

use collided_protocol::report::Relation;
use collided_protocol::step::Rows;
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};

use crate::oracle::{Surface, Triangle};

/// One case of `static.json`.
#[derive(Debug, Clone, Deserialize)]
pub struct Case {
    /// Its name.
    pub id: String,
    /// The kind of difficulty.
    pub group: String,
    /// What is hard about it.
    pub why: String,
    /// The first mesh.
    pub a: Mesh,
    /// The second mesh.
    pub b: Mesh,
    /// Transform of `a`.
    #[serde(rename = "ma", deserialize_with = "rows")]
    pub rows_a: Rows,
    /// Transform of `b`.
    #[serde(rename = "mb", deserialize_with = "rows")]
    pub rows_b: Rows,
    /// The exact answer, or why there is none.
    pub expected: Expected,
}

/// Polygons in their own frame, with the triangulation that the answer speaks of.
#[derive(Debug, Clone, Deserialize)]
pub struct Mesh {
    /// Positions; may be NaN or infinite.
    #[serde(deserialize_with = "points")]
    pub vertices: Vec<[f64; 3]>,
    /// Vertex numbers of the corners of each polygon.
    pub polygons: Vec<Vec<u32>>,
    /// Vertex numbers of the corners of each triangle; none where the mesh is to be refused.
    #[serde(default)]
    pub triangles: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    #[serde(default, rename = "tri_poly")]
    pub polygon_of: Vec<u32>,
}

impl Mesh {
    /// The mesh with its vertices elsewhere.
    pub fn surface<'a>(&'a self, vertices: &'a [[f64; 3]]) -> Surface<'a> {
        Surface { vertices, triangles: &self.triangles, polygon_of: &self.polygon_of }
    }
}

/// What must come out.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum Expected {
    /// The input is valid, and this is the truth.
    Answer(Answer),
    /// The input must be refused.
    Refused {
        /// Why.
        reason: String,
    },
}

/// The exact answer on rounded world vertices.
#[derive(Debug, Clone, Deserialize)]
pub struct Answer {
    /// Whether the surfaces have a point in common.
    pub surface_contact: bool,
    /// Which of the two is inside the other: `a_in_b`, `b_in_a`.
    pub containment: Option<String>,
    /// Either of these.
    pub interfering: bool,
    /// The strongest relation of the surfaces.
    #[serde(deserialize_with = "relation")]
    pub relation: Relation,
    /// Interfering triangles, ordered.
    #[serde(rename = "tri_pairs")]
    pub triangle_pairs: Vec<TrianglePair>,
    /// Interfering polygons, ordered.
    #[serde(rename = "poly_pairs")]
    pub polygon_pairs: Vec<(u32, u32)>,
}

/// Triangle of `a`, triangle of `b`, how they meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub struct TrianglePair(
    /// Triangle of `a`.
    pub u32,
    /// Triangle of `b`.
    pub u32,
    /// How they meet.
    #[serde(deserialize_with = "relation")]
    pub Relation,
);

impl Case {
    /// The answer of a valid case; `None` when the case must be refused.
    pub fn answer(&self) -> Option<&Answer> {
        match &self.expected {
            Expected::Answer(answer) => Some(answer),
            Expected::Refused { .. } => None,
        }
    }

    /// The polygon pairs of an answer, ordered, each with the strongest relation of its triangles.
    pub fn polygon_relations(&self, answer: &Answer) -> Vec<(u32, u32, Relation)> {
        let mut strongest = BTreeMap::new();
        for &TrianglePair(a, b, found) in &answer.triangle_pairs {
            let polygons = (self.a.polygon_of[a as usize], self.b.polygon_of[b as usize]);
            let relation = strongest.entry(polygons).or_insert(found);
            *relation = found.max(*relation);
        }
        strongest.into_iter().map(|((a, b), relation)| (a, b, relation)).collect()
    }
}

/// Every case of `static.json`.
///
/// # Panics
/// When the file does not have its format.
pub fn static_cases() -> Vec<Case> {
    #[derive(Deserialize)]
    struct File {
        count: usize,
        cases: Vec<Case>,
    }
    let file: File = parse(include_str!("../data/hardcases/static.json"));
    assert_eq!(file.cases.len(), file.count);
    file.cases
}

/// Two unit cubes, placed where a collision library was seen to be wrong.
#[derive(Debug, Clone, Deserialize)]
pub struct CubeCase {
    /// Its name.
    pub name: String,
    /// Transform of the first cube.
    #[serde(rename = "TA")]
    pub rows_a: Rows,
    /// Transform of the second cube.
    #[serde(rename = "TB")]
    pub rows_b: Rows,
    /// 1 when the exact images of the surfaces have a point in common, else 0.
    exact: u32,
    /// The same of rounded world vertices, where it differs.
    exact_rounded: Option<u32>,
}

impl CubeCase {
    /// Whether the surfaces have a point in common, their vertices rounded.
    pub fn surface_contact(&self) -> bool {
        self.exact_rounded.unwrap_or(self.exact) == 1
    }
}

/// The unit cube of [`cube_cases`], in triangles.
pub fn unit_cube() -> Mesh {
    let bit = |i: u32, b: u32| f64::from(i >> b & 1);
    Mesh {
        vertices: (0..8).map(|i| [bit(i, 2), bit(i, 1), bit(i, 0)]).collect(),
        polygons: CUBE_TRIANGLES.iter().map(|triangle| triangle.to_vec()).collect(),
        triangles: CUBE_TRIANGLES.to_vec(),
        polygon_of: (0..CUBE_TRIANGLES.len() as u32).collect(),
    }
}

#[rustfmt::skip]
const CUBE_TRIANGLES: [[u32; 3]; 12] = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
];

/// Every pair of cubes on which another library was measured to be wrong.
pub fn cube_cases() -> Vec<CubeCase> {
    #[derive(Deserialize)]
    struct File {
        cases: Vec<CubeCase>,
    }
    [
        include_str!("../data/hardcases/from-issues/measured_coal_vertex_gap.json"),
        include_str!("../data/hardcases/from-issues/measured_fcl_face_touch.json"),
        include_str!("../data/hardcases/from-issues/measured_parry_face_touch.json"),
    ]
    .into_iter()
    .flat_map(|text| parse::<File>(text).cases)
    .collect()
}

/// Pairs of triangles from issues of three-bvh-csg and parry, all of them apart: in parry's, a corner of one is in the plane of
/// the other and beyond its edge by a ten-millionth of its length.
pub fn apart_triangles() -> Vec<(Triangle, Triangle)> {
    #[derive(Deserialize)]
    struct Cylinder {
        #[serde(rename = "A")]
        a: Triangle,
        #[serde(rename = "B")]
        b: Vec<Triangle>,
    }
    #[derive(Deserialize)]
    struct Panic {
        tri1: Triangle,
        tri2: Triangle,
    }
    let cylinder: Cylinder =
        parse(include_str!("../data/hardcases/from-issues/threebvhcsg_56_cylinder_triangles.json"));
    let panic: Panic = parse(include_str!("../data/hardcases/from-issues/parry_253_tri_tri_panic.json"));
    let pairs = cylinder.b.into_iter().map(|b| (cylinder.a, b));
    pairs.chain([(panic.tri1, panic.tri2)]).collect()
}

fn parse<'de, T: Deserialize<'de>>(text: &'de str) -> T {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("malformed hard cases: {error}"))
}

/// A number, or the name of one that JSON does not have: `NaN`, `Infinity`, `-Infinity`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(into = "serde_json::Value")]
pub struct Number(pub f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Value(f64),
            Name(String),
        }
        match Written::deserialize(deserializer)? {
            Written::Value(value) => Ok(Number(value)),
            Written::Name(name) => name.parse().map(Number).map_err(D::Error::custom),
        }
    }
}

impl From<Number> for serde_json::Value {
    fn from(Number(value): Number) -> Self {
        match value {
            f64::INFINITY => "Infinity".into(),
            f64::NEG_INFINITY => "-Infinity".into(),
            value if value.is_nan() => "NaN".into(),
            value => value.into(),
        }
    }
}

fn points<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 3]>, D::Error> {
    let points: Vec<[Number; 3]> = Deserialize::deserialize(deserializer)?;
    Ok(points.into_iter().map(|point| point.map(|Number(value)| value)).collect())
}

fn rows<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rows, D::Error> {
    let rows: [[Number; 4]; 3] = Deserialize::deserialize(deserializer)?;
    Ok(rows.map(|row| row.map(|Number(value)| value)))
}

fn relation<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Relation, D::Error> {
    let name = String::deserialize(deserializer)?;
    let all = [Relation::None, Relation::Touch, Relation::Coplanar, Relation::Cross];
    let found = all.into_iter().find(|relation| relation.name() == name);
    found.ok_or_else(|| D::Error::custom(format!("no relation is called {name:?}")))
}
