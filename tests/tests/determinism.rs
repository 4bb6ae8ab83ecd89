//! The result section has the same bytes whatever the thread count, the order of the voxel matrices, and the body that is
//! named first: through real daemon processes, on real meshes.

use collided_client::{Client, Effect, Scene};
use collided_protocol::step::Rows;
use collided_tests::crowd;
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::meshes;

/// One pair of meshes and a transform of the second at which many of their polygons interfere, in all relations.
struct Contact {
    meshes: [&'static str; 2],
    rows: Rows,
}

const CONTACTS: [Contact; 3] = [
    Contact {
        meshes: ["spot", "low_poly_bunny"],
        rows: [[0.5, 0.1, 0.0, 0.2], [0.0, 0.4, 0.2, 0.1], [0.1, 0.0, 0.6, 0.3]],
    },
    Contact { meshes: ["spot", "spot"], rows: [[1.0, 0.0, 0.0, 0.25], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]] },
    Contact { meshes: ["env", "rob"], rows: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 20.0], [0.0, 0.0, 1.0, 0.0]] },
];

const IDENTITY: Rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A scene of the two meshes at one order, the second one named first if `swapped`.
fn scene(client: &Client, contact: &Contact, order: u32, swapped: bool) -> Scene {
    let database = client.database("shipped");
    let objects = contact.meshes.map(|name| {
        let numbered = format!("{name}-{order}");
        let path = meshes::path(name);
        database.loading(&numbered).order(order).replace(true).file(path).unwrap()
    });
    let mut scene = client.scene("contact").effects([Effect::PolygonPairs]).create().unwrap();
    let sequence = if swapped { [1, 0] } else { [0, 1] };
    for which in sequence {
        scene.add_body(&which.to_string(), &objects[which]).unwrap();
    }
    scene
}

#[test]
fn every_order_and_thread_count_gives_the_same_bytes() {
    let daemons = ["1", "2"].map(|threads| DaemonProcess::start_with(&["--threads", threads]));
    let clients = daemons.each_ref().map(DaemonProcess::client);
    for contact in &CONTACTS {
        let mut expected: Option<Vec<u8>> = None;
        for order in 0..=24 {
            for client in &clients {
                let mut scene = scene(client, contact, order, false);
                let report = scene.step(&[IDENTITY, contact.rows]).unwrap();
                assert!(report.polygon_pair_count() > 50, "{:?}: {}", contact.meshes, report.polygon_pair_count());
                let bytes = expected.get_or_insert_with(|| report.result_bytes().to_vec());
                assert!(report.result_bytes() == bytes, "{:?} at order {order}", contact.meshes);
            }
        }
    }
}

#[test]
fn naming_the_bodies_the_other_way_round_swaps_the_numbers_and_nothing_else() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    for contact in &CONTACTS {
        let mut polygon_pairs = [false, true].map(|swapped| {
            let mut scene = scene(&client, contact, 12, swapped);
            let rows = if swapped { [contact.rows, IDENTITY] } else { [IDENTITY, contact.rows] };
            let report = scene.step(&rows).unwrap();
            let pair = report.pairs().next().unwrap();
            let polygons =
                pair.polygon_pairs().map(|p| if swapped { (p.b, p.a, p.relation) } else { (p.a, p.b, p.relation) });
            (pair.relation(), polygons.collect::<Vec<_>>())
        });
        polygon_pairs[1].1.sort_unstable();
        assert_eq!(polygon_pairs[0], polygon_pairs[1], "{:?}", contact.meshes);
    }
}

/// Several steps of a moving crowd: the state that a scene keeps from step to step must not show either.
#[test]
fn a_moving_crowd_gives_the_same_bytes_step_by_step_on_one_thread_and_on_two() {
    const BODIES: usize = 200;
    let size = 1.0 / meshes::longest_side(&meshes::shipped("low_poly_bunny", Some(0)));
    let steps = crowd::moving(BODIES, 5, 0.5, 11);
    let reports = ["1", "2"].map(|threads| {
        let daemon = DaemonProcess::start_with(&["--threads", threads]);
        let client = daemon.client();
        let bunny = client.database("shipped").load("bunny", meshes::path("low_poly_bunny")).unwrap();
        let mut scene = client.scene("crowd").effects([Effect::PolygonPairs]).create().unwrap();
        for body in 0..BODIES {
            scene.add_body(&body.to_string(), &bunny).unwrap();
        }
        let scaled = |rows: &Rows| rows.map(|[x, y, z, t]| [size * x, size * y, size * z, t]);
        let report = |step: &Vec<Rows>| {
            let rows: Vec<Rows> = step.iter().map(scaled).collect();
            scene.step(&rows).unwrap().result_bytes().to_vec()
        };
        steps.iter().map(report).collect::<Vec<_>>()
    });
    assert!(reports[0].iter().all(|bytes| bytes.len() > 1000));
    assert!(reports[0] == reports[1]);
}
