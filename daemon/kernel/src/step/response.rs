//! Stage 9 of all pairs together: impulses and the velocities after, for bodies with mass.

use super::{Kept, Results};
use crate::effects::response::{
    Impulse, ManifoldPoint, MassProperties, Response, ResponseBody, ResponseError, ResponsePair, Velocity,
};
use crate::scene::{Body, BodyId, Dynamics};

/// Memory of the response, and what came of it.
#[derive(Debug, Default)]
pub(crate) struct StepResponse {
    solver: Response,
    /// Indices of the scene's bodies that take part, ascending.
    members: Vec<u32>,
    bodies: Vec<ResponseBody>,
    points: Vec<ManifoldPoint>,
    /// Place of the pair in the report, where it acts, and what body `b` gets.
    pub impulses: Vec<(u32, Impulse)>,
    /// Velocities after, of the bodies with mass that an impulse has reached; ascending.
    pub velocities: Vec<(BodyId, Velocity)>,
    /// The body for which there is none: its inertia, where it stands, is not positive definite.
    pub fault: Option<BodyId>,
}

impl StepResponse {
    pub fn solve(&mut self, results: &Results, kept: &[Kept], bodies: &[Body]) {
        self.impulses.clear();
        self.velocities.clear();
        self.fault = None;
        if results.manifold.is_empty() {
            return;
        }
        let places: Vec<[u32; 2]> = runs(results)
            .map(|(place, _)| {
                let kept = results.kept_pair(place, kept);
                [kept.a, kept.b]
            })
            .collect();
        self.members.clear();
        self.members.extend(places.iter().flatten());
        self.members.sort_unstable();
        self.members.dedup();
        self.bodies.clear();
        self.bodies.extend(self.members.iter().map(|&body| response_body(&bodies[body as usize])));
        self.points.clear();
        self.points.extend(results.manifold.iter().map(|&(_, point)| point));
        let member = |body: u32| self.members.partition_point(|&other| other < body);
        let mut first = 0;
        let pairs: Vec<ResponsePair<'_>> = runs(results)
            .zip(&places)
            .map(|((_, count), &[a, b])| {
                let manifold = &self.points[first..first + count];
                first += count;
                ResponsePair { a: member(a), b: member(b), manifold }
            })
            .collect();
        if let Err(error) = self.solver.solve(&self.bodies, &pairs) {
            self.fault = Some(bodies[self.members[faulty(&error)] as usize].id);
            return;
        }
        let places: Vec<u32> = runs(results).map(|(place, _)| place).collect();
        self.impulses.extend(self.solver.impulses().iter().map(|&impulse| (places[impulse.pair], impulse)));
        let moved = self.members.iter().zip(self.solver.velocities()).zip(&self.bodies);
        let moved = moved.filter(|((_, after), before)| **after != before.velocity);
        self.velocities.extend(moved.map(|((&member, &after), _)| (bodies[member as usize].id, after)));
    }
}

/// The pairs with contact points: place in the report, and how many points.
fn runs(results: &Results) -> impl Iterator<Item = (u32, usize)> {
    results.manifold.chunk_by(|one, other| one.0 == other.0).map(|points| (points[0].0, points.len()))
}

fn response_body(body: &Body) -> ResponseBody {
    // Of two bodies the larger restitution counts: this one leaves it to the other.
    let plain = Dynamics { mass: MassProperties::STATIC, restitution: 0.0, friction: 1.0 };
    let Dynamics { mass, restitution, friction } = body.dynamics.unwrap_or(plain);
    ResponseBody { mass, restitution, friction, rows: body.rows, velocity: body.velocity }
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
