//! Directions to move the second body along, and how far it is to where the extents of the two bodies part.

use std::cmp::Ordering;

use glam::DVec3;

use super::{MAX_FACES, MAX_PROJECTIONS};
use crate::affine::{Rows, magnitude, world_vertex};
use crate::effects::contacts::unit;
use crate::object::Object;

/// A unit vector, and how far the second body must go along it to have the first one behind it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub direction: DVec3,
    pub reach: f64,
}

/// What the search starts from.
pub(super) struct Candidates<'d> {
    /// The first ones are those of the contact regions; the others are ordered by reach.
    all: &'d [Candidate],
    contacts: usize,
    /// A length that rounding cannot hide.
    pub noise: f64,
}

impl Candidates<'_> {
    /// The shortest first.
    pub fn by_extents(&self) -> impl Iterator<Item = &Candidate> {
        self.all[self.contacts..].iter()
    }

    /// The directions of the contact regions and the shortest of all, in turns.
    pub fn promising(&self) -> impl Iterator<Item = &Candidate> {
        let (contacts, others) = self.all.split_at(self.contacts);
        let turns = (0..contacts.len().max(others.len())).flat_map(|i| [others.get(i), contacts.get(i)]);
        turns.flatten()
    }
}

/// Memory of the directions.
#[derive(Debug, Default)]
pub(super) struct Directions {
    bodies: [Outline; 2],
    /// Unit vectors to look along, both ways.
    directions: Vec<DVec3>,
    candidates: Vec<Candidate>,
}

/// What of one body matters for its extents.
#[derive(Debug, Default)]
struct Outline {
    used: Vec<u32>,
    /// World positions of the vertices that triangles have.
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    edges: Vec<DVec3>,
}

impl Directions {
    /// The candidates, each direction both ways. None for an empty body.
    pub fn candidates(
        &mut self,
        a: (&Object, &Rows),
        b: (&Object, &Rows),
        contact_normals: &[[f64; 3]],
    ) -> Candidates<'_> {
        let [first, second] = &mut self.bodies;
        first.gather(a);
        second.gather(b);
        let positions = first.positions.len() + second.positions.len();
        self.candidates.clear();
        self.directions.clear();
        self.directions.extend(contact_normals.iter().map(|&normal| unit(DVec3::from(normal))));
        distinct(&mut self.directions);
        let contacts = 2 * self.directions.len();
        if !(first.positions.is_empty() || second.positions.is_empty()) {
            self.add_candidates();
            self.directions.clear();
            self.add_directions(a.1, b.1, MAX_PROJECTIONS / positions);
            self.add_candidates();
        }
        let contacts = contacts.min(self.candidates.len());
        self.candidates[contacts..].sort_unstable_by(|c, d| order(c.reach, d.reach, c.direction, d.direction));
        let size = magnitude(a.1, a.0.reach()).max_element() + magnitude(b.1, b.0.reach()).max_element();
        Candidates { all: &self.candidates, contacts, noise: 4.0 * f64::EPSILON * size }
    }

    fn add_directions(&mut self, rows_a: &Rows, rows_b: &Rows, most: usize) {
        let [a, b] = &self.bodies;
        self.directions.extend(DVec3::AXES);
        self.directions.extend([rows_a, rows_b].into_iter().flat_map(box_axes));
        self.directions.push(unit(b.middle() - a.middle()));
        let room = most.saturating_sub(self.directions.len());
        let faces = a.normals.len() + b.normals.len();
        let step = faces.div_ceil(room.max(1)).max(1);
        self.directions.extend(a.normals.iter().chain(&b.normals).step_by(step));
        if faces + a.edges.len() * b.edges.len() <= room {
            let products = a.edges.iter().flat_map(|edge| b.edges.iter().map(|other| unit(edge.cross(*other))));
            self.directions.extend(products);
        }
        distinct(&mut self.directions);
    }

    /// Both ways of every direction.
    fn add_candidates(&mut self) {
        let [a, b] = &self.bodies;
        for &direction in &self.directions {
            let ((a_min, a_max), (b_min, b_max)) = (a.extent(direction), b.extent(direction));
            self.candidates.push(Candidate { direction, reach: a_max - b_min });
            self.candidates.push(Candidate { direction: -direction, reach: b_max - a_min });
        }
    }
}

impl Outline {
    fn gather(&mut self, (object, rows): (&Object, &Rows)) {
        self.used.clear();
        self.used.extend(object.triangles().iter().flatten());
        self.used.sort_unstable();
        self.used.dedup();
        let at = |vertex: u32| world_vertex(rows, object.vertices()[vertex as usize]);
        self.positions.clear();
        self.positions.extend(self.used.iter().map(|&vertex| at(vertex)));
        self.normals.clear();
        self.edges.clear();
        let step = object.triangle_count().div_ceil(MAX_FACES).max(1);
        for triangle in object.triangles().iter().step_by(step) {
            let [o, a, b] = triangle.map(at);
            let edges = [unit(a - o), unit(b - a), unit(o - b)];
            self.normals.push(unit(edges[0].cross(edges[1])));
            self.edges.extend(edges);
        }
        distinct(&mut self.normals);
        distinct(&mut self.edges);
    }

    fn extent(&self, direction: DVec3) -> (f64, f64) {
        let along = self.positions.iter().map(|position| position.dot(direction));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), at| (min.min(at), max.max(at)))
    }

    fn middle(&self) -> DVec3 {
        let min = self.positions.iter().fold(DVec3::INFINITY, |min, position| min.min(*position));
        let max = self.positions.iter().fold(DVec3::NEG_INFINITY, |max, position| max.max(*position));
        min / 2.0 + max / 2.0
    }
}

/// The normals of the transformed container's sides.
fn box_axes(rows: &Rows) -> [DVec3; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| unit(DVec3::new(rows[0][axis], rows[1][axis], rows[2][axis])));
    [unit(y.cross(z)), unit(z.cross(x)), unit(x.cross(y))]
}

/// Turns opposite directions alike, and keeps each once, up to 2^-40; drops those that are zero.
fn distinct(directions: &mut Vec<DVec3>) {
    let quantum = |direction: &DVec3| (*direction * (1u64 << 40) as f64).round().to_array().map(|x| x as i64);
    directions.retain(|direction| *direction != DVec3::ZERO);
    for direction in directions.iter_mut() {
        let is_backwards = quantum(direction).into_iter().find(|&x| x != 0).is_some_and(|x| x < 0);
        *direction = if is_backwards { -*direction } else { *direction };
    }
    directions.sort_unstable_by(|c, d| quantum(c).cmp(&quantum(d)).then_with(|| order(0.0, 0.0, *c, *d)));
    directions.dedup_by_key(|direction| quantum(direction));
}

/// By reach, then by direction: one order on every machine.
fn order(reach: f64, other_reach: f64, direction: DVec3, other: DVec3) -> Ordering {
    let coordinates = direction.to_array().into_iter().zip(other.to_array());
    coordinates.fold(reach.total_cmp(&other_reach), |order, (x, y)| order.then(x.total_cmp(&y)))
}
