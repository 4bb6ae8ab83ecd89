//! Two bodies, or two triangles, in the kernel, and what it says of them in the words of the protocol.

use std::sync::Arc;

use collided_kernel::{
    BodyId, Containment, Effects, NoClock, Object, Report, Scene, StepError, Transforms, Verdict, brute_force,
    polygon_test,
};
use collided_protocol::report::Relation;
use collided_protocol::step::Rows;
use glam::DVec3;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::oracle::{self, Triangle};

/// How two closed triangles meet, as the kernel sees it.
pub fn triangles(a: &Triangle, b: &Triangle) -> Relation {
    relation(polygon_test::triangles(&a.map(DVec3::from), &b.map(DVec3::from)))
}

/// A relation of the kernel in the words of the protocol.
pub fn relation(relation: Option<collided_kernel::Relation>) -> Relation {
    match relation {
        None => Relation::None,
        Some(collided_kernel::Relation::Touch) => Relation::Touch,
        Some(collided_kernel::Relation::Coplanar) => Relation::Coplanar,
        Some(collided_kernel::Relation::Cross) => Relation::Cross,
    }
}

/// A scene of two bodies.
pub struct KernelPair {
    scene: Scene,
    bodies: [BodyId; 2],
}

/// What a report says of the two bodies.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// Whether the pair is interfering; the alternative is proven clear.
    pub interfering: bool,
    /// Strongest relation of the polygon pairs; [`Relation::None`] when not asked for.
    pub relation: Relation,
    /// Polygon of the first body, of the second, and how they meet; empty when not asked for.
    pub polygon_pairs: Vec<(u32, u32, Relation)>,
    /// Which body is inside the other; [`Containment::None`] when not asked for.
    pub containment: Containment,
}

impl Outcome {
    /// Of all interfering polygon pairs of two surfaces.
    pub fn of(polygon_pairs: Vec<(u32, u32, Relation)>) -> Outcome {
        Outcome {
            interfering: !polygon_pairs.is_empty(),
            relation: oracle::strongest(&polygon_pairs),
            polygon_pairs,
            containment: Containment::None,
        }
    }

    /// What the same bodies give when the second one is named first.
    pub fn swapped(mut self) -> Outcome {
        self.polygon_pairs.iter_mut().for_each(|(a, b, _)| std::mem::swap(a, b));
        self.polygon_pairs.sort_unstable();
        self.containment = swapped(self.containment);
        self
    }
}

impl KernelPair {
    /// The two objects, placed by the identity.
    pub fn new(a: &Arc<Object>, b: &Arc<Object>, effects: Effects) -> KernelPair {
        let mut scene = Scene::new(effects);
        let bodies = [a, b].map(|object| scene.add_body(Arc::clone(object), None));
        KernelPair { scene, bodies }
    }

    /// One step, in the current rayon pool.
    ///
    /// # Errors
    /// Those of [`Scene::step`].
    ///
    /// # Panics
    /// When the report is not about the two bodies, or leaves the pair open.
    pub fn step(&mut self, rows_a: Rows, rows_b: Rows) -> Result<Outcome, StepError> {
        let report = self.scene.step(Transforms::Dense(&[rows_a, rows_b]), &NoClock)?;
        Ok(outcome(&report, self.bodies))
    }
}

/// The same of two bodies that have changed places.
fn swapped(containment: Containment) -> Containment {
    match containment {
        Containment::None => Containment::None,
        Containment::AInB => Containment::BInA,
        Containment::BInA => Containment::AInB,
        Containment::APartlyInB => Containment::BPartlyInA,
        Containment::BPartlyInA => Containment::APartlyInB,
        Containment::UnknownAOpen => Containment::UnknownBOpen,
        Containment::UnknownBOpen => Containment::UnknownAOpen,
        Containment::UnknownAInconsistent => Containment::UnknownBInconsistent,
        Containment::UnknownBInconsistent => Containment::UnknownAInconsistent,
    }
}

/// A pool of one thread and one of two, to run the same steps in.
///
/// # Panics
/// When threads cannot be started.
pub fn pools() -> [ThreadPool; 2] {
    [1, 2].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started"))
}

/// What the brute-force twin finds, everything asked for.
pub fn brute_force([a, b]: [&Object; 2], [rows_a, rows_b]: [&Rows; 2]) -> Outcome {
    let found = brute_force::polygon_pairs(a, rows_a, b, rows_b);
    Outcome::of(found.iter().map(|found| (found.a, found.b, relation(Some(found.relation)))).collect())
}

fn outcome(report: &Report<'_>, bodies: [BodyId; 2]) -> Outcome {
    let [pair] = report.pairs() else {
        assert!(report.pairs().is_empty(), "two bodies are one pair, not {}", report.pairs().len());
        return Outcome::of(Vec::new());
    };
    assert_eq!([pair.a, pair.b], bodies);
    let interfering = pair.verdict == Verdict::Interfering;
    let unknown = pair.containment.is_some_and(|containment| containment != Containment::None);
    assert!(pair.verdict != Verdict::Possible, "at full accuracy nothing stays open");
    assert!(interfering || unknown, "what is clear is listed only when its containment is not known");
    let found = report.polygon_pairs(pair).iter();
    Outcome {
        interfering,
        relation: relation(pair.relation),
        polygon_pairs: found.map(|found| (found.a, found.b, relation(Some(found.relation)))).collect(),
        containment: pair.containment.unwrap_or(Containment::None),
    }
}
