//! Reaching a limit is an error that names it; below it, everything works.

use collided_client::{Client, Effect, Error, ErrorCode, IDENTITY, Mesh, Reply, Request};
use collided_protocol::control::{BodySpec, Target, UploadSize};
use collided_protocol::limits::{MAX_BODIES, MAX_MESH_ELEMENTS, MAX_NAME, MAX_REPORTS_HELD};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::small_meshes::TRIANGLE;

#[track_caller]
fn is_refused<T: std::fmt::Debug>(outcome: Result<T, Error>, code: ErrorCode, parts: &[&str]) {
    let error = outcome.expect_err("it is beyond the limit");
    assert_eq!(error.code(), Some(code), "{error}");
    for part in parts {
        assert!(error.to_string().contains(part), "{part:?} is not in: {error}");
    }
}

#[test]
fn names_may_have_so_many_bytes_and_no_more() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let longest = "n".repeat(MAX_NAME);
    let object = client.database(&longest).upload(&longest, &TRIANGLE).unwrap();
    let mut scene = client.scene(&longest).create().unwrap();
    scene.add_bodies(&[collided_client::BodySpec::new(&longest, &object).group(&longest)]).unwrap();

    let too_long = "n".repeat(MAX_NAME + 1);
    let is_bad =
        |outcome: Result<(), Error>, what: &str| is_refused(outcome, ErrorCode::BadName, &[what, "257", "256"]);
    is_bad(client.database(&too_long).upload("tri", &TRIANGLE).map(drop), "database");
    is_bad(client.database("parts").upload(&too_long, &TRIANGLE).map(drop), "object");
    is_bad(client.scene(&too_long).create().map(drop), "scene");
    is_bad(scene.add_body(&too_long, &object).map(drop), "body");
    let grouped = collided_client::BodySpec::new("b", &object).group(&too_long);
    is_bad(scene.add_bodies(&[grouped]).map(drop), "group");
    is_bad(daemon.client_builder().name(&too_long).connect().map(drop), "client");
    assert_eq!(client.list().unwrap().len(), 1, "nothing else was loaded");
    assert_eq!(scene.step(&[IDENTITY]).unwrap().pairs().len(), 0, "nothing else was added");
}

#[test]
fn a_mesh_with_too_many_elements_is_refused_before_any_is_sent() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let begin = |vertices, polygons, corners| {
        let (database, object) = ("parts".to_owned(), "huge".to_owned());
        let target = Target { database, object, order: None, replace: false };
        client.request(&Request::BeginUpload { target, size: UploadSize { vertices, polygons, corners } })
    };
    let (most, over) = (MAX_MESH_ELEMENTS, MAX_MESH_ELEMENTS + 1);
    for (size, what) in [((over, 0, 0), "vertices"), ((0, over, 0), "polygons"), ((0, 0, over), "corners")] {
        let (vertices, polygons, corners) = size;
        is_refused(begin(vertices, polygons, corners), ErrorCode::LimitExceeded, &["huge", what, "1073741825"]);
    }
    is_refused(begin(u64::MAX, u64::MAX, u64::MAX), ErrorCode::LimitExceeded, &["1073741824"]);
    let reply = begin(most, most, most).expect("memory is taken as parts come, not when they are announced");
    let Reply::UploadReady { upload } = reply else { panic!("{reply:?}") };
    is_refused(client.request(&Request::FinishUpload { upload }), ErrorCode::BadMessage, &["1073741824"]);
}

/// Adds `count` bodies, in requests of a size that the control channel takes.
fn add_bodies(client: &Client, scene: u32, first: u32, count: u32) -> Result<(), Error> {
    const AT_ONCE: u32 = 1 << 17;
    let body = |number: u32| BodySpec {
        name: number.to_string(),
        database: "parts".to_owned(),
        object: "tri".to_owned(),
        group: None,
    };
    for first in (first..first + count).step_by(AT_ONCE as usize) {
        let bodies = (first..first + AT_ONCE.min(count)).map(body).collect();
        client.request(&Request::AddBodies { scene, bodies })?;
    }
    Ok(())
}

#[test]
fn a_scene_may_have_so_many_bodies_and_no_more() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let scene = client.scene("crowd").create().unwrap();
    add_bodies(&client, scene.id(), 0, MAX_BODIES).unwrap();
    is_refused(add_bodies(&client, scene.id(), MAX_BODIES, 1), ErrorCode::LimitExceeded, &["1048577", "1048576"]);
    assert_eq!(client.status().unwrap().scenes[0].bodies, u64::from(MAX_BODIES));
    client.request(&Request::RemoveBodies { scene: scene.id(), bodies: vec![0] }).unwrap();
    add_bodies(&client, scene.id(), MAX_BODIES, 1).expect("there is room for one again");
}

/// `count` triangles with one vertex in common: with itself in the same place, each interferes with each.
fn star(count: u32) -> (Vec<[f64; 3]>, Vec<u32>) {
    let point = |index: u32| {
        let index = f64::from(index);
        [1.0, index, index * index]
    };
    let vertices = std::iter::once([0.0; 3]).chain((0..=count).map(point)).collect();
    (vertices, (0..count).flat_map(|index| [0, index + 1, index + 2]).collect())
}

#[test]
fn reports_grow_and_those_that_are_held_stay_as_they_are() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = client.scene("growing").effects([Effect::PolygonPairs]).create().unwrap();
    let mut held = Vec::new();
    for (step, count) in [2_u32, 40, 200, 500].into_iter().enumerate() {
        let (vertices, corners) = star(count);
        let mesh = Mesh { vertices: &vertices, corner_counts: &vec![3; count as usize], corners: &corners };
        let object = client.database("stars").loading(&format!("star {count}")).mesh(&mesh).unwrap();
        let bodies = scene.bodies().to_vec();
        scene.remove_bodies(&bodies).unwrap();
        scene.add_body(&format!("a {step}"), &object).unwrap();
        scene.add_body(&format!("b {step}"), &object).unwrap();
        let report = scene.step(&[IDENTITY, IDENTITY]).unwrap();
        assert_eq!(report.polygon_pair_count(), (count * count) as usize);
        let bytes = report.result_bytes().to_vec();
        held.push((report, bytes));
    }
    assert_eq!(held.len(), MAX_REPORTS_HELD);
    assert!(matches!(scene.step(&[IDENTITY, IDENTITY]), Err(Error::TooManyReportsHeld)));
    for (report, bytes) in &held {
        assert_eq!(report.result_bytes(), bytes, "a report does not change while it is held");
    }
    let (_, largest) = held.pop().expect("reports are held");
    assert_eq!(scene.step(&[IDENTITY, IDENTITY]).unwrap().result_bytes(), largest);
}
