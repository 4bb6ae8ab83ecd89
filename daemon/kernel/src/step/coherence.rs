//! Coherence from step to step: what a pair of bodies remembers, so that it need not be tested again.
//!
//! A pair that was tested and found clear may know a *gap*: a distance that its surfaces were proven to exceed. While the points
//! of both bodies have together come less far since then ([`Path`]), it is clear without a test. The gap comes from the
//! very test that is run anyway: containers, voxels and boxes of triangles that are nearer than a wanted *clearance* are not discarded,
//! and each pair of triangles that is found nearer lowers the clearance to a lower bound of its distance. What is left of it at the
//! end is the gap.
//!
//! A pair that interferes and is asked for nothing but the verdict remembers two triangles that proved it, its *witness*,
//! which the next test looks at first; then it searches where they are (`witness.rs`).

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::witness::Witness;
use super::{Kept, World};
use crate::path::Path;
use crate::report::Level;
use crate::workforce::Workforce;

/// The first clearance lasts for so many steps such as the last one.
const STEPS_AHEAD: f64 = 16.0;

/// Later ones for no fewer.
const FEW_STEPS: f64 = 4.0;

/// A gap that lasts for fewer is not worth its cost.
const FEWEST_STEPS: f64 = 2.0;

/// The most that the first clearance may be of the smaller body's box: bodies that move farther in a step gain nothing.
const LARGEST_SHARE: f64 = 0.125;

/// After a clearance that was found in full, so many times as much is wanted.
const GROWTH: f64 = 1.5;

/// After each failure twice as many tests are done without looking for a gap, up to so many.
const LONGEST_WAIT: u8 = 32;

/// What a pair of bodies knows from earlier steps.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Memory {
    /// The surfaces were proven farther apart than this; 0: nothing is known. World length.
    gap: f64,
    /// The clearance to look for next; 0: none was looked for yet.
    next: f64,
    /// Lengths of the paths of both bodies then.
    paths: [f64; 2],
    /// Tests to be done before a gap is looked for again, and how many they were after the last failure.
    waiting: u8,
    wait: u8,
    /// Triangles of both bodies that interfered.
    pub witness: Option<Witness>,
}

impl Memory {
    /// Whether anything is known that may spare a test.
    pub fn is_useful(&self) -> bool {
        self.gap > 0.0 || self.witness.is_some()
    }

    /// How far the points of both bodies have come since, at most.
    fn moved(&self, paths: &[Path; 2]) -> f64 {
        let since = |which: usize| (paths[which].length() - self.paths[which]).next_up();
        (since(0) + since(1)).next_up()
    }
}

/// How far apart the surfaces of a pair that is being tested are known to be, if no point in common turns up.
#[derive(Debug, Default)]
pub(crate) struct Clearance {
    /// Bits of the distance; those of positive numbers are ordered as the numbers are.
    bits: AtomicU64,
    /// What it was at first.
    wanted: f64,
    /// Less is as good as nothing.
    least: f64,
}

impl Clearance {
    pub fn now(&self) -> f64 {
        f64::from_bits(self.bits.load(Ordering::Relaxed))
    }

    /// What one thread has found; the smallest counts.
    pub fn lower(&self, to: f64) {
        self.bits.fetch_min(self.useful(to).to_bits(), Ordering::Relaxed);
    }

    /// The distance, or 0 when it is too small to be of use.
    pub fn useful(&self, distance: f64) -> f64 {
        if distance >= self.least { distance } else { 0.0 }
    }
}

/// The paths of the bodies. Each goes on when it is asked for: bodies that are near no other have none.
#[derive(Debug, Default)]
pub(super) struct Paths {
    of_bodies: Vec<Path>,
}

impl Paths {
    /// Forgets them: bodies have other indices now.
    pub fn forget(&mut self) {
        self.of_bodies.clear();
    }

    /// The paths that led to the last step, of number `last_step`, go on through the step under way.
    pub fn go_on(&mut self, world: &World<'_>, last_step: u64) {
        go_on(&mut self.of_bodies, 0, world, last_step);
    }

    /// The same by all threads.
    pub fn go_on_shared(&mut self, world: &World<'_>, last_step: u64, workforce: &dyn Workforce) {
        /// Bodies that one thread takes at a time, some microseconds of work.
        const CHUNK: usize = 64;
        let paths = &mut self.of_bodies;
        let go_on = |(chunk, paths): (usize, &mut [Path])| go_on(paths, CHUNK * chunk, world, last_step);
        workforce.share(&mut || paths.par_chunks_mut(CHUNK).enumerate().for_each(go_on));
    }

    /// The paths of a pair that have gone on through the step under way, if both have.
    fn known(&self, pair: &Kept, world: &World<'_>) -> Option<[Path; 2]> {
        let path = |body: u32| self.of_bodies.get(body as usize).filter(|path| path.step() == world.step);
        Some([*path(pair.a)?, *path(pair.b)?])
    }

    /// The paths of a pair up to the step under way, begun there if need be; `last_step` is the number of the one before.
    fn of(&mut self, pair: &Kept, world: &World<'_>, last_step: u64) -> [Path; 2] {
        if self.of_bodies.len() < world.bodies.len() {
            self.of_bodies.resize(world.bodies.len(), Path::default());
        }
        [pair.a, pair.b].map(|body| {
            let path = &mut self.of_bodies[body as usize];
            if path.step() != world.step {
                *path = followed(path, body, world, last_step);
            }
            *path
        })
    }
}

/// The paths of the bodies from `first` on.
fn go_on(paths: &mut [Path], first: usize, world: &World<'_>, last_step: u64) {
    for (at, path) in paths.iter_mut().enumerate().filter(|(_, path)| path.step() == last_step) {
        *path = followed(path, (first + at) as u32, world, last_step);
    }
}

/// A path through the step under way.
fn followed(path: &Path, body: u32, world: &World<'_>, last_step: u64) -> Path {
    if path.step() == last_step && !world.places.is_exchanged(body, world.step) {
        path.advanced(world.places.displacement(body, world.rigid, world.step), world.step)
    } else {
        Path::begin(world.step)
    }
}

/// Takes over what a pair knows from the last step, and decides it where that is enough.
pub(super) fn recall(pair: &mut Kept, last: &Kept, world: &World<'_>, paths: &Paths) {
    let Some(paths) = paths.known(pair, world) else { return };
    if !paths.iter().all(Path::leads_through) {
        return;
    }
    pair.memory = last.memory;
    let step = (paths[0].within() + paths[1].within()).next_up();
    let moved = pair.memory.moved(&paths);
    pair.apart = moved < pair.memory.gap;
    pair.free = (moved + step).next_up() < pair.memory.gap;
    let largest = largest_clearance(pair, world);
    if STEPS_AHEAD * step > largest {
        pair.memory.witness = None;
        return;
    }
    let is_exact = world.accuracy_of(pair.a, pair.b).level == Level::Polygons;
    if pair.overlapping && !pair.apart && !last.is_interfering() && is_exact {
        want(pair, step, largest);
    }
}

fn largest_clearance(pair: &Kept, world: &World<'_>) -> f64 {
    let size = |body: u32| (world.boxes[body as usize].max - world.boxes[body as usize].min).max_element();
    LARGEST_SHARE * size(pair.a).min(size(pair.b))
}

/// Has the test of a pair look for a gap, unless that has failed of late.
fn want(pair: &mut Kept, step: f64, largest: f64) {
    if pair.memory.waiting > 0 {
        pair.memory.waiting -= 1;
        return;
    }
    let next = pair.memory.next.max(FEW_STEPS * step).min(largest);
    let wanted = if pair.memory.next > 0.0 { next } else { STEPS_AHEAD * step };
    pair.clearance = Clearance { bits: AtomicU64::new(wanted.to_bits()), wanted, least: FEWEST_STEPS * step };
}

/// Notes what the test of a pair has shown.
pub(super) fn learn(pair: &mut Kept, world: &World<'_>, paths: &mut Paths, last_step: u64) {
    pair.memory.gap = 0.0;
    let paths = paths.of(pair, world, last_step);
    if pair.is_interfering() || pair.is_open() {
        return;
    }
    let memory = &mut pair.memory;
    memory.witness = None;
    if pair.clearance.wanted > 0.0 {
        memory.gap = pair.clearance.now();
        memory.paths = paths.map(|path| path.length());
        let in_full = memory.gap >= pair.clearance.wanted;
        memory.next = if in_full { GROWTH * memory.gap } else { memory.gap.max(pair.clearance.least) };
        memory.wait = if memory.gap > 0.0 { 0 } else { (2 * memory.wait).clamp(1, LONGEST_WAIT) };
        memory.waiting = memory.wait;
    }
}
