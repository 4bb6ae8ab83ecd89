//! Messages of the control channel, as daemon and client read them, and the uploads that they announce.

use std::fmt::Debug;
use std::io::Cursor;

use collided_client::frame::{self, FrameError};
use collided_protocol::control::{Reply, Request};
use collided_protocol::names::Rendezvous;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::upload::upload;

/// Reads the bytes as a stream of frames, and as one message without a frame, of each kind. What can be read is the same
/// message after it was written and read again, and what cannot leaves the stream at the next frame. Reads them as an upload,
/// too: see the module `upload`.
///
/// # Panics
/// When one of these does not hold.
pub fn wire_messages(bytes: &[u8]) {
    frames::<Request>(bytes);
    frames::<Reply>(bytes);
    message::<Request>(bytes);
    message::<Reply>(bytes);
    message::<Rendezvous>(bytes);
    upload(bytes);
}

fn frames<T: Serialize + DeserializeOwned + PartialEq + Debug>(bytes: &[u8]) {
    let mut stream = Cursor::new(bytes);
    loop {
        let start = stream.position() as usize;
        match frame::read::<T>(&mut stream) {
            Ok(None) | Err(FrameError::Io(_)) => return,
            Ok(Some(message)) => round_trip(&message),
            Err(FrameError::TooLarge { .. } | FrameError::Json(_)) => {}
        }
        assert_eq!(stream.position() as usize, frame_end(bytes, start), "the frame at byte {start}");
    }
}

/// Where the frame that begins at `start` ends, or the bytes do.
fn frame_end(bytes: &[u8], start: usize) -> usize {
    let length = [0, 1, 2, 3].map(|byte| bytes[start + byte]);
    (start + 4 + u32::from_le_bytes(length) as usize).min(bytes.len())
}

fn message<T: Serialize + DeserializeOwned + PartialEq + Debug>(bytes: &[u8]) {
    if let Ok(message) = serde_json::from_slice::<T>(bytes) {
        round_trip(&message);
    }
}

fn round_trip<T: Serialize + DeserializeOwned + PartialEq + Debug>(message: &T) {
    let mut stream = Vec::new();
    frame::write(&mut stream, message).expect("a message that was read fits a frame");
    let again = frame::read::<T>(&mut stream.as_slice()).expect("what was written can be read");
    assert_eq!(again.as_ref(), Some(message));
}
