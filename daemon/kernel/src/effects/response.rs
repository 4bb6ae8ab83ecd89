//! Effect `response`: impulses at the contacts of bodies with mass, and the velocities after.
//!
//! The model is impulsive: positions stay, velocities jump, and an impulse on one body of a pair is the opposite of that on the
//! other at the same point. So linear momentum and angular momentum about any point are conserved up to rounding. Nothing is
//! integrated: gravity is for the caller to add to the velocities before (g·dt).
//!
//! # The rule
//! Bodies that touch, static ones left out, hang together in islands; each is solved by itself, in the order of its pairs.
//! 1. **Rest**: what approaches is stopped at all points together, with friction, by sequential impulses with accumulated
//!    clamping (Catto 2005, "Iterative Dynamics with Temporal Coherence"), which is projected Gauss–Seidel, hastened by
//!    conjugate directions. Tangential impulses stay in the Coulomb cone: at most μ times the normal impulse in any direction.
//! 2. **Impact**, from the velocities before, each restitution divided by E, the largest of the island: the pair that approaches
//!    fastest is taken alone (the first one of equals) and its contact points collide at once; then again the fastest, until
//!    none approaches faster than [`RESTING`]; what is left comes to rest. So an impulse runs through a row of bodies, as in
//!    Newton's cradle (the Gauss–Seidel rule in Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012, "Reflections on Simultaneous
//!    Impact"). The points of a pair follow Moreau's law: the impulses that just stop the approach, times 1 + e, which gives
//!    each point that was pushed Newton's −e times its speed of approach. Then friction, up to μ times the normal impulse.
//! 3. The impulses are 1 − E times those of the first and E times those of the second.
//!
//! A pair that meets no other one so rebounds by its own restitution: E·(e/E). In a stack impacts of 0 < e < 1 taken one by one
//! would go on without end (McNamara, Young 1992, "Inelastic collapse and clumping in a one-dimensional granular medium"), and
//! those until [`RESTING`] grow, for each pair, with the square of its height; elastic ones with its height. Momentum, the Coulomb cones and "nothing
//! approaches" are kept by any such mean, because they are convex, and so is the kinetic energy. (Chatterjee, Ruina 1998, "A
//! New Algebraic Rigid-Body Collision Law Based on Impulse Space Considerations" combine impulses of two limits for one contact.)
//!
//! Without friction neither raises the kinetic energy, for e up to 1; friction takes energy away. A pair's restitution is the
//! larger and its friction the geometric mean of the two bodies' (as in Box2D).
//!
//! # How exact it is
//! Iterations end when no impulse of a round changes the velocity of its contact by more than [`TOLERANCE`] of the island's
//! fastest contact, or after [`MAX_ROUNDS`] rounds; impacts end after [`MAX_IMPACTS`] per pair of the island, and what is left
//! of them comes to rest. [`Response::was_capped`] says when a cap was reached: contacts that jam converge slowest, and impacts
//! of pairs with much less restitution than the island's largest.

mod manifold;
mod mass;
mod solver;

use std::borrow::Borrow;

use crate::affine::Rows;
pub use manifold::add_manifold;
pub use mass::MassProperties;
use solver::Solver;

/// Change of a contact's velocity, relative to the fastest contact of the island, that ends the iterations.
pub const TOLERANCE: f64 = 1e-12;

/// Speed of approach, relative to the fastest contact of the island, that no longer bounces.
pub const RESTING: f64 = 1e-6;

/// The most rounds over the contacts in one solution.
pub const MAX_ROUNDS: u32 = 4096;

/// The most impacts of an island, per pair of it.
pub const MAX_IMPACTS: usize = 64;

/// A body as the response sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponseBody {
    /// Mass, centre and inertia in the object's frame.
    pub mass: MassProperties,
    /// 0 (nothing bounces) to 1 (nothing is lost).
    pub restitution: f64,
    /// Coulomb's coefficient, 0 or more.
    pub friction: f64,
    /// Where it stands.
    pub rows: Rows,
    /// Velocity before.
    pub velocity: Velocity,
}

/// How a body moves. World frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Velocity {
    /// Of the centre of mass, in length units per time unit.
    pub linear: [f64; 3],
    /// In radians per time unit.
    pub angular: [f64; 3],
}

/// A point where two bodies touch, and the unit vector from the first to the second there. World frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManifoldPoint {
    /// World position.
    pub position: [f64; 3],
    /// Unit vector.
    pub normal: [f64; 3],
}

/// Two bodies that touch, by their places in the list of bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePair<'m> {
    /// The first body.
    pub a: usize,
    /// The second body.
    pub b: usize,
    /// Where they touch, for example from [`add_manifold`].
    pub manifold: &'m [ManifoldPoint],
}

/// What happened at one contact point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulse {
    /// Which of the pairs.
    pub pair: usize,
    /// World position.
    pub point: [f64; 3],
    /// On the second body, in mass times velocity; the first one receives the opposite.
    pub on_b: [f64; 3],
}

/// Why there is no response. Bodies are named by their places in the list.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// A mass that is not positive.
    #[error("body {body} has mass {mass}; give a positive number, or infinity for a body that never moves")]
    Mass {
        /// The body.
        body: usize,
        /// Its mass.
        mass: f64,
    },
    /// An inertia tensor that no body of that mass has.
    #[error("body {body} has an inertia tensor that is not symmetric and positive definite where it stands")]
    Inertia {
        /// The body.
        body: usize,
    },
    /// Restitution outside of 0 to 1.
    #[error("body {body} has restitution {restitution}; give a number from 0 to 1")]
    Restitution {
        /// The body.
        body: usize,
        /// Its restitution.
        restitution: f64,
    },
    /// Friction below 0.
    #[error("body {body} has friction {friction}; give a finite number, 0 or more")]
    Friction {
        /// The body.
        body: usize,
        /// Its friction.
        friction: f64,
    },
    /// A velocity, transform or centre of mass that is NaN or infinite.
    #[error("body {body} has a velocity, transform or centre of mass that is not finite")]
    NotFinite {
        /// The body.
        body: usize,
    },
    /// A density that is not positive.
    #[error("density {density} is not a positive finite number")]
    Density {
        /// The density.
        density: f64,
    },
    /// The mesh does not enclose a volume.
    #[error("the mesh is open at {edges} edges; close it, or give mass, centre and inertia instead of a density")]
    OpenMesh {
        /// Edges of an odd number of triangles.
        edges: usize,
    },
    /// The faces of the mesh run different ways around.
    #[error(
        "the faces of the mesh disagree at {edges} edges about which side is out; turn them, or give mass, centre and inertia instead of a density"
    )]
    InconsistentMesh {
        /// Edges along which neighbours disagree.
        edges: usize,
    },
    /// The mesh is closed around nothing.
    #[error("the mesh encloses no volume; give mass, centre and inertia instead of a density")]
    NoVolume,
}

/// The response of one set of bodies. Its memory serves one step after the other.
#[derive(Debug, Default)]
pub struct Response {
    solver: Solver,
    velocities: Vec<Velocity>,
    impulses: Vec<Impulse>,
}

impl Response {
    /// Computes impulses and velocities.
    ///
    /// # Errors
    /// [`ResponseError`] names the body and the value. Nothing is computed then.
    ///
    /// # Panics
    /// When a pair names a body that is not there.
    ///
    /// ```
    /// use collided_kernel::affine::IDENTITY;
    /// use collided_kernel::effects::response::{
    ///     ManifoldPoint, MassProperties, Response, ResponseBody, ResponsePair, Velocity,
    /// };
    ///
    /// let inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// let velocity = Velocity { linear: [2.0, 0.0, 0.0], ..Velocity::default() };
    /// let mass = MassProperties { mass: 1.0, centre: [0.0; 3], inertia };
    /// let ball = ResponseBody { mass, restitution: 1.0, friction: 0.0, rows: IDENTITY, velocity };
    /// let wall = ResponseBody { mass: MassProperties::STATIC, velocity: Velocity::default(), ..ball };
    /// let touch = [ManifoldPoint { position: [0.5, 0.0, 0.0], normal: [1.0, 0.0, 0.0] }];
    /// let mut response = Response::default();
    /// response.solve(&[ball, wall], &[ResponsePair { a: 0, b: 1, manifold: &touch }])?;
    /// assert_eq!(response.velocities()[0].linear, [-2.0, 0.0, 0.0]);
    /// # Ok::<(), collided_kernel::effects::response::ResponseError>(())
    /// ```
    pub fn solve<'m>(
        &mut self,
        bodies: &[ResponseBody],
        pairs: impl IntoIterator<Item = impl Borrow<ResponsePair<'m>>>,
    ) -> Result<(), ResponseError> {
        self.velocities.clear();
        self.impulses.clear();
        self.solver.start(bodies, pairs)?;
        self.solver.solve();
        self.velocities.extend(bodies.iter().map(|body| body.velocity));
        self.impulses.extend(self.solver.impulses());
        self.solver.velocities_after(&mut self.velocities);
        Ok(())
    }

    /// Velocities after, in the order of the bodies.
    pub fn velocities(&self) -> &[Velocity] {
        &self.velocities
    }

    /// Whether a cap on rounds or impacts ended the solution: momentum is conserved all the same, but bodies may still
    /// approach, or slide where they should stick.
    pub fn was_capped(&self) -> bool {
        self.solver.was_capped()
    }

    /// Impulses other than zero, in the order of the pairs and of their points.
    pub fn impulses(&self) -> &[Impulse] {
        &self.impulses
    }
}
