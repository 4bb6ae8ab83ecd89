//! A batch: candidate poses of some bodies in, a verdict for each out. No body moves.
//!
//! A planner asks this: of the poses that a robot could take, which are free? A candidate is the scene with the bodies that the batch
//! names where the candidate has them, and all others where they are. Its verdict is that of the pairs that the interest matrix keeps
//! and that have a named body in them: pairs of two other bodies are the same for every candidate, and a step says what is known of them.
//!
//! | verdict | when |
//! |---|---|
//! | interfering | some of these pairs is proven to; with `containment`, also when one body is inside the other |
//! | clear | all of them are proven clear |
//! | possible | none is proven to interfere, and some is left open by its accuracy or the budget |
//!
//! Only verdicts are computed: effects besides `containment` count as `interference`, whatever they are. A candidate ends at its first
//! proven pair.

use glam::DVec3;

use crate::affine::Rows;
use crate::global_boxes::GlobalBox;
use crate::places::Places;
use crate::report::{StageCounts, StageTimes, Verdict};
use crate::scene::{Body, BodyId};
use crate::step::Batch;
use crate::submatrix::Placed;
use crate::transforms::StepError;

/// What one batch asks. Each transform is read once, so they may stand in memory that another process can write.
#[derive(Debug, Clone, Copy)]
pub struct BatchInput<'a> {
    /// The bodies whose poses vary, each once, in any order.
    pub bodies: &'a [BodyId],
    /// Their transforms: those of the first candidate, in the order of `bodies`, then those of the second, and so on.
    pub rows: &'a [Rows],
    /// Candidates behind the first one of this verdict are not reported.
    pub stop_at: Option<Verdict>,
}

/// What a batch found: a view into the scene's memory.
#[derive(Debug, Clone, Copy)]
pub struct BatchReport<'s> {
    pub(crate) batch: &'s Batch,
    /// Boxes of bodies at rest that had to be computed first.
    pub(crate) settled: u64,
}

impl<'s> BatchReport<'s> {
    /// The verdict of each candidate; `None` behind the one at which the batch was to stop. The same whatever the number of threads.
    pub fn verdicts(&self) -> impl ExactSizeIterator<Item = Option<Verdict>> + 's {
        self.batch.verdicts()
    }

    /// How many things each stage looked at, over all candidates. Candidates that were begun before another one ended the batch count too.
    pub fn counts(&self) -> StageCounts {
        let counts = self.batch.counts();
        StageCounts { boxes: counts.boxes + self.settled, ..counts }
    }

    /// How long each stage took. Boxes of candidates are looked up within the time of voxels.
    pub fn times(&self) -> StageTimes {
        self.batch.times()
    }
}

/// The poses of a batch, copied and checked.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    /// Indices of the named bodies.
    named: Vec<u32>,
    /// Whether a body of the scene is one of them.
    is_named: Vec<bool>,
    /// Candidate after candidate, body after body.
    rows: Vec<Rows>,
    magnitudes: Vec<DVec3>,
    boxes: Vec<GlobalBox>,
}

/// A body where a candidate, or the scene, has it.
#[derive(Clone, Copy)]
pub(crate) struct Placement<'c> {
    /// Its index.
    pub body: u32,
    pub placed: Placed<'c>,
    pub bounds: &'c GlobalBox,
}

impl Candidates {
    /// Reads a batch and checks all of it.
    pub fn take(&mut self, bodies: &[Body], places: &Places, input: &BatchInput<'_>) -> Result<(), StepError> {
        self.find(bodies, input.bodies)?;
        let (expected, found) = (self.named.len(), input.rows.len());
        if expected == 0 && found > 0 || expected > 0 && !found.is_multiple_of(expected) {
            return Err(StepError::TransformCount { expected, found });
        }
        self.rows.clear();
        self.rows.extend_from_slice(input.rows);
        self.magnitudes.clear();
        self.boxes.clear();
        for (place, rows) in self.rows.iter().enumerate() {
            let at = self.named[place % expected] as usize;
            let magnitude = places
                .check_at(at, &bodies[at], rows)
                .map_err(|fault| StepError::BadCandidate { candidate: place / expected, fault: Box::new(fault) })?;
            self.magnitudes.push(magnitude);
            self.boxes.push(places.box_at(at, rows));
        }
        Ok(())
    }

    /// Finds the bodies that are named.
    fn find(&mut self, bodies: &[Body], ids: &[BodyId]) -> Result<(), StepError> {
        const WHAT: &str = "transform";
        self.named.clear();
        self.is_named.clear();
        self.is_named.resize(bodies.len(), false);
        for (position, &id) in ids.iter().enumerate() {
            let body = id.0;
            let at = bodies.binary_search_by_key(&id, |body| body.id);
            let at = at.map_err(|_| StepError::UnknownBody { what: WHAT, position, body })?;
            if std::mem::replace(&mut self.is_named[at], true) {
                return Err(StepError::BodyTwice { what: WHAT, position, body });
            }
            self.named.push(at as u32);
        }
        Ok(())
    }

    /// How many candidates there are.
    pub fn count(&self) -> usize {
        self.rows.len().checked_div(self.named.len()).unwrap_or(0)
    }

    /// How many transforms.
    pub fn transform_count(&self) -> usize {
        self.rows.len()
    }

    pub fn is_named(&self, body: u32) -> bool {
        self.is_named[body as usize]
    }

    /// The boxes of the named bodies in a candidate.
    pub fn boxes(&self, candidate: usize) -> &[GlobalBox] {
        &self.boxes[candidate * self.named.len()..][..self.named.len()]
    }

    /// The named bodies where a candidate has them.
    pub fn placements<'c>(
        &'c self,
        candidate: usize,
        bodies: &'c [Body],
    ) -> impl ExactSizeIterator<Item = Placement<'c>> {
        (0..self.named.len()).map(move |place| self.placement(candidate, place, bodies))
    }

    /// The `place`-th of them.
    pub fn placement<'c>(&'c self, candidate: usize, place: usize, bodies: &'c [Body]) -> Placement<'c> {
        let (body, at) = (self.named[place], candidate * self.named.len() + place);
        let object = &*bodies[body as usize].object;
        let placed = Placed { object, rows: &self.rows[at], magnitude: self.magnitudes[at] };
        Placement { body, placed, bounds: &self.boxes[at] }
    }
}
