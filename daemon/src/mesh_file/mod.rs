//! Mesh files: OBJ, STL, PLY and OFF, told apart by the ending of the name.
//!
//! The polygons keep their corners, order and numbers, and coordinates their full precision: text is rounded once, to the
//! nearest f64, and binary values are carried over as they are. What a mesh must be beyond its format (indices in range,
//! 3 corners or more, finite vertices) is checked where objects are built, so that uploads and files get the same answer.

mod error;
mod obj;
mod off;
mod ply;
mod stl;
mod text;

#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use collided_kernel::PolygonMesh;
use rustix::fs::{Mode, OFlags};

pub use error::{Malformed, MeshFileError, Place};

/// Told how many bytes of how many are done. Each byte of a file counts twice: when it is read, and when it is parsed.
pub type Progress<'p> = &'p mut dyn FnMut(u64, u64);

/// How many bytes pass between two calls of a [`Progress`].
const PROGRESS_STRIDE: usize = 1 << 20;

/// A format of mesh files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Wavefront OBJ: `v` and `f` statements; everything else is skipped.
    Obj,
    /// Stereolithography, text or binary. Vertices at equal positions become one.
    Stl,
    /// Polygon file format, text or binary of either byte order.
    Ply,
    /// Geomview's object file format, text.
    Off,
}

impl Format {
    /// The format that the ending of `path` names, in upper or lower case; `None` for any other ending.
    pub fn of_path(path: &Path) -> Option<Format> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Format::Obj),
            "stl" => Some(Format::Stl),
            "ply" => Some(Format::Ply),
            "off" => Some(Format::Off),
            _ => None,
        }
    }
}

/// Reads a mesh file.
///
/// # Errors
/// When the ending names no format, the file cannot be read, or it does not follow its format.
pub fn read(path: &Path, progress: Progress<'_>) -> Result<PolygonMesh, MeshFileError> {
    let format = Format::of_path(path).ok_or_else(|| MeshFileError::UnknownEnding { path: path.to_owned() })?;
    let bytes =
        read_bytes(path, progress).map_err(|source| MeshFileError::Unreadable { path: path.to_owned(), source })?;
    let read = bytes.len() as u64;
    parse(&bytes, format, &mut |done, total| progress(read + done, read + total))
        .map_err(|malformed| MeshFileError::Malformed { path: path.to_owned(), malformed })
}

/// Reads a mesh from the bytes of a mesh file.
///
/// # Errors
/// When the bytes do not follow the format.
pub fn parse(bytes: &[u8], format: Format, progress: Progress<'_>) -> Result<PolygonMesh, Malformed> {
    let mut meter = Meter::new(bytes.len(), progress);
    match format {
        Format::Obj => obj::parse(bytes, &mut meter),
        Format::Stl => stl::parse(bytes, &mut meter),
        Format::Ply => ply::parse(bytes, &mut meter),
        Format::Off => off::parse(bytes, &mut meter),
    }
}

fn read_bytes(path: &Path, progress: Progress<'_>) -> io::Result<Vec<u8>> {
    let mut file = open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    loop {
        let read = file.by_ref().take(PROGRESS_STRIDE as u64).read_to_end(&mut bytes)?;
        if read == 0 {
            return Ok(bytes);
        }
        let done = bytes.len() as u64;
        progress(done, 2 * length.max(done));
    }
}

/// Opens a regular file. Anything else might never end, or keep its reader waiting for ever: the daemon reads what any
/// client names.
fn open(path: &Path) -> io::Result<File> {
    let file = File::from(rustix::fs::open(path, OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC, Mode::empty())?);
    match file.metadata()?.file_type() {
        kind if kind.is_file() => Ok(file),
        kind if kind.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file")),
    }
}

/// Passes the position of a parser on to a [`Progress`], once in [`PROGRESS_STRIDE`] bytes and at the end.
struct Meter<'p> {
    progress: Progress<'p>,
    total: usize,
    next: usize,
}

impl<'p> Meter<'p> {
    fn new(total: usize, progress: Progress<'p>) -> Self {
        Meter { progress, total, next: PROGRESS_STRIDE.min(total) }
    }

    fn at(&mut self, position: usize) {
        if position >= self.next {
            (self.progress)(position as u64, self.total as u64);
            self.next = if position >= self.total { usize::MAX } else { (position + PROGRESS_STRIDE).min(self.total) };
        }
    }
}

/// Adds a polygon to `mesh`.
fn push_polygon(
    mesh: &mut PolygonMesh,
    corners: impl IntoIterator<Item = Result<u32, Malformed>>,
) -> Result<(), Malformed> {
    let first = mesh.corners.len();
    for corner in corners {
        mesh.corners.push(corner?);
    }
    mesh.corner_counts.push((mesh.corners.len() - first) as u32);
    Ok(())
}
