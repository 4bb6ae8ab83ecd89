//! Stage 9 of one pair: the effects that ask for more than its polygon pairs.

use super::reach::FAR;
use super::{Kept, World};
use crate::affine::{Rows, magnitude};
use crate::effects::contacts::{Contacts, TrianglePair};
use crate::effects::containment::{Containment, Ray, containment};
use crate::effects::distance::{self, Distance, distance};
use crate::effects::penetration::{Penetration, Separation, SurfaceTest};
use crate::effects::response::{ManifoldPoint, add_manifold};
use crate::effects::time_of_contact::{self, FirstContact, TimeOfContact, time_of_contact};
use crate::effects::{Effects, Touching};
use crate::object::Object;
use crate::report::{StageCounts, Verdict};
use crate::submatrix::Placed;

/// The effects that look at where the surfaces meet.
pub(super) const AT_CONTACTS: Effects = Effects::CONTACTS.union(Effects::PENETRATION).union(Effects::RESPONSE);

/// The effects that need all pairs of triangles of surfaces that meet: these, and the distance, which then is 0.
pub(super) const OF_TRIANGLES: Effects = AT_CONTACTS.union(Effects::DISTANCE);

/// The effects that have something to say of surfaces that are apart.
pub(super) const BEYOND_SURFACES: Effects = FAR.union(Effects::CONTAINMENT);

/// Whether a pair asks for anything that is left to do when its verdict is known.
pub(super) fn is_needed(kept: &Kept) -> bool {
    kept.effects.meets(FAR)
        || kept.overlapping && kept.verdict() == Verdict::Clear && kept.effects.contains(Effects::CONTAINMENT)
        || kept.is_interfering() && kept.effects.meets(AT_CONTACTS) && !kept.is_unfinished()
}

/// One thread's memory of the effects, and what they have found, each with the number of its pair.
#[derive(Debug, Default)]
pub(crate) struct Conclusion {
    ray: Ray,
    distance_memory: distance::Memory,
    time_memory: time_of_contact::Memory,
    separation: Separation,
    surface_test: SurfaceTest,
    contacts: Contacts,
    triangles: Vec<TrianglePair>,
    normals: Vec<[f64; 3]>,
    pub contained: Vec<(u32, Containment)>,
    pub distances: Vec<(u32, Distance)>,
    pub times: Vec<(u32, FirstContact)>,
    pub penetrations: Vec<(u32, Penetration)>,
    /// By pair, and number within it.
    pub manifold: Vec<([u32; 2], ManifoldPoint)>,
    manifold_of_region: Vec<ManifoldPoint>,
    pub regions: PairRegions,
    pub counts: StageCounts,
}

/// The regions of several pairs, one after the other.
#[derive(Debug, Default)]
pub(crate) struct PairRegions {
    /// Pair, and how many regions it has.
    pub pairs: Vec<(u32, usize)>,
    pub contacts: Contacts,
}

impl Conclusion {
    /// Computes what a pair asks for. `touching` are its pairs of triangles that interfere.
    pub fn add(&mut self, pair: u32, kept: &Kept, touching: &[Touching], world: World<'_>) {
        let sides = [kept.a, kept.b].map(|body| world.placed(body));
        let [a, b] = sides.map(|side| (side.object, side.rows));
        let mut is_inside = false;
        let verdict = kept.verdict();
        if kept.effects.contains(Effects::CONTAINMENT) && kept.overlapping && verdict == Verdict::Clear {
            let found = self.containment(sides[0], sides[1]);
            is_inside = found.is_proven();
            self.contained.push((pair, found));
        }
        let meets = verdict == Verdict::Interfering && !kept.is_unfinished();
        if kept.effects.contains(Effects::DISTANCE) {
            let found = if meets {
                distance::at_contact(a, b, touching.iter().map(|touching| touching.triangles))
            } else {
                self.counts.distance_searches += 1;
                distance(a, b, world.accuracy_of(kept.a, kept.b).distance, &mut self.distance_memory)
            };
            self.distances.extend(found.map(|found| (pair, found)));
        }
        if meets && kept.effects.meets(AT_CONTACTS) {
            self.add_contacts(pair, kept, touching, a, b);
        }
        if kept.effects.contains(Effects::PENETRATION) && (meets || is_inside) {
            self.add_penetration(pair, kept, a, b);
        }
        if kept.effects.contains(Effects::TIME_OF_CONTACT) && !kept.free {
            self.add_time(pair, kept, world);
        }
    }

    /// Which of two bodies, whose surfaces are apart, lies inside the other.
    pub fn containment(&mut self, a: Placed<'_>, b: Placed<'_>) -> Containment {
        self.counts.containment_tests += 1;
        containment(a, b, &mut self.ray)
    }

    fn add_contacts(
        &mut self,
        pair: u32,
        kept: &Kept,
        touching: &[Touching],
        a: (&Object, &Rows),
        b: (&Object, &Rows),
    ) {
        self.triangles.clear();
        self.triangles.extend(touching.iter().map(|touching| touching.triangles));
        self.contacts.find(a, b, &self.triangles);
        self.normals.clear();
        self.normals.extend(self.contacts.regions().iter().map(|region| region.normal));
        if kept.effects.contains(Effects::CONTACTS) {
            self.counts.contact_pairs += 1;
            self.regions.pairs.push((pair, self.contacts.regions().len()));
            self.regions.contacts.append(&self.contacts, 0..self.contacts.regions().len());
        }
        if kept.effects.contains(Effects::RESPONSE) {
            self.manifold_of_region.clear();
            for region in self.contacts.regions() {
                add_manifold(&self.contacts, region, &mut self.manifold_of_region);
            }
            self.manifold.extend((0..).zip(&self.manifold_of_region).map(|(number, &point)| ([pair, number], point)));
        }
    }

    fn add_penetration(&mut self, pair: u32, kept: &Kept, a: (&Object, &Rows), b: (&Object, &Rows)) {
        self.counts.penetration_searches += 1;
        if !kept.is_interfering() {
            self.normals.clear();
        }
        let (surfaces, ray) = (&mut self.surface_test, &mut self.ray);
        let mut is_clear = |rows: &Rows| {
            !surfaces.interferes(a, (b.0, rows)) && !containment(placed_at(a), placed_at((b.0, rows)), ray).is_proven()
        };
        let found = self.separation.find(a, b, &self.normals, &mut is_clear);
        self.penetrations.extend(found.map(|found| (pair, found)));
    }

    /// What is inside the other body at the start is in contact there, when the pair asks for containment.
    fn add_time(&mut self, pair: u32, kept: &Kept, world: World<'_>) {
        self.counts.time_searches += 1;
        let [a, b] = [kept.a, kept.b].map(|body| (&*world.bodies[body as usize].object, world.motion(body)));
        let mut found =
            time_of_contact((a.0, &a.1), (b.0, &b.1), world.accuracy_of(kept.a, kept.b).time, &mut self.time_memory);
        let at_start = TimeOfContact::Contact { lo: 0.0, hi: 0.0 };
        if found != at_start && kept.effects.contains(Effects::CONTAINMENT) {
            let [from_a, from_b] = [a.1.at(0.0), b.1.at(0.0)];
            let start = [placed_at((a.0, &from_a)), placed_at((b.0, &from_b))];
            if containment(start[0], start[1], &mut self.ray).is_proven() {
                found = at_start;
            }
        }
        if found != TimeOfContact::Free {
            let at_lo = [a.1, b.1].map(|motion| motion.at(found.free_until()));
            self.times.push((pair, FirstContact { time: found, at_lo }));
        }
    }
}

fn placed_at<'o>((object, rows): (&'o Object, &'o Rows)) -> Placed<'o> {
    Placed { object, rows, magnitude: magnitude(rows, object.reach()) }
}
