//! Several processes share one collision world.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use collided_client::{Effect, IDENTITY, Verdict};
use collided_tests::client_process::SteppingClient;
use collided_tests::daemon_process::{DaemonProcess, await_some, program, shared_files};
use collided_tests::small_meshes::{TRIANGLE, TWO_TRIANGLES, at};

#[test]
fn two_client_processes_step_scenes_of_their_own_with_one_shared_object() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    client.database("shared").upload("tri", &TRIANGLE).unwrap();
    let (a, b) = (SteppingClient::start(&daemon, "shared", "tri"), SteppingClient::start(&daemon, "shared", "tri"));
    let status = client.status().unwrap();
    assert_eq!(status.objects, 1, "both use the same object");
    assert_eq!(client.database("shared").list().unwrap()[0].bodies, 4);
    let mut owners: Vec<i32> = status.scenes.iter().map(|scene| scene.owner).collect();
    owners.sort_unstable();
    let mut expected = [a.pid(), b.pid()];
    expected.sort_unstable();
    assert_eq!(owners, expected, "each process owns its scene");
    for summary in [a.finish(), b.finish()] {
        assert_eq!((summary.error, summary.polygon_pairs), (None, vec![1]));
    }
}

#[test]
fn a_client_that_attaches_late_finds_the_objects_and_disturbs_nobody() {
    let daemon = DaemonProcess::start();
    daemon.client().database("parts").upload("tri", &TRIANGLE).unwrap();
    let early = SteppingClient::start(&daemon, "parts", "tri");
    let late = daemon.client();
    let object = late.database("parts").get("tri").unwrap();
    let mut scene = late.scene("late").create().unwrap();
    scene.add_body("a", &object).unwrap();
    scene.add_body("b", &object).unwrap();
    assert_eq!(scene.step(&[IDENTITY, at(0.0, 0.0, 1.0)]).unwrap().pairs().len(), 0);
    assert_eq!(scene.step(&[IDENTITY, IDENTITY]).unwrap().pairs().len(), 1);
    assert_eq!(early.finish().error, None);
}

#[test]
fn two_scenes_of_one_client_are_independent() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let object = client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let [mut apart, mut together] = ["apart", "together"].map(|name| {
        let mut scene = client.scene(name).effects([Effect::Interference]).create().unwrap();
        scene.add_body("a", &object).unwrap();
        scene.add_body("b", &object).unwrap();
        scene
    });
    let mut first = apart.send(&[IDENTITY, at(9.0, 0.0, 0.0)]).unwrap();
    let second = together.step(&[IDENTITY, IDENTITY]).unwrap();
    let first = first.collect(collided_tests::daemon_process::PATIENCE).unwrap();
    assert!(first.is_clear());
    assert_eq!(second.pairs().next().unwrap().verdict(), Verdict::Interfering);
    drop(apart);
    assert!(!together.step(&[IDENTITY, IDENTITY]).unwrap().is_clear(), "the other scene goes on");
}

#[test]
fn replacing_an_object_reaches_the_scenes_of_a_stepping_client() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let parts = client.database("parts");
    parts.upload("part", &TRIANGLE).unwrap();
    let stepping = SteppingClient::start(&daemon, "parts", "part");
    let replaced = parts.loading("part").replace(true).mesh(&TWO_TRIANGLES).unwrap();
    assert_eq!((replaced.info().revision, replaced.info().polygons), (1, 2));
    let steps = || client.status().unwrap().scenes.iter().find(|s| s.scene == stepping.scene).unwrap().steps;
    let replaced_at = steps();
    await_some("the client steps on", || (steps() > replaced_at + 1).then_some(()));
    let summary = stepping.finish();
    assert_eq!(summary.error, None);
    assert_eq!(summary.polygon_pairs, [1, 2], "each step saw the old object twice, or the new one twice");
}

#[test]
fn a_killed_client_is_noticed_and_the_others_are_undisturbed() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let bystander = SteppingClient::start(&daemon, "parts", "tri");
    let before = shared_files(daemon.rendezvous()).len();
    let victim = SteppingClient::start(&daemon, "parts", "tri");
    let scene = victim.scene;
    victim.kill();
    await_some("its scene is dropped", || {
        client.status().unwrap().scenes.iter().all(|status| status.scene != scene).then_some(())
    });
    await_some("what it had in shared memory is removed", || {
        (shared_files(daemon.rendezvous()).len() <= before).then_some(())
    });
    assert_eq!(client.database("parts").list().unwrap()[0].bodies, 2, "its bodies are gone");
    assert_eq!(bystander.finish().error, None);
}

#[test]
fn a_client_killed_in_the_middle_of_its_upload_leaves_nothing_and_disturbs_nobody() {
    for stage in ["upload", "build"] {
        let daemon = DaemonProcess::start();
        let client = daemon.client();
        client.database("parts").upload("tri", &TRIANGLE).unwrap();
        let bystander = SteppingClient::start(&daemon, "parts", "tri");
        let before = shared_files(daemon.rendezvous()).len();
        let mut loading = Command::new(program("loading_client"));
        let mut loading = loading.arg(daemon.directory()).arg(stage).stdout(Stdio::piped()).spawn().unwrap();
        let mut reached = String::new();
        BufReader::new(loading.stdout.take().unwrap()).read_line(&mut reached).unwrap();
        assert_eq!(reached.trim(), stage);
        loading.kill().unwrap();
        loading.wait().unwrap();
        await_some("the daemon notices", || (client.status().unwrap().clients.len() == 2).then_some(()));
        await_some("what it had in shared memory is removed", || {
            (shared_files(daemon.rendezvous()).len() <= before).then_some(())
        });
        if stage == "upload" {
            assert_eq!(client.list().unwrap().len(), 1, "half an object is none");
        }
        client.database("parts").loading("long").replace(true).mesh(&TRIANGLE).unwrap();
        assert_eq!(bystander.finish().error, None);
    }
}

#[test]
fn a_client_that_leaves_in_order_leaves_nothing_in_shared_memory() {
    let daemon = DaemonProcess::start();
    daemon.client().database("parts").upload("tri", &TRIANGLE).unwrap();
    let before = shared_files(daemon.rendezvous());
    assert_eq!(SteppingClient::start(&daemon, "parts", "tri").finish().error, None);
    await_some("the same files as before", || (shared_files(daemon.rendezvous()) == before).then_some(()));
}
