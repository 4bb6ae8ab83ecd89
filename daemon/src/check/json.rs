//! One JSON object a line, a line a step.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use collided_client::{
    BodyId, BoundRecord, ContactRegion, Containment, DistanceRecord, ImpulseRecord, Rows, StageCounts, TimeOfContact,
    VelocityRecord,
};
use collided_protocol::Effect;
use serde::Serialize;

use super::output::{Output, Pair, StepResult};
use crate::scene_file::SceneFile;

/// Prints to `writer`.
pub(super) struct Json<W> {
    writer: W,
}

impl<W: Write> Json<W> {
    pub fn new(writer: W) -> Json<W> {
        Json { writer }
    }
}

impl<W: Write> Output for Json<W> {
    fn begin(&mut self, _: &Path, _: &SceneFile) -> io::Result<()> {
        Ok(())
    }

    fn step(&mut self, result: &StepResult<'_>) -> io::Result<()> {
        let line = StepLine {
            scene: result.path.to_string_lossy().into_owned(),
            step: result.index,
            pairs: result.pairs().map(PairLine::from).collect(),
            incomplete: !result.report.is_complete(),
            velocities: velocities(result),
            response_fault: result.report.response_fault().map(|body| result.name(body)),
            response_capped: result.report.response_was_capped(),
            time_fault: result.time_fault(),
            stages: *result.report.counts(),
        };
        let mut text = serde_json::to_vec(&line)?;
        text.push(b'\n');
        self.writer.write_all(&text)?;
        self.writer.flush()
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[derive(Serialize)]
struct StepLine<'a> {
    scene: String,
    step: usize,
    pairs: Vec<PairLine<'a>>,
    /// The budget was used up before all pairs were found: those that are not listed are open too.
    #[serde(skip_serializing_if = "is_false")]
    incomplete: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    velocities: Option<BTreeMap<&'a str, VelocityValue>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    response_fault: Option<&'a str>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    response_capped: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_fault: Option<&'a str>,
    #[serde(with = "Stages")]
    stages: StageCounts,
}

/// A pair; what was not asked for is left out.
#[derive(Serialize)]
struct PairLine<'a> {
    a: &'a str,
    b: &'a str,
    verdict: &'static str,
    level: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    bound: Option<BoundValue>,
    #[serde(skip_serializing_if = "is_false")]
    unfinished: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    relation: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polygon_pairs: Option<Vec<(u32, u32, &'static str)>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<RegionValue>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    distance: Option<DistanceValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    penetration: Option<PenetrationValue>,
    #[serde(skip_serializing_if = "Option::is_none")]
    containment: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    containment_reason: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_of_contact: Option<[f64; 2]>,
    /// Of a contact that is not confirmed: how near the bodies come.
    #[serde(skip_serializing_if = "Option::is_none")]
    time_of_contact_possible: Option<DistanceLeft>,
    /// Where the bodies are at the start of the bracket.
    #[serde(skip_serializing_if = "Option::is_none")]
    at_contact: Option<PlacesOfPair>,
    #[serde(skip_serializing_if = "Option::is_none")]
    response: Option<Vec<ImpulseValue>>,
}

/// How far apart, or how deep in each other, a pair left possible can be.
#[derive(Serialize)]
struct BoundValue {
    orders: [u32; 2],
    apart_at_most: f64,
    deep_at_most: f64,
}

impl From<&BoundRecord> for BoundValue {
    fn from(&BoundRecord { orders, apart_at_most, deep_at_most, .. }: &BoundRecord) -> Self {
        BoundValue { orders, apart_at_most, deep_at_most }
    }
}

#[derive(Serialize)]
struct RegionValue {
    points: Vec<[f64; 3]>,
    segments: Vec<[[f64; 3]; 2]>,
    areas: Vec<Vec<[f64; 3]>>,
    centre: [f64; 3],
    normal: [f64; 3],
    length: f64,
    area: f64,
}

#[derive(Serialize)]
struct DistanceValue {
    value: f64,
    lower: f64,
    on_a: [f64; 3],
    on_b: [f64; 3],
    polygon_a: u32,
    polygon_b: u32,
}

#[derive(Serialize)]
struct PenetrationValue {
    translation_of_b: [f64; 3],
    depth: f64,
}

#[derive(Serialize)]
struct DistanceLeft {
    distance_left: f64,
}

#[derive(Serialize)]
struct PlacesOfPair {
    a: Rows,
    b: Rows,
}

#[derive(Serialize)]
struct ImpulseValue {
    point: [f64; 3],
    impulse_on_b: [f64; 3],
}

#[derive(Serialize)]
struct VelocityValue {
    linear: [f64; 3],
    angular: [f64; 3],
}

impl<'a> From<Pair<'a>> for PairLine<'a> {
    fn from(Pair { a, b, effects, found }: Pair<'a>) -> Self {
        let asked = |effect: Effect| effects.contains(effect);
        let polygon_pairs = || found.polygon_pairs().map(|pair| (pair.a, pair.b, pair.relation.name())).collect();
        let containment = asked(Effect::Containment).then(|| found.containment());
        let time = found.time_of_contact();
        PairLine {
            a,
            b,
            verdict: found.verdict().name(),
            level: found.level().name(),
            bound: found.bound().map(BoundValue::from),
            unfinished: found.is_unfinished(),
            relation: asked(Effect::PolygonPairs).then(|| found.relation().name()),
            polygon_pairs: asked(Effect::PolygonPairs).then(polygon_pairs),
            contacts: asked(Effect::Contacts).then(|| found.contacts().map(RegionValue::from).collect()),
            distance: found.distance().map(DistanceValue::from),
            penetration: found.penetration().map(|penetration| PenetrationValue {
                translation_of_b: penetration.translation_of_b,
                depth: penetration.depth,
            }),
            containment: containment.map(Containment::name),
            containment_reason: containment.and_then(Containment::reason),
            time_of_contact: time.map(|time| [time.free_until(), time.at_the_latest()]),
            time_of_contact_possible: time.and_then(|time| match time {
                TimeOfContact::Contact { .. } => None,
                TimeOfContact::Possible { distance, .. } => Some(DistanceLeft { distance_left: distance }),
            }),
            at_contact: found.at_contact().map(|[a, b]| PlacesOfPair { a: *a, b: *b }),
            response: asked(Effect::Response).then(|| found.impulses().iter().map(ImpulseValue::from).collect()),
        }
    }
}

impl From<ContactRegion<'_>> for RegionValue {
    fn from(region: ContactRegion<'_>) -> Self {
        RegionValue {
            points: region.points().iter().map(|point| point.position).collect(),
            segments: region.segments().iter().map(|segment| segment.ends).collect(),
            areas: region.areas().map(|(corners, _)| corners.to_vec()).collect(),
            centre: region.centre(),
            normal: region.normal(),
            length: region.length(),
            area: region.area(),
        }
    }
}

impl From<&DistanceRecord> for DistanceValue {
    fn from(&DistanceRecord { value, lower, on_a, on_b, polygon_a, polygon_b, .. }: &DistanceRecord) -> Self {
        DistanceValue { value, lower, on_a, on_b, polygon_a, polygon_b }
    }
}

impl From<&ImpulseRecord> for ImpulseValue {
    fn from(&ImpulseRecord { point, impulse_on_b, .. }: &ImpulseRecord) -> Self {
        ImpulseValue { point, impulse_on_b }
    }
}

fn is_false(value: &bool) -> bool {
    !value
}

fn velocities<'a>(result: &StepResult<'a>) -> Option<BTreeMap<&'a str, VelocityValue>> {
    let value = |&VelocityRecord { body, linear, angular, .. }: &VelocityRecord| {
        (result.name(BodyId(body)), VelocityValue { linear, angular })
    };
    result.effects.any(Effect::Response).then(|| result.report.velocities().iter().map(value).collect())
}

/// The names of the stage counts.
#[derive(Serialize)]
#[serde(remote = "StageCounts")]
struct Stages {
    boxes: u64,
    broad_pairs: u64,
    interest_pairs: u64,
    container_pairs: u64,
    voxels_visited: u64,
    voxel_pairs: u64,
    polygon_candidates: u64,
    exact_tests: u64,
    containment_tests: u64,
    distance_searches: u64,
    contact_pairs: u64,
    penetration_searches: u64,
    time_searches: u64,
    response_points: u64,
    interfering_pairs: u64,
    polygon_pairs: u64,
}
