//! The first contact of two moving triangles.
//!
//! From a proven time on, the axis that separates longest gives the next (see `chords.rs`). Straight motion is one span
//! of chords; a rotation is cut into spans that shrink towards the contact, so that their deviation does. Near the end
//! of the way the contact is looked for: by the exact static test, or by an inclusion proof. Where rounding hides
//! whether there is one, the search goes around the place and leaves a doubt.

use glam::DVec3;

use super::body::MovingBody;
use super::chords::{Chords, Separated};
use super::exact::ExactTriangles;
use super::inclusion::{self, Ball, Span};
use super::nearest;
use crate::polygon_test;

/// Times closer than this are not told apart: 2^-48. A step from 0 to 1 has about as many f64.
pub(super) const RESOLUTION: f64 = f64::EPSILON * 16.0;

/// Work units of one step from axis to axis, in comparisons of voxels.
const STEP_COST: u32 = 16;

/// Work units of exact arithmetic.
const EXACT_COST: u32 = 1 << 10;

/// What may still be spent before the search gives up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Work(pub u32);

impl Work {
    /// Takes `cost`; false when there is not enough left.
    pub fn spend(&mut self, cost: u32) -> bool {
        match self.0.checked_sub(cost) {
            Some(left) => {
                self.0 = left;
                true
            }
            None => {
                self.0 = 0;
                false
            }
        }
    }
}

/// A span of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bracket {
    pub lo: f64,
    pub hi: f64,
}

/// How the search ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outcome {
    /// No contact is proven up to the end; what is doubtful has been told.
    Passed,
    /// Proven apart up to `lo`, but for doubts; contact at or before `hi` confirmed.
    Contact(Bracket),
    /// Proven apart up to here, but for doubts, and that is enough.
    Enough(f64),
    /// The work is used up.
    GivenUp,
}

/// Two triangles of two moving bodies.
pub(super) struct TrianglePair<'m> {
    pub bodies: [&'m MovingBody<'m>; 2],
    pub triangles: [u32; 2],
    /// Width of the bracket to reach.
    pub tolerance: f64,
}

impl TrianglePair<'_> {
    /// Searches from `from` to `until`, or until proven apart up to `enough`; calls `doubt` for each time in which a
    /// contact can be neither proven nor excluded.
    pub fn search(
        &self,
        from: f64,
        until: f64,
        enough: f64,
        work: &mut Work,
        mut doubt: impl FnMut(Bracket),
    ) -> Outcome {
        let straight = self.bodies.iter().all(|body| body.motion.is_straight());
        let whole = straight.then(|| self.chords(0.0, 1.0));
        let (mut now, mut span) = (from, until - from);
        loop {
            if now >= enough {
                return Outcome::Enough(now);
            }
            if !work.spend(STEP_COST) {
                return Outcome::GivenUp;
            }
            let end = if straight { until } else { (now + span).min(until) };
            let step = match &whole {
                Some(chords) => chords.separated_longest(now, end),
                None => self.in_span(now, end),
            };
            match step {
                Some(step) if step.until >= end => {
                    if end >= until {
                        return Outcome::Passed;
                    }
                    span = 4.0 * (end - now);
                    now = end;
                    continue;
                }
                Some(step) => {
                    if let Some(hi) = self.confirmed(now, &step) {
                        return Outcome::Contact(Bracket { lo: step.until, hi });
                    }
                    if step.until - now > RESOLUTION {
                        let limited_by_pad = step.until - now < 0.5 * (step.about - now);
                        span = if limited_by_pad { 0.25 * (end - now) } else { 4.0 * (step.about - step.until) };
                        span = span.max(RESOLUTION);
                        now = step.until;
                        continue;
                    }
                }
                None => {}
            }
            if !straight && end - now > RESOLUTION {
                span = 0.125 * (end - now);
                continue;
            }
            match self.around(now, until, work) {
                Around::Contact(bracket) => return Outcome::Contact(bracket),
                found @ (Around::Clear(next) | Around::Doubt(Bracket { hi: next, .. })) => {
                    if let Around::Doubt(bracket) = found {
                        doubt(bracket);
                    }
                    if next >= until {
                        return Outcome::Passed;
                    }
                    (now, span) = (next, (next - now).max(RESOLUTION));
                }
            }
        }
    }

    /// How far apart the triangles are at `t`, rounding included.
    pub fn distance_at(&self, t: f64) -> f64 {
        let [a, b] = self.placed(t);
        let bound: f64 = self.bodies.iter().map(|body| body.bound.length()).sum();
        nearest::vector_between(&a, &b).length() * (1.0 + 1e-12) + bound
    }

    /// Where the static test sees the triangles at `t`.
    fn placed(&self, t: f64) -> [[DVec3; 3]; 2] {
        [0, 1].map(|which| self.bodies[which].corners_at(self.triangles[which], t))
    }

    fn touch_at(&self, t: f64) -> bool {
        let [a, b] = self.placed(t);
        polygon_test::triangles(&a, &b).is_some()
    }

    fn chords(&self, start: f64, end: f64) -> Chords {
        let [[a0, b0], [a1, b1]] = [start, end].map(|t| self.placed(t));
        let pad = |body: &&MovingBody<'_>| body.deviation(end - start) + body.bound.length() * (1.0 + 1e-15);
        let pad = self.bodies.iter().map(pad).sum();
        Chords::new(&[a0, a1], &[b0, b1], pad)
    }

    fn in_span(&self, start: f64, end: f64) -> Option<Separated> {
        let time = |at: f64| start + at * (end - start);
        let found = self.chords(start, end).separated_longest(0.0, 1.0)?;
        let until = if found.until >= 1.0 { end } else { time(found.until) };
        Some(Separated { until, about: time(found.about) })
    }

    /// Looks for a contact soon after a step from `now` that may have ended near it; says by when there has been one.
    fn confirmed(&self, now: f64, step: &Separated) -> Option<f64> {
        let left = step.about - step.until;
        if left > 0.25 * self.tolerance {
            return None;
        }
        // From well before, when it is clear who is on which side.
        let before = now.max(step.until - 0.25 * self.tolerance);
        let times = [step.about + 0.25 * self.tolerance, step.about + left].map(|t: f64| t.min(1.0));
        let pass = times.into_iter().find(|&t| self.pass_between(before, t));
        pass.or_else(|| [step.about, times[1], times[0]].into_iter().find(|&t| self.touch_after(step.until, t)))
    }

    /// From a time at which f64 proves nothing on: a contact, or the next time at which the triangles are proven apart.
    fn around(&self, now: f64, until: f64, work: &mut Work) -> Around {
        if now == 0.0 && self.touch_at(now) {
            return Around::Contact(Bracket { lo: now, hi: now });
        }
        // From before, when it was clear who is on which side; up to now there is none.
        let (before, soon) = ((now - 0.25 * self.tolerance).max(0.0), (now + 0.25 * self.tolerance).min(1.0));
        if self.pass_between(before, soon) {
            return Around::Contact(Bracket { lo: now, hi: soon });
        }
        let exact = ExactTriangles::new(self.bodies, self.triangles);
        let apart = |next: f64| exact.as_ref().is_some_and(|exact| exact.are_apart(now, next));
        work.spend(EXACT_COST);
        if apart(until) {
            return Around::Clear(until);
        }
        if exact.as_ref().is_some_and(|exact| exact.meet(now, soon, six(&self.placed(soon)))) {
            return Around::Contact(Bracket { lo: now, hi: soon });
        }
        let mut next = now;
        let mut stride = RESOLUTION;
        loop {
            if self.touch_after(now, next) {
                return Around::Contact(Bracket { lo: now, hi: next });
            }
            if next > now && (next >= until || self.chords_at(next).separated_at(0.0)) || !work.spend(STEP_COST) {
                let proven = exact.as_ref().map_or(now, |exact| exact.apart_until(now, next));
                return if proven >= next {
                    Around::Clear(next)
                } else {
                    Around::Doubt(Bracket { lo: proven, hi: next })
                };
            }
            next = (now + stride).min(until);
            stride *= 2.0;
        }
    }

    /// Whether the static test sees a contact at `t`, and, of straight motion, not by its rounding alone.
    fn touch_after(&self, now: f64, t: f64) -> bool {
        let apart = || ExactTriangles::new(self.bodies, self.triangles).is_some_and(|exact| exact.are_apart(now, t));
        self.touch_at(t) && !apart()
    }

    /// The triangles at one time, their rounding included.
    fn chords_at(&self, t: f64) -> Chords {
        let [a, b] = self.placed(t);
        let bound: f64 = self.bodies.iter().map(|body| body.bound.length() * (1.0 + 1e-15)).sum();
        Chords::new(&[a; 2], &[b; 2], bound)
    }

    /// Whether the triangles have a point in common between two times, proven with what f64 knows.
    fn pass_between(&self, start: f64, end: f64) -> bool {
        let placed = [start, end].map(|t| self.placed(t));
        let balls = |strays: bool| {
            [0, 1].map(|at| {
                let corner = |i: usize| {
                    let body = self.bodies[i / 3];
                    let stray = if strays { body.deviation(end - start) } else { 0.0 };
                    let error = body.bound + DVec3::splat(stray * (1.0 + 1e-15));
                    let position = placed[at][i / 3][i % 3];
                    [0, 1, 2].map(|axis| Ball { value: position[axis], error: error[axis] })
                };
                [0, 1, 2, 3, 4, 5].map(corner)
            })
        };
        inclusion::proves_contact(&Span { ends: balls(false), lines: balls(true), about: six(&placed[1]) })
    }
}

/// What is found around a place where nothing is proven.
enum Around {
    Contact(Bracket),
    /// Proven apart up to here.
    Clear(f64),
    /// Proven apart again after this, or the end of the search.
    Doubt(Bracket),
}

fn six(placed: &[[DVec3; 3]; 2]) -> [DVec3; 6] {
    std::array::from_fn(|i| placed[i / 3][i % 3])
}
