//! Scene files: objects, bodies, what to compute and a list of steps, as TOML or JSON by the ending of the name.
//!
//! Reading goes through `document`, the shape of the file as serde sees it, and `validate`, which resolves names and
//! says by name what does not fit. Values that only the daemon can judge (NaN and infinity, vertex indices, orders) are
//! left to it, so that files, uploads and steps get the same answer.

mod document;
mod error;
mod validate;
mod values;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use collided_client::{RigidMotion, Velocity};
use collided_kernel::PolygonMesh;
use collided_protocol::Effects;
use collided_protocol::control::{Accuracy, Dynamics, Interest};
use collided_protocol::step::Rows;

pub use error::SceneFileError;

/// A scene file with its names resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneFile {
    /// The objects.
    pub objects: Vec<Object>,
    /// The bodies, in the order of the file.
    pub bodies: Vec<Body>,
    /// Effects of every pair without a rule of its own.
    pub effects: Effects,
    /// Pairs with a rule of their own.
    pub interest: Vec<Rule>,
    /// How exactly effects are computed.
    pub accuracy: Accuracy,
    /// Bodies with mass, by place in `bodies`.
    pub dynamics: Vec<(usize, Dynamics)>,
    /// The steps, in order. A body that a step does not name keeps its last transform.
    pub steps: Vec<Step>,
}

/// An object of a scene file.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its name, unique in the file.
    pub name: String,
    /// Where its polygons are.
    pub source: Source,
    /// Order M of its voxel matrix; `None` lets the daemon choose.
    pub order: Option<u32>,
}

/// Where the polygons of an object are.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// In a mesh file, whose path is relative to the working directory or absolute.
    File(PathBuf),
    /// In the scene file.
    Inline(PolygonMesh),
}

/// A body of a scene file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Body {
    /// Its name, unique in the file.
    pub name: String,
    /// Its object, by place in [`SceneFile::objects`].
    pub object: usize,
    /// Pairs within a group are ignored.
    pub group: Option<String>,
}

/// A pair of bodies with a rule of its own. Bodies are given by place in [`SceneFile::bodies`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// One body.
    pub a: usize,
    /// The other body.
    pub b: usize,
    /// What to compute for the pair.
    pub interest: Interest,
    /// How exactly, if not as the scene.
    pub accuracy: Option<Accuracy>,
}

/// Where a body is in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The body, by place in [`SceneFile::bodies`].
    pub body: usize,
    /// Body frame to world.
    pub rows: Rows,
}

/// A step. Bodies are given by place in [`SceneFile::bodies`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Step {
    /// Transforms at its end.
    pub poses: Vec<Pose>,
    /// Bodies that turn on their way, from their last transforms.
    pub motions: Vec<(usize, RigidMotion)>,
    /// Velocities.
    pub velocities: Vec<(usize, Velocity)>,
    /// Its length in time; 0 when not given.
    pub delta_time: f64,
}

/// What a scene file is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// JSON, named `.json`.
    Json,
    /// TOML, named `.toml`.
    Toml,
}

impl Format {
    /// The format by the ending of a file's name, whatever the case of its letters.
    fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_ascii_lowercase() {
            ending if ending == "json" => Some(Format::Json),
            ending if ending == "toml" => Some(Format::Toml),
            _ => None,
        }
    }
}

impl SceneFile {
    /// Reads a scene file.
    ///
    /// # Errors
    /// When the file cannot be read, is not TOML or JSON, or does not describe a scene that this version can check.
    pub fn read(path: &Path) -> Result<SceneFile, SceneFileError> {
        let format = Format::of(path).ok_or_else(|| SceneFileError::UnknownEnding { path: path.to_owned() })?;
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneFileError::Unreadable { path: path.to_owned(), source })?;
        SceneFile::parse(&text, format, path)
    }

    /// Takes the text of the scene file at `path`, which is named in errors and which mesh files stand relative to.
    ///
    /// # Errors
    /// When the text is not of that format, or does not describe a scene that this version can check.
    pub fn parse(text: &str, format: Format, path: &Path) -> Result<SceneFile, SceneFileError> {
        let document = match format {
            Format::Json => document::from_json(text),
            Format::Toml => document::from_toml(text),
        };
        let document = document.map_err(|message| SceneFileError::Syntax { path: path.to_owned(), message })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        validate::scene(document, folder).map_err(|invalid| SceneFileError::Invalid { path: path.to_owned(), invalid })
    }
}
