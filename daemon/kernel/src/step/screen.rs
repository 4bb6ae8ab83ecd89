//! Stages 4 and 5: the pairs that matter, without those that the first look proves apart.
//!
//! Most pairs whose boxes overlap are told apart by little: it is not worth remembering them, nor making tasks of them. What is looked
//! at here is proven again where it is not enough, and a pair that is clear at its first look is as clear as any.

use rayon::prelude::*;

use super::conclusion::BEYOND_SURFACES;
use super::unmoved::LastStep;
use super::{Clock, FAR, Kept, Limit, World};
use crate::effects::Effects;
use crate::report::Level;
use crate::submatrix::{Outline, are_apart};
use crate::workforce::Workforce;

/// Pairs looked at between two looks at the budget: a few microseconds.
const SLICE: usize = 64;

/// Pairs, or bodies, that one thread takes at a time.
const CHUNK: usize = 128;

/// Pairs before it is worth waking another thread, and that are shared out at once: less than a millisecond of work.
const LIGHT: usize = 512;
const TURN: usize = 1 << 13;

/// Memory of the stage.
#[derive(Debug, Default)]
pub(super) struct Screen {
    pairs: Vec<Asked>,
    /// Those of the last step.
    last: Vec<Asked>,
    outlines: Vec<Outline>,
    /// The step that each is of.
    steps: Vec<u64>,
}

/// A pair of bodies of which something is asked.
#[derive(Debug, Clone, Copy, Default)]
struct Asked {
    a: u32,
    b: u32,
    effects: Effects,
    overlapping: bool,
    /// Whether the first look can be spared: the last step knows more, or has had it.
    is_known: bool,
    apart: bool,
}

/// What the last step leaves of pairs, which are asked for in their order.
struct Known<'s> {
    remembered: &'s LastStep,
    looked_at: &'s [Asked],
    next: [usize; 2],
}

impl<'s> Known<'s> {
    /// Of pairs from this one on.
    fn from(pair: (u32, u32), remembered: &'s LastStep, looked_at: &'s [Asked]) -> Known<'s> {
        let next = [remembered.first_from(pair), looked_at.partition_point(|last| (last.a, last.b) < pair)];
        Known { remembered, looked_at, next }
    }

    /// Whether the first look can be spared, and whether the pair is apart, as it was then.
    fn of(&mut self, pair: (u32, u32), effects: Effects, world: &World<'_>) -> (bool, bool) {
        let [next, next_looked_at] = &mut self.next;
        if self.remembered.remembers(pair, next) {
            return (true, false);
        }
        let rests = |body: u32| self.remembered.rests(body, world);
        if !rests(pair.0) || !rests(pair.1) {
            return (false, false);
        }
        let before = self.looked_at[*next_looked_at..].iter().take_while(|last| (last.a, last.b) < pair).count();
        *next_looked_at += before;
        let last = self.looked_at.get(*next_looked_at).filter(|last| (last.a, last.b) == pair);
        last.filter(|last| last.effects == effects).map_or((false, false), |last| (true, last.apart))
    }
}

impl Screen {
    /// Forgets the last step: bodies have other indices now.
    pub fn forget(&mut self) {
        self.pairs.clear();
    }

    /// Stage 4: the pairs that matter, ordered; says how many. `farther` holds all of `overlapping`, or nothing.
    pub fn ask(
        &mut self,
        overlapping: &[(u32, u32)],
        farther: &[(u32, u32)],
        world: &World<'_>,
        last: &LastStep,
        workforce: &dyn Workforce,
    ) -> usize {
        std::mem::swap(&mut self.pairs, &mut self.last);
        let Screen { pairs, last: looked_at, .. } = self;
        pairs.clear();
        if farther.is_empty() && overlapping.len() >= LIGHT && workforce.threads() > 1 {
            pairs.resize(overlapping.len(), Asked::default());
            let ask = |(asked, pairs): (&mut [Asked], &[(u32, u32)])| {
                let mut known = Known::from(pairs[0], last, looked_at);
                asked
                    .iter_mut()
                    .zip(pairs)
                    .for_each(|(asked, &pair)| *asked = Asked::of(pair, true, world, &mut known));
            };
            workforce.share(&mut || pairs.par_chunks_mut(CHUNK).zip(overlapping.par_chunks(CHUNK)).for_each(ask));
        } else {
            let mut known = Known { remembered: last, looked_at, next: [0; 2] };
            let mut next = overlapping.iter().peekable();
            let all = if farther.is_empty() { overlapping } else { farther };
            pairs.extend(all.iter().map(|&pair| {
                let overlapping = next.next_if_eq(&&pair).is_some();
                Asked::of(pair, overlapping, world, &mut known)
            }));
        }
        pairs.retain(Asked::matters);
        pairs.len()
    }

    /// The first look of stage 5, at the pairs of which only the surfaces are asked and all of the accuracy. The others are kept.
    pub fn keep(&mut self, world: &World<'_>, limit: &Limit<'_>, clock: &dyn Clock, kept: &mut Vec<Kept>) {
        let Screen { pairs, outlines, steps, .. } = self;
        if limit.exists() {
            for slice in pairs.chunks_mut(SLICE) {
                if limit.spend(slice.len() as u64) {
                    break;
                }
                outline(slice, outlines, steps, world);
                slice.iter_mut().for_each(|pair| pair.look(world, outlines));
            }
            return kept.extend(pairs.iter().filter(|pair| !pair.apart).map(Asked::kept));
        }
        if pairs.len() < LIGHT {
            outline(pairs, outlines, steps, world);
            pairs.iter_mut().for_each(|pair| pair.look(world, outlines));
        } else {
            outline_shared(pairs, outlines, steps, world, clock);
            let look = |pair: &mut Asked| pair.look(world, outlines);
            for pairs in pairs.chunks_mut(TURN) {
                clock.share(&mut || pairs.par_chunks_mut(CHUNK).for_each(|pairs| pairs.iter_mut().for_each(look)));
            }
        }
        kept.extend(pairs.iter().filter(|pair| !pair.apart).map(Asked::kept));
    }
}

/// The outlines of the bodies of these pairs.
fn outline(pairs: &[Asked], outlines: &mut Vec<Outline>, steps: &mut Vec<u64>, world: &World<'_>) {
    make_room(outlines, steps, world);
    for body in bodies(pairs) {
        if steps[body] != world.step {
            steps[body] = world.step;
            outlines[body] = Outline::of(world.placed(body as u32));
        }
    }
}

/// The same by all threads, for pairs that are the only ones of the step.
fn outline_shared(
    pairs: &[Asked],
    outlines: &mut Vec<Outline>,
    steps: &mut Vec<u64>,
    world: &World<'_>,
    clock: &dyn Clock,
) {
    make_room(outlines, steps, world);
    bodies(pairs).for_each(|body| steps[body] = world.step);
    let outline = |(chunk, (outlines, steps)): (usize, (&mut [Outline], &[u64]))| {
        for (at, outline) in outlines.iter_mut().enumerate().filter(|&(at, _)| steps[at] == world.step) {
            *outline = Outline::of(world.placed((CHUNK * chunk + at) as u32));
        }
    };
    clock.share(&mut || outlines.par_chunks_mut(CHUNK).zip(steps.par_chunks(CHUNK)).enumerate().for_each(outline));
}

fn make_room(outlines: &mut Vec<Outline>, steps: &mut Vec<u64>, world: &World<'_>) {
    if steps.len() < world.bodies.len() {
        steps.resize(world.bodies.len(), 0);
        outlines.resize(world.bodies.len(), Outline::default());
    }
}

/// The bodies of pairs that are to be looked at.
fn bodies(pairs: &[Asked]) -> impl Iterator<Item = usize> {
    pairs.iter().filter(|pair| !pair.is_known).flat_map(|pair| [pair.a as usize, pair.b as usize])
}

impl Asked {
    fn of((a, b): (u32, u32), overlapping: bool, world: &World<'_>, known: &mut Known<'_>) -> Asked {
        let effects = world.effects_of(a, b);
        let (is_known, apart) = known.of((a, b), effects, world);
        Asked { a, b, effects, overlapping, is_known, apart }
    }

    fn matters(&self) -> bool {
        if self.overlapping { !self.effects.is_empty() } else { self.effects.meets(FAR) }
    }

    fn look(&mut self, world: &World<'_>, outlines: &[Outline]) {
        if !self.is_known {
            self.apart = self.is_apart(world, outlines);
        }
    }

    fn is_apart(&self, world: &World<'_>, outlines: &[Outline]) -> bool {
        let is_asked = self.overlapping && !self.effects.meets(BEYOND_SURFACES);
        is_asked && world.accuracy_of(self.a, self.b).level == Level::Polygons && {
            let bodies = [self.a, self.b];
            are_apart(bodies.map(|body| world.placed(body)), bodies.map(|body| &outlines[body as usize]))
        }
    }

    fn kept(&self) -> Kept {
        let &Asked { a, b, effects, overlapping, .. } = self;
        Kept { a, b, effects, overlapping, ..Kept::default() }
    }
}
