//! Pairs of poses in NumPy's `.npy` format.

use std::path::Path;

use collided_protocol::step::Rows;
use thiserror::Error;

/// Why a file of poses cannot be used.
#[derive(Debug, Error)]
pub enum NpyError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not what is needed.
    #[error(
        "{path}: {what}; write an array of shape (n, 2, 3, 4), of motions (n, 2, 2, 3, 4), type '<f8', with numpy.save"
    )]
    Malformed {
        /// The file.
        path: String,
        /// What is wrong.
        what: String,
    },
}

/// Format version 1.0 (NumPy Enhancement Proposal 1): magic, version, length of the header in two bytes.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";
const HEADER_START: usize = MAGIC.len() + 2;

/// The transforms of two bodies per pose, from a little-endian f64 array of shape (n, 2, 3, 4) in C order.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read_pose_pairs(path: &Path) -> Result<Vec<[Rows; 2]>, NpyError> {
    read(path, ", 2, 3, 4)")
}

/// The transforms of two bodies at the start and at the end of each motion, from a little-endian f64 array of shape
/// (n, 2, 2, 3, 4) in C order: the first body's start and end, then the second's.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read_motion_pairs(path: &Path) -> Result<Vec<[[Rows; 2]; 2]>, NpyError> {
    let bodies: Vec<[Rows; 2]> = read(path, ", 2, 2, 3, 4)")?;
    Ok(bodies.as_chunks::<2>().0.to_vec())
}

/// Pairs of transforms, whatever they are pairs of; `shape` is what follows the count.
fn read(path: &Path, shape: &str) -> Result<Vec<[Rows; 2]>, NpyError> {
    let name = || path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| NpyError::Unreadable { path: name(), source })?;
    pairs(&bytes, shape).map_err(|what| NpyError::Malformed { path: name(), what })
}

fn pairs(bytes: &[u8], shape: &str) -> Result<Vec<[Rows; 2]>, String> {
    let (header, data) = split(bytes).ok_or("not an .npy file of version 1.0")?;
    let pairs_of_each = if shape.starts_with(", 2, 2,") { 2 } else { 1 };
    let count = count(header, shape).ok_or_else(|| format!("the header is {header:?}"))? * pairs_of_each;
    let (numbers, rest) = data.as_chunks::<8>();
    if !rest.is_empty() || numbers.len() != count * 24 {
        return Err(format!("{count} pairs of transforms take {} bytes, not {}", count * 192, data.len()));
    }
    let number = |i: usize| f64::from_le_bytes(numbers[i]);
    let rows = |first: usize| [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| number(first + 4 * row + column)));
    Ok((0..count).map(|pair| [rows(24 * pair), rows(24 * pair + 12)]).collect())
}

fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let length: [u8; 2] = bytes.strip_prefix(MAGIC)?.get(..2)?.try_into().ok()?;
    let (header, data) = bytes[HEADER_START..].split_at_checked(u16::from_le_bytes(length).into())?;
    Some((std::str::from_utf8(header).ok()?.trim(), data))
}

fn count(header: &str, following: &str) -> Option<usize> {
    let plain = header.contains("'descr': '<f8'") && header.contains("'fortran_order': False");
    let (_, shape) = header.split_once("'shape': (").filter(|_| plain)?;
    let (count, _) = shape.split_once(following)?;
    count.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(shape: &str, numbers: usize) -> Vec<u8> {
        let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
        let length = (header.len() as u16).to_le_bytes();
        let data = (0..numbers).flat_map(|i| (i as f64).to_le_bytes());
        MAGIC.iter().copied().chain(length).chain(header.into_bytes()).chain(data).collect()
    }

    fn pose_pairs(bytes: &[u8]) -> Result<Vec<[Rows; 2]>, String> {
        pairs(bytes, ", 2, 3, 4)")
    }

    #[test]
    fn poses_come_in_order() {
        let poses = pose_pairs(&file("(2, 2, 3, 4)", 48)).expect("the file is well formed");
        assert_eq!(poses.len(), 2);
        assert_eq!(poses[1][1][0], [36.0, 37.0, 38.0, 39.0]);
        let motions = pairs(&file("(1, 2, 2, 3, 4)", 48), ", 2, 2, 3, 4)").expect("the file is well formed");
        assert_eq!(motions, poses);
    }

    #[test]
    fn other_files_are_refused_and_say_why() {
        assert!(pose_pairs(b"PK").is_err_and(|what| what.contains("not an .npy file")));
        assert!(pose_pairs(&file("(2, 3, 4)", 24)).is_err_and(|what| what.contains("(2, 3, 4)")));
        assert!(pose_pairs(&file("(2, 2, 3, 4)", 47)).is_err_and(|what| what.contains("384 bytes, not 376")));
    }
}
