//! Frames of the control channel: a `u32`, little endian, the number of bytes that follow, then one JSON value.

use std::io::{self, Read, Write};

use collided_protocol::limits::MAX_CONTROL_MESSAGE;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Why a frame could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The socket failed, timed out, or ended within a frame.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The frame is larger than the limit. When reading, all of it was skipped: the next frame can be read.
    #[error("a control message of {bytes} bytes is larger than the limit of {MAX_CONTROL_MESSAGE}")]
    TooLarge {
        /// Its size.
        bytes: u64,
    },
    /// The frame does not hold the JSON value that was expected. The next frame can be read.
    #[error("{0}")]
    Json(#[from] serde_json::Error),
}

/// Writes one frame.
///
/// # Errors
/// [`FrameError::TooLarge`] before anything is written; [`FrameError::Io`].
pub fn write(stream: &mut impl Write, message: &impl Serialize) -> Result<(), FrameError> {
    let mut frame = vec![0; 4];
    serde_json::to_writer(&mut frame, message)?;
    let bytes = frame.len() - 4;
    if bytes > MAX_CONTROL_MESSAGE {
        return Err(FrameError::TooLarge { bytes: bytes as u64 });
    }
    frame[..4].copy_from_slice(&(bytes as u32).to_le_bytes());
    Ok(stream.write_all(&frame)?)
}

/// Reads one frame; `None` when the other side ended the stream between two frames.
///
/// # Errors
/// All of [`FrameError`].
pub fn read<T: DeserializeOwned>(stream: &mut impl Read) -> Result<Option<T>, FrameError> {
    let Some(json) = read_json(stream)? else { return Ok(None) };
    Ok(Some(serde_json::from_slice(&json)?))
}

/// Reads the JSON text of one frame; `None` when the other side ended the stream between two frames.
///
/// # Errors
/// [`FrameError::TooLarge`], [`FrameError::Io`].
pub fn read_json(stream: &mut impl Read) -> Result<Option<Vec<u8>>, FrameError> {
    let Some(bytes) = read_length(stream)? else { return Ok(None) };
    let mut body = stream.take(u64::from(bytes));
    if bytes as usize > MAX_CONTROL_MESSAGE {
        io::copy(&mut body, &mut io::sink())?;
        return Err(FrameError::TooLarge { bytes: u64::from(bytes) });
    }
    // The announced length is not trusted with memory before the bytes have come.
    let mut json = Vec::new();
    body.read_to_end(&mut json)?;
    if json.len() < bytes as usize {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    Ok(Some(json))
}

fn read_length(stream: &mut impl Read) -> io::Result<Option<u32>> {
    let mut length = [0; 4];
    let mut filled = 0;
    while filled < length.len() {
        match stream.read(&mut length[filled..]) {
            Ok(0) if filled == 0 => return Ok(None),
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(Some(u32::from_le_bytes(length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_written() {
        let mut bytes = Vec::new();
        write(&mut bytes, &"first").unwrap();
        write(&mut bytes, &2).unwrap();
        let mut stream = bytes.as_slice();
        assert_eq!(read::<String>(&mut stream).unwrap().as_deref(), Some("first"));
        assert_eq!(read::<u32>(&mut stream).unwrap(), Some(2));
        assert_eq!(read::<u32>(&mut stream).unwrap(), None);
    }

    #[test]
    fn a_frame_beyond_the_limit_is_skipped_whole() {
        let bytes = MAX_CONTROL_MESSAGE as u32 + 1;
        let mut next = Vec::new();
        write(&mut next, &"next").unwrap();
        let too_large = bytes.to_le_bytes();
        let mut stream = too_large.as_slice().chain(io::repeat(b' ').take(u64::from(bytes))).chain(next.as_slice());
        assert!(matches!(read::<String>(&mut stream), Err(FrameError::TooLarge { .. })));
        assert_eq!(read::<String>(&mut stream).unwrap().as_deref(), Some("next"));
    }

    #[test]
    fn a_frame_that_ends_early_is_an_error() {
        let mut bytes = Vec::new();
        write(&mut bytes, &"cut").unwrap();
        for end in 1..bytes.len() {
            assert!(matches!(read::<String>(&mut &bytes[..end]), Err(FrameError::Io(_))), "cut at {end}");
        }
    }
}
