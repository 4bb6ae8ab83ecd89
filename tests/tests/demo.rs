//! `collided demo` from the outside: it ends by itself, draws its picture, and leaves nothing behind.

use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Output, Stdio};

use collided_tests::daemon_process::RuntimeDirectory;
use rustix::process::{Pid, Signal, kill_process};

/// What is in the folder of a test.
fn left_in(runtime: &RuntimeDirectory) -> Vec<OsString> {
    let entries = fs::read_dir(runtime.path()).expect("the folder is there");
    entries.map(|entry| entry.expect("the folder can be read").file_name()).collect()
}

#[test]
fn the_demo_draws_what_interferes_and_leaves_nothing() {
    let runtime = RuntimeDirectory::new();
    let mut command = runtime.collided();
    command.args(["demo", "--steps", "12", "--picture", "picture.svg"]).current_dir(runtime.path());
    let Output { status, stdout, stderr } = command.stdin(Stdio::null()).output().expect("the program runs");
    let text = String::from_utf8(stdout).expect("the output is text");
    assert!(status.success(), "{text}{}", String::from_utf8_lossy(&stderr));
    for part in ["pasture", "room", "12/12", "picture.svg"] {
        assert!(text.contains(part), "{text}does not say {part}");
    }
    let picture = fs::read_to_string(runtime.path().join("picture.svg")).expect("there is a picture");
    assert!(picture.starts_with("<svg") && picture.trim_end().ends_with("</svg>"));
    assert!(!picture.contains("NaN") && !picture.contains("inf"), "every number is finite");
    assert!(picture.len() < 2 << 20, "the picture has {} bytes", picture.len());
    assert!(!picture.contains(": 0 of 8640 polygons"), "some polygons interfere from the first step on");
    assert_eq!(left_in(&runtime), ["picture.svg"]);
}

#[test]
fn a_picture_that_cannot_be_written_is_trouble() {
    let runtime = RuntimeDirectory::new();
    let mut command = runtime.collided();
    command.args(["demo", "--steps", "1", "--picture", "no such folder/picture.svg"]).current_dir(runtime.path());
    let output = command.stdin(Stdio::null()).output().expect("the program runs");
    let reason = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{reason}");
    assert!(reason.contains("no such folder/picture.svg") && reason.contains("--picture"), "{reason}");
}

#[test]
fn an_interrupted_demo_leaves_nothing() {
    let runtime = RuntimeDirectory::new();
    let mut command = runtime.collided();
    command.args(["demo", "--steps", "100000"]).current_dir(runtime.path());
    let mut demo = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().expect("the program runs");
    let mut output = BufReader::new(demo.stdout.take().expect("stdout is piped"));
    let mut line = String::new();
    output.read_line(&mut line).expect("the output can be read");
    assert!(line.starts_with("a daemon process and 2 client processes"), "{line}");
    kill_process(Pid::from_child(&demo), Signal::INT).expect("the demo runs");
    output.read_to_string(&mut line).expect("the output is text");
    assert_eq!(demo.wait().expect("the demo can be waited for").code(), Some(130), "{line}");
    assert!(left_in(&runtime).is_empty(), "{:?}", left_in(&runtime));
}
