//! Transforms in NumPy's `.npy` format: poses and motions of two bodies, steps of many.

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
        "{path}: {what}; write an array of shape (n, 2, 3, 4), of motions (n, 2, 2, 3, 4), of steps (steps, bodies, 3, 4), type '<f8', with numpy.save"
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
    Ok(read(path, &[None, Some(2), Some(3), Some(4)])?.1.as_chunks::<2>().0.to_vec())
}

/// The transforms of two bodies at the start and at the end of each motion, from a little-endian f64 array of shape
/// (n, 2, 2, 3, 4) in C order: the first body's start and end, then the second's.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read_motion_pairs(path: &Path) -> Result<Vec<[[Rows; 2]; 2]>, NpyError> {
    let (_, rows) = read(path, &[None, Some(2), Some(2), Some(3), Some(4)])?;
    Ok(rows.as_chunks::<2>().0.as_chunks::<2>().0.to_vec())
}

/// The transforms of all bodies in each step, from a little-endian f64 array of shape (steps, bodies, 3, 4) in C order.
///
/// # Errors
/// When the file cannot be read or holds something else.
pub fn read_steps(path: &Path) -> Result<Vec<Vec<Rows>>, NpyError> {
    let (shape, rows) = read(path, &[None, None, Some(3), Some(4)])?;
    Ok(rows.chunks(shape[1].max(1)).map(<[Rows]>::to_vec).collect())
}

/// Writes transforms in C order as an array of items of the shape `item`, followed by (3, 4): `[2]` for pairs of poses.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, item: &[usize], rows: impl IntoIterator<Item = Rows>) -> std::io::Result<()> {
    let rows: Vec<Rows> = rows.into_iter().collect();
    let count = rows.len() / item.iter().product::<usize>().max(1);
    let counts: Vec<String> = [&[count], item].concat().iter().map(usize::to_string).collect();
    std::fs::write(path, file(&format!("({}, 3, 4)", counts.join(", ")), rows.into_iter().flatten().flatten()))
}

fn file(shape: &str, numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    let length = (header.len() as u16).to_le_bytes();
    let data = numbers.into_iter().flat_map(f64::to_le_bytes);
    MAGIC.iter().copied().chain(length).chain(header.into_bytes()).chain(data).collect()
}

/// The shape, and all transforms; `None` in the expected shape stands for any count.
fn read(path: &Path, expected: &[Option<usize>]) -> Result<(Vec<usize>, Vec<Rows>), NpyError> {
    let name = || path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| NpyError::Unreadable { path: name(), source })?;
    transforms(&bytes, expected).map_err(|what| NpyError::Malformed { path: name(), what })
}

fn transforms(bytes: &[u8], expected: &[Option<usize>]) -> Result<(Vec<usize>, Vec<Rows>), String> {
    let (header, data) = split(bytes).ok_or("not an .npy file of version 1.0")?;
    let is_expected = |shape: &Vec<usize>| {
        shape.len() == expected.len() && shape.iter().zip(expected).all(|(&is, wanted)| wanted.is_none_or(|n| n == is))
    };
    let shape = shape(header).filter(is_expected).ok_or_else(|| format!("the header is {header:?}"))?;
    let numbers = shape.iter().try_fold(1usize, |product, &count| product.checked_mul(count));
    let bytes_expected = numbers.and_then(|numbers| numbers.checked_mul(8)).ok_or("the shape is too large")?;
    if data.len() != bytes_expected {
        return Err(format!("an array of shape {shape:?} takes {bytes_expected} bytes, not {}", data.len()));
    }
    let numbers: Vec<f64> = data.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect();
    Ok((shape, numbers.as_chunks::<4>().0.as_chunks::<3>().0.to_vec()))
}

fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let length: [u8; 2] = bytes.strip_prefix(MAGIC)?.get(..2)?.try_into().ok()?;
    let (header, data) = bytes[HEADER_START..].split_at_checked(u16::from_le_bytes(length).into())?;
    Some((std::str::from_utf8(header).ok()?.trim(), data))
}

fn shape(header: &str) -> Option<Vec<usize>> {
    let plain = header.contains("'descr': '<f8'") && header.contains("'fortran_order': False");
    let (_, shape) = header.split_once("'shape': (").filter(|_| plain)?;
    shape.split_once(')')?.0.split(',').map(|count| count.trim().parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: &[Option<usize>] = &[None, Some(2), Some(3), Some(4)];

    fn ascending(shape: &str, numbers: usize) -> Vec<u8> {
        file(shape, (0..numbers).map(|i| i as f64))
    }

    #[test]
    fn transforms_come_in_order() {
        let (shape, rows) = transforms(&ascending("(2, 2, 3, 4)", 48), POSES).expect("the file is well formed");
        assert_eq!((shape, rows.len()), (vec![2, 2, 3, 4], 4));
        assert_eq!(rows[3][0], [36.0, 37.0, 38.0, 39.0]);
        assert_eq!(rows[3][2][3], 47.0);
    }

    #[test]
    fn other_files_are_refused_and_say_why() {
        let refused = |bytes: &[u8], why: &str| transforms(bytes, POSES).is_err_and(|what| what.contains(why));
        assert!(refused(b"PK", "not an .npy file"));
        assert!(refused(&ascending("(2, 3, 4)", 24), "(2, 3, 4)"));
        assert!(refused(&ascending("(2, 3, 3, 4)", 72), "(2, 3, 3, 4)"));
        assert!(refused(&ascending("(2, 2, 3, 4)", 47), "384 bytes, not 376"));
    }
}
