//! Trouble with a study, in the words of the scene file.

use std::io;
use std::path::PathBuf;

use collided_kernel::{ObjectError, StepError};
use collided_protocol::WireError;

use crate::mesh_file::MeshFileError;
use crate::scene_file::SceneFileError;

/// Why a scene could not be studied, or the study not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The scene file is missing, malformed, or not a scene.
    #[error(transparent)]
    SceneFile(#[from] SceneFileError),
    /// A mesh file of the scene is missing or malformed.
    #[error("scene file {}, object \"{object}\": {source}", scene.display())]
    Mesh {
        /// The scene file.
        scene: PathBuf,
        /// The object.
        object: String,
        /// What is wrong with its mesh file.
        source: Box<MeshFileError>,
    },
    /// The kernel refuses the polygons or the order of an object.
    #[error("scene file {}, object \"{object}\": {source}", scene.display())]
    Object {
        /// The scene file.
        scene: PathBuf,
        /// The object.
        object: String,
        /// What is wrong with it.
        source: ObjectError,
    },
    /// The scene has an accuracy or a mass that is out of range.
    #[error("scene file {}: {source}", scene.display())]
    Setting {
        /// The scene file.
        scene: PathBuf,
        /// What is out of range.
        source: Box<WireError>,
    },
    /// A step has a transform or a motion that cannot be used.
    #[error("scene file {}, step {step}: {source}", scene.display())]
    Step {
        /// The scene file.
        scene: PathBuf,
        /// The step.
        step: usize,
        /// What is wrong with it.
        source: Box<StepError>,
    },
    /// There is nothing to measure.
    #[error("scene file {}: {nothing}", scene.display())]
    Nothing {
        /// The scene file.
        scene: PathBuf,
        /// What is missing, and the remedy.
        nothing: &'static str,
    },
    /// A file of the study cannot be written.
    #[error("{}: {source}; check that --out names a folder that you can write to", path.display())]
    Output {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Results cannot be printed.
    #[error("the results cannot be written: {0}; check where the output goes")]
    Print(io::Error),
    /// The system cannot start threads.
    #[error("no threads to compute with: {0}; end other work on this host, and try again")]
    Threads(String),
    /// The kernel has said something wrong at full accuracy or in its bounds.
    #[error("{wrong} answers contradict the exact ones ({setting}); report this as a bug, with the scene")]
    Contradiction {
        /// How many.
        wrong: u64,
        /// Where.
        setting: String,
    },
}
