//! What can be wrong with a mesh file.

use std::fmt;
use std::io;
use std::path::PathBuf;

/// How much of an offending text an error shows, in characters.
const EXCERPT_LENGTH: usize = 40;

/// Why a mesh file could not be read. Names the file, the place, the offending text and the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The system did not let the file be read.
    #[error("mesh file {}: {source}; {}", path.display(), self.remedy())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The ending of the name does not say what the file is.
    #[error("mesh file {}: the ending of its name is none of .obj, .stl, .ply and .off; {}", path.display(), self.remedy())]
    UnknownEnding {
        /// The file.
        path: PathBuf,
    },
    /// The file does not follow its format.
    #[error("mesh file {}, {malformed}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        malformed: Malformed,
    },
}

impl MeshFileError {
    /// Whether the file could not be read at all, rather than not understood.
    pub fn is_unreadable(&self) -> bool {
        matches!(self, MeshFileError::Unreadable { .. })
    }

    /// What the reader can do about it; the end of the whole message.
    pub fn remedy(&self) -> &'static str {
        match self {
            MeshFileError::Unreadable { source, .. } => match source.kind() {
                io::ErrorKind::NotFound => "check the path; the file must be there for the process that reads it",
                io::ErrorKind::PermissionDenied => "allow the user who runs the daemon to read it",
                io::ErrorKind::IsADirectory => "name a file in that directory",
                io::ErrorKind::InvalidInput => "name a file, not a pipe or a device",
                _ => "check the file and its file system",
            },
            MeshFileError::UnknownEnding { .. } => {
                "convert the mesh to one of these formats, or name the file after its format"
            }
            MeshFileError::Malformed { malformed, .. } => malformed.remedy,
        }
    }
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A line of text, counted from 1.
    Line(u64),
    /// An offset in bytes, counted from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Line(line) => write!(f, "line {line}"),
            Place::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// A file that does not follow its format.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}; {remedy}")]
pub struct Malformed {
    /// Where.
    pub place: Place,
    /// What was found there, and what was expected.
    pub problem: String,
    /// What the reader can do about it.
    pub remedy: &'static str,
}

impl Malformed {
    pub(super) fn new(place: Place, problem: impl Into<String>, remedy: &'static str) -> Self {
        Malformed { place, problem: problem.into(), remedy }
    }
}

/// A readable, quoted and bounded rendering of a piece of a file.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    // A character takes at most four bytes, so this prefix is never shorter than the excerpt.
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * EXCERPT_LENGTH + 4)]);
    let shown: String = text.chars().take(EXCERPT_LENGTH).collect();
    let more = if text.chars().count() > EXCERPT_LENGTH { "…" } else { "" };
    format!("\"{}{more}\"", shown.escape_debug())
}
