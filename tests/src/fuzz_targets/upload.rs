//! A mesh that comes in parts through shared memory.

use collided::upload::MeshParts;
use collided_protocol::PROTOCOL_VERSION;
use collided_protocol::control::{UPLOAD_CORNERS, UPLOAD_VERTICES, UploadHeader, UploadSize};
use collided_protocol::limits::MAX_MESH_ELEMENTS;
use collided_protocol::step::Word;

use super::build_or_refuse;
use super::source::Source;

const MAX_PARTS: usize = 8;
const MAX_PART_WORDS: usize = 32;
const KINDS: usize = UPLOAD_CORNERS as usize + 1;

/// The words that came of each kind, by its number.
type Words = [Vec<Word>; KINDS];

/// Reads the bytes as an upload: its size, then parts. A part is taken exactly when it is in turn, within what was announced, and
/// of numbers that fit; one that is refused leaves nothing behind. The mesh is there when all of it has come, bit by bit, and is
/// built or refused like any other.
///
/// # Panics
/// When one of these does not hold.
pub fn upload(bytes: &[u8]) {
    let mut source = Source::new(bytes);
    let announced = [0; KINDS].map(|_| source.number());
    let [vertices, polygons, corners] = announced;
    let parts = MeshParts::new("mesh", UploadSize { vertices, polygons, corners });
    assert_eq!(parts.is_ok(), announced.iter().all(|&count| count <= MAX_MESH_ELEMENTS), "{announced:?}");
    let Ok(mut parts) = parts else { return };
    let room = [3 * vertices, polygons, corners];
    let mut taken = Words::default();
    for _ in 0..source.below(MAX_PARTS) {
        part_is_right(&mut parts, room, &mut taken, &mut source);
    }
    mesh_is_right(parts, room, &taken);
}

fn part_is_right(parts: &mut MeshParts, room: [u64; KINDS], taken: &mut Words, source: &mut Source<'_>) {
    let kind = source.below(KINDS + 1);
    let so_far = taken.get(kind).map_or(0, |words| words.len() as u64);
    // Seldom wrong, so that an upload comes to its end.
    let protocol = PROTOCOL_VERSION ^ u32::from(source.byte() == 255);
    let first_word = if source.byte() == 255 { source.number() } else { so_far };
    let words: Vec<Word> = (0..source.below(MAX_PART_WORDS)).map(|_| word(source, kind)).collect();
    let header = UploadHeader { protocol, kind: kind as u32, first_word };
    let right = protocol == PROTOCOL_VERSION
        && first_word == so_far
        && room.get(kind).is_some_and(|room| so_far + words.len() as u64 <= *room)
        && (header.kind == UPLOAD_VERTICES || words.iter().all(|&word| word <= u64::from(u32::MAX)));
    match parts.take(&header, &words) {
        Ok(()) => {
            assert!(right, "a bad part was taken: {header:?}, {words:?}");
            taken[kind].extend(words);
        }
        Err(error) => assert!(!right, "a good part was refused ({error}): {header:?}, {words:?}"),
    }
}

fn word(source: &mut Source<'_>, kind: usize) -> Word {
    if kind as u32 == UPLOAD_VERTICES { source.coordinate().to_bits() } else { source.number() }
}

fn mesh_is_right(parts: MeshParts, room: [u64; KINDS], taken: &Words) {
    let complete = taken.iter().zip(room).all(|(words, room)| words.len() as u64 == room);
    let Ok(mesh) = parts.finish() else {
        assert!(!complete, "a complete mesh was refused");
        return;
    };
    assert!(complete, "a mesh of {room:?} words was taken for complete");
    let found: Words = [
        mesh.vertices.as_flattened().iter().map(|coordinate| coordinate.to_bits()).collect(),
        mesh.corner_counts.iter().copied().map(Word::from).collect(),
        mesh.corners.iter().copied().map(Word::from).collect(),
    ];
    assert_eq!(found, *taken);
    build_or_refuse(mesh, None);
}
