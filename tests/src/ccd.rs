//! The motions of `data/ccd`, and what the kernel says of them.

use std::path::{Path, PathBuf};

use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
use collided_kernel::motion::Motion;
use collided_kernel::{Object, PolygonMesh};
use collided_protocol::step::Rows;
use serde::Deserialize;

use crate::hardcases::Mesh;

/// One case of `ccd.json`.
#[derive(Debug, Clone, Deserialize)]
pub struct Case {
    /// Its name.
    pub id: String,
    /// The kind of difficulty.
    pub group: String,
    /// The first mesh.
    pub a: Mesh,
    /// The second mesh.
    pub b: Mesh,
    /// Motion of `a`.
    pub motion_a: CaseMotion,
    /// Motion of `b`.
    pub motion_b: CaseMotion,
    /// The truth.
    pub expected: Expected,
}

/// A motion, as the file has it.
#[derive(Debug, Clone, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub enum CaseMotion {
    /// Of straight lines.
    Linear {
        /// The transform at the start.
        m0: Rows,
        /// The transform at the end.
        m1: Rows,
    },
    /// A screw.
    Rigid {
        /// The transform at the start.
        m0: Rows,
        /// Direction of the axis.
        axis: [f64; 3],
        /// A point on the axis at the start.
        center: [f64; 3],
        /// In radians.
        angle: f64,
        /// Displacement of the centre.
        translate: [f64; 3],
    },
}

/// The truth about a case.
#[derive(Debug, Clone, Deserialize)]
pub struct Expected {
    /// When the closed sets first have a point in common, containment included; none when they never have.
    pub toc: Option<f64>,
}

impl CaseMotion {
    /// In the words of the kernel.
    pub fn motion(&self) -> Motion {
        match *self {
            CaseMotion::Linear { m0, m1 } if m0 == m1 => Motion::Still(m0),
            CaseMotion::Linear { m0, m1 } => Motion::Linear { from: m0, to: m1 },
            CaseMotion::Rigid { m0, axis, center, angle, translate } => {
                Motion::Rigid { from: m0, axis, centre: center, angle, translate }
            }
        }
    }
}

#[derive(Deserialize)]
struct Cases {
    cases: Vec<Case>,
}

/// Where the data are.
pub fn directory() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ccd")
}

/// All cases of `ccd.json`.
///
/// # Panics
/// When the file is not as it should be.
pub fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(directory().join("ccd.json")).expect("the data are in the repository");
    let cases: Cases = serde_json::from_str(&text).expect("the data are well formed");
    cases.cases
}

/// An object of a case.
///
/// # Panics
/// When the kernel refuses it.
pub fn object(mesh: &Mesh, order: Option<u32>) -> Object {
    let polygons = PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons);
    Object::build(polygons, order, &()).expect("the meshes of moving cases are valid")
}

/// The time of contact of two moving objects at a tolerance, with iterations to spare.
pub fn time_of(a: (&Object, &Motion), b: (&Object, &Motion), tolerance: f64, memory: &mut Memory) -> TimeOfContact {
    time_of_contact(a, b, TimeSettings { tolerance, ..TimeSettings::default() }, memory)
}

/// The motion between two placements of a rigid body whose frame's origin moves straight while it turns about it, the
/// shorter way.
pub fn turning(from: Rows, to: Rows) -> Motion {
    // Row by row: to·fromᵀ.
    let turn = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| to[i][k] * from[j][k]).sum::<f64>()));
    let axis = [turn[2][1] - turn[1][2], turn[0][2] - turn[2][0], turn[1][0] - turn[0][1]];
    let (sine, cosine) = (axis.iter().map(|x| x * x).sum::<f64>().sqrt(), turn[0][0] + turn[1][1] + turn[2][2] - 1.0);
    if sine == 0.0 {
        return Motion::Linear { from, to };
    }
    let centre = from.map(|row| row[3]);
    let translate = [0, 1, 2].map(|axis| to[axis][3] - centre[axis]);
    Motion::Rigid { from, axis, centre, angle: sine.atan2(cosine), translate }
}
