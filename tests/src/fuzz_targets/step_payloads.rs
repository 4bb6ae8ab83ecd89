//! Steps as a client writes them into shared memory, up to the report.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use collided::step_payload::Message as Read;
use collided::{kernel_errors, step_payload};
use collided_client::IDENTITY;
use collided_kernel::{
    BatchInput, BodyId, Effects, NoClock, Object, PairResult, PolygonMesh, PolygonPair, Report, Scene, StepError,
    StepInput, Transforms, Verdict,
};
use collided_protocol::limits::{MAX_BATCH_TRANSFORMS, MAX_BODIES};
use collided_protocol::step::{MOTION_LINEAR, ROWS_WORDS, Rows, STEP_BATCH, STEP_DENSE, STEP_SPARSE, StepHeader, Word};
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};

use super::is_finite;
use super::source::Source;

const MAX_STEPS: usize = 4;
const MAX_TRANSFORMS: usize = 6;
const MAX_CANDIDATES: usize = 4;
/// From this byte on a message is a batch.
const BATCHES: u8 = 224;
/// The ids of the living bodies: body 1 was removed.
const BODIES: [u32; 3] = [0, 2, 3];
const REMOVED: BodyId = BodyId(1);

/// A tetrahedron, closed; two of its faces have four corners, three of them in a line.
static OBJECT: LazyLock<Arc<Object>> = LazyLock::new(|| {
    let vertices = vec![[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]];
    let polygons: [&[u32]; 4] = [&[0, 2, 1, 4], &[0, 4, 1, 3], &[1, 2, 3], &[2, 0, 3]];
    let mesh = PolygonMesh::from_polygons(vertices, polygons.map(Vec::from));
    Arc::new(Object::build(mesh, Some(3), &()).expect("the object is valid"))
});

/// A message of a client that need not keep to the protocol.
struct Message {
    header: StepHeader,
    words: Vec<Word>,
}

/// Pairs of a report, with their polygon pairs.
type Pairs = Vec<(PairResult, Vec<PolygonPair>)>;

/// Sends steps to a scene of three bodies. A message is taken exactly when it keeps to the protocol, with the very bits that it
/// has; a step is refused exactly when it names bodies that it must not, or is not finite in the world. The report is that of a
/// new scene whose bodies are placed at once where the accepted steps have left them. A batch moves none of them, and its verdicts are
/// those of new scenes too.
///
/// # Panics
/// When one of these does not hold.
pub fn step_payloads(bytes: &[u8]) {
    let mut source = Source::new(bytes);
    let (mut scene, mut placed) = (scene(), BTreeMap::from(BODIES.map(|body| (body, IDENTITY))));
    for _ in 0..=source.below(MAX_STEPS) {
        step_is_right(&mut scene, &mut placed, &message(&mut source));
    }
    // Whatever was refused last has left nothing behind.
    step_is_right(&mut scene, &mut placed, &Message { header: header(STEP_SPARSE, 0), words: Vec::new() });
}

fn scene() -> Scene {
    let mut scene = Scene::new(Effects::POLYGON_PAIRS.union(Effects::CONTAINMENT));
    for _ in 0..=BODIES.len() {
        scene.add_body(Arc::clone(&OBJECT), None);
    }
    scene.remove_body(REMOVED).expect("the body is there");
    scene
}

fn header(kind: u32, transform_count: u32) -> StepHeader {
    let (protocol, motion) = (PROTOCOL_VERSION, MOTION_LINEAR);
    StepHeader { protocol, kind, transform_count, candidate_count: 1, motion, ..StepHeader::default() }
}

/// Most often as a client of this release would write it, else with faults in some bytes of the header, or in the length.
fn message(source: &mut Source<'_>) -> Message {
    let kind = match source.byte() {
        BATCHES.. => STEP_BATCH,
        byte => [STEP_DENSE, STEP_SPARSE][usize::from(byte % 2)],
    };
    let count = if kind == STEP_DENSE { BODIES.len() } else { source.below(MAX_TRANSFORMS) };
    let candidates = if kind == STEP_BATCH { source.below(MAX_CANDIDATES) } else { 1 };
    let mut words = Vec::new();
    if kind != STEP_DENSE {
        let ids = |source: &mut Source<'_>| [source.number() as u32, source.number() as u32];
        words.extend((0..count.div_ceil(2)).map(|_| bytemuck::cast::<_, Word>(ids(source))));
    }
    words.extend((0..candidates * count).flat_map(|_| bytemuck::cast::<Rows, [Word; ROWS_WORDS]>(source.transform())));
    let mut header = StepHeader { candidate_count: candidates as u32, ..header(kind, count as u32) };
    if kind == STEP_BATCH {
        header.stop_at = source.below(4) as u32;
    }
    for _ in 0..source.below(8).saturating_sub(5) {
        let at = source.below(size_of::<StepHeader>());
        bytemuck::bytes_of_mut(&mut header)[at] = source.byte();
    }
    match source.below(16) {
        13 => words.clear(),
        14 => drop(words.pop()),
        15 => words.push(source.number()),
        _ => {}
    }
    Message { header, words }
}

fn step_is_right(scene: &mut Scene, placed: &mut BTreeMap<u32, Rows>, message: &Message) {
    let mut copied = step_payload::Copied::default();
    let read = match step_payload::read(&message.header, &message.words, &mut copied) {
        Ok(read) => read,
        Err(error) => return refused(&error, keeps_to_protocol(message), &message.header),
    };
    assert!(keeps_to_protocol(message), "a malformed step was taken: {:?}", message.header);
    match read {
        Read::Step(input) => moves_are_right(scene, placed, message, input),
        Read::Batch(input) => batch_is_right(scene, placed, message, &input),
    }
}

/// The candidates one by one, each in a new scene.
fn batch_is_right(scene: &mut Scene, placed: &BTreeMap<u32, Rows>, message: &Message, input: &BatchInput<'_>) {
    let moves = (0..message.header.candidate_count as usize).map(|candidate| batch_moves(message, candidate));
    let candidates: Option<Vec<_>> = moves.map(|moves| placed_by(placed, &moves)).collect();
    // Where there is no candidate, the ids are wrong or right all the same.
    let ids = batch_moves(message, 0).iter().map(|&(body, _)| (body, IDENTITY)).collect::<Vec<_>>();
    let expected = candidates.filter(|_| placed_by(placed, &ids).is_some());
    match scene.batch(input, &NoClock) {
        Ok(report) => {
            let expected = expected.unwrap_or_else(|| panic!("a bad batch was answered: {input:?}"));
            let mut verdicts: Vec<_> = expected.iter().map(|placed| Some(verdict(placed, input.bodies))).collect();
            let stop = verdicts.iter().position(|verdict| input.stop_at.is_some() && *verdict == input.stop_at);
            verdicts.iter_mut().skip(stop.map_or(usize::MAX, |stop| stop + 1)).for_each(|verdict| *verdict = None);
            assert!(report.verdicts().eq(verdicts.iter().copied()), "{verdicts:?}: {expected:?}");
        }
        Err(error) => refused_by_kernel(&error, expected.is_some(), &message.header),
    }
}

/// The ids of a batch, with their transforms in one of its candidates; with none where there is no candidate.
fn batch_moves(Message { header, words }: &Message, candidate: usize) -> Vec<(u32, Rows)> {
    let count = header.transform_count as usize;
    let first = count.div_ceil(2) + 12 * count * candidate;
    let entry = |index: usize| words.get(first + index).map_or(0.0, |&word| f64::from_bits(word));
    let transform = |at: usize| [0, 4, 8].map(|row| [0, 1, 2, 3].map(|column| entry(12 * at + row + column)));
    (0..count).map(|at| ((words[at / 2] >> (32 * (at % 2))) as u32, transform(at))).collect()
}

fn verdict(placed: &BTreeMap<u32, Rows>, named: &[BodyId]) -> Verdict {
    let interferes = |(pair, _): &(PairResult, Vec<PolygonPair>)| {
        pair.verdict == Verdict::Interfering && (named.contains(&pair.a) || named.contains(&pair.b))
    };
    if pairs_at_once(placed).iter().any(interferes) { Verdict::Interfering } else { Verdict::Clear }
}

fn moves_are_right(scene: &mut Scene, placed: &mut BTreeMap<u32, Rows>, message: &Message, input: StepInput<'_>) {
    if message.header.rigid_count + message.header.velocity_count > 0 {
        // Where these lead is for the tests of motions to say; here they are read, and the step is given up.
        return;
    }
    let expected = moves(message).and_then(|moves| placed_by(placed, &moves));
    match scene.step(input, &NoClock) {
        Ok(report) => {
            *placed = expected.unwrap_or_else(|| panic!("a bad step was answered: {input:?}"));
            assert_eq!(pairs(&report), pairs_at_once(placed), "{placed:?}");
        }
        Err(error) => refused_by_kernel(&error, expected.is_some(), &message.header),
    }
}

fn refused_by_kernel(error: &StepError, was_right: bool, header: &StepHeader) {
    refused(&kernel_errors::step_error(error, &|body| body.to_string()), was_right, header);
}

fn refused(error: &WireError, was_right: bool, header: &StepHeader) {
    assert!(!was_right, "a good step was refused ({error}): {header:?}");
    assert!(error.code != ErrorCode::Internal && !error.message.is_empty() && !error.remedy.is_empty(), "{error:?}");
}

/// As `docs/protocol.md` has it, in numbers wider than any count.
fn keeps_to_protocol(Message { header, words }: &Message) -> bool {
    let (count, candidates) = (u128::from(header.transform_count), u128::from(header.candidate_count));
    let id_words = if header.kind == STEP_DENSE { 0 } else { count.div_ceil(2) };
    let (rigid, velocities) = (u128::from(header.rigid_count), u128::from(header.velocity_count));
    let is_allowed = match header.kind {
        STEP_DENSE => candidates == 1 && rigid == 0,
        STEP_SPARSE => candidates == 1,
        STEP_BATCH => {
            let transforms = count * candidates;
            count > 0 && transforms <= MAX_BATCH_TRANSFORMS.into() && rigid + velocities == 0 && header.stop_at <= 3
        }
        _ => false,
    };
    header.protocol == PROTOCOL_VERSION
        && is_allowed
        && [header.transform_count, header.rigid_count, header.velocity_count].iter().all(|count| *count <= MAX_BODIES)
        && header.motion == MOTION_LINEAR
        && words.len() as u128 == id_words + 12 * candidates * count + 11 * rigid + 7 * velocities
}

/// Which body goes where, word by word; `None` for a dense step of too few or too many bodies.
fn moves(Message { header, words }: &Message) -> Option<Vec<(u32, Rows)>> {
    let count = header.transform_count as usize;
    let dense = header.kind == STEP_DENSE;
    if dense && count != BODIES.len() {
        return None;
    }
    let half = |index: usize| (words[index / 2] >> (32 * (index % 2))) as u32;
    let body = |index: usize| if dense { BODIES[index] } else { half(index) };
    let rows = &words[words.len() - 12 * count..];
    let entry = |index: usize| f64::from_bits(rows[index]);
    let transform = |first: usize| [0, 4, 8].map(|row| [0, 1, 2, 3].map(|column| entry(first + row + column)));
    Some((0..count).map(|index| (body(index), transform(12 * index))).collect())
}

/// Where the bodies are after the moves; `None` when these must be refused.
fn placed_by(placed: &BTreeMap<u32, Rows>, moves: &[(u32, Rows)]) -> Option<BTreeMap<u32, Rows>> {
    let moved: BTreeMap<u32, Rows> = moves.iter().copied().collect();
    let right = moved.len() == moves.len()
        && moved.iter().all(|(body, rows)| placed.contains_key(body) && is_finite(&OBJECT, rows));
    right.then(|| placed.iter().map(|(&body, &rows)| (body, *moved.get(&body).unwrap_or(&rows))).collect())
}

fn pairs_at_once(placed: &BTreeMap<u32, Rows>) -> Pairs {
    let rows: Vec<Rows> = placed.values().copied().collect();
    let mut scene = scene();
    pairs(&scene.step(Transforms::Dense(&rows), &NoClock).expect("the bodies were placed there before"))
}

fn pairs(report: &Report<'_>) -> Pairs {
    report.pairs().iter().map(|pair| (pair.clone(), report.polygon_pairs(pair).to_vec())).collect()
}
