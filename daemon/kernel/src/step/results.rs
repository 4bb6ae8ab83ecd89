//! Stage 10: what all threads have found, put together in the order of the report, so that nothing of how they shared the work
//! can be observed.

use std::ops::Range;
use std::sync::Mutex;

use super::worker::Worker;
use super::{Kept, World, get_mut, run};
use crate::effects::contacts::Contacts;
use crate::effects::containment::Containment;
use crate::effects::distance::Distance;
use crate::effects::penetration::Penetration;
use crate::effects::response::ManifoldPoint;
use crate::effects::time_of_contact::FirstContact;
use crate::effects::{Effects, Found};
use crate::open_bound;
use crate::report::{Level, OpenBound, PairResult, PolygonPair, StageCounts, Verdict};
use crate::scene::BodyId;

/// The records of a report. Those of an effect name a pair by its place in `pairs`, and come in the order of the pairs.
#[derive(Debug, Default)]
pub(crate) struct Results {
    pub pairs: Vec<PairResult>,
    pub polygon_pairs: Vec<PolygonPair>,
    pub distances: Vec<(u32, Distance)>,
    pub times: Vec<(u32, FirstContact)>,
    /// A body that counts as still because this step is the first to place it.
    pub time_fault: Option<BodyId>,
    pub penetrations: Vec<(u32, Penetration)>,
    /// Place of the pair, and its regions in `contacts`.
    pub regions: Vec<(u32, Range<usize>)>,
    pub contacts: Contacts,
    /// Of the pairs left possible.
    pub bounds: Vec<(u32, OpenBound)>,
    /// What is known of pairs where their accuracy ends, and where they were put aside for want of time.
    open: Vec<(u32, OpenBound)>,
    progress: Vec<(u32, OpenBound)>,
    /// Points for the response: place of the pair, and number within it.
    pub manifold: Vec<([u32; 2], ManifoldPoint)>,
    contained: Vec<(u32, Containment)>,
    /// Pair, the thread that has its regions (none: the last step), and which of them they are.
    sources: Vec<(u32, Option<usize>, Range<usize>)>,
    /// Number among the kept pairs of each pair of the report.
    kept: Vec<u32>,
    counts: StageCounts,
}

impl Results {
    pub fn clear(&mut self) {
        self.pairs.clear();
        self.polygon_pairs.clear();
        self.distances.clear();
        self.times.clear();
        self.penetrations.clear();
        self.regions.clear();
        self.contacts.clear();
        self.manifold.clear();
        self.bounds.clear();
        self.open.clear();
        self.progress.clear();
        self.contained.clear();
        self.sources.clear();
        self.kept.clear();
        self.counts = StageCounts::default();
    }

    /// Takes over what one thread has found.
    pub fn take(&mut self, worker: &mut Worker) {
        self.open.append(&mut worker.open);
        self.progress.append(&mut worker.progress);
        let from = &mut worker.conclusion;
        self.distances.append(&mut from.distances);
        self.times.append(&mut from.times);
        self.penetrations.append(&mut from.penetrations);
        self.manifold.append(&mut from.manifold);
        self.contained.append(&mut from.contained);
        self.counts.add(&std::mem::take(&mut from.counts));
    }

    /// Takes over what the last step has found of the pairs for which that is still true.
    pub fn recall(&mut self, kept: &[Kept], last: &Results) {
        for (pair, kept) in (0..).zip(kept).filter(|(_, kept)| kept.concluded) {
            let Some(before) = kept.unmoved else { continue };
            self.contained.extend(records_of(&last.contained, before).map(|found| (pair, found.1)));
            let Ok(place) = last.kept.binary_search(&before) else { continue };
            let place = place as u32;
            self.distances.extend(records_of(&last.distances, place).map(|found| (pair, found.1)));
            self.times.extend(records_of(&last.times, place).map(|found| (pair, found.1)));
            self.penetrations.extend(records_of(&last.penetrations, place).map(|found| (pair, found.1)));
            let first = last.manifold.partition_point(|&([of, _], _)| of < place);
            let points = last.manifold[first..].iter().take_while(|&&([of, _], _)| of == place);
            self.manifold.extend(points.map(|&([_, number], point)| ([pair, number], point)));
            self.sources.extend(records_of(&last.regions, place).map(|found| (pair, None, found.1.clone())));
        }
    }

    /// Takes over the regions that all threads have found, and those of the last step, in the order of the pairs.
    pub fn take_regions(&mut self, workers: &mut [Mutex<Worker>], last: &Results) {
        for (worker, from) in workers.iter_mut().enumerate() {
            let mut next = 0;
            for (pair, count) in get_mut(from).conclusion.regions.pairs.drain(..) {
                self.sources.push((pair, Some(worker), next..next + count));
                next += count;
            }
        }
        self.sources.sort_unstable_by_key(|&(pair, ..)| pair);
        for (pair, worker, regions) in &self.sources {
            let first = self.contacts.regions().len();
            match worker {
                Some(worker) => {
                    let found = &get_mut(&mut workers[*worker]).conclusion.regions.contacts;
                    self.contacts.append(found, regions.clone());
                }
                None => self.contacts.append(&last.contacts, regions.clone()),
            }
            self.regions.push((*pair, first..self.contacts.regions().len()));
        }
        workers.iter_mut().for_each(|worker| get_mut(worker).conclusion.regions.contacts.clear());
    }

    /// Lists the pairs that are not proven clear, and those of which an effect has something to say.
    pub fn list(&mut self, world: &World<'_>, kept: &[Kept], found: &[Found]) {
        self.order();
        self.polygon_pairs.extend(found.iter().map(PolygonPair::from));
        let mut first = [0; 6];
        for (pair, kept) in (0..).zip(kept) {
            let polygon_pairs = run(found, &mut first[0], |found| found.pair == pair);
            let contained = run(&self.contained, &mut first[1], |&(of, _)| of == pair);
            let contained = self.contained[contained].first().map(|&(_, found)| found);
            let distances = run(&self.distances, &mut first[2], |&(of, _)| of == pair);
            let times = run(&self.times, &mut first[3], |&(of, _)| of == pair);
            let ends = [
                run(&self.open, &mut first[4], |&(of, _)| of == pair),
                run(&self.progress, &mut first[5], |&(of, _)| of == pair),
            ];
            let containment = contained.unwrap_or(Containment::None);
            let is_asked = kept.effects.contains(Effects::CONTAINMENT) && kept.overlapping && kept.is_unfinished();
            let verdict = match kept.verdict() {
                _ if containment.is_proven() => Verdict::Interfering,
                // The surfaces are apart; there was no time to ask whether one is inside the other.
                Verdict::Clear if is_asked && contained.is_none() => Verdict::Possible,
                verdict => verdict,
            };
            let is_of_interest = containment != Containment::None || !distances.is_empty() || !times.is_empty();
            if verdict == Verdict::Clear && !is_of_interest && !kept.is_unfinished() {
                continue;
            }
            let mut level = world.accuracy_of(kept.a, kept.b).level;
            if verdict == Verdict::Possible {
                let bound = self.open[ends[0].clone()].first().or(self.progress[ends[1].clone()].first());
                level = if ends[0].is_empty() { bound.map_or(Level::GlobalBoxes, level_of) } else { level };
                let bound = bound.map_or_else(|| bound_of_boxes(world, kept), |&(_, bound)| bound);
                self.bounds.push((pair, bound));
            }
            self.kept.push(pair);
            self.pairs.push(PairResult {
                a: world.bodies[kept.a as usize].id,
                b: world.bodies[kept.b as usize].id,
                verdict,
                level,
                unfinished: kept.is_unfinished(),
                relation: found[polygon_pairs.clone()].iter().map(|found| found.relation).max(),
                containment: kept.effects.contains(Effects::CONTAINMENT).then_some(containment),
                polygon_pairs,
            });
        }
        self.name_places();
    }

    /// No key is there twice, so the order is the same whichever thread has found what.
    fn order(&mut self) {
        self.contained.sort_unstable_by_key(|&(pair, _)| pair);
        self.distances.sort_unstable_by_key(|&(pair, _)| pair);
        self.times.sort_unstable_by_key(|&(pair, _)| pair);
        self.penetrations.sort_unstable_by_key(|&(pair, _)| pair);
        self.manifold.sort_unstable_by_key(|&(key, _)| key);
        self.open.sort_unstable_by_key(|&(pair, _)| pair);
        self.progress.sort_unstable_by(|one, other| {
            one.0.cmp(&other.0).then(one.1.apart_at_most.total_cmp(&other.1.apart_at_most))
        });
    }

    /// Records name the places of their pairs in the report from now on.
    fn name_places(&mut self) {
        let place = |kept: &mut u32| *kept = self.kept.partition_point(|&other| other < *kept) as u32;
        self.distances.iter_mut().for_each(|(pair, _)| place(pair));
        self.times.iter_mut().for_each(|(pair, _)| place(pair));
        self.penetrations.iter_mut().for_each(|(pair, _)| place(pair));
        self.manifold.iter_mut().for_each(|([pair, _], _)| place(pair));
        self.regions.iter_mut().for_each(|(pair, _)| place(pair));
        self.bounds.iter_mut().for_each(|(pair, _)| place(pair));
    }

    /// The kept pair of a pair of the report.
    pub fn kept_pair<'k>(&self, place: u32, kept: &'k [Kept]) -> &'k Kept {
        &kept[self.kept[place as usize] as usize]
    }

    pub fn count(&self, counts: &mut StageCounts) {
        counts.add(&self.counts);
        counts.interfering_pairs = self.pairs.iter().filter(|pair| pair.verdict == Verdict::Interfering).count() as u64;
        counts.polygon_pairs = self.polygon_pairs.len() as u64;
        counts.response_points = self.manifold.len() as u64;
    }
}

/// The level of what was put aside.
fn level_of((_, bound): &(u32, OpenBound)) -> Level {
    if bound.orders == [0; 2] { Level::Containers } else { Level::Voxels }
}

fn bound_of_boxes(world: &World<'_>, kept: &Kept) -> OpenBound {
    let [a, b] = [kept.a, kept.b].map(|body| &world.boxes[body as usize]);
    open_bound::of_boxes(a, b)
}

/// The records of one pair, by its number in records that are in order.
fn records_of<T>(records: &[(u32, T)], pair: u32) -> impl Iterator<Item = &(u32, T)> {
    let first = records.partition_point(|record| record.0 < pair);
    records[first..].iter().take_while(move |record| record.0 == pair)
}
