//! The sections of a report, effect by effect, as words.

use bytemuck::{NoUninit, Pod};
use collided_kernel::Report;
use collided_kernel::effects::time_of_contact::{FirstContact, TimeOfContact};
use collided_protocol::effect_records::{
    BoundRecord, ContactAreaRecord, ContactPointRecord, ContactRegionRecord, ContactSegmentRecord, DistanceRecord,
    ImpulseRecord, PenetrationRecord, TIME_CONTACT, TIME_POSSIBLE, TimeRecord,
};
use collided_protocol::step::{VelocityRecord, Word};

use super::{PAIR_WORDS, POLYGON_PAIR_VALUES};

const fn words_of<T>() -> usize {
    size_of::<T>() / size_of::<Word>()
}

/// A record as words.
pub fn of<T: NoUninit, const N: usize>(record: T) -> [Word; N]
where
    [Word; N]: Pod,
{
    bytemuck::cast(record)
}

/// In the order of the sections: how many records each has, and how many words they take.
pub fn counts(report: &Report<'_>) -> [(usize, usize); 13] {
    let contacts = report.contacts();
    let records = |count: usize, words: usize| (count, count * words);
    let polygon_pairs = report.polygon_pair_count();
    [
        records(report.pairs().len(), PAIR_WORDS),
        (polygon_pairs, (polygon_pairs * POLYGON_PAIR_VALUES).div_ceil(2)),
        records(report.distances().len(), words_of::<DistanceRecord>()),
        records(report.times_of_contact().len(), words_of::<TimeRecord>()),
        records(contacts.regions().len(), words_of::<ContactRegionRecord>()),
        records(contacts.points().len(), words_of::<ContactPointRecord>()),
        records(contacts.segments().len(), words_of::<ContactSegmentRecord>()),
        records(contacts.areas().len(), words_of::<ContactAreaRecord>()),
        records(contacts.corners().len(), words_of::<[f64; 3]>()),
        records(report.penetrations().len(), words_of::<PenetrationRecord>()),
        records(report.impulses().len(), words_of::<ImpulseRecord>()),
        records(report.velocities().len(), words_of::<VelocityRecord>()),
        records(report.bounds().len(), words_of::<BoundRecord>()),
    ]
}

/// The words of all sections behind the polygon pairs.
pub fn words<'r>(report: &'r Report<'r>) -> impl Iterator<Item = Word> + 'r {
    let contacts = report.contacts();
    let points =
        contacts.points().iter().map(|point| ContactPointRecord { position: point.position, normal: point.normal });
    let segments =
        contacts.segments().iter().map(|segment| ContactSegmentRecord { ends: segment.ends, normal: segment.normal });
    let areas =
        contacts.areas().iter().map(|area| ContactAreaRecord { corners: range(&area.corners), normal: area.normal });
    distances(report)
        .flat_map(of::<_, { words_of::<DistanceRecord>() }>)
        .chain(times(report).flat_map(of::<_, { words_of::<TimeRecord>() }>))
        .chain(regions(report).flat_map(of::<_, { words_of::<ContactRegionRecord>() }>))
        .chain(points.flat_map(of::<_, { words_of::<ContactPointRecord>() }>))
        .chain(segments.flat_map(of::<_, { words_of::<ContactSegmentRecord>() }>))
        .chain(areas.flat_map(of::<_, { words_of::<ContactAreaRecord>() }>))
        .chain(contacts.corners().iter().flat_map(|&corner| of::<_, { words_of::<[f64; 3]>() }>(corner)))
        .chain(penetrations(report).flat_map(of::<_, { words_of::<PenetrationRecord>() }>))
        .chain(impulses(report).flat_map(of::<_, { words_of::<ImpulseRecord>() }>))
        .chain(velocities(report).flat_map(of::<_, { words_of::<VelocityRecord>() }>))
        .chain(bounds(report).flat_map(of::<_, { words_of::<BoundRecord>() }>))
}

fn range(range: &std::ops::Range<usize>) -> [u32; 2] {
    [range.start as u32, range.len() as u32]
}

fn distances<'r>(report: &'r Report<'r>) -> impl Iterator<Item = DistanceRecord> + 'r {
    report.distances().iter().map(|&(pair, distance)| DistanceRecord {
        pair,
        polygon_a: distance.polygon_a,
        polygon_b: distance.polygon_b,
        reserved: 0,
        value: distance.value,
        lower: distance.lower,
        on_a: distance.on_a,
        on_b: distance.on_b,
    })
}

fn times<'r>(report: &'r Report<'r>) -> impl Iterator<Item = TimeRecord> + 'r {
    report.times_of_contact().iter().map(|&(pair, FirstContact { time, at_lo: [rows_a, rows_b] })| {
        let (kind, hi, distance) = match time {
            TimeOfContact::Contact { hi, .. } => (TIME_CONTACT, hi, 0.0),
            TimeOfContact::Possible { hi, distance, .. } => (TIME_POSSIBLE, hi, distance),
            // The kernel lists no pair that is free over the whole step.
            TimeOfContact::Free => (TIME_POSSIBLE, 1.0, 0.0),
        };
        TimeRecord { pair, kind, lo: time.free_until(), hi, distance, rows_a, rows_b }
    })
}

fn regions<'r>(report: &'r Report<'r>) -> impl Iterator<Item = ContactRegionRecord> + 'r {
    let of_pair = |(pair, regions): &'r (u32, std::ops::Range<usize>)| {
        report.contacts().regions()[regions.clone()].iter().map(move |region| ContactRegionRecord {
            pair: *pair,
            reserved: 0,
            points: range(&region.points),
            segments: range(&region.segments),
            areas: range(&region.areas),
            centre: region.centre,
            normal: region.normal,
            length: region.length,
            area: region.area,
        })
    };
    report.regions().iter().flat_map(of_pair)
}

fn penetrations<'r>(report: &'r Report<'r>) -> impl Iterator<Item = PenetrationRecord> + 'r {
    report.penetrations().iter().map(|&(pair, penetration)| PenetrationRecord {
        pair,
        reserved: 0,
        translation_of_b: penetration.translation_of_b,
        depth: penetration.depth,
    })
}

fn impulses<'r>(report: &'r Report<'r>) -> impl Iterator<Item = ImpulseRecord> + 'r {
    report.impulses().iter().map(|&(pair, impulse)| ImpulseRecord {
        pair,
        reserved: 0,
        point: impulse.point,
        impulse_on_b: impulse.on_b,
    })
}

fn bounds<'r>(report: &'r Report<'r>) -> impl Iterator<Item = BoundRecord> + 'r {
    report.bounds().iter().map(|&(pair, bound)| BoundRecord {
        pair,
        orders: bound.orders,
        reserved: 0,
        apart_at_most: bound.apart_at_most,
        deep_at_most: bound.deep_at_most,
    })
}

fn velocities<'r>(report: &'r Report<'r>) -> impl Iterator<Item = VelocityRecord> + 'r {
    report.velocities().iter().map(|&(body, velocity)| VelocityRecord {
        body: body.0,
        reserved: 0,
        linear: velocity.linear,
        angular: velocity.angular,
    })
}
