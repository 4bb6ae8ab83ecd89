//! Interference reports, read where the daemon wrote them.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use collided_protocol::WireError;
use collided_protocol::effect_records::{BoundRecord, DistanceRecord, ImpulseRecord, PenetrationRecord, TimeRecord};
use collided_protocol::report::{
    Containment, FLAG_INCOMPLETE, FLAG_RESPONSE_CAPPED, Level, PAIR_UNFINISHED, PairRecord, PolygonPairRecord,
    Relation, ReportHeader, SECTION_PAIRS, SECTION_POLYGON_PAIRS, STATUS_OK, StageCounts, StageTimes, Verdict,
};
use collided_protocol::step::{Rows, VelocityRecord, Word};

use crate::effect_results::{ContactRegion, EffectRecords, TimeOfContact};
use crate::error::Error;
use crate::scene::BodyId;
use crate::transport::StepResponse;

/// The report of one step, in shared memory. Dropping it gives the memory back; a scene may have
/// [`MAX_REPORTS_HELD`](collided_protocol::limits::MAX_REPORTS_HELD) at once.
pub struct Report {
    response: StepResponse,
    _held: Held,
}

/// Counts the reports of a scene that are held.
pub(crate) struct Held(Arc<AtomicUsize>);

impl Held {
    pub(crate) fn new(count: &Arc<AtomicUsize>) -> Held {
        count.fetch_add(1, Ordering::Relaxed);
        Held(Arc::clone(count))
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// The records of a report, where they stand in its words.
#[derive(Clone, Copy, Debug, Default)]
pub struct Records<'a> {
    pairs: &'a [PairRecord],
    polygon_pairs: &'a [PolygonPairRecord],
    effects: EffectRecords<'a>,
}

/// A pair of bodies that is not proven clear, or of which an effect has something to say.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    record: &'a PairRecord,
    polygon_pairs: &'a [PolygonPairRecord],
    /// Its place in the report.
    place: u32,
    effects: EffectRecords<'a>,
}

/// A pair of interfering polygons, by the caller's polygon numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PolygonPair {
    /// Polygon of body `a`.
    pub a: u32,
    /// Polygon of body `b`.
    pub b: u32,
    /// How they meet; [`Relation::None`] for a code that this version does not know.
    pub relation: Relation,
}

impl fmt::Debug for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Report").field("header", self.header()).finish_non_exhaustive()
    }
}

impl Report {
    /// Takes over a response: an error of the daemon becomes an error, and what the accessors rely on is checked.
    pub(crate) fn new(response: StepResponse, held: Held) -> Result<Report, Error> {
        let report = Report { response, _held: held };
        decode(report.header(), report.words())?;
        Ok(report)
    }

    fn header(&self) -> &ReportHeader {
        self.response.user_header()
    }

    fn words(&self) -> &[Word] {
        self.response.payload()
    }

    fn records(&self) -> Records<'_> {
        Records::locate(self.header(), self.words()).unwrap_or_default()
    }

    /// The pairs that are not proven clear, and those of which an effect has something to say, ordered by (a, b); in each,
    /// a < b.
    pub fn pairs(&self) -> impl ExactSizeIterator<Item = Pair<'_>> {
        self.records().pairs()
    }

    /// The pair that first meets, or may meet, within the step; of those that may meet first, the one proven free for the
    /// shortest. Given with the effect `time_of_contact`.
    pub fn first_contact(&self) -> Option<(Pair<'_>, TimeOfContact)> {
        let times = self.pairs().filter_map(|pair| Some((pair, pair.time_of_contact()?)));
        times.min_by(|one, other| one.1.free_until().total_cmp(&other.1.free_until()))
    }

    /// Whether every pair is proven clear.
    pub fn is_clear(&self) -> bool {
        self.is_complete() && self.pairs().all(|pair| pair.verdict() == Verdict::Clear)
    }

    /// Whether the budget was enough to find the pairs that matter; if not, every pair that is not listed is open too.
    pub fn is_complete(&self) -> bool {
        self.header().flags & FLAG_INCOMPLETE == 0
    }

    /// How many polygon pairs there are, over all pairs.
    pub fn polygon_pair_count(&self) -> usize {
        self.records().polygon_pairs.len()
    }

    /// The velocities, after the impulses of this step, of the bodies with mass that one has reached; ascending by id. Given with
    /// the effect `response`.
    pub fn velocities(&self) -> &[VelocityRecord] {
        self.records().effects.velocities
    }

    /// A body whose inertia, where it stands, is not positive definite (it is flattened, say): there is no response then.
    pub fn response_fault(&self) -> Option<BodyId> {
        self.header().response_fault.checked_sub(1).map(BodyId)
    }

    /// Whether a cap on impacts or iterations ended the response of this step early: momentum is conserved all the same, but bodies
    /// may still approach, or slide where they should stick.
    pub fn response_was_capped(&self) -> bool {
        self.header().flags & FLAG_RESPONSE_CAPPED != 0
    }

    /// A body that this step was the first to place, though a pair of it asks for the effect `time_of_contact`: without an earlier
    /// step it has no motion, and counts as still. The lowest id of several. All else that was asked for is answered.
    pub fn time_fault(&self) -> Option<BodyId> {
        self.header().time_fault.checked_sub(1).map(BodyId)
    }

    /// How many steps the scene had answered before this one.
    pub fn step(&self) -> u64 {
        self.header().step
    }

    /// How many things each stage looked at.
    pub fn counts(&self) -> &StageCounts {
        &self.header().counts
    }

    /// How long each stage took, in nanoseconds.
    pub fn times(&self) -> &StageTimes {
        &self.header().times
    }

    /// The result section: the same bytes for the same input, whatever the thread count and the order.
    pub fn result_bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self.words())
    }
}

impl<'a> Pair<'a> {
    /// The first body.
    pub fn a(&self) -> BodyId {
        BodyId(self.record.a)
    }

    /// The second body.
    pub fn b(&self) -> BodyId {
        BodyId(self.record.b)
    }

    /// What is known of the pair.
    pub fn verdict(&self) -> Verdict {
        Verdict::from_code(self.record.verdict).unwrap_or(Verdict::Possible)
    }

    /// How far that was refined.
    pub fn level(&self) -> Level {
        Level::from_code(self.record.level).unwrap_or(Level::GlobalBoxes)
    }

    /// Whether the budget was used up before all was done that the pair asks for: effects that are missing were not computed.
    pub fn is_unfinished(&self) -> bool {
        self.record.flags & PAIR_UNFINISHED != 0
    }

    /// How far apart, or how deep in each other, the bodies can still be; given when the verdict is possible.
    pub fn bound(&self) -> Option<&'a BoundRecord> {
        of_pair(self.effects.bounds, self.place, |record| record.pair).first()
    }

    /// How the bodies meet; given with the effect `polygon_pairs`.
    pub fn relation(&self) -> Relation {
        Relation::from_code(self.record.relation).unwrap_or(Relation::None)
    }

    /// Which body is inside the other; given with the effect `containment`.
    pub fn containment(&self) -> Containment {
        Containment::from_code(self.record.containment).unwrap_or(Containment::None)
    }

    /// The interfering polygon pairs, ordered by (a, b); empty unless the effect `polygon_pairs` was asked for.
    pub fn polygon_pairs(&self) -> impl ExactSizeIterator<Item = PolygonPair> + use<'a> {
        self.polygon_pairs.iter().map(|record| PolygonPair {
            a: record.a,
            b: record.b,
            relation: relation(record.relation).unwrap_or(Relation::None),
        })
    }
}

impl<'a> Pair<'a> {
    /// The minimum distance. `None`: beyond the limit, or the pair does not ask for the effect `distance`.
    pub fn distance(&self) -> Option<&'a DistanceRecord> {
        of_pair(self.effects.distances, self.place, |record| record.pair).first()
    }

    /// When the bodies first meet within the step. `None`: not at all, proven, or the pair does not ask for the effect
    /// `time_of_contact`.
    pub fn time_of_contact(&self) -> Option<TimeOfContact> {
        self.time_record().map(TimeOfContact::from)
    }

    /// Where the two bodies are at [`TimeOfContact::free_until`], so that a step may go on from there. `None` as for
    /// [`time_of_contact`](Self::time_of_contact).
    pub fn at_contact(&self) -> Option<[&'a Rows; 2]> {
        self.time_record().map(|record| [&record.rows_a, &record.rows_b])
    }

    fn time_record(&self) -> Option<&'a TimeRecord> {
        of_pair(self.effects.times, self.place, |record| record.pair).first()
    }

    /// Where the bodies meet; given with the effect `contacts`.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = ContactRegion<'a>> + use<'a> {
        let effects = self.effects;
        let regions = of_pair(effects.regions, self.place, |record| record.pair);
        regions.iter().map(move |record| ContactRegion::new(record, &effects))
    }

    /// A translation that takes the bodies apart; given with the effect `penetration`.
    pub fn penetration(&self) -> Option<&'a PenetrationRecord> {
        of_pair(self.effects.penetrations, self.place, |record| record.pair).first()
    }

    /// Impulses at the contacts; given with the effect `response`.
    pub fn impulses(&self) -> &'a [ImpulseRecord] {
        of_pair(self.effects.impulses, self.place, |record| record.pair)
    }
}

/// The records of a pair; records come in the order of pairs.
fn of_pair<T>(records: &[T], place: u32, pair: impl Fn(&T) -> u32) -> &[T] {
    let first = records.partition_point(|record| pair(record) < place);
    let count = records[first..].partition_point(|record| pair(record) == place);
    &records[first..first + count]
}

fn relation(code: u32) -> Option<Relation> {
    u8::try_from(code).ok().and_then(Relation::from_code)
}

/// Takes the words of a report as records, and checks what reading them relies on.
///
/// # Errors
/// [`Error::Refused`] with the daemon's error; [`Error::BadReply`] when the words are not what the header says.
pub fn decode<'a>(header: &ReportHeader, words: &'a [Word]) -> Result<Records<'a>, Error> {
    if header.status != STATUS_OK {
        return Err(refusal(header, words));
    }
    let records = Records::locate(header, words)?;
    records.pairs.iter().try_for_each(|pair| check_pair(pair, records.polygon_pairs.len()))?;
    records.effects.check()?;
    Ok(records)
}

impl<'a> Records<'a> {
    /// The records where the header says, which may say anything yet.
    fn locate(header: &ReportHeader, words: &'a [Word]) -> Result<Records<'a>, Error> {
        let pairs = section(header, words, SECTION_PAIRS)?;
        let polygon_pairs = section(header, words, SECTION_POLYGON_PAIRS)?;
        Ok(Records { pairs, polygon_pairs, effects: EffectRecords::locate(header, words)? })
    }

    /// As [`Report::pairs`].
    pub fn pairs(self) -> impl ExactSizeIterator<Item = Pair<'a>> {
        self.pairs.iter().enumerate().map(move |(place, record)| {
            let first = record.first_polygon_pair as usize;
            let polygon_pairs = &self.polygon_pairs[first..first + record.polygon_pair_count as usize];
            Pair { record, polygon_pairs, place: place as u32, effects: self.effects }
        })
    }
}

/// The records of a section, where they stand.
pub(crate) fn section<'a, T: bytemuck::Pod>(
    header: &ReportHeader,
    words: &'a [Word],
    number: usize,
) -> Result<&'a [T], Error> {
    let section = header.sections[number];
    if section.count == 0 && section.first_word as usize <= words.len() {
        return Ok(&[]);
    }
    let bytes: &[u8] = bytemuck::cast_slice(words);
    let first = section.first_word as usize * size_of::<Word>();
    let length = section.count as usize * size_of::<T>();
    let records = bytes.get(first..).and_then(|rest| rest.get(..length));
    let records = records.and_then(|records| bytemuck::try_cast_slice(records).ok());
    records.ok_or_else(|| Error::BadReply(format!("section {number} lies outside the report")))
}

fn check_pair(pair: &PairRecord, polygon_pair_count: usize) -> Result<(), Error> {
    let end = pair.first_polygon_pair as usize + pair.polygon_pair_count as usize;
    let codes = Verdict::from_code(pair.verdict).is_some()
        && Level::from_code(pair.level).is_some()
        && Relation::from_code(pair.relation).is_some()
        && Containment::from_code(pair.containment).is_some();
    if end > polygon_pair_count || !codes {
        return Err(Error::BadReply(format!("the record of bodies {} and {} is malformed", pair.a, pair.b)));
    }
    Ok(())
}

pub(crate) fn refusal(header: &ReportHeader, words: &[Word]) -> Error {
    let bytes: &[u8] = bytemuck::cast_slice(words);
    let json = bytes.get(..header.error_bytes as usize).unwrap_or(bytes);
    match serde_json::from_slice::<WireError>(json) {
        Ok(error) => Error::Refused(error),
        Err(error) => Error::BadReply(format!("the error of a step, code {}: {error}", header.status)),
    }
}
