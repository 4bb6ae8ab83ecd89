//! Stage 10: what all threads have found, put together in the order of the report, so that nothing of how they shared the work
//! can be observed.

use std::ops::Range;
use std::sync::Mutex;

use super::conclusion::Conclusion;
use super::worker::Worker;
use super::{Kept, get_mut, run};
use crate::effects::contacts::Contacts;
use crate::effects::containment::Containment;
use crate::effects::distance::Distance;
use crate::effects::penetration::Penetration;
use crate::effects::response::ManifoldPoint;
use crate::effects::time_of_contact::TimeOfContact;
use crate::effects::{Effects, Found};
use crate::report::{Level, PairResult, PolygonPair, StageCounts, Verdict};
use crate::scene::Body;

/// The records of a report. Those of an effect name a pair by its place in `pairs`, and come in the order of the pairs.
#[derive(Debug, Default)]
pub(crate) struct Results {
    pub pairs: Vec<PairResult>,
    pub polygon_pairs: Vec<PolygonPair>,
    pub distances: Vec<(u32, Distance)>,
    pub times: Vec<(u32, TimeOfContact)>,
    pub penetrations: Vec<(u32, Penetration)>,
    /// Place of the pair, and its regions in `contacts`.
    pub regions: Vec<(u32, Range<usize>)>,
    pub contacts: Contacts,
    /// Points for the response.
    pub manifold: Vec<(u32, ManifoldPoint)>,
    contained: Vec<(u32, Containment)>,
    /// Pair, the thread that has its regions, and which of that thread's they are.
    sources: Vec<(u32, usize, Range<usize>)>,
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
        self.contained.clear();
        self.kept.clear();
        self.counts = StageCounts::default();
    }

    /// Takes over what one thread has found.
    pub fn take(&mut self, from: &mut Conclusion) {
        self.distances.append(&mut from.distances);
        self.times.append(&mut from.times);
        self.penetrations.append(&mut from.penetrations);
        self.manifold.append(&mut from.manifold);
        self.contained.append(&mut from.contained);
        self.counts.add(&std::mem::take(&mut from.counts));
    }

    /// Takes over the regions that all threads have found, in the order of the pairs.
    pub fn take_regions(&mut self, workers: &mut [Mutex<Worker>]) {
        self.sources.clear();
        for (worker, from) in workers.iter_mut().enumerate() {
            let mut next = 0;
            for (pair, count) in get_mut(from).conclusion.regions.pairs.drain(..) {
                self.sources.push((pair, worker, next..next + count));
                next += count;
            }
        }
        self.sources.sort_unstable_by_key(|&(pair, ..)| pair);
        for (pair, worker, regions) in &self.sources {
            let first = self.contacts.regions().len();
            self.contacts.append(&get_mut(&mut workers[*worker]).conclusion.regions.contacts, regions.clone());
            self.regions.push((*pair, first..self.contacts.regions().len()));
        }
        workers.iter_mut().for_each(|worker| get_mut(worker).conclusion.regions.contacts.clear());
    }

    /// Lists the pairs that are not proven clear, and those of which an effect has something to say.
    pub fn list(&mut self, bodies: &[Body], kept: &[Kept], found: &[Found]) {
        self.order();
        self.polygon_pairs.extend(found.iter().map(PolygonPair::from));
        let mut first = [0; 4];
        for (pair, kept) in (0..).zip(kept) {
            let polygon_pairs = run(found, &mut first[0], |found| found.pair == pair);
            let contained = run(&self.contained, &mut first[1], |&(of, _)| of == pair);
            let distances = run(&self.distances, &mut first[2], |&(of, _)| of == pair);
            let times = run(&self.times, &mut first[3], |&(of, _)| of == pair);
            let containment = self.contained[contained].first().map_or(Containment::None, |&(_, found)| found);
            let interfering = kept.is_interfering() || containment.is_proven();
            if !interfering && containment == Containment::None && distances.is_empty() && times.is_empty() {
                continue;
            }
            self.kept.push(pair);
            self.pairs.push(PairResult {
                a: bodies[kept.a as usize].id,
                b: bodies[kept.b as usize].id,
                verdict: if interfering { Verdict::Interfering } else { Verdict::Clear },
                level: Level::Polygons,
                relation: found[polygon_pairs.clone()].iter().map(|found| found.relation).max(),
                containment: kept.effects.contains(Effects::CONTAINMENT).then_some(containment),
                polygon_pairs,
            });
        }
        self.name_places();
    }

    /// What a thread has found of a pair stands together; the pairs come in order.
    fn order(&mut self) {
        self.contained.sort_by_key(|&(pair, _)| pair);
        self.distances.sort_by_key(|&(pair, _)| pair);
        self.times.sort_by_key(|&(pair, _)| pair);
        self.penetrations.sort_by_key(|&(pair, _)| pair);
        self.manifold.sort_by_key(|&(pair, _)| pair);
    }

    /// Records name the places of their pairs in the report from now on.
    fn name_places(&mut self) {
        let place = |kept: &mut u32| *kept = self.kept.partition_point(|&other| other < *kept) as u32;
        self.distances.iter_mut().for_each(|(pair, _)| place(pair));
        self.times.iter_mut().for_each(|(pair, _)| place(pair));
        self.penetrations.iter_mut().for_each(|(pair, _)| place(pair));
        self.manifold.iter_mut().for_each(|(pair, _)| place(pair));
        self.regions.iter_mut().for_each(|(pair, _)| place(pair));
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
