//! Trouble with a scene, in the words of its file.

use std::io;
use std::path::PathBuf;

use crate::scene_file::SceneFileError;

/// Why a scene was not checked to its end.
#[derive(Debug, thiserror::Error)]
pub(super) enum CheckError {
    #[error(transparent)]
    SceneFile(#[from] SceneFileError),
    #[error("scene file {}, object \"{object}\": {source}", path.display())]
    Object { path: PathBuf, object: String, source: Box<collided_client::Error> },
    #[error("scene file {}: {source}", path.display())]
    Scene { path: PathBuf, source: Box<collided_client::Error> },
    #[error("scene file {}, step {step}: {source}", path.display())]
    Step { path: PathBuf, step: usize, source: Box<collided_client::Error> },
    #[error("the results cannot be written: {0}; check where the output goes")]
    Output(#[from] io::Error),
    #[error("interrupted")]
    Interrupted,
}

impl CheckError {
    /// Whether no other scene can be checked either.
    pub fn ends_the_run(&self) -> bool {
        match self {
            CheckError::SceneFile(_) => false,
            CheckError::Object { source, .. } | CheckError::Scene { source, .. } | CheckError::Step { source, .. } => {
                matches!(**source, collided_client::Error::DaemonGone)
            }
            CheckError::Output(_) | CheckError::Interrupted => true,
        }
    }
}
