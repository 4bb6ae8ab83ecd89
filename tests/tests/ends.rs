//! How a daemon ends, in order or not, and who may begin.

use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use collided_client::{Client, Effect, Error, IDENTITY};
use collided_tests::client_process::SteppingClient;
use collided_tests::daemon_process::{DaemonProcess, RuntimeDirectory, shared_files};
use collided_tests::small_meshes::TRIANGLE;
use rustix::process::Signal;

#[test]
fn a_signal_ends_the_daemon_cleanly_and_nothing_is_left() {
    for signal in [Signal::TERM, Signal::INT] {
        let mut daemon = DaemonProcess::start();
        daemon.client().database("parts").upload("tri", &TRIANGLE).unwrap();
        let mut stepping = SteppingClient::start(&daemon, "parts", "tri");
        daemon.signal(signal);
        assert!(daemon.wait().success());
        let error = stepping.await_summary().error;
        assert_eq!(error, Some(Error::DaemonGone.to_string()), "the client is told");
        assert_eq!(daemon.leftovers(), Vec::<PathBuf>::new());
    }
}

#[test]
fn a_killed_daemon_is_a_typed_error_and_the_next_one_starts_clean() {
    let mut daemon = DaemonProcess::start();
    let client = daemon.client();
    let object = client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let mut scene = client.scene("scene").effects([Effect::Interference]).create().unwrap();
    scene.add_body("a", &object).unwrap();
    scene.step(&[IDENTITY]).unwrap();
    let mut stepping = SteppingClient::start(&daemon, "parts", "tri");
    let old = daemon.rendezvous().clone();

    daemon.signal(Signal::KILL);
    assert_eq!(daemon.wait().signal(), Some(Signal::KILL.as_raw()));
    assert_eq!(stepping.await_summary().error, Some(Error::DaemonGone.to_string()));
    assert!(matches!(scene.step(&[IDENTITY]), Err(Error::DaemonGone)));
    assert!(matches!(client.list(), Err(Error::DaemonGone)));

    daemon.restart();
    assert_ne!(daemon.rendezvous().epoch, old.epoch);
    assert_eq!(shared_files(&old), Vec::<PathBuf>::new(), "the older epoch is wiped");
    assert!(!PathBuf::from(&old.iceoryx2_root).exists(), "the older epoch is wiped");
    assert_eq!(daemon.client().list().unwrap(), []);
    daemon.signal(Signal::TERM);
    assert!(daemon.wait().success());
    drop((scene, client));
    assert_eq!(daemon.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn a_step_under_way_when_the_daemon_is_killed_does_not_hang() {
    let mut daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = client.scene("scene").create().unwrap();
    daemon.pause();
    let mut pending = scene.send(&[]).unwrap();
    daemon.signal(Signal::KILL);
    daemon.wait();
    let start = Instant::now();
    assert!(matches!(pending.collect(Duration::from_secs(60)), Err(Error::DaemonGone)));
    assert!(start.elapsed() < Duration::from_secs(30), "noticed by the socket, not by the deadline");
}

#[test]
fn a_second_daemon_of_an_instance_is_refused_by_name() {
    let daemon = DaemonProcess::start();
    let second = daemon.command(&["serve"]);
    assert_eq!(second.status.code(), Some(2));
    let said = String::from_utf8(second.stderr).unwrap();
    assert!(said.contains(&format!("already served by process {}", daemon.pid())), "{said}");
    assert!(daemon.client().status().is_ok(), "the first one goes on");
}

#[test]
fn instances_in_one_runtime_directory_do_not_touch_each_other() {
    let mut daemon = DaemonProcess::start();
    let mut other = daemon.runtime().collided();
    let mut other = other.args(["serve", "--instance", "other"]).spawn().unwrap();
    let directory = daemon.runtime().instance("other");
    let client = Client::builder().directory(directory).timeout(Duration::from_secs(30)).connect().unwrap();
    daemon.signal(Signal::TERM);
    assert!(daemon.wait().success());
    let mut scene = client.scene("scene").create().unwrap();
    assert!(scene.step(&[]).unwrap().is_clear());
    let other_pid = rustix::process::Pid::from_raw(other.id() as i32).unwrap();
    rustix::process::kill_process(other_pid, Signal::TERM).unwrap();
    assert!(other.wait().unwrap().success());
    assert_eq!(daemon.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn without_a_daemon_the_error_says_where_it_was_looked_for() {
    let runtime = RuntimeDirectory::new();
    let directory = runtime.instance("nobody");
    let builder = Client::builder().instance("nobody").directory(&directory);
    let error = builder.timeout(Duration::from_millis(30)).connect().unwrap_err();
    let Error::NoDaemon { instance, directory: looked, .. } = &error else { panic!("{error:?}") };
    assert_eq!((instance.as_str(), looked), ("nobody", &directory));
    assert!(error.to_string().contains("collided serve --instance nobody"), "{error}");
    for command in ["list", "status"] {
        let output = runtime.collided().arg(command).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{command}");
    }
}
