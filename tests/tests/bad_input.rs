//! Bad input: a typed error to that client alone, which names what, where and the remedy; everybody goes on.

use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::time::Duration;

use collided_client::{BodyId, BodySpec, Client, Error, ErrorCode, IDENTITY, Mesh, Reply, Request, Scene, frame};
use collided_protocol::names::{RENDEZVOUS_FILE, SOCKET_FILE};
use collided_tests::daemon_process::{DaemonProcess, RuntimeDirectory};
use collided_tests::small_meshes::{TRIANGLE, at};
use rustix::fs::{CWD, FileType, Mode, mknodat};

/// Checks the code, that the text holds each of `parts`, and that the daemon goes on.
fn check<T: std::fmt::Debug>(daemon: &DaemonProcess, outcome: Result<T, Error>, code: ErrorCode, parts: &[&str]) {
    let error = outcome.expect_err("bad input is refused");
    assert_eq!(error.code(), Some(code), "{error}");
    for part in parts {
        assert!(error.to_string().contains(part), "{part:?} is not in: {error}");
    }
    daemon.client().status().expect("the daemon goes on");
}

fn scene(client: &Client) -> Scene {
    let object = client.database("parts").upload("tri", &TRIANGLE).unwrap();
    let mut scene = client.scene("scene").create().unwrap();
    scene.add_bodies(&[BodySpec::new("base", &object), BodySpec::new("arm", &object)]).unwrap();
    scene
}

#[test]
fn meshes_that_cannot_be_are_refused_by_vertex_polygon_and_corner() {
    let daemon = DaemonProcess::start();
    let parts = daemon.client().database("parts");
    let good = TRIANGLE.vertices;
    let index = Mesh { vertices: good, corner_counts: &[3], corners: &[0, 1, 3] };
    check(&daemon, parts.upload("x", &index), ErrorCode::IndexOutOfRange, &["\"x\"", "polygon 0", "3"]);
    let few = Mesh { vertices: good, corner_counts: &[3, 2], corners: &[0, 1, 2, 0, 1] };
    check(&daemon, parts.upload("x", &few), ErrorCode::TooFewCorners, &["polygon 1", "2"]);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let vertices = [good[0], [0.0, bad, 0.0], good[2]];
        let mesh = Mesh { vertices: &vertices, ..TRIANGLE };
        check(&daemon, parts.upload("x", &mesh), ErrorCode::NonFiniteVertex, &["vertex 1", &bad.to_string()]);
    }
    let counts = Mesh { vertices: good, corner_counts: &[3, 3], corners: &[0, 1, 2] };
    check(&daemon, parts.upload("x", &counts), ErrorCode::BadMessage, &["\"x\""]);
    check(&daemon, parts.loading("x").order(31).mesh(&TRIANGLE), ErrorCode::OrderOutOfRange, &["31", "30"]);
    assert_eq!(daemon.client().list().unwrap(), [], "nothing was loaded");
}

#[test]
fn an_empty_mesh_is_allowed_and_never_interferes() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let empty = client.database("parts").upload("empty", &Mesh::default()).unwrap();
    assert_eq!(empty.info().container, None);
    let mut scene = scene(&client);
    scene.add_body("ghost", &empty).unwrap();
    assert_eq!(scene.step(&[IDENTITY; 3]).unwrap().pairs().len(), 1, "the two triangles alone");
}

#[test]
fn mesh_files_that_cannot_be_read_are_refused_by_path() {
    let daemon = DaemonProcess::start();
    let parts = daemon.client().database("parts");
    check(&daemon, parts.load("x", "/nowhere/mesh.obj"), ErrorCode::MeshUnreadable, &["/nowhere/mesh.obj"]);
    for (name, part) in [("pipe.obj", "not a regular file"), ("folder.obj", "is a directory")] {
        let path = daemon.runtime().path().join(name);
        match name {
            "pipe.obj" => mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap(),
            _ => std::fs::create_dir(&path).unwrap(),
        }
        check(&daemon, parts.load("x", &path), ErrorCode::MeshUnreadable, &[name, part]);
    }
    let file = daemon.runtime().path().join("bad.obj");
    std::fs::write(&file, "v 0 0 zero\n").unwrap();
    check(&daemon, parts.load("x", &file), ErrorCode::MeshMalformed, &["bad.obj", "zero"]);
}

#[test]
fn transforms_that_cannot_be_are_refused_by_body_and_no_body_moves() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let mut scene = scene(&client);
    let before = scene.step(&[IDENTITY, at(9.0, 0.0, 0.0)]).unwrap().result_bytes().to_vec();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let step = scene.step(&[IDENTITY, at(0.0, bad, 0.0)]);
        check(&daemon, step, ErrorCode::NonFiniteTransform, &["\"arm\"", "row 1", "column 3", &bad.to_string()]);
    }
    let mut huge = IDENTITY;
    huge[0] = [f64::MAX, f64::MAX, 0.0, f64::MAX];
    check(&daemon, scene.step(&[IDENTITY, huge]), ErrorCode::WorldOverflow, &["\"arm\"", "vertex"]);
    check(&daemon, scene.step(&[IDENTITY]), ErrorCode::BadStep, &["1 transforms for 2 bodies"]);
    check(&daemon, scene.step_sparse(&[(BodyId(77), IDENTITY)]), ErrorCode::UnknownBody, &["77"]);
    let twice = [(scene.bodies()[0], IDENTITY); 2];
    check(&daemon, scene.step_sparse(&twice), ErrorCode::BadStep, &["\"base\""]);
    assert_eq!(scene.step_sparse(&[]).unwrap().result_bytes(), before, "no body has moved");
}

#[test]
fn unknown_and_duplicate_names_are_refused() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let parts = client.database("parts");
    let mut scene = scene(&client);
    let tri = parts.get("tri").unwrap();
    check(&daemon, parts.get("nothing"), ErrorCode::UnknownObject, &["\"parts\"", "\"nothing\""]);
    check(&daemon, parts.unload("nothing"), ErrorCode::UnknownObject, &["\"nothing\""]);
    check(&daemon, client.database("no").list(), ErrorCode::UnknownDatabase, &["\"no\""]);
    check(&daemon, parts.upload("tri", &TRIANGLE), ErrorCode::DuplicateObject, &["\"tri\""]);
    check(&daemon, scene.add_body("arm", &tri), ErrorCode::DuplicateBody, &["\"arm\""]);
    let twins = [BodySpec::new("new", &tri), BodySpec::new("new", &tri)];
    check(&daemon, scene.add_bodies(&twins), ErrorCode::DuplicateBody, &["\"new\""]);
    check(&daemon, scene.add_body("", &tri), ErrorCode::BadName, &["empty"]);
    check(&daemon, scene.remove_bodies(&[BodyId(0), BodyId(9)]), ErrorCode::UnknownBody, &["9"]);
    check(&daemon, scene.ignore(BodyId(0), BodyId(9)), ErrorCode::UnknownBody, &["9"]);
    check(&daemon, parts.unload("tri"), ErrorCode::ObjectInUse, &["\"tri\"", "2 bodies"]);
    assert_eq!(scene.step(&[IDENTITY, IDENTITY]).unwrap().pairs().len(), 1, "all or nothing was added and removed");
    drop(scene);
    parts.unload("tri").unwrap();
}

#[test]
fn a_scene_belongs_to_its_client() {
    let daemon = DaemonProcess::start();
    let (owner, other) = (daemon.client(), daemon.client());
    let mut scene = scene(&owner);
    let drop_it = other.request(&Request::DropScene { scene: scene.id() });
    check(&daemon, drop_it, ErrorCode::UnknownScene, &["another client owns it"]);
    scene.step(&[IDENTITY, IDENTITY]).unwrap();
}

/// A connection that says what no client of this release would say.
fn raw(daemon: &DaemonProcess) -> UnixStream {
    UnixStream::connect(daemon.directory().join(SOCKET_FILE)).unwrap()
}

fn ask(mut stream: &UnixStream, message: &impl serde::Serialize) -> Reply {
    frame::write(&mut stream, message).unwrap();
    frame::read(&mut stream).unwrap().expect("the daemon replies")
}

fn hello(protocol: u32, iceoryx2: &str) -> Request {
    let (iceoryx2, client) = (iceoryx2.to_owned(), "raw".to_owned());
    Request::Hello { protocol_min: protocol, protocol_max: protocol, iceoryx2, client }
}

fn code(reply: &Reply) -> Option<ErrorCode> {
    match reply {
        Reply::Error(error) => Some(error.code),
        _ => None,
    }
}

#[test]
fn the_daemon_refuses_other_versions_and_requests_out_of_turn() {
    let daemon = DaemonProcess::start();
    let stream = raw(&daemon);
    assert_eq!(code(&ask(&stream, &Request::Status)), Some(ErrorCode::BadMessage), "hello comes first");
    assert_eq!(code(&ask(&stream, &hello(99, "0.10.0"))), Some(ErrorCode::ProtocolMismatch));
    assert_eq!(code(&ask(&stream, &hello(1, "0.9.0"))), Some(ErrorCode::Iceoryx2Mismatch));
    assert!(matches!(ask(&stream, &hello(1, "0.10.0")), Reply::Hello { protocol: 1, .. }));
    assert_eq!(code(&ask(&stream, &hello(1, "0.10.0"))), Some(ErrorCode::BadMessage), "hello comes once");
    assert_eq!(code(&ask(&stream, &serde_json::json!({ "request": "dance" }))), Some(ErrorCode::BadMessage));
    let extra = serde_json::json!({ "request": "list", "database": null, "colour": "red" });
    assert_eq!(code(&ask(&stream, &extra)), Some(ErrorCode::BadMessage), "unknown fields are not passed over");
    assert!(matches!(ask(&stream, &Request::Status), Reply::Status(_)), "the connection goes on");
}

#[test]
fn an_effect_that_there_is_not_is_named_with_those_that_there_are() {
    let daemon = DaemonProcess::start();
    let stream = raw(&daemon);
    assert!(matches!(ask(&stream, &hello(1, "0.10.0")), Reply::Hello { .. }));
    let reply = ask(&stream, &serde_json::json!({ "request": "create_scene", "name": "s", "effects": ["smell"] }));
    assert_eq!(code(&reply), Some(ErrorCode::UnknownEffect));
    let said = format!("{reply:?}");
    assert!(["smell", "interference", "polygon_pairs"].iter().all(|name| said.contains(name)), "{said}");
    assert!(matches!(ask(&stream, &Request::Status), Reply::Status(status) if status.scenes.is_empty()));
}

#[test]
fn a_message_beyond_the_limit_is_refused_and_the_connection_goes_on() {
    let daemon = DaemonProcess::start();
    let mut stream = raw(&daemon);
    assert!(matches!(ask(&stream, &hello(1, "0.10.0")), Reply::Hello { .. }));
    let bytes = collided_protocol::limits::MAX_CONTROL_MESSAGE as u32 + 1;
    stream.write_all(&bytes.to_le_bytes()).unwrap();
    std::io::copy(&mut std::io::repeat(b' ').take(u64::from(bytes)), &mut stream).unwrap();
    let reply = frame::read::<Reply>(&mut stream).unwrap().unwrap();
    assert_eq!(code(&reply), Some(ErrorCode::LimitExceeded));
    assert!(matches!(ask(&stream, &Request::Status), Reply::Status(_)));
}

#[test]
fn bytes_that_are_no_message_end_or_spoil_nothing_but_their_connection() {
    let daemon = DaemonProcess::start();
    let mut scene = scene(&daemon.client());
    for bytes in [&[][..], &[1], &[255; 4], &[4, 0, 0, 0, b'n'], &[2, 0, 0, 0, b'{', b'}']] {
        raw(&daemon).write_all(bytes).unwrap();
    }
    scene.step(&[IDENTITY, IDENTITY]).unwrap();
}

/// A daemon of another release, as far as a client looks at it.
fn other_release(directory: &Path, protocol: u32, iceoryx2: &str) -> UnixListener {
    std::fs::create_dir_all(directory).unwrap();
    let rendezvous = serde_json::json!({
        "epoch": "0", "pid": 1, "protocol_min": protocol, "protocol_max": protocol, "iceoryx2": iceoryx2,
        "iceoryx2_prefix": "x", "iceoryx2_root": "/tmp/x", "version": "9.9.9",
    });
    std::fs::write(directory.join(RENDEZVOUS_FILE), rendezvous.to_string()).unwrap();
    UnixListener::bind(directory.join(SOCKET_FILE)).unwrap()
}

#[test]
fn the_client_refuses_a_daemon_of_other_versions() {
    let runtime = RuntimeDirectory::new();
    let connect = |directory: &Path| Client::builder().directory(directory).timeout(Duration::from_secs(5)).connect();
    let directory = runtime.instance("protocol");
    let _daemon = other_release(&directory, 99, "0.10.0");
    assert!(matches!(connect(&directory), Err(Error::ProtocolMismatch { daemon_min: 99, client_max: 1, .. })));
    let directory = runtime.instance("iceoryx2");
    let _daemon = other_release(&directory, 1, "0.9.0");
    assert!(matches!(connect(&directory), Err(Error::Iceoryx2Mismatch { daemon, .. }) if daemon == "0.9.0"));
}
