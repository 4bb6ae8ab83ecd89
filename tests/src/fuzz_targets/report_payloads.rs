//! Reports as a client finds them in shared memory.

use std::hint::black_box;

use collided_client::report::{self, Pair, PolygonPair, Records};
use collided_client::{Error, Relation};
use collided_protocol::WireError;
use collided_protocol::report::{ReportHeader, SECTION_PAIRS, SECTION_POLYGON_PAIRS, STATUS_OK, Section};
use collided_protocol::step::Word;

use super::source::Source;

const PAIR_BYTES: usize = 24;
const POLYGON_PAIR_BYTES: usize = 12;
/// The first section of an effect.
const EFFECTS: usize = 2;
/// The last code of verdicts, levels, relations and containments, as `docs/protocol.md` has them.
const LAST_CODES: [u8; 4] = [2, 3, 3, 8];

/// The record of a pair of bodies, read byte by byte.
struct PairBytes {
    bodies: [u32; 2],
    /// Of verdict, level, relation and containment.
    codes: [u8; 4],
    first: u64,
    count: u64,
}

/// Reads the bytes as a report: some numbers of the header, then the words. It is taken exactly when its sections lie within the
/// words and its pairs are sound, and then says what the bytes say; an error in place of a report comes out as that error. What
/// effects have to say may be refused too, and can be read when it was not.
///
/// # Panics
/// When one of these does not hold.
pub fn report_payloads(bytes: &[u8]) {
    let mut source = Source::new(bytes);
    let header = header(&mut source);
    let payload = source.rest();
    let mut words: Vec<Word> = vec![0; payload.len().div_ceil(size_of::<Word>())];
    bytemuck::cast_slice_mut(&mut words)[..payload.len()].copy_from_slice(payload);
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let decoded = report::decode(&header, &words);
    if header.status != STATUS_OK {
        return error_is_right(&header, bytes, &decoded.expect_err("an error is no report"));
    }
    let expected = pairs(&header, bytes);
    match decoded {
        Ok(records) => records_are_right(records, &expected.expect("what was taken is sound"), &header, bytes),
        Err(error) => {
            assert!(matches!(error, Error::BadReply(_)), "{error}");
            let has_effects = header.sections[EFFECTS..].iter().any(|section| *section != Section::default());
            assert!(expected.is_none() || has_effects, "a sound report was refused: {error}");
        }
    }
}

/// The sections of pairs and polygon pairs; behind them as many of effects as the length of an error says, when there is none.
fn header(source: &mut Source<'_>) -> ReportHeader {
    let (status, error_bytes) = (source.number() as u32, source.number() as u32);
    let mut header = ReportHeader { status, error_bytes, ..ReportHeader::default() };
    let effects = if status == STATUS_OK { error_bytes as usize } else { 0 };
    for section in header.sections.iter_mut().take(EFFECTS + effects) {
        *section = Section { first_word: source.number() as u32, count: source.number() as u32 };
    }
    header
}

fn error_is_right(header: &ReportHeader, bytes: &[u8], found: &Error) {
    let json = &bytes[..bytes.len().min(header.error_bytes as usize)];
    match (serde_json::from_slice::<WireError>(json), found) {
        (Ok(expected), Error::Refused(error)) => assert_eq!(*error, expected),
        (Err(_), Error::BadReply(message)) => assert!(message.contains(&header.status.to_string()), "{message}"),
        (expected, _) => panic!("{expected:?} was read as {found:?}"),
    }
}

/// The records of section `number`, when all of them lie within the bytes.
fn section<'a>(header: &ReportHeader, bytes: &'a [u8], number: usize, record: usize) -> Option<&'a [u8]> {
    let Section { first_word, count } = header.sections[number];
    let first = 8 * u64::from(first_word);
    let end = first + record as u64 * u64::from(count);
    (end <= bytes.len() as u64).then(|| &bytes[first as usize..end as usize])
}

/// The pairs, when all of the report is sound.
fn pairs(header: &ReportHeader, bytes: &[u8]) -> Option<Vec<PairBytes>> {
    let records = section(header, bytes, SECTION_PAIRS, PAIR_BYTES)?;
    section(header, bytes, SECTION_POLYGON_PAIRS, POLYGON_PAIR_BYTES)?;
    let polygon_pairs = u64::from(header.sections[SECTION_POLYGON_PAIRS].count);
    let pairs: Vec<PairBytes> = records.chunks_exact(PAIR_BYTES).map(PairBytes::read).collect();
    let is_sound = |pair: &PairBytes| {
        pair.codes.iter().zip(LAST_CODES).all(|(code, last)| *code <= last) && pair.first + pair.count <= polygon_pairs
    };
    pairs.iter().all(is_sound).then_some(pairs)
}

impl PairBytes {
    fn read(record: &[u8]) -> PairBytes {
        let number = |at| u32_at(record, at);
        PairBytes {
            bodies: [number(0), number(4)],
            codes: [record[8], record[9], record[10], record[11]],
            first: number(12).into(),
            count: number(16).into(),
        }
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([0, 1, 2, 3].map(|byte| bytes[at + byte]))
}

fn records_are_right(records: Records<'_>, expected: &[PairBytes], header: &ReportHeader, bytes: &[u8]) {
    assert_eq!(records.pairs().len(), expected.len());
    let polygon_pairs = section(header, bytes, SECTION_POLYGON_PAIRS, POLYGON_PAIR_BYTES).expect("it is sound");
    for (pair, expected) in records.pairs().zip(expected) {
        let codes = [pair.verdict() as u8, pair.level() as u8, pair.relation() as u8, pair.containment() as u8];
        assert_eq!(([pair.a().0, pair.b().0], codes), (expected.bodies, expected.codes));
        let range = expected.first as usize..(expected.first + expected.count) as usize;
        let expected = range.map(|index| polygon_pair(&polygon_pairs[index * POLYGON_PAIR_BYTES..]));
        assert!(pair.polygon_pairs().eq(expected), "the polygon pairs of {pair:?}");
        read_effects(pair);
    }
}

/// All that a pair says of effects can be read, whatever it is.
fn read_effects(pair: Pair<'_>) {
    black_box((pair.distance(), pair.time_of_contact(), pair.penetration(), pair.impulses()));
    black_box((pair.bound(), pair.is_unfinished()));
    for region in pair.contacts() {
        black_box((region.points(), region.segments()));
        for area in region.areas() {
            black_box(area);
        }
    }
}

fn polygon_pair(record: &[u8]) -> PolygonPair {
    let relation = match u32_at(record, 8) {
        1 => Relation::Touch,
        2 => Relation::Coplanar,
        3 => Relation::Cross,
        _ => Relation::None,
    };
    PolygonPair { a: u32_at(record, 0), b: u32_at(record, 4), relation }
}
