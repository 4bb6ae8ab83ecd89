//! The commands of the `collided` program that talk to a running daemon.

use std::io::{BufRead, BufReader};
use std::process::{Output, Stdio};

use collided_client::{Client, ObjectInfo, Status};
use collided_tests::daemon_process::{DaemonProcess, PATIENCE, RuntimeDirectory, await_end};
use rustix::process::{Pid, Signal, kill_process};

const TRIANGLE_OFF: &str = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

fn stdout(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn load_list_status_and_unload_work_on_the_running_daemon() {
    let daemon = DaemonProcess::start();
    let file = daemon.runtime().path().join("tri.off");
    std::fs::write(&file, TRIANGLE_OFF).unwrap();
    let file = file.to_str().unwrap();
    assert!(stdout(&daemon.command(&["load", "parts", file])).starts_with("parts/tri: 1 polygons"));
    stdout(&daemon.command(&["load", "parts", file, "--name", "other", "--order", "3"]));

    let listed = stdout(&daemon.command(&["list", "--json"]));
    let objects: Vec<ObjectInfo> = listed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let names: Vec<&str> = objects.iter().map(|object| object.object.as_str()).collect();
    assert_eq!(names, ["other", "tri"]);
    assert!(stdout(&daemon.command(&["list"])).lines().nth(2).unwrap().starts_with("parts     tri"));

    let status: Status = serde_json::from_str(&stdout(&daemon.command(&["status", "--json"]))).unwrap();
    assert_eq!((status.pid, status.objects, status.threads), (daemon.pid(), 2, 2));

    stdout(&daemon.command(&["unload", "parts", "tri"]));
    assert_eq!(daemon.client().list().unwrap().len(), 1);
}

#[test]
fn trouble_is_status_2_with_the_reason_on_stderr() {
    let daemon = DaemonProcess::start();
    let commands: [(&[&str], &str); 4] = [
        (&["load", "parts", "/nowhere/mesh.obj"], "/nowhere/mesh.obj"),
        (&["unload", "parts", "tri"], "\"parts\""),
        (&["list", "parts"], "\"parts\""),
        (&["serve", "--threads", "0"], "0 worker threads"),
    ];
    for (command, part) in commands {
        let output = daemon.command(command);
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(part), "{part:?} is not in: {said}");
    }
}

#[test]
fn flags_win_over_the_settings_file_and_unknown_settings_are_refused() {
    let runtime = RuntimeDirectory::new();
    let file = runtime.path().join("collided.toml");
    std::fs::write(&file, "instance = 'from-file'\nthreads = 3\n").unwrap();
    let mut daemon =
        runtime.collided().arg("serve").arg("--config").arg(&file).args(["--threads", "1"]).spawn().unwrap();
    let directory = runtime.instance("from-file");
    let client = Client::builder().directory(directory).timeout(PATIENCE).connect().unwrap();
    assert_eq!(client.status().unwrap().threads, 1);
    kill_process(Pid::from_raw(daemon.id() as i32).unwrap(), Signal::TERM).unwrap();
    assert!(await_end(&mut daemon).success());

    std::fs::write(&file, "thread = 3\n").unwrap();
    let output = runtime.collided().arg("serve").arg("--config").arg(&file).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("thread"));
}

#[test]
fn the_daemon_may_open_as_many_descriptors_as_the_system_allows() {
    let daemon = DaemonProcess::start();
    let limits = std::fs::read_to_string(format!("/proc/{}/limits", daemon.pid())).unwrap();
    let line = limits.lines().find(|line| line.starts_with("Max open files")).unwrap();
    let [soft, hard, _] = line.split_whitespace().skip(3).collect::<Vec<_>>()[..] else { panic!("{line}") };
    assert_eq!(soft, hard, "{line}");
}

#[test]
fn a_log_that_nobody_reads_does_not_harm_the_daemon() {
    let runtime = RuntimeDirectory::new();
    let mut command = runtime.collided();
    let mut daemon = command.args(["serve", "--log", "info"]).stderr(Stdio::piped()).spawn().unwrap();
    BufReader::new(daemon.stderr.take().unwrap()).read_line(&mut String::new()).unwrap();
    for _ in 0..3 {
        let client = Client::builder().directory(runtime.instance("default")).connect().unwrap();
        client.scene("scene").create().unwrap();
        assert_eq!(client.list().unwrap(), []);
    }
    kill_process(Pid::from_raw(daemon.id() as i32).unwrap(), Signal::TERM).unwrap();
    assert!(await_end(&mut daemon).success());
}
