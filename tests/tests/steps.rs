//! Sending steps and collecting reports.

use std::time::Duration;

use collided_client::{
    BodySpec, Client, Effect, Effects, Error, ErrorCode, IDENTITY, Interest, Mesh, Relation, Request, Scene, Verdict,
};
use collided_tests::daemon_process::{DaemonProcess, PATIENCE};
use collided_tests::small_meshes::{TRIANGLE, at};

fn scene_with(client: &Client, bodies: usize) -> Scene {
    let object = client.database("parts").loading("tri").replace(true).mesh(&TRIANGLE).unwrap();
    let mut scene = client.scene("scene").effects([Effect::PolygonPairs]).create().unwrap();
    let specs: Vec<BodySpec> = (0..bodies).map(|index| BodySpec::new(format!("body{index}"), &object)).collect();
    scene.add_bodies(&specs).unwrap();
    scene
}

#[test]
fn a_report_says_which_polygons_of_which_bodies_interfere_and_how() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 3);
    let report = scene.step(&[IDENTITY, at(0.25, 0.25, 0.0), at(0.0, 0.0, 7.0)]).unwrap();
    let pair = report.pairs().next().unwrap();
    assert_eq!(report.pairs().len(), 1);
    assert_eq!((pair.a(), pair.b()), (scene.bodies()[0], scene.bodies()[1]));
    assert_eq!((pair.verdict(), pair.relation()), (Verdict::Interfering, Relation::Coplanar));
    let polygons: Vec<_> = pair.polygon_pairs().map(|p| (p.a, p.b, p.relation)).collect();
    assert_eq!(polygons, [(0, 0, Relation::Coplanar)]);
    assert_eq!((report.counts().boxes, report.counts().interfering_pairs), (3, 1));
    assert!(report.times().total > 0);
}

#[test]
fn dense_sparse_and_written_steps_give_the_same_bytes() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 3);
    let poses = [IDENTITY, at(0.25, 0.0, 0.0), at(0.0, 0.25, 0.0)];
    let bodies = scene.bodies().to_vec();
    let dense = scene.step(&poses).unwrap().result_bytes().to_vec();
    let backwards: Vec<_> = bodies.iter().copied().zip(poses).rev().collect();
    assert_eq!(scene.step_sparse(&backwards).unwrap().result_bytes(), dense);
    assert_eq!(scene.step_sparse(&backwards[..1]).unwrap().result_bytes(), dense, "the others stay where they are");
    assert_eq!(scene.step_sparse(&[]).unwrap().result_bytes(), dense);
    assert_eq!(scene.write_step(|rows| rows.copy_from_slice(&poses)).unwrap().result_bytes(), dense);
}

#[test]
fn a_scene_of_many_bodies_takes_and_gives_more_than_fits_at_first() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 300);
    let report = scene.step(&[IDENTITY; 300]).unwrap();
    assert_eq!(report.pairs().len(), 300 * 299 / 2);
    assert_eq!(report.polygon_pair_count(), 300 * 299 / 2);
    assert!(report.pairs().all(|pair| pair.polygon_pairs().len() == 1));
}

#[test]
fn a_step_is_sent_now_and_collected_later() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 2);
    daemon.pause();
    let mut first = scene.send(&[IDENTITY, IDENTITY]).unwrap();
    let mut second = scene.send(&[IDENTITY, at(9.0, 0.0, 0.0)]).unwrap();
    assert!(matches!(scene.send(&[IDENTITY, IDENTITY]), Err(Error::TooManyInFlight)));
    daemon.resume();
    assert!(second.collect(PATIENCE).unwrap().is_clear(), "reports may be collected in any order");
    assert!(!first.collect(PATIENCE).unwrap().is_clear());
    assert!(matches!(first.collect(PATIENCE), Err(Error::AlreadyCollected)));
}

#[test]
fn a_deadline_passes_and_the_report_can_still_be_collected_or_given_up() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 2);
    daemon.pause();
    let mut pending = scene.send(&[IDENTITY, at(9.0, 0.0, 0.0)]).unwrap();
    for wait in [Duration::ZERO, Duration::from_millis(5)] {
        assert!(matches!(pending.collect(wait), Err(Error::Deadline { waited }) if waited == wait));
    }
    scene.set_deadline(Duration::from_millis(5));
    assert!(matches!(scene.step(&[IDENTITY, IDENTITY]), Err(Error::Deadline { .. })));
    daemon.resume();
    assert!(pending.collect(PATIENCE).unwrap().is_clear());
    scene.set_deadline(PATIENCE);
    let report = scene.step_sparse(&[]).unwrap();
    assert!(!report.is_clear(), "the step whose report was given up has moved the bodies");
    assert_eq!(report.step(), 2);
}

#[test]
fn reports_beyond_the_limit_are_refused_until_one_is_dropped() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 2);
    let mut held: Vec<_> = (0..4).map(|x| scene.step(&[IDENTITY, at(f64::from(x), 0.0, 0.0)]).unwrap()).collect();
    assert!(matches!(scene.step(&[IDENTITY, IDENTITY]), Err(Error::TooManyReportsHeld)));
    let clear: Vec<bool> = held.iter().map(collided_client::Report::is_clear).collect();
    assert_eq!(clear, [false, false, true, true], "what is held does not change");
    held.pop();
    assert!(!scene.step(&[IDENTITY, IDENTITY]).unwrap().is_clear());
}

#[test]
fn a_report_outlives_its_scene_and_its_client() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 2);
    let report = scene.step(&[IDENTITY, IDENTITY]).unwrap();
    drop((scene, client));
    assert_eq!(report.polygon_pair_count(), 1);
}

#[test]
fn bodies_come_and_go_between_steps_and_ids_are_never_used_again() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 3);
    let [first, second, third] = scene.bodies().try_into().unwrap();
    scene.remove_bodies(&[second]).unwrap();
    let object = client.database("parts").get("tri").unwrap();
    let again = scene.add_body("body1", &object).unwrap();
    assert!(again > third, "a removed body's id is not given again");
    assert_eq!(scene.bodies(), [first, third, again]);
    let report = scene.step(&[IDENTITY, at(9.0, 0.0, 0.0), IDENTITY]).unwrap();
    let pairs: Vec<_> = report.pairs().map(|pair| (pair.a(), pair.b())).collect();
    assert_eq!(pairs, [(first, again)]);
}

#[test]
fn interest_groups_and_effects_decide_what_is_reported() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let object = client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let mut scene = client.scene("scene").effects([Effect::Interference]).create().unwrap();
    let arm = |name: &str| BodySpec::new(name, &object).group("arm");
    let ids = scene.add_bodies(&[arm("upper"), arm("lower"), BodySpec::new("table", &object)]).unwrap();
    let pairs = |scene: &mut Scene| {
        let report = scene.step(&[IDENTITY; 3]).unwrap();
        report.pairs().map(|pair| (pair.a().0, pair.b().0, pair.polygon_pairs().len())).collect::<Vec<_>>()
    };
    assert_eq!(pairs(&mut scene), [(0, 2, 0), (1, 2, 0)]);
    scene.ignore(ids[0], ids[2]).unwrap();
    let effects = Effects::from(Effect::PolygonPairs);
    scene.set_interest(&[(ids[0], ids[1], Interest::Effects(effects))]).unwrap();
    assert_eq!(pairs(&mut scene), [(0, 1, 1), (1, 2, 0)]);
    scene.set_interest(&[(ids[0], ids[1], Interest::Default), (ids[2], ids[0], Interest::Default)]).unwrap();
    scene.set_effects([Effect::PolygonPairs]).unwrap();
    assert_eq!(pairs(&mut scene), [(0, 2, 1), (1, 2, 1)]);
}

#[test]
fn a_step_for_a_dropped_scene_is_a_typed_error() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene_with(&client, 1);
    scene.step(&[IDENTITY]).unwrap();
    client.request(&Request::DropScene { scene: scene.id() }).unwrap();
    assert_eq!(scene.step(&[IDENTITY]).unwrap_err().code(), Some(ErrorCode::UnknownScene));
    let object = client.database("parts").get("tri").unwrap();
    assert_eq!(scene.add_body("late", &object).unwrap_err().code(), Some(ErrorCode::UnknownScene));
}

#[test]
fn a_mesh_of_several_parts_is_uploaded_whole() {
    // 3 words a vertex: a part ends within one.
    const COUNT: usize = 400_000;
    let vertices: Vec<[f64; 3]> =
        (0..COUNT).map(|index| [index as f64, (index % 2) as f64, (index % 3) as f64]).collect();
    let corners: Vec<u32> = (0..COUNT as u32 - 2).flat_map(|index| [index, index + 1, index + 2]).collect();
    let corner_counts = vec![3; COUNT - 2];
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut last = 0;
    let mesh = Mesh { vertices: &vertices, corner_counts: &corner_counts, corners: &corners };
    let database = client.database("parts");
    let loading = database.loading("strip").order(6).on_progress(|stage, done, _| {
        if stage == "upload" {
            last = done;
        }
    });
    let object = loading.mesh(&mesh).unwrap();
    let info = object.info();
    assert_eq!((info.vertices, info.polygons, info.order), (COUNT as u64, COUNT as u64 - 2, 6));
    assert_eq!(info.container, Some([[0.0; 3], [COUNT as f64 - 1.0, 1.0, 2.0]]));
    assert_eq!(last, (3 * COUNT + corner_counts.len() + corners.len()) as u64);
}
