//! Stage 9 of all pairs together: impulses and the velocities after, for bodies with mass.

use std::ops::Range;

use super::{Kept, Results, World};
use crate::effects::response::{
    Impulse, ManifoldPoint, MassProperties, Response, ResponseBody, ResponseError, ResponsePair, Velocity,
};
use crate::scene::{BodyId, Dynamics};

/// Memory of the response, and what came of it.
#[derive(Debug, Default)]
pub(crate) struct StepResponse {
    solver: Response,
    /// Indices of the scene's bodies that take part, ascending.
    members: Vec<u32>,
    bodies: Vec<ResponseBody>,
    points: Vec<ManifoldPoint>,
    pairs: Vec<TouchingPair>,
    /// Place of the pair in the report, where it acts, and what body `b` gets.
    pub impulses: Vec<(u32, Impulse)>,
    /// Velocities after, of the bodies with mass that an impulse has reached; ascending.
    pub velocities: Vec<(BodyId, Velocity)>,
    /// The body for which there is none: its inertia, where it stands, is not positive definite.
    pub fault: Option<BodyId>,
    /// Whether a cap ended the solution before it was as exact as it should be.
    pub capped: bool,
}

/// A pair with contact points.
#[derive(Debug)]
struct TouchingPair {
    /// In the report.
    place: u32,
    /// Indices of the scene's bodies.
    bodies: [u32; 2],
    /// Which of the points are its own.
    points: Range<usize>,
}

impl StepResponse {
    pub fn solve(&mut self, results: &Results, kept: &[Kept], world: &World<'_>) {
        self.clear();
        if results.manifold.is_empty() {
            return;
        }
        self.gather(results, kept, world);
        let bodies = world.bodies;
        let member = |body: u32| self.members.partition_point(|&other| other < body);
        let pairs = self.pairs.iter().map(|pair| {
            let [a, b] = pair.bodies.map(member);
            ResponsePair { a, b, manifold: &self.points[pair.points.clone()] }
        });
        if let Err(error) = self.solver.solve(&self.bodies, pairs) {
            self.fault = Some(bodies[self.members[faulty(&error)] as usize].id);
            return;
        }
        self.capped = self.solver.was_capped();
        self.impulses.extend(self.solver.impulses().iter().map(|&impulse| (self.pairs[impulse.pair].place, impulse)));
        let moved = self.members.iter().zip(self.solver.velocities()).zip(&self.bodies);
        let moved = moved.filter(|((_, after), before)| **after != before.velocity);
        self.velocities.extend(moved.map(|((&member, &after), _)| (bodies[member as usize].id, after)));
    }

    /// Nothing meets.
    pub fn clear(&mut self) {
        self.impulses.clear();
        self.velocities.clear();
        (self.fault, self.capped) = (None, false);
    }

    /// The pairs with contact points, and the bodies of these.
    fn gather(&mut self, results: &Results, kept: &[Kept], world: &World<'_>) {
        self.pairs.clear();
        let mut first = 0;
        for points in results.manifold.chunk_by(|([one, _], _), ([other, _], _)| one == other) {
            let place = points[0].0[0];
            let kept = results.kept_pair(place, kept);
            self.pairs.push(TouchingPair { place, bodies: [kept.a, kept.b], points: first..first + points.len() });
            first += points.len();
        }
        self.points.clear();
        self.points.extend(results.manifold.iter().map(|&(_, point)| point));
        self.members.clear();
        self.members.extend(self.pairs.iter().flat_map(|pair| pair.bodies));
        self.members.sort_unstable();
        self.members.dedup();
        self.bodies.clear();
        self.bodies.extend(self.members.iter().map(|&body| response_body(body, world)));
    }
}

fn response_body(at: u32, world: &World<'_>) -> ResponseBody {
    let body = &world.bodies[at as usize];
    // Of two bodies the larger restitution counts: this one leaves it to the other.
    let plain = Dynamics { mass: MassProperties::STATIC, restitution: 0.0, friction: 1.0 };
    let Dynamics { mass, restitution, friction } = body.dynamics.unwrap_or(plain);
    ResponseBody { mass, restitution, friction, rows: *world.places.rows(at), velocity: body.velocity }
}

/// Place of the body that an error names.
fn faulty(error: &ResponseError) -> usize {
    match error {
        ResponseError::Mass { body, .. }
        | ResponseError::Inertia { body }
        | ResponseError::Restitution { body, .. }
        | ResponseError::Friction { body, .. }
        | ResponseError::NotFinite { body } => *body,
        _ => 0,
    }
}
