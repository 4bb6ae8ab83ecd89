//! Impulses of one set of bodies, island by island. The rule stands in [the module above](super).

use std::borrow::Borrow;
use std::ops::Range;

use glam::{DMat3, DVec3};

use super::{
    Impulse, MAX_IMPACTS, MAX_ROUNDS, RESTING, ResponseBody, ResponseError, ResponsePair, TOLERANCE, Velocity,
};
use crate::affine::world_vertex;
use crate::topology::{join, root};

/// A body while it is solved.
#[derive(Debug, Clone, Copy)]
struct Mover {
    inverse_mass: f64,
    inverse_inertia: DMat3,
    centre: DVec3,
    linear: DVec3,
    angular: DVec3,
    /// Both, before any impulse.
    before: [DVec3; 2],
}

/// One contact point.
#[derive(Debug, Clone, Copy)]
struct Contact {
    pair: usize,
    bodies: [usize; 2],
    point: DVec3,
    normal: DVec3,
    /// From the centres of mass.
    arms: [DVec3; 2],
    tangents: [DVec3; 2],
    /// Impulse per velocity, along the normal and the tangents.
    mass: [f64; 3],
    friction: f64,
    /// Impulse in the current solution, along the normal and the tangents.
    current: [f64; 3],
    /// The same before the last round, and the conjugate direction.
    start: [f64; 3],
    direction: [f64; 3],
    /// Impulse on the second body so far.
    total: DVec3,
    /// The same where nothing bounces.
    rested: DVec3,
}

impl Contact {
    /// What the last round did.
    fn step(&self) -> [f64; 3] {
        [0, 1, 2].map(|i| self.current[i] - self.start[i])
    }
}

/// What a round goes over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sweep {
    Normals,
    /// The normal impulses being what they are.
    Friction,
    Both,
}

/// The contacts of one pair.
#[derive(Debug, Clone)]
struct Pair {
    contacts: Range<usize>,
    bodies: [usize; 2],
    restitution: f64,
    island: u32,
}

/// Memory of the solver.
#[derive(Debug, Default)]
pub(super) struct Solver {
    movers: Vec<Mover>,
    contacts: Vec<Contact>,
    pairs: Vec<Pair>,
    parents: Vec<u32>,
    /// Numbers of the pairs, those of one island side by side.
    order: Vec<usize>,
    /// Numbers of the contacts of one island.
    island: Vec<usize>,
    /// Normal velocities of a pair before its impact.
    before: Vec<f64>,
    /// Whether a cap ended a solution.
    capped: bool,
}

impl Solver {
    /// Takes over the bodies and makes contacts of the pairs.
    pub fn start<'m>(
        &mut self,
        bodies: &[ResponseBody],
        pairs: impl IntoIterator<Item = impl Borrow<ResponsePair<'m>>>,
    ) -> Result<(), ResponseError> {
        self.capped = false;
        self.movers.clear();
        for (number, body) in bodies.iter().enumerate() {
            self.movers.push(mover(number, body)?);
        }
        self.contacts.clear();
        self.pairs.clear();
        for (number, pair) in pairs.into_iter().enumerate() {
            let pair = pair.borrow();
            let (a, b) = (&bodies[pair.a], &bodies[pair.b]);
            let start = self.contacts.len();
            let friction = (a.friction * b.friction).sqrt();
            for point in pair.manifold {
                let (position, normal) = (DVec3::from(point.position), DVec3::from(point.normal));
                self.contacts.extend(self.contact(number, [pair.a, pair.b], position, normal, friction));
            }
            let contacts = start..self.contacts.len();
            let restitution = a.restitution.max(b.restitution);
            self.pairs.push(Pair { contacts, bodies: [pair.a, pair.b], restitution, island: 0 });
        }
        self.find_islands();
        Ok(())
    }

    /// `None` where neither body can move.
    fn contact(&self, pair: usize, bodies: [usize; 2], point: DVec3, normal: DVec3, friction: f64) -> Option<Contact> {
        let arms = bodies.map(|body| point - self.movers[body].centre);
        let (u, v) = normal.any_orthonormal_pair();
        let mass = [normal, u, v].map(|direction| {
            let give = |side: usize| {
                let (mover, turn) = (&self.movers[bodies[side]], arms[side].cross(direction));
                mover.inverse_mass + turn.dot(mover.inverse_inertia * turn)
            };
            1.0 / (give(0) + give(1))
        });
        let contact = Contact {
            pair,
            bodies,
            point,
            normal,
            arms,
            tangents: [u, v],
            mass,
            friction,
            current: [0.0; 3],
            start: [0.0; 3],
            direction: [0.0; 3],
            total: DVec3::ZERO,
            rested: DVec3::ZERO,
        };
        mass.iter().all(|mass| mass.is_finite()).then_some(contact)
    }

    /// Bodies that move and touch share an island; a static body is in none.
    fn find_islands(&mut self) {
        self.parents.clear();
        self.parents.extend(0..self.movers.len() as u32);
        for pair in &self.pairs {
            let [a, b] = pair.bodies;
            let can_move = |body: usize| self.movers[body].inverse_mass > 0.0;
            if can_move(a) && can_move(b) && !pair.contacts.is_empty() {
                join(&mut self.parents, a as u32, b as u32);
            }
        }
        for pair in &mut self.pairs {
            let [a, b] = pair.bodies;
            let moving = if self.movers[a].inverse_mass > 0.0 { a } else { b };
            pair.island = root(&mut self.parents, moving as u32);
        }
        self.order.clear();
        self.order.extend((0..self.pairs.len()).filter(|&pair| !self.pairs[pair].contacts.is_empty()));
        self.order.sort_unstable_by_key(|&pair| (self.pairs[pair].island, pair));
    }

    /// Island by island.
    pub fn solve(&mut self) {
        let mut start = 0;
        while start < self.order.len() {
            let island = self.pairs[self.order[start]].island;
            let same = |&&pair: &&usize| self.pairs[pair].island == island;
            let end = start + self.order[start..].iter().take_while(same).count();
            self.solve_island(start..end);
            start = end;
        }
    }

    fn solve_island(&mut self, pairs: Range<usize>) {
        let mut island = std::mem::take(&mut self.island);
        island.clear();
        island.extend(self.order[pairs.clone()].iter().flat_map(|&pair| self.pairs[pair].contacts.clone()));
        let fastest = island.iter().map(|&contact| self.speed(contact)).fold(0.0, f64::max);
        let enough = fastest * TOLERANCE;
        let most = self.order[pairs.clone()].iter().map(|&pair| self.pairs[pair].restitution).fold(0.0, f64::max);
        if most < 1.0 {
            self.rest(&island, enough);
        }
        if most > 0.0 {
            self.begin_anew(&island);
            self.collide_all(pairs, fastest, most);
            self.rest(&island, enough);
            self.mix(&island, most);
        }
        self.island = island;
    }

    /// Stops what approaches, at all points together.
    fn rest(&mut self, island: &[usize], enough: f64) {
        self.forget(island.iter().copied());
        self.iterate(island.iter().copied(), enough, Sweep::Both);
    }

    /// Puts the impulses so far aside, and the bodies back to their velocities before.
    fn begin_anew(&mut self, island: &[usize]) {
        for &number in island {
            let contact = &mut self.contacts[number];
            contact.rested = std::mem::take(&mut contact.total);
            for body in contact.bodies {
                let mover = &mut self.movers[body];
                [mover.linear, mover.angular] = mover.before;
            }
        }
    }

    /// The mean of the impulses with rebound, which get the weight, and of those without.
    fn mix(&mut self, island: &[usize], weight: f64) {
        for &number in island {
            let contact = &mut self.contacts[number];
            contact.total = contact.total * weight + contact.rested * (1.0 - weight);
        }
    }

    /// Impacts, until none approaches but slowly. Restitutions are shares of `most`.
    fn collide_all(&mut self, pairs: Range<usize>, fastest: f64, most: f64) {
        for _ in 0..MAX_IMPACTS * pairs.len() {
            let Some(pair) = self.fastest_approach(pairs.clone(), fastest * RESTING) else { return };
            self.collide(pair, self.pairs[pair].restitution / most, fastest * TOLERANCE);
        }
        self.capped = true;
    }

    /// Whether a cap ended a solution before it was as exact as it should be.
    pub fn was_capped(&self) -> bool {
        self.capped
    }

    /// The pair whose contact approaches fastest, and faster than `slow`; the first one of equals.
    fn fastest_approach(&self, pairs: Range<usize>, slow: f64) -> Option<usize> {
        let approach = |pair: usize| {
            let contacts = self.pairs[pair].contacts.clone();
            contacts.map(|contact| -self.normal_velocity(contact)).fold(f64::NEG_INFINITY, f64::max)
        };
        let all = self.order[pairs].iter().map(|&pair| (approach(pair), pair));
        let fast = all.filter(|(speed, _)| *speed > slow);
        fast.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, pair)| pair)
    }

    /// The impact of one pair: what stops the approach, times 1 + e, then friction.
    fn collide(&mut self, pair: usize, restitution: f64, enough: f64) {
        let contacts = self.pairs[pair].contacts.clone();
        self.forget(contacts.clone());
        self.before.clear();
        for contact in contacts.clone() {
            self.before.push(self.normal_velocity(contact));
        }
        self.iterate(contacts.clone(), enough, Sweep::Normals);
        self.bounce(contacts.clone(), restitution);
        self.start_directions(contacts.clone());
        self.iterate(contacts, enough, Sweep::Friction);
    }

    /// Adds e times the impulses that stopped the approach; less where that, the solution not being exact, would make energy.
    fn bounce(&mut self, contacts: Range<usize>, restitution: f64) {
        let (mut work_before, mut work_after) = (0.0, 0.0);
        for (contact, before) in contacts.clone().zip(&self.before) {
            let impulse = self.contacts[contact].current[0];
            work_before += impulse * before;
            work_after += impulse * self.normal_velocity(contact);
        }
        // The energy goes up by s·(before + s/2·(after − before)) with s times the impulses.
        let most = -2.0 * work_before / (work_after - work_before);
        let more = if most.is_finite() { restitution.min(most - 1.0).max(0.0) } else { restitution };
        for contact in contacts {
            let impulse = self.contacts[contact].current[0] * more;
            self.contacts[contact].current[0] += impulse;
            self.push(contact, self.contacts[contact].normal * impulse);
        }
    }

    /// Rounds until nothing changes, each from where the last one and a step along the conjugate direction lead (Silcowitz,
    /// Niebe, Erleben 2010, "A nonsmooth nonlinear conjugate gradient method for interactive contact force problems"). It ends
    /// with a plain round, so that no contact pulls and none leaves its cone.
    fn iterate(&mut self, contacts: impl Iterator<Item = usize> + Clone, enough: f64, sweep: Sweep) {
        let mut last_squares = f64::INFINITY;
        for _ in 0..MAX_ROUNDS {
            if self.round(contacts.clone(), sweep) <= enough {
                return;
            }
            let steps = contacts.clone().map(|contact| self.contacts[contact].step());
            let squares: f64 = steps.map(|[x, y, z]| x * x + y * y + z * z).sum();
            // Growing steps mean that a contact has opened or closed, or begun to slide: begin anew.
            let weight = if squares <= last_squares { squares / last_squares } else { 0.0 };
            last_squares = squares;
            contacts.clone().for_each(|contact| self.go_on(contact, weight));
        }
        self.round(contacts, sweep);
        self.capped = true;
    }

    /// One round; says by how much the velocity of a contact changed at most.
    fn round(&mut self, contacts: impl Iterator<Item = usize> + Clone, sweep: Sweep) -> f64 {
        contacts.clone().for_each(|contact| self.contacts[contact].start = self.contacts[contact].current);
        let mut change = 0.0f64;
        for contact in contacts {
            if sweep != Sweep::Friction {
                change = change.max(self.press(contact));
            }
            if sweep != Sweep::Normals {
                change = change.max(self.drag(contact));
            }
        }
        change
    }

    /// A step along the conjugate direction, which then turns to where the last round went.
    fn go_on(&mut self, number: usize, weight: f64) {
        let contact = &mut self.contacts[number];
        let step = contact.step();
        let along = contact.direction.map(|direction| direction * weight);
        contact.direction = [0, 1, 2].map(|i| along[i] + step[i]);
        contact.current = [0, 1, 2].map(|i| contact.current[i] + along[i]);
        let [u, v] = contact.tangents;
        let impulse = contact.normal * along[0] + u * along[1] + v * along[2];
        self.push(number, impulse);
    }

    /// Stops the approach of one contact; says by how much its velocity changed.
    fn press(&mut self, number: usize) -> f64 {
        let contact = &self.contacts[number];
        let wanted = contact.current[0] - self.normal_velocity(number) * contact.mass[0];
        let (normal, mass, old, new) = (contact.normal, contact.mass[0], contact.current[0], wanted.max(0.0));
        self.contacts[number].current[0] = new;
        self.push(number, normal * (new - old));
        (new - old).abs() / mass
    }

    /// Stops the sliding of one contact, as far as the cone allows; says by how much its velocity changed.
    fn drag(&mut self, number: usize) -> f64 {
        let Contact { tangents: [u, v], mass, friction, current, .. } = self.contacts[number];
        if friction == 0.0 {
            return 0.0;
        }
        let sliding = self.velocity(number);
        let wanted = [current[1] - u.dot(sliding) * mass[1], current[2] - v.dot(sliding) * mass[2]];
        let (length, most) = (wanted[0].hypot(wanted[1]), friction * current[0]);
        let [x, y] = if length > most { wanted.map(|along| along * (most / length)) } else { wanted };
        self.contacts[number].current = [current[0], x, y];
        self.push(number, u * (x - current[1]) + v * (y - current[2]));
        ((x - current[1]) / mass[1]).abs().max(((y - current[2]) / mass[2]).abs())
    }

    /// An impulse on the second body of a contact, and its opposite on the first.
    fn push(&mut self, number: usize, impulse: DVec3) {
        let contact = &mut self.contacts[number];
        contact.total += impulse;
        let Contact { bodies, arms, .. } = *contact;
        for (side, impulse) in [(0, -impulse), (1, impulse)] {
            let mover = &mut self.movers[bodies[side]];
            mover.linear += impulse * mover.inverse_mass;
            mover.angular += mover.inverse_inertia * arms[side].cross(impulse);
        }
    }

    fn forget(&mut self, contacts: impl Iterator<Item = usize> + Clone) {
        contacts.clone().for_each(|contact| self.contacts[contact].current = [0.0; 3]);
        self.start_directions(contacts);
    }

    fn start_directions(&mut self, contacts: impl Iterator<Item = usize>) {
        contacts.for_each(|contact| self.contacts[contact].direction = [0.0; 3]);
    }

    /// Of the second body as seen from the first one.
    fn velocity(&self, number: usize) -> DVec3 {
        let Contact { bodies, arms, .. } = &self.contacts[number];
        let at = |side: usize| {
            let mover = &self.movers[bodies[side]];
            mover.linear + mover.angular.cross(arms[side])
        };
        at(1) - at(0)
    }

    fn normal_velocity(&self, number: usize) -> f64 {
        self.contacts[number].normal.dot(self.velocity(number))
    }

    /// The largest speed that either body has at a contact.
    fn speed(&self, number: usize) -> f64 {
        let Contact { bodies, arms, .. } = &self.contacts[number];
        let at = |side: usize| {
            let mover = &self.movers[bodies[side]];
            mover.linear.length() + mover.angular.length() * arms[side].length()
        };
        at(0).max(at(1))
    }

    /// Impulses other than zero.
    pub fn impulses(&self) -> impl Iterator<Item = Impulse> {
        let pushed = self.contacts.iter().filter(|contact| contact.total != DVec3::ZERO);
        pushed.map(|contact| Impulse {
            pair: contact.pair,
            point: contact.point.to_array(),
            on_b: contact.total.to_array(),
        })
    }

    /// Adds to the velocities what the impulses in all do: rounding does not add up over the rounds.
    pub fn velocities_after(&self, velocities: &mut [Velocity]) {
        for contact in &self.contacts {
            for (side, impulse) in [(0, -contact.total), (1, contact.total)] {
                let body = contact.bodies[side];
                let mover = &self.movers[body];
                let velocity = &mut velocities[body];
                let linear = DVec3::from(velocity.linear) + impulse * mover.inverse_mass;
                let turn = mover.inverse_inertia * contact.arms[side].cross(impulse);
                velocity.linear = linear.to_array();
                velocity.angular = (DVec3::from(velocity.angular) + turn).to_array();
            }
        }
    }
}

/// Checks a body.
fn mover(number: usize, body: &ResponseBody) -> Result<Mover, ResponseError> {
    let (mass, rows) = (&body.mass, &body.rows);
    if mass.mass.is_nan() || mass.mass <= 0.0 {
        return Err(ResponseError::Mass { body: number, mass: mass.mass });
    }
    if !(0.0..=1.0).contains(&body.restitution) {
        return Err(ResponseError::Restitution { body: number, restitution: body.restitution });
    }
    if !(body.friction >= 0.0 && body.friction.is_finite()) {
        return Err(ResponseError::Friction { body: number, friction: body.friction });
    }
    let (linear, angular) = (DVec3::from(body.velocity.linear), DVec3::from(body.velocity.angular));
    let centre = world_vertex(rows, mass.centre);
    if !(linear.is_finite() && angular.is_finite() && centre.is_finite()) {
        return Err(ResponseError::NotFinite { body: number });
    }
    let inverse = mass.inverse(rows).filter(|(_, inverse_inertia)| inverse_inertia.is_finite());
    let (inverse_mass, inverse_inertia) = inverse.ok_or(ResponseError::Inertia { body: number })?;
    Ok(Mover { inverse_mass, inverse_inertia, centre, linear, angular, before: [linear, angular] })
}
