//! Every hard case through the kernel's whole pipeline: any order of the voxel matrices, either body first, one thread or two.

use std::collections::BTreeMap;
use std::sync::Arc;

use collided_kernel::{Containment, Effects, Object, ObjectError, PolygonMesh, StepError};
use collided_tests::hardcases::{self, Answer, Case, Expected, Mesh};
use collided_tests::kernel_pair::{self, KernelPair, Outcome};
use rayon::ThreadPool;

/// Even and odd, below, at and above one level of the pyramid (six halvings).
const ORDERS: [u32; 6] = [0, 1, 6, 7, 12, 18];

fn build(mesh: &Mesh, order: Option<u32>) -> Result<Arc<Object>, ObjectError> {
    let polygons = PolygonMesh::from_polygons(mesh.vertices.clone(), &mesh.polygons);
    Object::build(polygons, order, &()).map(Arc::new)
}

/// The reason for which an object or a step was refused, in the words of the table.
fn reason(error: &(dyn std::error::Error + 'static)) -> &'static str {
    let object = error.downcast_ref().map(|error| match error {
        ObjectError::NonFiniteVertex { .. } => "non-finite vertex",
        ObjectError::IndexOutOfRange { .. } => "index out of range",
        ObjectError::TooFewCorners { .. } => "polygon with fewer than 3 vertices",
        _ => "another error of an object",
    });
    let step = error.downcast_ref().map(|error| match error {
        StepError::NonFiniteTransform { .. } => "non-finite matrix",
        StepError::WorldOverflow { .. } => "non-finite world vertex",
        _ => "another error of a step",
    });
    object.or(step).unwrap_or("another error")
}

/// The objects of a case, or why there are none.
type Objects = Result<[Arc<Object>; 2], ObjectError>;

/// One way to run a case.
#[derive(Clone, Copy)]
struct Way<'a> {
    swapped: bool,
    effects: Effects,
    pool: &'a ThreadPool,
}

fn run(case: &Case, objects: Objects, way: Way<'_>) -> Result<Outcome, Box<dyn std::error::Error + Send + Sync>> {
    let [a, b] = objects?;
    way.pool.install(|| {
        if way.swapped {
            let outcome = KernelPair::new(&b, &a, way.effects).step(case.rows_b, case.rows_a)?;
            return Ok(outcome.swapped());
        }
        Ok(KernelPair::new(&a, &b, way.effects).step(case.rows_a, case.rows_b)?)
    })
}

/// Whether the kernel cuts the polygons into the very triangles that the table speaks of.
fn same_triangles(mesh: &Mesh) -> bool {
    build(mesh, Some(0)).is_ok_and(|object| {
        let polygon_of = (0..object.triangle_count()).map(|triangle| object.polygon_of(triangle));
        object.triangles() == mesh.triangles && polygon_of.eq(mesh.polygon_of.iter().copied())
    })
}

/// What is wrong with an outcome; `None` when nothing is.
fn fault(case: &Case, answer: &Answer, outcome: &Outcome, relations_comparable: bool) -> Option<String> {
    let pairs: Vec<_> = outcome.polygon_pairs.iter().map(|&(a, b, _)| (a, b)).collect();
    if outcome.interfering != answer.interfering {
        Some(format!("interfering: {}", outcome.interfering))
    } else if containment(outcome.containment) != answer.containment.as_deref() {
        Some(format!("containment {:?}", outcome.containment))
    } else if pairs != answer.polygon_pairs {
        Some(format!("polygon pairs {pairs:?}, not {:?}", answer.polygon_pairs))
    } else if outcome.relation != answer.relation {
        Some(format!("relation {}, not {}", outcome.relation.name(), answer.relation.name()))
    } else if relations_comparable && outcome.polygon_pairs != case.polygon_relations(answer) {
        Some(format!("relations {:?}", outcome.polygon_pairs))
    } else {
        None
    }
}

/// In the words of the table, which takes what is inside an open mesh for outside.
fn containment(found: Containment) -> Option<&'static str> {
    match found {
        Containment::AInB => Some("a_in_b"),
        Containment::BInA => Some("b_in_a"),
        Containment::None | Containment::UnknownBOpen | Containment::UnknownAOpen => None,
        _ => Some("another one"),
    }
}

/// Without the effect containment, the verdict is about surfaces.
fn fault_of_verdict_alone(answer: &Answer, outcome: &Outcome) -> Option<String> {
    let expected = Outcome { interfering: answer.surface_contact, ..Outcome::of(Vec::new()) };
    (*outcome != expected).then(|| format!("with the effect interference alone: {outcome:?}"))
}

fn fault_in_one_way(case: &Case, objects: Objects, way: Way<'_>, relations_comparable: bool) -> Option<String> {
    match (&case.expected, run(case, objects, way)) {
        (Expected::Answer(answer), Ok(outcome)) if way.effects.contains(Effects::CONTAINMENT) => {
            fault(case, answer, &outcome, relations_comparable)
        }
        (Expected::Answer(answer), Ok(outcome)) => fault_of_verdict_alone(answer, &outcome),
        (Expected::Answer(_), Err(error)) => Some(format!("refused: {error}")),
        (Expected::Refused { .. }, Ok(outcome)) => Some(format!("not refused: {outcome:?}")),
        (Expected::Refused { reason: expected }, Err(error)) => {
            let found = reason(error.as_ref());
            (found != expected).then(|| format!("refused because of {found}, not of {expected}: {error}"))
        }
    }
}

/// Either body first, on one thread and on two, and the verdict alone.
fn ways(pools: &[ThreadPool; 2]) -> [Way<'_>; 5] {
    let [one, two] = pools;
    let effects = Effects::POLYGON_PAIRS.union(Effects::CONTAINMENT);
    [
        Way { swapped: false, effects, pool: one },
        Way { swapped: true, effects, pool: one },
        Way { swapped: false, effects, pool: two },
        Way { swapped: true, effects: effects.union(Effects::INTERFERENCE), pool: two },
        Way { swapped: false, effects: Effects::INTERFERENCE, pool: two },
    ]
}

fn faults_at_order(case: &Case, order: Option<u32>, pools: &[ThreadPool; 2]) -> Vec<String> {
    let comparable = same_triangles(&case.a) && same_triangles(&case.b);
    let objects = || Ok([build(&case.a, order)?, build(&case.b, order)?]);
    let objects: Objects = objects();
    let fault = |way: Way<'_>| {
        let fault = fault_in_one_way(case, objects.clone(), way, comparable)?;
        let threads = way.pool.current_num_threads();
        Some(format!("{}: order {order:?}, swapped {}, {threads} threads: {fault}", case.id, way.swapped))
    };
    ways(pools).into_iter().filter_map(fault).collect()
}

fn faults(case: &Case, pools: &[ThreadPool; 2]) -> Vec<String> {
    let orders = ORDERS.map(Some).into_iter().chain([None]);
    orders.flat_map(|order| faults_at_order(case, order, pools)).collect()
}

#[test]
fn the_whole_table() {
    let pools = kernel_pair::pools();
    let mut table: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    let mut all_faults = Vec::new();
    for case in hardcases::static_cases() {
        let faults = faults(&case, &pools);
        let [cases, wrong] = table.entry(case.group).or_default();
        *cases += 1;
        *wrong += usize::from(!faults.is_empty());
        all_faults.extend(faults);
    }
    println!("{:<20} {:>6} {:>6}", "group", "cases", "wrong");
    for (group, [cases, wrong]) in &table {
        println!("{group:<20} {cases:>6} {wrong:>6}");
    }
    assert!(all_faults.is_empty(), "{} faults:\n{}", all_faults.len(), all_faults.join("\n"));
    assert_eq!(table.values().map(|[cases, _]| cases).sum::<usize>(), 246);
}

#[test]
fn cubes_that_other_libraries_get_wrong() {
    for order in ORDERS {
        let cube = build(&hardcases::unit_cube(), Some(order)).expect("a cube is valid");
        let mut pair = KernelPair::new(&cube, &cube, Effects::INTERFERENCE);
        for case in hardcases::cube_cases() {
            let outcome = pair.step(case.rows_a, case.rows_b).expect("the transforms are finite");
            assert_eq!(outcome.interfering, case.surface_contact(), "{} at order {order}", case.name);
        }
    }
}
