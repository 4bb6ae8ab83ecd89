//! A kernel report, written once into the shared memory that the client reads.

mod effect_words;

use std::iter;

use collided_client::transport::{self, StepActive};
use collided_kernel as kernel;
use collided_protocol::limits::MAX_REPORT_WORDS;
use collided_protocol::report::{
    Containment, FLAG_INCOMPLETE, FLAG_RESPONSE_CAPPED, Level, NOT_LOOKED_AT, PAIR_UNFINISHED, PairRecord, Relation,
    ReportHeader, SECTION_CANDIDATES, STATUS_OK, Section, StageCounts, StageTimes, Verdict,
};
use collided_protocol::step::Word;
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};

/// Reports up to this size are written without asking for free memory: a scene has made sure of them when it began.
pub const INITIAL_REPORT_WORDS: usize = 1024;

pub(crate) const PAIR_WORDS: usize = size_of::<PairRecord>() / size_of::<Word>();
/// 32-bit values of a [`collided_protocol::report::PolygonPairRecord`].
pub(crate) const POLYGON_PAIR_VALUES: usize = 3;

/// The header of a report without times, counts and sections.
pub fn header(sequence: u64, step: u64) -> ReportHeader {
    ReportHeader { protocol: PROTOCOL_VERSION, status: STATUS_OK, sequence, step, part_count: 1, ..Default::default() }
}

/// Writes and sends a report. `finish` is called when the payload is written, to complete the header's times.
///
/// # Errors
/// [`ErrorCode::LimitExceeded`], [`ErrorCode::OutOfMemory`]: nothing was sent then.
pub fn send_report(
    active: &StepActive,
    mut header: ReportHeader,
    report: &kernel::Report<'_>,
    finish: impl FnOnce(&mut StageTimes),
) -> Result<(), WireError> {
    let words = place_sections(&mut header, &effect_words::counts(report));
    check_size(words)?;
    header.counts = stage_counts(report.counts());
    header.times = stage_times(report.times());
    header.response_fault = fault(report.response_fault());
    header.time_fault = fault(report.time_fault());
    let flag = |is_set: bool, flag: u32| if is_set { flag } else { 0 };
    header.flags =
        flag(report.response_was_capped(), FLAG_RESPONSE_CAPPED) | flag(!report.is_complete(), FLAG_INCOMPLETE);
    let pairs = pair_records(report).flat_map(effect_words::of::<_, PAIR_WORDS>).chain(polygon_pair_words(report));
    send(active, header, words, pairs.chain(effect_words::words(report)), finish)
}

/// Sends so many words; zeros follow the content.
fn send(
    active: &StepActive,
    mut header: ReportHeader,
    words: usize,
    content: impl Iterator<Item = Word>,
    finish: impl FnOnce(&mut StageTimes),
) -> Result<(), WireError> {
    let mut response = active.loan_slice_uninit(words).map_err(|error| out_of_memory(words, &error.to_string()))?;
    transport::fill(response.payload_mut(), content);
    // SAFETY: every word of the payload was written.
    let mut response = unsafe { response.assume_init() };
    finish(&mut header.times);
    *response.user_header_mut() = header;
    response.send().map_err(send_failed)
}

/// Writes and sends the verdicts of a batch; `finish` as of [`send_report`].
///
/// # Errors
/// As [`send_report`].
pub fn send_batch(
    active: &StepActive,
    mut header: ReportHeader,
    report: &kernel::BatchReport<'_>,
    finish: impl FnOnce(&mut StageTimes),
) -> Result<(), WireError> {
    let count = report.verdicts().len();
    header.sections[SECTION_CANDIDATES] = Section { first_word: 0, count: count as u32 };
    let words = count.div_ceil(size_of::<Word>());
    check_size(words)?;
    header.counts = stage_counts(&report.counts());
    header.times = stage_times(&report.times());
    let mut codes = report.verdicts().map(|found| found.map_or(NOT_LOOKED_AT, |found| verdict(found) as u8));
    let word = |_| Word::from_ne_bytes([0; size_of::<Word>()].map(|_: u8| codes.next().unwrap_or(0)));
    send(active, header, words, (0..words).map(word), finish)
}

/// A body of a header, 0 for none.
fn fault(body: Option<kernel::BodyId>) -> u32 {
    body.map_or(0, |body| body.0 + 1)
}

/// Writes into the header where the sections stand, one after the other; says how many words they take. `sections` holds, in the
/// order of their numbers, the count of records and the words of all of them.
fn place_sections(header: &mut ReportHeader, sections: &[(usize, usize)]) -> usize {
    let mut words = 0;
    for (place, &(count, section_words)) in header.sections.iter_mut().zip(sections) {
        *place = Section { first_word: words as u32, count: count as u32 };
        words += section_words;
    }
    words
}

/// Sends an error in place of a report.
///
/// # Errors
/// [`ErrorCode::OutOfMemory`], [`ErrorCode::Internal`]: the client learns only that the step was let go.
pub fn send_error(active: &StepActive, mut header: ReportHeader, error: &WireError) -> Result<(), WireError> {
    let json = serde_json::to_vec(error).unwrap_or_default();
    header.status = error.code as u32;
    header.error_bytes = json.len() as u32;
    let words = json.len().div_ceil(size_of::<Word>());
    let response = active.loan_slice_uninit(words).map_err(|error| out_of_memory(words, &error.to_string()))?;
    let mut chunks = json.chunks(size_of::<Word>());
    let mut response = response.write_from_fn(|_| chunks.next().map_or(0, word_of_bytes));
    *response.user_header_mut() = header;
    response.send().map_err(send_failed)
}

fn check_size(words: usize) -> Result<(), WireError> {
    if words > MAX_REPORT_WORDS {
        return Err(WireError::new(
            ErrorCode::LimitExceeded,
            format!("the report would have {words} words, more than the limit of {MAX_REPORT_WORDS}"),
            "ask for `interference` instead of `polygon_pairs`, or split the scene",
        ));
    }
    if words <= INITIAL_REPORT_WORDS {
        return Ok(());
    }
    transport::check_shared_memory((words * size_of::<Word>()) as u64).map_err(|short| {
        let free = short.free;
        out_of_memory(words, &format!("{} bytes are needed with the reserve and {free} are free", short.needed))
    })
}

fn out_of_memory(words: usize, cause: &str) -> WireError {
    WireError::new(
        ErrorCode::OutOfMemory,
        format!("no shared memory for a report of {words} words: {cause}"),
        "enlarge /dev/shm, or ask for less",
    )
}

fn send_failed(error: iceoryx2::port::SendError) -> WireError {
    WireError::new(ErrorCode::Internal, format!("a report could not be sent: {error}"), "send the step again")
}

fn pair_records(report: &kernel::Report<'_>) -> impl Iterator<Item = PairRecord> {
    let mut first_polygon_pair = 0;
    report.pairs().iter().map(move |pair| {
        let polygon_pair_count = report.polygon_pairs(pair).len() as u32;
        let record = PairRecord {
            a: pair.a.0,
            b: pair.b.0,
            verdict: verdict(pair.verdict) as u8,
            level: level(pair.level) as u8,
            relation: pair.relation.map_or(Relation::None, relation) as u8,
            containment: pair.containment.map_or(Containment::None, containment) as u8,
            first_polygon_pair,
            polygon_pair_count,
            flags: if pair.unfinished { PAIR_UNFINISHED } else { 0 },
        };
        first_polygon_pair += polygon_pair_count;
        record
    })
}

fn polygon_pair_words(report: &kernel::Report<'_>) -> impl Iterator<Item = Word> {
    let records = report.pairs().iter().flat_map(|pair| report.polygon_pairs(pair));
    let mut values = records.flat_map(|pair| [pair.a, pair.b, relation(pair.relation) as u32]);
    iter::from_fn(move || Some(bytemuck::cast([values.next()?, values.next().unwrap_or(0)])))
}

fn word_of_bytes(bytes: &[u8]) -> Word {
    let mut word = [0; size_of::<Word>()];
    word[..bytes.len()].copy_from_slice(bytes);
    Word::from_ne_bytes(word)
}

fn verdict(verdict: kernel::Verdict) -> Verdict {
    match verdict {
        kernel::Verdict::Clear => Verdict::Clear,
        kernel::Verdict::Interfering => Verdict::Interfering,
        kernel::Verdict::Possible => Verdict::Possible,
    }
}

fn level(level: kernel::Level) -> Level {
    match level {
        kernel::Level::GlobalBoxes => Level::GlobalBoxes,
        kernel::Level::Containers => Level::Containers,
        kernel::Level::Voxels => Level::Voxels,
        kernel::Level::Polygons => Level::Polygons,
    }
}

fn relation(relation: kernel::Relation) -> Relation {
    match relation {
        kernel::Relation::Touch => Relation::Touch,
        kernel::Relation::Coplanar => Relation::Coplanar,
        kernel::Relation::Cross => Relation::Cross,
    }
}

fn containment(containment: kernel::Containment) -> Containment {
    match containment {
        kernel::Containment::None => Containment::None,
        kernel::Containment::AInB => Containment::AInB,
        kernel::Containment::BInA => Containment::BInA,
        kernel::Containment::APartlyInB => Containment::APartlyInB,
        kernel::Containment::BPartlyInA => Containment::BPartlyInA,
        kernel::Containment::UnknownAOpen => Containment::UnknownAOpen,
        kernel::Containment::UnknownBOpen => Containment::UnknownBOpen,
        kernel::Containment::UnknownAInconsistent => Containment::UnknownAInconsistent,
        kernel::Containment::UnknownBInconsistent => Containment::UnknownBInconsistent,
    }
}

fn stage_counts(counts: &kernel::StageCounts) -> StageCounts {
    StageCounts {
        boxes: counts.boxes,
        broad_pairs: counts.broad_pairs,
        interest_pairs: counts.interest_pairs,
        container_pairs: counts.container_pairs,
        voxels_visited: counts.voxels_visited,
        voxel_pairs: counts.voxel_pairs,
        polygon_candidates: counts.polygon_candidates,
        exact_tests: counts.exact_tests,
        containment_tests: counts.containment_tests,
        distance_searches: counts.distance_searches,
        contact_pairs: counts.contact_pairs,
        penetration_searches: counts.penetration_searches,
        time_searches: counts.time_searches,
        response_points: counts.response_points,
        interfering_pairs: counts.interfering_pairs,
        polygon_pairs: counts.polygon_pairs,
    }
}

fn stage_times(times: &kernel::StageTimes) -> StageTimes {
    StageTimes {
        boxes: times.boxes,
        broad_phase: times.broad_phase,
        interest: times.interest,
        voxels: times.voxels,
        polygon_pairs: times.polygon_pairs,
        polygon_tests: times.polygon_tests,
        effects: times.effects,
        report: 0,
        total: 0,
    }
}
