//! What can be wrong with a scene file.

use std::io;
use std::path::PathBuf;

/// Why a scene file could not be used. Names the file, the place, the value and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneFileError {
    /// The system did not let the file be read.
    #[error("scene file {}: {source}; check the path and that the file is readable text", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The ending of the name does not say what the file is.
    #[error("scene file {}: the ending of its name is neither .json nor .toml; name the file after its format", path.display())]
    UnknownEnding {
        /// The file.
        path: PathBuf,
    },
    /// The file is not JSON or TOML, or not in the shape of a scene.
    #[error("scene file {}: {message}; correct the file there", path.display())]
    Syntax {
        /// The file.
        path: PathBuf,
        /// What the parser said, with line and column.
        message: String,
    },
    /// The file is a scene, but not one that can be checked.
    #[error("scene file {}: {invalid}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What does not fit, and where.
        invalid: Invalid,
    },
}

/// Something that does not fit, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}; {remedy}")]
pub struct Invalid {
    /// The object, body or step, by name or number.
    pub place: String,
    /// What was found there.
    pub problem: String,
    /// What the reader can do about it.
    pub remedy: String,
}

impl Invalid {
    pub(super) fn new(place: impl Into<String>, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Invalid { place: place.into(), problem: problem.into(), remedy: remedy.into() }
    }
}
