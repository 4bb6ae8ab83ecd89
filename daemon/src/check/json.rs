//! One JSON object a line, a line a step.

use std::io::{self, Write};
use std::path::Path;

use collided_client::{Containment, StageCounts};
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
    #[serde(with = "Stages")]
    stages: StageCounts,
}

#[derive(Serialize)]
struct PairLine<'a> {
    a: &'a str,
    b: &'a str,
    verdict: &'static str,
    level: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    relation: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polygon_pairs: Option<Vec<(u32, u32, &'static str)>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    containment: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    containment_reason: Option<&'static str>,
}

impl<'a> From<Pair<'a>> for PairLine<'a> {
    fn from(pair: Pair<'a>) -> Self {
        PairLine {
            a: pair.a,
            b: pair.b,
            verdict: pair.verdict.name(),
            level: pair.level.name(),
            relation: pair.polygon_pairs.as_ref().map(|polygons| polygons.relation.name()),
            containment: pair.containment.map(Containment::name),
            containment_reason: pair.containment.and_then(Containment::reason),
            polygon_pairs: pair
                .polygon_pairs
                .map(|polygons| polygons.pairs.iter().map(|pair| (pair.a, pair.b, pair.relation.name())).collect()),
        }
    }
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
    interfering_pairs: u64,
    polygon_pairs: u64,
}
