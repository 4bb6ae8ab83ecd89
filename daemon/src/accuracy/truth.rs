//! Answers of a pass through the steps, and what they are worth beside the exact ones.

use std::collections::BTreeMap;

use collided_kernel::effects::time_of_contact::TimeOfContact;
use collided_kernel::{Report, Verdict};

use super::measurement::{Errors, Worth};
use super::statistics::quantile;

/// A step and a pair of bodies, ids as places in the file.
pub type Place = (usize, u32, u32);

/// What a pass through the steps has said.
#[derive(Debug, Clone, Default)]
pub struct Answers {
    /// Verdicts of the pairs that were listed.
    pub verdicts: BTreeMap<Place, Verdict>,
    /// Distances.
    pub distances: BTreeMap<Place, f64>,
    /// Times of contact.
    pub times: BTreeMap<Place, Met>,
    /// The largest bound of how far pairs left open are apart, where there is one.
    pub apart: Option<f64>,
    /// Steps in which a pair that is not listed may be open too.
    pub incomplete: Vec<usize>,
}

/// A bracket of a first contact, in shares of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Proven free before.
    pub lo: f64,
    /// In contact by then, or perhaps.
    pub hi: f64,
    /// Whether the contact is proven.
    pub proven: bool,
}

impl Answers {
    /// Takes what the report of a step says.
    pub fn note(&mut self, step: usize, report: &Report<'_>) {
        let pairs = report.pairs();
        let place = |pair: &u32| (step, pairs[*pair as usize].a.0, pairs[*pair as usize].b.0);
        self.verdicts.extend(pairs.iter().map(|pair| ((step, pair.a.0, pair.b.0), pair.verdict)));
        self.distances.extend(report.distances().iter().map(|(pair, found)| (place(pair), found.value)));
        self.times.extend(report.times_of_contact().iter().filter_map(|(pair, found)| match found.time {
            TimeOfContact::Free => None,
            TimeOfContact::Contact { lo, hi } => Some((place(pair), Met { lo, hi, proven: true })),
            TimeOfContact::Possible { lo, hi, .. } => Some((place(pair), Met { lo, hi, proven: false })),
        }));
        let bounds = report.bounds().iter().map(|(_, bound)| bound.apart_at_most);
        self.apart = bounds.chain(self.apart).max_by(f64::total_cmp);
        if !report.is_complete() {
            self.incomplete.push(step);
        }
    }

    /// Of verdicts, beside the exact ones about `candidates`, which are all the pairs that more than boxes must decide.
    pub fn verdicts_against(&self, exact: &Answers, candidates: &[Place]) -> Worth {
        let of = |place: &Place| match self.verdicts.get(place) {
            Some(&verdict) => verdict,
            None if self.incomplete.contains(&place.0) => Verdict::Possible,
            None => Verdict::Clear,
        };
        let truth = |place: &Place| exact.verdicts.get(place).copied().unwrap_or(Verdict::Clear);
        let open = candidates.iter().filter(|place| of(place) == Verdict::Possible).count();
        let wrong = candidates.iter().filter(|place| of(place) != Verdict::Possible && of(place) != truth(place));
        Worth {
            pairs: candidates.len() as u64,
            open: open as u64,
            wrong: wrong.count() as u64,
            apart: self.apart,
            ..Worth::default()
        }
    }

    /// Of distances, beside the tightest ones.
    pub fn distances_against(&self, exact: &Answers) -> Worth {
        let found = exact.distances.iter().filter_map(|(place, exact)| Some((self.distances.get(place)?, exact)));
        let errors: Vec<f64> = found.map(|(found, exact)| relative_error(*found, *exact)).collect();
        let (pairs, decided) = (exact.distances.len() as u64, errors.len() as u64);
        Worth { pairs, open: pairs - decided, error: Errors::of(errors), ..Worth::default() }
    }

    /// Of times of contact, beside the tightest ones. A bracket that does not meet the tightest one is wrong; errors are those
    /// of proven contacts.
    pub fn times_against(&self, exact: &Answers) -> Worth {
        let both = self.times.iter().filter_map(|(place, found)| Some((found, exact.times.get(place)?)));
        let proven = both.clone().filter(|(found, exact)| found.proven && exact.proven);
        let errors = proven.map(|(found, exact)| found.farthest_from(0.5 * (exact.lo + exact.hi))).collect();
        let disjoint = both.filter(|(found, exact)| found.hi < exact.lo || exact.hi < found.lo).count();
        let invented = self.times.iter().filter(|(place, met)| met.proven && !exact.times.contains_key(place)).count();
        let missed = exact.times.iter().filter(|(place, met)| met.proven && !self.times.contains_key(place)).count();
        let open = self.times.values().filter(|met| !met.proven).count();
        let free_now = exact.times.keys().filter(|place| !self.times.contains_key(place)).count();
        Worth {
            pairs: (self.times.len() + free_now) as u64,
            open: open as u64,
            wrong: (disjoint + invented + missed) as u64,
            error: Errors::of(errors),
            ..Worth::default()
        }
    }
}

impl Met {
    fn farthest_from(&self, time: f64) -> f64 {
        (self.lo - time).abs().max((self.hi - time).abs())
    }
}

fn relative_error(found: f64, exact: f64) -> f64 {
    if found == exact { 0.0 } else { (found - exact).abs() / exact }
}

impl Errors {
    /// `None` of no errors.
    pub fn of(mut errors: Vec<f64>) -> Option<Errors> {
        errors.sort_unstable_by(f64::total_cmp);
        Some(Errors { median: quantile(&errors, 0.5)?, largest: *errors.last()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdicts(verdicts: &[(u32, Verdict)]) -> Answers {
        let verdicts = verdicts.iter().map(|&(b, verdict)| ((0, 0, b), verdict));
        Answers { verdicts: verdicts.collect(), ..Answers::default() }
    }

    #[test]
    fn open_pairs_are_not_wrong_and_missing_ones_are_clear() {
        let exact = verdicts(&[(1, Verdict::Interfering), (2, Verdict::Interfering)]);
        let candidates = [1, 2, 3, 4].map(|b| (0, 0, b));
        let found = verdicts(&[(1, Verdict::Interfering), (3, Verdict::Possible), (4, Verdict::Interfering)]);
        let worth = found.verdicts_against(&exact, &candidates);
        assert_eq!((worth.pairs, worth.open, worth.wrong), (4, 1, 2));
        let incomplete = Answers { incomplete: vec![0], ..found };
        let worth = incomplete.verdicts_against(&exact, &candidates);
        assert_eq!((worth.open, worth.wrong), (2, 1), "pair 2 is open, pair 4 still wrong");
    }

    #[test]
    fn distances_err_by_a_share_of_themselves() {
        let distances = |values: [f64; 2]| Answers {
            distances: [((0, 0, 1), values[0]), ((0, 0, 2), values[1])].into(),
            ..Answers::default()
        };
        let worth = distances([0.0, 2.2]).distances_against(&distances([0.0, 2.0]));
        let Some(Errors { median, largest }) = worth.error else { panic!("two distances were compared") };
        assert!((largest - 0.1).abs() < 1e-12 && (median - 0.05).abs() < 1e-12);
        assert_eq!(Answers::default().distances_against(&distances([1.0, 2.0])).open, 2);
    }

    #[test]
    fn brackets_that_miss_the_exact_one_are_wrong() {
        let met = |lo: f64, hi: f64, proven: bool| Answers {
            times: [((1, 0, 1), Met { lo, hi, proven })].into(),
            ..Answers::default()
        };
        let exact = met(0.5, 0.5, true);
        let worth = met(0.25, 0.5, true).times_against(&exact);
        assert_eq!((worth.pairs, worth.open, worth.wrong), (1, 0, 0));
        assert_eq!(worth.error, Some(Errors { median: 0.25, largest: 0.25 }));
        assert_eq!(met(0.25, 0.75, false).times_against(&exact).open, 1);
        assert_eq!(met(0.6, 0.75, true).times_against(&exact).wrong, 1);
        assert_eq!(Answers::default().times_against(&exact).wrong, 1, "a contact is missed");
        assert_eq!(exact.times_against(&Answers::default()).wrong, 1, "a contact is invented");
        assert_eq!(met(0.25, 0.75, false).times_against(&Answers::default()).wrong, 0);
    }
}
