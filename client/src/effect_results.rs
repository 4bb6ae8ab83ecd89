//! What the effects of a report say, read where the daemon wrote them.

use bytemuck::Pod;
use collided_protocol::effect_records::{
    BoundRecord, ContactAreaRecord, ContactPointRecord, ContactRegionRecord, ContactSegmentRecord, DistanceRecord,
    ImpulseRecord, PenetrationRecord, SECTION_AREA_CORNERS, SECTION_BOUNDS, SECTION_CONTACT_AREAS,
    SECTION_CONTACT_POINTS, SECTION_CONTACT_REGIONS, SECTION_CONTACT_SEGMENTS, SECTION_DISTANCES, SECTION_IMPULSES,
    SECTION_PENETRATIONS, SECTION_TIMES_OF_CONTACT, SECTION_VELOCITIES, TIME_CONTACT, TIME_POSSIBLE, TimeRecord,
};
use collided_protocol::report::ReportHeader;
use collided_protocol::step::{VelocityRecord, Word};

use crate::error::Error;
use crate::report::section;

/// When two bodies first meet, in shares of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeOfContact {
    /// In the bracket, which is no wider than the tolerance.
    Contact {
        /// Proven free before.
        lo: f64,
        /// Contact at this time or before it is confirmed.
        hi: f64,
    },
    /// A contact could be neither excluded nor placed within the tolerance.
    Possible {
        /// Proven free before.
        lo: f64,
        /// The last time at which the first contact may be.
        hi: f64,
        /// An upper bound of the distance between the bodies at `lo`.
        distance: f64,
    },
}

impl TimeOfContact {
    /// Up to this time the bodies are proven apart.
    pub fn free_until(self) -> f64 {
        let (TimeOfContact::Contact { lo, .. } | TimeOfContact::Possible { lo, .. }) = self;
        lo
    }

    /// The end of the bracket.
    pub fn at_the_latest(self) -> f64 {
        let (TimeOfContact::Contact { hi, .. } | TimeOfContact::Possible { hi, .. }) = self;
        hi
    }
}

impl From<&TimeRecord> for TimeOfContact {
    fn from(&TimeRecord { kind, lo, hi, distance, .. }: &TimeRecord) -> Self {
        match kind {
            TIME_CONTACT => TimeOfContact::Contact { lo, hi },
            _ => TimeOfContact::Possible { lo, hi, distance },
        }
    }
}

/// A connected part of what two bodies have in common.
#[derive(Debug, Clone, Copy)]
pub struct ContactRegion<'a> {
    record: &'a ContactRegionRecord,
    effects: EffectRecords<'a>,
}

impl<'a> ContactRegion<'a> {
    pub(crate) fn new(record: &'a ContactRegionRecord, effects: &EffectRecords<'a>) -> ContactRegion<'a> {
        ContactRegion { record, effects: *effects }
    }

    /// Its middle.
    pub fn centre(&self) -> [f64; 3] {
        self.record.centre
    }

    /// Unit normal from body `a` to body `b`; zero where none is defined.
    pub fn normal(&self) -> [f64; 3] {
        self.record.normal
    }

    /// Sum of the lengths of its segments.
    pub fn length(&self) -> f64 {
        self.record.length
    }

    /// Sum of its areas.
    pub fn area(&self) -> f64 {
        self.record.area
    }

    /// Points in which the bodies meet.
    pub fn points(&self) -> &'a [ContactPointRecord] {
        within(self.effects.points, self.record.points)
    }

    /// Segments in which they meet.
    pub fn segments(&self) -> &'a [ContactSegmentRecord] {
        within(self.effects.segments, self.record.segments)
    }

    /// Areas in which they lie in one plane and overlap: corners, in order around the area, and normal.
    pub fn areas(&self) -> impl ExactSizeIterator<Item = (&'a [[f64; 3]], [f64; 3])> + use<'a> {
        let corners = self.effects.corners;
        within(self.effects.areas, self.record.areas)
            .iter()
            .map(move |area| (within(corners, area.corners), area.normal))
    }
}

/// The sections of the effects.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EffectRecords<'a> {
    pub distances: &'a [DistanceRecord],
    pub times: &'a [TimeRecord],
    pub regions: &'a [ContactRegionRecord],
    points: &'a [ContactPointRecord],
    segments: &'a [ContactSegmentRecord],
    areas: &'a [ContactAreaRecord],
    corners: &'a [[f64; 3]],
    pub penetrations: &'a [PenetrationRecord],
    pub impulses: &'a [ImpulseRecord],
    pub velocities: &'a [VelocityRecord],
    pub bounds: &'a [BoundRecord],
}

impl<'a> EffectRecords<'a> {
    pub fn locate(header: &ReportHeader, words: &'a [Word]) -> Result<EffectRecords<'a>, Error> {
        Ok(EffectRecords {
            distances: section(header, words, SECTION_DISTANCES)?,
            times: section(header, words, SECTION_TIMES_OF_CONTACT)?,
            regions: section(header, words, SECTION_CONTACT_REGIONS)?,
            points: section(header, words, SECTION_CONTACT_POINTS)?,
            segments: section(header, words, SECTION_CONTACT_SEGMENTS)?,
            areas: section(header, words, SECTION_CONTACT_AREAS)?,
            corners: section(header, words, SECTION_AREA_CORNERS)?,
            penetrations: section(header, words, SECTION_PENETRATIONS)?,
            impulses: section(header, words, SECTION_IMPULSES)?,
            velocities: section(header, words, SECTION_VELOCITIES)?,
            bounds: section(header, words, SECTION_BOUNDS)?,
        })
    }

    /// Checks what reading the records relies on.
    pub fn check(&self) -> Result<(), Error> {
        let regions = self.regions.iter().all(|region| {
            is_within(self.points, region.points)
                && is_within(self.segments, region.segments)
                && is_within(self.areas, region.areas)
        });
        let areas = self.areas.iter().all(|area| is_within(self.corners, area.corners));
        let times = self.times.iter().all(|time| matches!(time.kind, TIME_CONTACT | TIME_POSSIBLE));
        if regions && areas && times {
            return Ok(());
        }
        Err(Error::BadReply("a record of an effect is malformed".to_owned()))
    }
}

fn is_within<T: Pod>(records: &[T], [first, count]: [u32; 2]) -> bool {
    first as usize + count as usize <= records.len()
}

fn within<T: Pod>(records: &[T], [first, count]: [u32; 2]) -> &[T] {
    &records[first as usize..first as usize + count as usize]
}
