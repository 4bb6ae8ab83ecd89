//! Batches: the verdicts are those of single steps with the same poses, and the scene is as it was.

use std::sync::Arc;

use collided_client as client;
use collided_client::{Batch, BodySpec, Effect, Error, ErrorCode};
use collided_kernel::affine::IDENTITY;
use collided_kernel::{
    Accuracy, BatchInput, BodyId, Budget, Effects, GroupId, Interest, Level, NoClock, Object, Report, Scene, StepError,
    Transforms, Verdict,
};
use collided_protocol::step::Rows;
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::kernel_pair::pools;
use collided_tests::solids::{at, cuboid, tetrahedron};
use collided_tests::{crowd, meshes};

const BODIES: usize = 24;
/// The bodies whose poses vary, in several cases.
const NAMED: [&[u32]; 3] = [&[7], &[20, 3, 11, 4], &[23, 0, 1, 2, 8, 9, 10, 12, 13, 14, 15, 16, 17, 18, 19, 21, 22]];
const CANDIDATES: usize = 40;
/// Of the cube in which bodies are: some meet, some do not.
const SIDE: f64 = 6.0;

/// Boxes large enough to hold others, small ones, and bunnies; some in groups, some with rules.
fn scene(effects: Effects) -> Scene {
    let objects: [Arc<Object>; 4] =
        [cuboid([0.9, 0.8, 0.7]), cuboid([0.05; 3]), meshes::shipped("low_poly_bunny", None), tetrahedron(0.3)];
    let mut scene = Scene::new(effects);
    for body in 0..BODIES {
        scene.add_body(Arc::clone(&objects[body % 4]), (body % 6 == 3).then_some(GroupId(1)));
    }
    let rules = [(7, 2, Interest::Ignore), (3, 4, Interest::Effects(Effects::CONTAINMENT)), (11, 20, Interest::Ignore)];
    for (a, b, interest) in rules {
        scene.set_interest(BodyId(a), BodyId(b), interest).expect("both are there");
    }
    scene
}

fn crowd_of(count: usize, seed: u64) -> Vec<Vec<Rows>> {
    crowd::moving_within(SIDE, count, CANDIDATES, seed)
}

/// Poses that have nothing to do with each other.
fn candidates(bodies: usize, seed: u64) -> Vec<Rows> {
    (0..CANDIDATES as u64)
        .flat_map(|candidate| crowd::moving_within(SIDE, bodies, 1, 100 * seed + candidate).remove(0))
        .collect()
}

fn ids(named: &[u32]) -> Vec<BodyId> {
    named.iter().map(|&body| BodyId(body)).collect()
}

fn place(scene: &mut Scene, rows: &[Rows]) {
    scene.step(Transforms::Dense(rows), &NoClock).expect("the transforms are finite");
}

fn batch(scene: &mut Scene, named: &[u32], rows: &[Rows], stop_at: Option<Verdict>) -> Vec<Option<Verdict>> {
    let input = BatchInput { bodies: &ids(named), rows, stop_at };
    scene.batch(&input, &NoClock).expect("the transforms are finite").verdicts().collect()
}

/// What a report says of the pairs with a named body.
fn verdict(report: &Report<'_>, named: &[u32]) -> Verdict {
    let concerned = report.pairs().iter().filter(|pair| [pair.a.0, pair.b.0].iter().any(|body| named.contains(body)));
    let verdicts: Vec<_> = concerned.map(|pair| pair.verdict).collect();
    let strongest = [Verdict::Interfering, Verdict::Possible].into_iter().find(|verdict| verdicts.contains(verdict));
    strongest.unwrap_or(Verdict::Clear)
}

/// The verdicts of single steps, each from where the bodies rest.
fn single_steps(scene: &mut Scene, rest: &[Rows], named: &[u32], rows: &[Rows]) -> Vec<Option<Verdict>> {
    let candidates = rows.chunks(named.len()).map(|rows| {
        let mut all = rest.to_vec();
        named.iter().zip(rows).for_each(|(&body, rows)| all[body as usize] = *rows);
        let report = scene.step(Transforms::Dense(&all), &NoClock).expect("the transforms are finite");
        Some(verdict(&report, named))
    });
    candidates.collect()
}

/// Of several cases together, so that none of the verdicts is missing.
fn count(verdicts: &[Option<Verdict>], verdict: Verdict) -> usize {
    verdicts.iter().filter(|found| **found == Some(verdict)).count()
}

#[test]
fn verdicts_are_those_of_single_steps() {
    let rest = crowd_of(BODIES, 1).remove(0);
    let level = |level, order| Accuracy { level, order, ..Accuracy::default() };
    let accuracies = [
        Accuracy::default(),
        level(Level::Voxels, Some(7)),
        level(Level::Voxels, None),
        level(Level::Containers, None),
        level(Level::GlobalBoxes, None),
    ];
    let effects = [Effects::INTERFERENCE, Effects::CONTAINMENT, Effects::POLYGON_PAIRS.union(Effects::DISTANCE)];
    let mut seen = Vec::new();
    for (case, (effects, accuracy)) in effects.iter().flat_map(|e| accuracies.iter().map(move |a| (*e, *a))).enumerate()
    {
        let (mut batched, mut stepped) = (scene(effects), scene(effects));
        for scene in [&mut batched, &mut stepped] {
            scene.set_accuracy(accuracy);
            let own = Some(level(Level::Containers, None));
            scene.set_pair_accuracy(BodyId(7), BodyId(0), own).expect("both are there");
        }
        place(&mut batched, &rest);
        for named in NAMED {
            let rows = candidates(named.len(), case as u64);
            let found = batch(&mut batched, named, &rows, None);
            assert_eq!(found, single_steps(&mut stepped, &rest, named, &rows), "{accuracy:?}, {effects:?}, {named:?}");
            if named.len() == 1 {
                seen.push(found);
            }
        }
    }
    let seen = seen.concat();
    for verdict in [Verdict::Clear, Verdict::Interfering, Verdict::Possible] {
        assert!(count(&seen, verdict) > 30, "{verdict:?}: {}", count(&seen, verdict));
    }
}

#[test]
fn what_is_inside_another_body_interferes_where_that_is_asked() {
    for (effects, inside) in [(Effects::CONTAINMENT, Verdict::Interfering), (Effects::INTERFERENCE, Verdict::Clear)] {
        let mut scene = Scene::new(effects);
        scene.add_body(cuboid([1.0; 3]), None);
        scene.add_body(cuboid([0.1; 3]), None);
        let rows = [at(0.0, 0.0, 0.0), at(0.95, 0.0, 0.0), at(1.1, 0.0, 0.0), at(1.2, 0.0, 0.0)];
        // No step has placed the bodies yet: they are at the identity.
        let found = batch(&mut scene, &[1], &rows, None);
        assert_eq!(found, [inside, Verdict::Interfering, Verdict::Interfering, Verdict::Clear].map(Some));
    }
}

#[test]
fn no_body_has_moved_afterwards() {
    let steps = crowd_of(BODIES, 2);
    let all = [Effects::POLYGON_PAIRS, Effects::CONTAINMENT, Effects::CONTACTS, Effects::TIME_OF_CONTACT];
    let effects = all.into_iter().fold(Effects::NONE, Effects::union);
    let (mut with, mut without) = (scene(effects), scene(effects));
    let mut searched = 0;
    // With one thread, counts tell, too, whether what is remembered is the same.
    let [pool, _] = pools();
    for (number, rows) in steps.iter().enumerate() {
        let said = [&mut with, &mut without].map(|scene| {
            let report =
                pool.install(|| scene.step(Transforms::Dense(rows), &NoClock)).expect("the transforms are finite");
            let pairs: Vec<_> = report.pairs().iter().map(|pair| (pair, report.polygon_pairs(pair))).collect();
            let more = (report.regions(), report.contacts().regions(), report.times_of_contact(), report.time_fault());
            format!("{pairs:?} {more:?} {:?}", report.counts())
        });
        assert_eq!(said[0], said[1], "step {number}");
        let named = NAMED[number % 3];
        let input = BatchInput { bodies: &ids(named), rows: &candidates(named.len(), number as u64), stop_at: None };
        searched +=
            pool.install(|| with.batch(&input, &NoClock)).expect("the transforms are finite").counts().exact_tests;
    }
    assert!(searched > 1000, "{searched} exact tests");
}

#[test]
fn a_batch_ends_at_the_first_candidate_of_a_verdict_whatever_the_threads() {
    let rest = crowd_of(BODIES, 3).remove(0);
    // Many, so that two threads have begun others by then.
    let rows: Vec<Rows> = (0..30).flat_map(|seed| candidates(1, 1000 + seed)).collect();
    let mut scene = scene(Effects::INTERFERENCE);
    let coarse = Accuracy { level: Level::Containers, ..Accuracy::default() };
    scene.set_pair_accuracy(BodyId(7), BodyId(0), Some(coarse)).expect("both are there");
    place(&mut scene, &rest);
    let all = batch(&mut scene, &[7], &rows, None);
    assert!(all.iter().all(Option::is_some));
    let pools = pools();
    for verdict in [Verdict::Clear, Verdict::Interfering, Verdict::Possible] {
        for first in [0, 10, 700] {
            let rows = &rows[first..];
            let stop = all[first..].iter().position(|found| *found == Some(verdict)).expect("some candidate is");
            let expected: Vec<_> = (0..rows.len()).map(|at| all[first + at].filter(|_| at <= stop)).collect();
            for pool in &pools {
                let found = pool.install(|| batch(&mut scene, &[7], rows, Some(verdict)));
                assert_eq!(found, expected, "{verdict:?} from {first} on");
            }
        }
    }
    let free = batch(&mut scene, &[7], &[at(0.0, 0.0, 90.0); 3], Some(Verdict::Interfering));
    assert_eq!(free, [Some(Verdict::Clear); 3]);
}

/// A batch sees bodies that came, went or changed since the last step where they are.
#[test]
fn what_has_changed_since_the_last_step_is_seen() {
    let rest = crowd_of(BODIES, 4).remove(0);
    let (mut batched, mut stepped) = (scene(Effects::INTERFERENCE), scene(Effects::INTERFERENCE));
    let mut check = |change: &dyn Fn(&mut Scene), seed: u64| {
        change(&mut batched);
        change(&mut stepped);
        let rows = candidates(1, seed);
        let found = batch(&mut batched, &[7], &rows, None);
        let steps: Vec<_> = rows
            .iter()
            .map(|rows| {
                let transforms = Transforms::Sparse { bodies: &[7], rows: std::slice::from_ref(rows) };
                Some(verdict(&stepped.step(transforms, &NoClock).expect("the transforms are finite"), &[7]))
            })
            .collect();
        assert_eq!(found, steps, "change {seed}");
        (count(&found, Verdict::Interfering), count(&found, Verdict::Clear))
    };
    check(&|_| (), 1);
    let placed = check(&|scene| place(scene, &rest), 2);
    assert!(placed.0 > 5 && placed.1 > 5, "{placed:?}");
    let wall = cuboid([2.0, 2.0, 0.1]);
    check(&|scene| scene.replace_object(BodyId(5), Arc::clone(&wall)).expect("it is there"), 3);
    check(&|scene| scene.replace_object(BodyId(7), Arc::clone(&wall)).expect("it is there"), 4);
    check(&|scene| assert_eq!(scene.add_body(Arc::clone(&wall), None), BodyId(24)), 5);
    let full = check(&|scene| scene.remove_body(BodyId(0)).expect("it is there"), 6);
    let empty = check(&|scene| (8..24).for_each(|body| scene.remove_body(BodyId(body)).expect("it is there")), 7);
    assert!(full.0 > empty.0, "{full:?} {empty:?}");
    check(&|scene| scene.set_effects(Effects::NONE), 8);
}

#[test]
fn a_budget_leaves_candidates_open_and_never_says_more() {
    let rest = crowd_of(BODIES, 5).remove(0);
    let mut scene = scene(Effects::CONTAINMENT);
    place(&mut scene, &rest);
    let [pool, _] = pools();
    for (case, named) in NAMED.into_iter().enumerate() {
        let rows = candidates(named.len(), 50 + case as u64);
        scene.set_budget(Budget::Unlimited);
        let exact = batch(&mut scene, named, &rows, None);
        let mut open = Vec::new();
        for work in [0, 1, 50, 300, 1000, 3000, 10_000, 30_000, 100_000, 10_000_000] {
            scene.set_budget(Budget::Work(work));
            let found = pool.install(|| batch(&mut scene, named, &rows, None));
            let is_honest = |(found, exact)| found == exact || found == &Some(Verdict::Possible);
            assert!(found.iter().zip(&exact).all(is_honest), "{named:?} with {work}: {found:?}, {exact:?}");
            open.push(count(&found, Verdict::Possible));
        }
        assert_eq!((open[0], open[9]), (CANDIDATES, 0), "{open:?}");
        assert!(open.windows(2).all(|two| two[0] >= two[1]), "{open:?}");
        assert!(open.iter().any(|open| (1..CANDIDATES).contains(open)), "{open:?}");
    }
}

#[test]
fn bad_batches_are_refused_by_name_and_nothing_is_computed() {
    let mut scene = Scene::new(Effects::INTERFERENCE);
    for _ in 0..3 {
        scene.add_body(cuboid([1.0; 3]), None);
    }
    let good = [at(0.0, 0.0, 9.0), at(0.0, 5.0, 0.0), at(5.0, 0.0, 0.0), at(0.0, 0.0, 5.0)];
    let (mut not_finite, mut too_far) = (good, good);
    not_finite[3][2][1] = f64::NAN;
    too_far[2] = at(f64::MAX, 0.0, 0.0);
    too_far[2][0][0] = f64::MAX;
    let refused = |scene: &mut Scene, named: &[u32], rows: &[Rows]| {
        let input = BatchInput { bodies: &ids(named), rows, stop_at: None };
        scene.batch(&input, &NoClock).map(|report| report.verdicts().len()).expect_err("the batch is bad").to_string()
    };
    let cases: [(&[u32], &[Rows], &str); 6] = [
        (&[2, 0], &not_finite, "candidate 1: the transform of body 0 has NaN in row 2, column 1"),
        (&[2, 0], &too_far, "candidate 1: the transform of body 2 carries vertex 1"),
        (&[2, 9], &good, "transform 1 of the step is for body 9"),
        (&[2, 1, 2], &good[..3], "transform 2 of the step is for body 2, which already has one"),
        (&[2, 1, 0], &good, "4 transforms for 3 bodies"),
        (&[], &good, "4 transforms for 0 bodies"),
    ];
    for (named, rows, part) in cases {
        let error = refused(&mut scene, named, rows);
        assert!(error.contains(part), "{error:?} does not say {part:?}");
        assert_eq!(batch(&mut scene, &[2, 0], &good, None).len(), 2);
    }
    let fault =
        StepError::BadCandidate { candidate: 3, fault: Box::new(StepError::TransformCount { expected: 1, found: 2 }) };
    assert_eq!(fault.to_string(), "candidate 3: the step has 2 transforms for 1 bodies");
    assert_eq!(batch(&mut scene, &[], &[], None), []);
    assert_eq!(batch(&mut scene, &[1], &[], None), []);
    assert_eq!(batch(&mut scene, &[1], &[IDENTITY], None), [Some(Verdict::Interfering)]);
}

/// Farther apart: there is room among so many bunnies, which are three units long.
fn spread(rows: &Rows) -> Rows {
    rows.map(|[x, y, z, translation]| [x, y, z, 4.0 * translation])
}

/// Bunnies in a real daemon.
fn client_scene(daemon: &DaemonProcess) -> client::Scene {
    let client = daemon.client();
    let object = client.database("parts").load("bunny", meshes::path("low_poly_bunny")).expect("the mesh loads");
    let mut scene = client.scene("planner").effects([Effect::Interference]).create().expect("a scene");
    let specs: Vec<_> = (0..BODIES).map(|body| BodySpec::new(format!("bunny {body}"), &object)).collect();
    scene.add_bodies(&specs).expect("bodies can be added");
    scene
}

fn verdicts(scene: &mut client::Scene, batch: &Batch<'_>) -> Vec<Option<client::Verdict>> {
    scene.step_batch(batch).expect("an answer").verdicts().collect()
}

#[test]
fn through_the_daemon_one_thread_and_two_say_what_single_steps_say() {
    let rest: Vec<Rows> = crowd_of(BODIES, 6)[0].iter().map(spread).collect();
    let bodies = [client::BodyId(9), client::BodyId(2)];
    let rows: Vec<Rows> =
        (0..10).flat_map(|seed| candidates(bodies.len(), 300 + seed)).map(|rows| spread(&rows)).collect();
    let said = ["1", "2"].map(|threads| {
        let daemon = DaemonProcess::start_with(&["--threads", threads]);
        let mut scene = client_scene(&daemon);
        scene.step(&rest).expect("the transforms are finite");
        let batch = Batch { bodies: &bodies, candidates: &rows, stop_at: None };
        let all = verdicts(&mut scene, &batch);
        let report = scene.step_batch(&batch).expect("an answer");
        for verdict in [client::Verdict::Clear, client::Verdict::Interfering] {
            let first = all.iter().position(|found| *found == Some(verdict)).expect("some candidate is");
            let named =
                if verdict == client::Verdict::Clear { report.first_clear() } else { report.first_interfering() };
            assert_eq!(named, Some(first));
            let stopped = verdicts(&mut scene, &Batch { stop_at: Some(verdict), ..batch });
            assert_eq!(stopped[..=first], all[..=first]);
            assert!(stopped[first + 1..].iter().all(Option::is_none) && stopped.len() == all.len());
        }
        assert!(report.counts().exact_tests > 0 && report.times().total > 0);
        let after = scene.step_sparse(&[]).expect("an answer");
        assert_eq!(after.step(), 1, "batches are no steps");
        drop((report, after));
        let single = rows.chunks(2).map(|rows| {
            let report = scene.step_sparse(&[(bodies[0], rows[0]), (bodies[1], rows[1])]).expect("an answer");
            let concerned = report.pairs().any(|pair| bodies.contains(&pair.a()) || bodies.contains(&pair.b()));
            Some(if concerned { client::Verdict::Interfering } else { client::Verdict::Clear })
        });
        assert_eq!(single.collect::<Vec<_>>(), all);
        all
    });
    assert_eq!(said[0], said[1]);
}

#[test]
fn a_client_learns_which_candidate_is_bad() {
    let daemon = DaemonProcess::start();
    let mut scene = client_scene(&daemon);
    let bodies = [client::BodyId(0), client::BodyId(3)];
    let mut rows = vec![at(0.0, 0.0, 50.0); 8];
    let good = verdicts(&mut scene, &Batch { bodies: &bodies, candidates: &rows, stop_at: None });
    assert_eq!(good, [Some(client::Verdict::Interfering); 4], "both are in one place");
    rows[5][1][3] = f64::INFINITY;
    let mut refused = |bodies: &[client::BodyId], rows: &[Rows], code: ErrorCode, parts: &[&str]| {
        let error = scene.step_batch(&Batch { bodies, candidates: rows, stop_at: None }).expect_err("it is bad");
        assert!(matches!(error, Error::Refused(_)) && error.code() == Some(code), "{error}");
        parts.iter().for_each(|part| assert!(error.to_string().contains(part), "{error} does not say {part:?}"));
    };
    refused(&bodies, &rows, ErrorCode::NonFiniteTransform, &["candidate 2", "\"bunny 3\"", "inf", "row 1, column 3"]);
    refused(&bodies, &rows[..3], ErrorCode::BadStep, &["3 transforms", "2 bodies"]);
    refused(&[], &[], ErrorCode::BadStep, &["0 bodies"]);
    refused(&[bodies[0], bodies[0]], &rows[..4], ErrorCode::BadStep, &["\"bunny 0\""]);
    refused(&[client::BodyId(99)], &rows[..1], ErrorCode::UnknownBody, &["body 99"]);
    let none = scene.step_batch(&Batch { bodies: &bodies, ..Batch::default() }).expect("nothing is asked");
    assert_eq!((none.verdicts().len(), none.first_clear()), (0, None));
}
