//! What `check` and `demo` have started ends with them, also when they are killed, and leaves nothing behind.

use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

use collided_client::Client;
use collided_protocol::names::{RENDEZVOUS_FILE, Rendezvous};
use collided_tests::daemon_process::{PATIENCE, RuntimeDirectory, await_some, shared_files};
use rustix::process::{Pid, Signal, kill_process};

/// The private daemon of a command: connected to, and what it has published.
struct Found {
    client: Client,
    published: Rendezvous,
}

/// Starts a command with a pipe as its standard output.
fn start(command: &mut Command) -> (Child, impl BufRead + use<>) {
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().expect("the program can be started");
    let stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
    (child, stdout)
}

fn find(runtime: &RuntimeDirectory, command: &Child) -> Found {
    let directory = runtime.instance(&format!("private-{}-0", command.id()));
    let client = Client::builder().directory(&directory).timeout(PATIENCE).connect().expect("the daemon answers");
    let published = std::fs::read(directory.join(RENDEZVOUS_FILE)).expect("a daemon has published itself");
    Found { client, published: serde_json::from_slice(&published).expect("the rendezvous file is JSON") }
}

/// A client of the test's own would keep files of the epoch open, and be one more that writes them: it has to go first.
fn await_nothing_left(runtime: &RuntimeDirectory, Found { client, published }: Found) {
    drop(client);
    let root = PathBuf::from(&published.iceoryx2_root);
    await_some("the daemon ends and removes everything", || {
        let left = runtime.path().join("collided").exists() || root.exists() || !shared_files(&published).is_empty();
        (!left).then_some(())
    });
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).expect("the process runs");
}

/// A demo whose clients are stepping.
fn stepping_demo(runtime: &RuntimeDirectory) -> (Child, impl BufRead + use<>, Found) {
    let mut command = runtime.collided();
    let (demo, output) = start(command.args(["demo", "--steps", "100000"]).current_dir(runtime.path()));
    let found = find(runtime, &demo);
    await_some("both clients step", || {
        let scenes = found.client.status().expect("the daemon answers").scenes;
        (scenes.iter().filter(|scene| scene.steps > 0).count() == 2).then_some(())
    });
    (demo, output, found)
}

#[test]
fn a_killed_demo_takes_its_clients_and_its_daemon_along() {
    let runtime = RuntimeDirectory::new();
    let (mut demo, _output, found) = stepping_demo(&runtime);
    demo.kill().expect("the demo runs");
    demo.wait().expect("the demo can be waited for");
    await_nothing_left(&runtime, found);
}

#[test]
fn an_interrupted_demo_whose_clients_step_leaves_nothing() {
    let runtime = RuntimeDirectory::new();
    let (mut demo, mut output, found) = stepping_demo(&runtime);
    signal(&demo, Signal::INT);
    output.read_to_string(&mut String::new()).expect("the output is text");
    assert_eq!(demo.wait().expect("the demo can be waited for").code(), Some(130));
    await_nothing_left(&runtime, found);
}

/// A check that waits for its output to be read: there is more of it than a pipe holds.
fn blocked_check(runtime: &RuntimeDirectory) -> (Child, impl BufRead + use<>, Found) {
    let scene = serde_json::json!({
        "objects": { "tri": { "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "polygons": [[0, 1, 2]] } },
        "bodies": [{ "name": "a", "object": "tri" }, { "name": "b", "object": "tri" }],
        "steps": vec![serde_json::json!({}); 5000],
    });
    std::fs::write(runtime.path().join("scene.json"), scene.to_string()).expect("a file for the test can be written");
    let mut command = runtime.collided();
    let (check, mut output) =
        start(command.args(["check", "scene.json", "--format", "json"]).current_dir(runtime.path()));
    output.read_line(&mut String::new()).expect("the first step is answered");
    let found = find(runtime, &check);
    (check, output, found)
}

#[test]
fn a_killed_check_takes_its_daemon_along() {
    let runtime = RuntimeDirectory::new();
    let (mut check, _output, found) = blocked_check(&runtime);
    check.kill().expect("the check runs");
    check.wait().expect("the check can be waited for");
    await_nothing_left(&runtime, found);
}

#[test]
fn an_interrupted_check_leaves_nothing() {
    let runtime = RuntimeDirectory::new();
    let (mut check, mut output, found) = blocked_check(&runtime);
    signal(&check, Signal::INT);
    output.read_to_string(&mut String::new()).expect("the output is text");
    assert_eq!(check.wait().expect("the check can be waited for").code(), Some(130));
    await_nothing_left(&runtime, found);
}

#[test]
fn a_check_whose_daemon_must_be_killed_leaves_nothing() {
    let runtime = RuntimeDirectory::new();
    let (mut check, mut output, found) = blocked_check(&runtime);
    let daemon = Pid::from_raw(found.published.pid as i32).expect("a process id is not 0");
    kill_process(daemon, Signal::KILL).expect("the daemon runs");
    output.read_to_string(&mut String::new()).expect("the output is text");
    assert_eq!(check.wait().expect("the check can be waited for").code(), Some(2));
    await_nothing_left(&runtime, found);
}
