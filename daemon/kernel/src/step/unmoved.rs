//! Pairs that have not moved since the last step: what was found then is true now.

use rayon::prelude::*;

use super::coherence::{self, Paths, recall};
use super::conclusion::is_needed;
use super::{Kept, Results, World, run};
use crate::effects::{Effects, Found, Touching};
use crate::workforce::Workforce;

/// Pairs that are worth another thread, and that one takes at a time.
const MANY: usize = 256;
const CHUNK: usize = 64;

/// What the last step found.
#[derive(Debug, Default)]
pub(super) struct LastStep {
    /// Its number.
    step: u64,
    kept: Vec<Kept>,
    found: Vec<Found>,
    touching: Vec<Touching>,
    /// What stage 9 found.
    pub results: Box<Results>,
    paths: Paths,
}

impl LastStep {
    /// Takes over what the last step has found, and leaves empty memory of the same size: a step has room for what any earlier one
    /// has found, whichever of the two memories it gets.
    pub fn take(
        &mut self,
        kept: &mut Vec<Kept>,
        found: &mut Vec<Found>,
        touching: &mut Vec<Touching>,
        results: &mut Box<Results>,
    ) {
        std::mem::swap(&mut self.results, results);
        exchange(&mut self.kept, kept);
        exchange(&mut self.found, found);
        exchange(&mut self.touching, touching);
    }

    /// The step under way is the last one from now on.
    pub fn end(&mut self, step: u64) {
        self.step = step;
    }

    /// Forgets everything: bodies have other indices now.
    pub fn forget(&mut self) {
        self.kept.clear();
        self.paths.forget();
    }

    /// Notes what the test of a pair has shown, for the next step.
    pub fn learn(&mut self, pair: &mut Kept, world: &World<'_>) {
        coherence::learn(pair, world, &mut self.paths, self.step);
    }

    /// Whether a body is where it was at the end of that step.
    pub fn rests(&self, body: u32, world: &World<'_>) -> bool {
        world.places.rests_since_end_of(body, self.step)
    }

    /// Where to look for a pair first, and for the pairs behind it.
    pub fn first_from(&self, pair: (u32, u32)) -> usize {
        self.kept.partition_point(|last| (last.a, last.b) < pair)
    }

    /// Whether something that may spare a test is known of a pair; `next` is where to look for it, and for the pairs behind it.
    pub fn remembers(&self, pair: (u32, u32), next: &mut usize) -> bool {
        *next += self.kept[*next..].iter().take_while(|last| (last.a, last.b) < pair).count();
        self.kept.get(*next).is_some_and(|last| (last.a, last.b) == pair && last.memory.is_useful())
    }

    /// Decides the pairs of which neither body has moved and the same is asked as then, or which have moved less than they were apart. Both
    /// lists are ordered.
    pub fn decide(&mut self, kept: &mut [Kept], world: &World<'_>, workforce: &dyn Workforce) {
        if kept.len() < MANY || workforce.threads() == 1 {
            self.paths.go_on(world, self.step);
            return self.decide_in(kept, 0, world);
        }
        self.paths.go_on_shared(world, self.step, workforce);
        let decide = |kept: &mut [Kept]| self.decide_in(kept, self.first_from((kept[0].a, kept[0].b)), world);
        workforce.share(&mut || kept.par_chunks_mut(CHUNK).for_each(decide));
    }

    /// The same for some of them, which are to be looked for from `next` on.
    fn decide_in(&self, kept: &mut [Kept], mut next: usize, world: &World<'_>) {
        let step = self.step;
        let is_unmoved = |body: u32| world.places.rests_since_end_of(body, step);
        for pair in kept {
            next += self.kept[next..].iter().take_while(|last| (last.a, last.b) < (pair.a, pair.b)).count();
            let Some(last) = self.kept.get(next).filter(|last| (last.a, last.b) == (pair.a, pair.b)) else { continue };
            pair.was_interfering = last.is_interfering();
            if last.is_open() || last.is_unfinished() {
                continue;
            }
            let same = (last.effects, last.overlapping) == (pair.effects, pair.overlapping);
            if same && is_unmoved(pair.a) && is_unmoved(pair.b) {
                pair.unmoved = Some(next as u32);
                *pair.interfering.get_mut() = last.is_interfering();
                pair.memory = last.memory;
                pair.concluded = is_concluded(pair, world, step);
            } else {
                recall(pair, last, world, &self.paths);
            }
        }
    }

    /// Appends what was found of the pairs that were so decided.
    pub fn recall(&self, kept: &[Kept], found: &mut Vec<Found>, touching: &mut Vec<Touching>) {
        let mut first = [0; 2];
        for (pair, kept) in (0..).zip(kept) {
            let Some(last) = kept.unmoved else { continue };
            first[0] += self.found[first[0]..].partition_point(|found| found.pair < last);
            first[1] += self.touching[first[1]..].partition_point(|touching| touching.pair < last);
            let polygons = run(&self.found, &mut first[0], |found| found.pair == last);
            let triangles = run(&self.touching, &mut first[1], |touching| touching.pair == last);
            found.extend(self.found[polygons].iter().map(|found| Found { pair, ..*found }));
            touching.extend(self.touching[triangles].iter().map(|touching| Touching { pair, ..*touching }));
        }
    }
}

/// Whether stage 9, too, would find of a pair unmoved since that step what it found then.
fn is_concluded(pair: &Kept, world: &World<'_>, step: u64) -> bool {
    let rests = |body: u32| world.places.rests_since_start_of(body, step);
    let has_time = pair.effects.contains(Effects::TIME_OF_CONTACT);
    is_needed(pair) && (!has_time || rests(pair.a) && rests(pair.b))
}

fn exchange<T>(last: &mut Vec<T>, current: &mut Vec<T>) {
    std::mem::swap(last, current);
    current.clear();
    current.reserve_exact(last.capacity());
}
