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

/// Motions of real meshes on which other libraries were measured to be late, early, or to see nothing: a file
/// `measured_ccd_*.json`. The first mesh rests.
#[derive(Debug, Clone, Deserialize)]
pub struct Measured {
    /// Names of the two meshes.
    pub meshes: [String; 2],
    /// The motions.
    pub cases: Vec<MeasuredCase>,
}

/// One motion of [`Measured`].
#[derive(Debug, Clone, Deserialize)]
pub struct MeasuredCase {
    /// Its number among all that were measured.
    pub motion_index: usize,
    /// Where the first mesh is.
    #[serde(rename = "A")]
    pub a: Rows,
    /// Where the second mesh starts.
    #[serde(rename = "B_start")]
    pub b_start: Rows,
    /// Where it ends.
    #[serde(rename = "B_end")]
    pub b_end: Rows,
    /// The first contact, found by an exact scan: contact [`REFERENCE_BOUND`] later, none that much before.
    pub toi_ref: f64,
}

/// How far [`MeasuredCase::toi_ref`] may be off.
pub const REFERENCE_BOUND: f64 = 1e-6;

impl Measured {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, or is not of this form.
    pub fn read(path: &Path) -> std::io::Result<Measured> {
        Ok(serde_json::from_str(&std::fs::read_to_string(path)?)?)
    }
}

impl MeasuredCase {
    /// Of the first mesh, and of the second.
    pub fn motions(&self) -> [Motion; 2] {
        [Motion::Still(self.a), turning(self.b_start, self.b_end)]
    }

    /// What is wrong with an answer that was given at a tolerance, if anything.
    pub fn fault(&self, found: TimeOfContact, tolerance: f64) -> Option<String> {
        let reference = self.toi_ref;
        match found {
            TimeOfContact::Contact { lo, hi } if hi - lo > tolerance => Some("the bracket is too wide".to_owned()),
            TimeOfContact::Contact { lo, hi }
                if lo <= reference + REFERENCE_BOUND && reference - REFERENCE_BOUND <= hi =>
            {
                None
            }
            _ => Some(format!("an exact scan found the first contact at {reference}")),
        }
    }
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
