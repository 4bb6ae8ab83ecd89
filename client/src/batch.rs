//! Batches: many candidate poses in one message, a verdict for each.

use std::fmt;

use collided_protocol::report::{
    NOT_LOOKED_AT, ReportHeader, SECTION_CANDIDATES, STATUS_OK, StageCounts, StageTimes, Verdict,
};
use collided_protocol::step::{Rows, Word};
use collided_protocol::{ErrorCode, WireError};

use crate::error::Error;
use crate::report::{Held, refusal, section};
use crate::scene::BodyId;
use crate::step::words_of_ids;
use crate::transport::StepResponse;

/// Candidate poses of some bodies. See [`Scene::step_batch`](crate::Scene::step_batch).
#[derive(Debug, Clone, Copy, Default)]
pub struct Batch<'a> {
    /// The bodies whose poses vary, each once, in any order.
    pub bodies: &'a [BodyId],
    /// Their transforms: those of the first candidate, in the order of `bodies`, then those of the second, and so on.
    pub candidates: &'a [Rows],
    /// Candidates behind the first one of this verdict are not looked at, and have none.
    pub stop_at: Option<Verdict>,
}

impl Batch<'_> {
    /// How many candidates there are.
    ///
    /// # Errors
    /// [`Error::Refused`] when the transforms do not come out even.
    pub(crate) fn count(&self) -> Result<usize, Error> {
        let (bodies, transforms) = (self.bodies.len(), self.candidates.len());
        match transforms.checked_div(bodies) {
            Some(count) if transforms.is_multiple_of(bodies) => Ok(count),
            _ => Err(Error::Refused(WireError::new(
                ErrorCode::BadStep,
                format!("the batch has {transforms} transforms for candidates of {bodies} bodies"),
                "name at least one body, and give as many transforms for each candidate as bodies",
            ))),
        }
    }

    /// The words of the payload.
    pub(crate) fn words(&self) -> impl Iterator<Item = Word> {
        let transforms: &[Word] = bytemuck::cast_slice(self.candidates);
        words_of_ids(self.bodies, |body| *body).chain(transforms.iter().copied())
    }
}

/// The verdicts of a batch, in shared memory. Dropping it gives the memory back; it counts as one of the
/// [`MAX_REPORTS_HELD`](collided_protocol::limits::MAX_REPORTS_HELD) reports of its scene.
pub struct BatchReport {
    response: StepResponse,
    _held: Held,
}

impl fmt::Debug for BatchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BatchReport").field("header", self.header()).finish_non_exhaustive()
    }
}

impl BatchReport {
    /// Takes over a response: an error of the daemon becomes an error, and what the accessors rely on is checked.
    pub(crate) fn new(response: StepResponse, held: Held, count: usize) -> Result<BatchReport, Error> {
        let codes = decode(response.user_header(), response.payload())?;
        if codes.len() != count {
            return Err(Error::BadReply(format!("{} verdicts came for {count} candidates", codes.len())));
        }
        Ok(BatchReport { response, _held: held })
    }

    fn header(&self) -> &ReportHeader {
        self.response.user_header()
    }

    fn codes(&self) -> &[u8] {
        section(self.header(), self.response.payload(), SECTION_CANDIDATES).unwrap_or_default()
    }

    /// What is known of each candidate, in the order in which they were given; `None` behind the one at which the batch stopped. The
    /// same whatever the number of threads.
    pub fn verdicts(&self) -> impl ExactSizeIterator<Item = Option<Verdict>> {
        self.codes().iter().map(|&code| Verdict::from_code(code))
    }

    /// Number of the first candidate that is proven clear.
    pub fn first_clear(&self) -> Option<usize> {
        self.first(Verdict::Clear)
    }

    /// Number of the first candidate that is proven to interfere.
    pub fn first_interfering(&self) -> Option<usize> {
        self.first(Verdict::Interfering)
    }

    fn first(&self, verdict: Verdict) -> Option<usize> {
        self.verdicts().position(|found| found == Some(verdict))
    }

    /// How many things each stage looked at, over all candidates.
    pub fn counts(&self) -> &StageCounts {
        &self.header().counts
    }

    /// How long each stage took, in nanoseconds.
    pub fn times(&self) -> &StageTimes {
        &self.header().times
    }
}

/// The codes of an answer to a batch, each of which is a verdict or says that there is none.
fn decode<'a>(header: &ReportHeader, words: &'a [Word]) -> Result<&'a [u8], Error> {
    if header.status != STATUS_OK {
        return Err(refusal(header, words));
    }
    let codes: &[u8] = section(header, words, SECTION_CANDIDATES)?;
    let is_known = |code: &u8| *code == NOT_LOOKED_AT || Verdict::from_code(*code).is_some();
    match codes.iter().position(|code| !is_known(code)) {
        Some(candidate) => Err(Error::BadReply(format!("candidate {candidate} has verdict {}", codes[candidate]))),
        None => Ok(codes),
    }
}

#[cfg(test)]
mod tests {
    use collided_protocol::report::Section;

    use super::*;

    #[test]
    fn candidates_are_written_behind_the_ids() {
        let rows = [1.0, 2.0].map(|value| [[value; 4]; 3]);
        let batch = Batch { bodies: &[BodyId(7)], candidates: &rows, stop_at: None };
        let words: Vec<Word> = batch.words().collect();
        assert_eq!((batch.count().unwrap(), words.len(), words[0]), (2, 25, 7));
        assert_eq!([1, 12, 13, 24].map(|word| f64::from_bits(words[word])), [1.0, 1.0, 2.0, 2.0]);
        for bodies in [&[][..], &[BodyId(0), BodyId(1), BodyId(2)]] {
            let error = Batch { bodies, ..batch }.count().expect_err("two transforms");
            assert_eq!(error.code(), Some(ErrorCode::BadStep));
        }
    }

    #[test]
    fn verdicts_that_are_none_are_refused() {
        let mut header = ReportHeader::default();
        let read =
            |header: &ReportHeader, codes: [u8; 8]| decode(header, &[Word::from_ne_bytes(codes)]).map(<[u8]>::to_vec);
        header.sections[SECTION_CANDIDATES] = Section { first_word: 0, count: 5 };
        assert_eq!(read(&header, [0, 1, 2, 255, 1, 9, 9, 9]).unwrap(), [0, 1, 2, 255, 1]);
        assert!(read(&header, [0, 1, 2, 3, 1, 0, 0, 0]).unwrap_err().to_string().contains("candidate 3"));
        header.sections[SECTION_CANDIDATES] = Section { first_word: 0, count: 9 };
        assert!(matches!(read(&header, [0; 8]), Err(Error::BadReply(_))));
    }
}
