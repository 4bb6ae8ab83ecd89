//! A step allocates nothing once its memory has grown: each effect alone, and all of them together. Nor does a batch.
//!
//! Known exceptions: integers of any length, which decide what two f64 do not (`predicates/any_range.rs`, the ties of
//! `contacts/position.rs`, and `time_of_contact/exact.rs` where rounding hides a contact), and rayon's own queues when a step is shared
//! out over more threads than one.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

use collided_kernel::effects::distance::DistanceSettings;
use collided_kernel::effects::response::{MassProperties, Velocity};
use collided_kernel::{
    Accuracy, BatchInput, BodyId, Dynamics, Effects, NoClock, Object, RigidMotion, Scene, StepInput, Transforms,
    Verdict,
};
use collided_protocol::step::Rows;
use collided_tests::solids::{at, cuboid};
use collided_tests::{crowd, meshes};
use rayon::ThreadPoolBuilder;

/// Counts what each thread asks the system for.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator as it came; the counter is plain memory of the thread, which needs no
// allocation and no destructor.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller keeps the contract of `alloc`, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and the memory is from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller keeps the contract of `realloc`, and the memory is from `System`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const EFFECTS: [(&str, Effects); 8] = [
    ("interference", Effects::INTERFERENCE),
    ("polygon_pairs", Effects::POLYGON_PAIRS),
    ("containment", Effects::CONTAINMENT),
    ("distance", Effects::DISTANCE),
    ("contacts", Effects::CONTACTS),
    ("penetration", Effects::PENETRATION),
    ("time_of_contact", Effects::TIME_OF_CONTACT),
    ("response", Effects::RESPONSE),
];

/// Bodies of one object, and where they are in each step of a cycle.
struct Crowd {
    name: &'static str,
    object: Arc<Object>,
    steps: Vec<Vec<Rows>>,
}

/// Bunnies that turn and drift, some into each other and some apart.
fn bunnies() -> Crowd {
    let steps = crowd::moving_within(3.0, 8, 4, 3);
    Crowd { name: "bunnies", object: meshes::shipped("low_poly_bunny", None), steps }
}

/// A stack of blocks, each touching the next; it leans now to this side, now to that.
fn stack() -> Crowd {
    let lean = |step: i32| (0..6).map(move |i| at(0.05 * f64::from(i * (step - 2)), 0.0, f64::from(i))).collect();
    Crowd { name: "stack", object: cuboid([0.5; 3]), steps: (0..4).map(lean).collect() }
}

fn scene(crowd: &Crowd, effects: Effects) -> Scene {
    let mut scene = Scene::new(effects);
    let mass = MassProperties::of_closed_mesh(&crowd.object, 1.0).expect("a closed mesh");
    let distance = DistanceSettings { up_to: 0.2, relative_tolerance: 0.0 };
    scene.set_accuracy(Accuracy { distance, ..Accuracy::default() });
    for _ in &crowd.steps[0] {
        let body = scene.add_body(Arc::clone(&crowd.object), None);
        let dynamics = Dynamics { mass, restitution: 0.5, friction: 0.3 };
        scene.set_dynamics(body, Some(dynamics)).expect("the body is there");
    }
    scene
}

/// One pass over the steps; says how many pairs interfere in them. The first body falls, and the last one turns on its way rather
/// than being placed.
fn pass(scene: &mut Scene, steps: &[Vec<Rows>], turned: &[(BodyId, RigidMotion)], ids: &[u32]) -> u64 {
    let fall = Velocity { linear: [0.1, 0.0, -1.0], angular: [0.0; 3] };
    let mut interfering = 0;
    for rows in steps {
        let transforms = Transforms::Sparse { bodies: ids, rows: &rows[..ids.len()] };
        let input = StepInput { transforms, rigid: turned, velocities: &[(BodyId(0), fall)] };
        interfering += scene.step(input, &NoClock).expect("the step is good").counts().interfering_pairs;
    }
    interfering
}

/// How often a second pass over the cycle asks the system for memory.
fn allocations(crowd: &Crowd, effects: Effects) -> u64 {
    let mut scene = scene(crowd, effects);
    let last = crowd.steps[0].len() as u32 - 1;
    let ids: Vec<u32> = (0..last).collect();
    let start = Transforms::Dense(&crowd.steps[0]);
    scene.step(start, &NoClock).expect("the step is good");
    // A whole turn: the body ends nearly where it began, and is near enough to the others on its way.
    let turn = RigidMotion { axis: [0.0, 0.0, 1.0], centre: [0.5; 3], angle: 6.25, translate: [0.0; 3] };
    let turned = [(BodyId(last), turn)];
    pass(&mut scene, &crowd.steps, &turned, &ids);
    // From the last step back to the first, as the next pass begins.
    scene.step(start, &NoClock).expect("the step is good");
    pass(&mut scene, &crowd.steps, &turned, &ids);
    scene.step(start, &NoClock).expect("the step is good");
    let before = COUNT.get();
    let interfering = pass(&mut scene, &crowd.steps, &turned, &ids);
    let count = COUNT.get() - before;
    let pairs = crowd.steps.len() * crowd.steps[0].len() * (crowd.steps[0].len() - 1) / 2;
    assert!((1..pairs as u64).contains(&interfering), "{}: {interfering} of {pairs} pairs interfere", crowd.name);
    count
}

/// How often a batch asks the system for memory after another one, and a step, of the same size.
fn allocations_of_batches(crowd: &Crowd, effects: Effects) -> u64 {
    let mut scene = scene(crowd, effects);
    let named = [BodyId(2), BodyId(0), BodyId(5)];
    let place = |scene: &mut Scene| {
        scene.step(Transforms::Dense(&crowd.steps[0]), &NoClock).expect("the step is good");
    };
    // Some where the others are, and some far off.
    let candidate = |at: usize| {
        let away = if at < 150 { 1.0 } else { 20.0 };
        crowd.steps[at % 4][(at * 7 + at / 6) % 6].map(|[x, y, z, shift]| [x, y, z, away * shift])
    };
    let rows: Vec<Rows> = (0..300).map(candidate).collect();
    let batch = BatchInput { bodies: &named, rows: &rows, stop_at: None };
    let judge = |scene: &mut Scene| {
        let report = scene.batch(&batch, &NoClock).expect("the batch is good");
        let interfering = report.verdicts().filter(|found| *found == Some(Verdict::Interfering)).count();
        assert!((1..100).contains(&interfering), "{}: {interfering} of 100", crowd.name);
    };
    (0..2).for_each(|_| {
        place(&mut scene);
        judge(&mut scene);
    });
    let before = COUNT.get();
    place(&mut scene);
    judge(&mut scene);
    judge(&mut scene);
    COUNT.get() - before
}

#[test]
fn a_batch_allocates_nothing_after_warm_up() {
    let pool = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    for effects in [Effects::INTERFERENCE, Effects::CONTAINMENT.union(Effects::POLYGON_PAIRS)] {
        assert_eq!(pool.install(|| allocations_of_batches(&bunnies(), effects)), 0, "{effects:?}");
    }
}

#[test]
fn a_step_allocates_nothing_after_warm_up() {
    let all = EFFECTS.iter().fold(Effects::NONE, |all, (_, effect)| all.union(*effect));
    let crowds = [bunnies(), stack()];
    let pool = ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started");
    // All on the one thread of the pool, whose counter is read: with more, pairs move between the memories of the threads.
    let counted: Vec<String> = pool.install(|| {
        let cases = EFFECTS.into_iter().chain([("all", all)]);
        let cases = cases.flat_map(|case| crowds.each_ref().map(|crowd| (crowd, case)));
        // Blocks that slide along each other meet where rounding hides it: integers of any length decide, which have no memory of their own.
        let cases =
            cases.filter(|(crowd, (_, effects))| crowd.name != "stack" || !effects.contains(Effects::TIME_OF_CONTACT));
        let counts = cases.map(|(crowd, (name, effects))| (crowd.name, name, allocations(crowd, effects)));
        counts
            .filter(|&(.., count)| count > 0)
            .map(|(crowd, name, count)| format!("{crowd}, {name}: {count}"))
            .collect()
    });
    assert!(counted.is_empty(), "allocations in the pass after warm-up: {counted:#?}");
}
