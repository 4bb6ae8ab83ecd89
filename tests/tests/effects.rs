//! Every effect as a client process asks for it: what the report holds, and that what was not asked for costs nothing.

use collided_client::{
    Accuracy, BodyId, Client, Containment, Dynamics, Effect, Error, ErrorCode, Mass, Mesh, Object, RigidMotion, Rows,
    Scene, StepInput, TimeOfContact, Velocity, Verdict,
};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::hardcases::unit_cube;
use collided_tests::small_meshes::at;

/// A unit cube, its corner at the origin.
fn cube(client: &Client) -> Object {
    let cube = unit_cube();
    let corners: Vec<u32> = cube.triangles.as_flattened().to_vec();
    let mesh = Mesh { vertices: &cube.vertices, corner_counts: &[3; 12], corners: &corners };
    client.database("parts").loading("cube").replace(true).mesh(&mesh).expect("a cube is valid")
}

fn scene(daemon: &DaemonProcess, effects: &[Effect], bodies: usize) -> Scene {
    let client = daemon.client();
    let cube = cube(&client);
    let mut scene = client.scene("effects").effects(effects.iter().copied()).create().expect("a scene can be created");
    for body in 0..bodies {
        scene.add_body(&format!("cube {body}"), &cube).expect("a body can be added");
    }
    scene
}

fn scaled(factor: f64, [x, y, z]: [f64; 3]) -> Rows {
    [[factor, 0.0, 0.0, x], [0.0, factor, 0.0, y], [0.0, 0.0, factor, z]]
}

#[test]
fn distance_and_its_limit() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Distance], 3);
    let transforms = [at(0.0, 0.0, 0.0), at(3.0, 4.0, 0.0), at(0.25, 0.25, 0.25)];
    let distances = |scene: &mut Scene| {
        let report = scene.step(&transforms).expect("the step is good");
        let found = report.pairs().filter_map(|pair| Some((pair.a().0, pair.b().0, pair.verdict(), *pair.distance()?)));
        found.map(|(a, b, verdict, distance)| (a, b, verdict, distance.value, distance.on_a)).collect::<Vec<_>>()
    };
    let all = distances(&mut scene);
    assert_eq!(all[0].0..=all[0].1, 0..=1);
    assert_eq!((all[0].2, all[0].3), (Verdict::Clear, (4.0f64 + 9.0).sqrt()));
    assert_eq!(all[1], (0, 2, Verdict::Interfering, 0.0, all[1].4));
    assert_eq!(all[2].3, (1.75f64 * 1.75 + 2.75 * 2.75).sqrt());
    scene.set_accuracy(Accuracy { distance_up_to: Some(3.3), ..Accuracy::default() }).expect("the limit is good");
    assert_eq!(distances(&mut scene).iter().map(|found| (found.0, found.1)).collect::<Vec<_>>(), [(0, 2), (1, 2)]);
}

#[test]
fn contacts_penetration_and_containment() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Contacts, Effect::Penetration, Effect::Containment], 4);
    let on_top = at(0.25, 0.0, 1.0);
    let beside = at(0.75, 0.1, 0.2);
    let inside = scaled(0.125, [0.5, 0.5, 0.5]);
    let report = scene.step(&[at(0.0, 0.0, 0.0), on_top, at(0.0, 0.0, 10.0), inside]).expect("the step is good");
    let pairs: Vec<_> = report.pairs().collect();
    assert_eq!(pairs.iter().map(|pair| (pair.a().0, pair.b().0)).collect::<Vec<_>>(), [(0, 1), (0, 3)]);
    let region = pairs[0].contacts().next().expect("the faces touch");
    assert_eq!((pairs[0].contacts().len(), region.normal(), region.area()), (1, [0.0, 0.0, 1.0], 0.75));
    let corners: usize = region.areas().map(|(corners, _)| corners.len()).sum();
    assert!(corners >= 4 && region.areas().all(|(corners, _)| corners.iter().all(|corner| corner[2] == 1.0)));
    assert!(pairs[0].penetration().is_some_and(|penetration| penetration.depth < 1e-12));
    assert_eq!((pairs[1].containment(), pairs[1].verdict()), (Containment::BInA, Verdict::Interfering));
    let out = pairs[1].penetration().expect("a way out").depth;
    assert!((0.5..0.5 + 1e-5).contains(&out), "{out}");
    drop(pairs);
    drop(report);
    let report = scene.step_sparse(&[(BodyId(1), beside)]).expect("the step is good");
    let pair = report.pairs().next().expect("the cubes overlap");
    let depth = pair.penetration().expect("a way out").depth;
    assert!((0.25..0.25 + 1e-5).contains(&depth), "{depth}");
    assert!(pair.contacts().all(|region| region.length() > 0.0));
}

#[test]
fn time_of_contact_of_linear_and_rigid_motions() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::TimeOfContact], 2);
    let first = scene.step(&[at(0.0, 0.0, 0.0), at(5.0, 0.0, 0.0)]).expect("the step is good");
    assert_eq!(first.pairs().len(), 0, "the first step only places the bodies");
    drop(first);
    // Past each other: at the end they are apart again.
    let report = scene.step_sparse(&[(BodyId(1), at(-11.0, 0.25, 0.0))]).expect("the step is good");
    let pair = report.pairs().next().expect("they meet on the way");
    let time = pair.time_of_contact().expect("they meet on the way");
    assert!(matches!(time, TimeOfContact::Contact { .. }), "{time:?}");
    assert!(
        time.free_until() <= 0.25 && 0.25 <= time.at_the_latest() && time.at_the_latest() - time.free_until() <= 1e-6
    );
    assert_eq!(pair.verdict(), Verdict::Clear);
    assert!(report.first_contact().is_some_and(|(pair, first)| pair.b() == BodyId(1) && first == time));
    drop(report);
    // Half a turn about the z axis through the origin brings the cube at x = -11 to x = 11, and past the other one.
    let turn = RigidMotion { angle: std::f64::consts::PI, ..RigidMotion::default() };
    scene
        .step_sparse(&[(BodyId(1), at(-11.0, 0.25, 0.0)), (BodyId(0), at(-0.5, 11.0, 0.0))])
        .expect("the step is good");
    let step = StepInput { rigid: &[(BodyId(1), RigidMotion { angle: -turn.angle, ..turn })], ..StepInput::default() };
    let report = scene.step_with(&step).expect("the step is good");
    let time = report.pairs().next().and_then(|pair| pair.time_of_contact()).expect("they meet on the way");
    assert!(0.3 < time.free_until() && time.at_the_latest() < 0.5, "{time:?}");
    let both = StepInput { transforms: &[(BodyId(1), at(0.0, 0.0, 0.0))], ..step };
    drop(report);
    let refused = scene.step_with(&both).expect_err("a body has a transform or a motion");
    assert!(matches!(&refused, Error::Refused(error) if error.code == ErrorCode::BadStep), "{refused}");
    for bad in [RigidMotion { axis: [0.0; 3], ..turn }, RigidMotion { angle: f64::NAN, ..turn }] {
        let step = StepInput { rigid: &[(BodyId(1), bad)], ..StepInput::default() };
        let refused = scene.step_with(&step).expect_err("the motion is bad");
        let Error::Refused(error) = &refused else { panic!("{refused}") };
        assert!(error.code == ErrorCode::BadMotion && error.message.contains("cube 1"), "{error}");
    }
}

#[test]
fn cubes_that_meet_head_on_exchange_their_velocities() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Response], 2);
    let dynamics = Dynamics { mass: Mass::Density { density: 3.0 }, restitution: 1.0, friction: 0.0 };
    scene.set_dynamics(&[(BodyId(0), Some(dynamics)), (BodyId(1), Some(dynamics))]).expect("cubes are closed");
    let towards = |x: f64| Velocity { linear: [x, 0.0, 0.0], ..Velocity::default() };
    let velocities = [(BodyId(0), towards(2.0)), (BodyId(1), towards(-1.0))];
    let transforms = [(BodyId(0), at(0.0, 0.0, 0.0)), (BodyId(1), at(1.0, 0.0, 0.0))];
    let step = StepInput { transforms: &transforms, velocities: &velocities, ..StepInput::default() };
    let report = scene.step_with(&step).expect("the step is good");
    let after: Vec<_> = report.velocities().iter().map(|velocity| (velocity.body, velocity.linear)).collect();
    assert_eq!(after.len(), 2);
    for ((body, linear), expected) in after.into_iter().zip([-1.0, 2.0]) {
        let error = [linear[0] - expected, linear[1], linear[2]].map(f64::abs);
        assert!(error.iter().all(|error| *error < 1e-9), "body {body}: {linear:?}");
    }
    let pair = report.pairs().next().expect("the faces touch");
    let impulse: f64 = pair.impulses().iter().map(|impulse| impulse.impulse_on_b[0]).sum();
    assert!((impulse - 9.0).abs() < 1e-8, "{impulse}");
}

#[test]
fn what_hits_a_static_body_rebounds_by_the_larger_restitution_of_the_two() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Response], 2);
    let falls = Velocity { linear: [0.0, 0.0, -2.0], ..Velocity::default() };
    let ball = Dynamics { mass: Mass::Density { density: 3.0 }, restitution: 0.0, friction: 0.0 };
    let floor = Dynamics { mass: Mass::Static, restitution: 0.5, friction: 0.0 };
    for (floor, after) in [(None, 0.0), (Some(floor), 1.0)] {
        scene.set_dynamics(&[(BodyId(0), floor), (BodyId(1), Some(ball))]).expect("a cube is closed");
        let transforms = [(BodyId(0), at(0.0, 0.0, 0.0)), (BodyId(1), at(0.0, 0.0, 1.0))];
        let velocities = [(BodyId(1), falls)];
        let step = StepInput { transforms: &transforms, velocities: &velocities, ..StepInput::default() };
        let report = scene.step_with(&step).expect("the step is good");
        let [velocity] = report.velocities() else { panic!("only the cube moves: {:?}", report.velocities()) };
        assert!(velocity.body == 1 && (velocity.linear[2] - after).abs() < 1e-9, "{:?}", velocity.linear);
    }
}

#[test]
fn a_response_that_a_cap_has_ended_says_so() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Response], 21);
    let dynamics = |restitution: f64| Dynamics { mass: Mass::Density { density: 1.0 }, restitution, friction: 0.0 };
    let falls = Velocity { linear: [0.0, 0.0, -1.0], ..Velocity::default() };
    let velocities: Vec<_> = (1..21).map(|body| (BodyId(body), falls)).collect();
    let transforms: Vec<_> = (0..21).map(|body| (BodyId(body), at(0.0, 0.0, f64::from(body)))).collect();
    // Of two bodies the larger restitution counts: one that bounces among many that hardly do.
    for (highest, is_capped) in [(0.01, false), (1.0, true)] {
        let restitution = |body: u32| if body == 20 { highest } else { 0.01 };
        let given: Vec<_> = (1..21).map(|body| (BodyId(body), Some(dynamics(restitution(body))))).collect();
        scene.set_dynamics(&given).expect("cubes are closed");
        let step = StepInput { transforms: &transforms, velocities: &velocities, ..StepInput::default() };
        let report = scene.step_with(&step).expect("the step is good");
        assert_eq!(report.response_was_capped(), is_capped, "{highest}");
    }
}

#[test]
fn a_body_without_an_earlier_step_is_named_and_all_else_is_answered() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene(&daemon, &[Effect::TimeOfContact, Effect::Distance], 2);
    let report = scene.step(&[at(0.0, 0.0, 0.0), at(3.0, 0.0, 0.0)]).expect("the step is good");
    assert_eq!(report.time_fault(), Some(BodyId(0)));
    let pair = report.pairs().next().expect("a distance");
    assert_eq!((pair.distance().map(|found| found.value), pair.time_of_contact()), (Some(2.0), None));
    drop(report);
    scene.add_body("late", &cube(&client)).expect("a body can be added");
    let turn = RigidMotion { translate: [0.0, 9.0, 0.0], ..RigidMotion::default() };
    let step = StepInput {
        transforms: &[(BodyId(1), at(-3.0, 0.0, 0.0))],
        rigid: &[(BodyId(2), turn)],
        ..StepInput::default()
    };
    let report = scene.step_with(&step).expect("the step is good");
    assert_eq!(report.time_fault(), Some(BodyId(2)), "the others have moved");
    let (pair, time) = report.first_contact().expect("0 and 1 meet");
    assert!((pair.a(), pair.b()) == (BodyId(0), BodyId(1)) && time.free_until() > 0.3, "{time:?}");
    drop(report);
    let report = scene.step_sparse(&[]).expect("the step is good");
    assert_eq!(report.time_fault(), None, "each has an earlier step now");
}

#[test]
fn only_bodies_of_pairs_that_ask_are_named_near_or_not() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Interference], 4);
    let asks = collided_client::Interest::Effects(Effect::TimeOfContact.into());
    let far_apart = [0.0, 10.0, 20.0, 30.0].map(|x| at(x, 0.0, 0.0));
    scene.set_interest(&[(BodyId(3), BodyId(2), asks)]).expect("a rule");
    assert_eq!(scene.step(&far_apart).expect("the step is good").time_fault(), Some(BodyId(2)));
    assert_eq!(scene.step(&far_apart).expect("the step is good").time_fault(), None);
}

#[test]
fn the_transforms_at_the_first_contact_are_those_of_the_motion() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::TimeOfContact, Effect::Distance], 2);
    scene.step(&[at(0.0, 0.0, 0.0), at(5.0, 0.0, 0.0)]).expect("the step is good");
    let report = scene.step_sparse(&[(BodyId(1), at(-11.0, 0.25, 0.0))]).expect("the step is good");
    let pair = report.pairs().next().expect("they meet on the way");
    let lo = pair.time_of_contact().expect("they meet on the way").free_until();
    let [a, b] = pair.at_contact().expect("they meet on the way").map(|rows| *rows);
    assert_eq!((a, b), (at(0.0, 0.0, 0.0), at(5.0 + lo * -16.0, lo * 0.25, 0.0)));
    drop(report);
    // A step goes on from there: it is clear, and nearly in contact.
    let report = scene.step(&[a, b]).expect("the step is good");
    let pair = report.pairs().next().expect("a distance");
    let distance = pair.distance().expect("the cubes are near").value;
    assert!(pair.verdict() == Verdict::Clear && distance <= 16.0 * 1e-6, "{distance}");
}

#[test]
fn mass_and_accuracy_out_of_range_are_refused_by_name() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Response], 1);
    let good = Dynamics { mass: Mass::Density { density: 1.0 }, restitution: 0.5, friction: 0.5 };
    let given = |mass: f64| Mass::Given {
        mass,
        centre: [0.0; 3],
        inertia: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    let bad = [
        (Dynamics { restitution: 1.5, ..good }, "restitution 1.5"),
        (Dynamics { friction: -1.0, ..good }, "friction -1"),
        (Dynamics { mass: given(-2.0), ..good }, "mass -2"),
        (Dynamics { mass: Mass::Density { density: 0.0 }, ..good }, "density 0"),
        (Dynamics { mass: Mass::Given { mass: 1.0, centre: [0.0; 3], inertia: [[0.0; 3]; 3] }, ..good }, "inertia"),
    ];
    for (dynamics, part) in bad {
        let refused = scene.set_dynamics(&[(BodyId(0), Some(dynamics))]).expect_err(part);
        let Error::Refused(error) = &refused else { panic!("{refused}") };
        assert_eq!(error.code, ErrorCode::BadDynamics, "{error}");
        assert!(error.message.contains(part) && error.message.contains("cube 0"), "{error}");
    }
    scene.set_dynamics(&[(BodyId(0), Some(good)), (BodyId(0), None)]).expect("good, and static again");
    let bad = [
        (Accuracy { distance_tolerance: Some(-0.1), ..Accuracy::default() }, "distance_tolerance"),
        (Accuracy { distance_up_to: Some(-1.0), ..Accuracy::default() }, "distance_up_to"),
        (Accuracy { time_tolerance: Some(0.0), ..Accuracy::default() }, "time_tolerance"),
        (Accuracy { iterations: Some(0), ..Accuracy::default() }, "iterations"),
    ];
    for (accuracy, part) in bad {
        let refused = scene.set_accuracy(accuracy).expect_err(part);
        let Error::Refused(error) = &refused else { panic!("{refused}") };
        assert!(error.code == ErrorCode::BadAccuracy && error.message.contains(part), "{error}");
    }
}

#[test]
fn what_no_pair_asks_for_is_not_computed_and_takes_no_byte() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon, &[Effect::Interference], 2);
    for shift in [0.5, 0.25] {
        let report = scene.step(&[at(0.0, 0.0, 0.0), at(shift, 0.0, 0.0)]).expect("the step is good");
        assert_eq!(report.result_bytes().len(), 24, "one pair and nothing else");
        let counts = report.counts();
        let unasked = [
            counts.containment_tests,
            counts.distance_searches,
            counts.contact_pairs,
            counts.penetration_searches,
            counts.time_searches,
            counts.response_points,
        ];
        assert_eq!(unasked, [0; 6]);
    }
    scene
        .set_interest(&[(BodyId(0), BodyId(1), collided_client::Interest::Effects(Effect::Distance.into()))])
        .expect("a rule");
    let report = scene.step(&[at(0.0, 0.0, 0.0), at(7.0, 0.0, 0.0)]).expect("the step is good");
    let pair = report.pairs().next().expect("the rule asks for a distance");
    assert_eq!((pair.distance().map(|distance| distance.value), report.counts().distance_searches), (Some(6.0), 1));
}
