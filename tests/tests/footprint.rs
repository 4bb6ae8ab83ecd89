//! What clients cost the host: memory of one copy of an object, however many use it, and no processor time while nothing moves.

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use collided_client::{BodySpec, IDENTITY, Mesh, translation};
use collided_tests::client_process::SteppingClient;
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::small_meshes::TRIANGLE;

/// Bytes of memory that are the process's own, its share of what it shares included.
fn memory(pid: u32) -> u64 {
    let rollup = fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).expect("the process lives");
    let line = rollup.lines().find_map(|line| line.strip_prefix("Pss:")).expect("the system says the share");
    let kilobytes: u64 = line.trim().trim_end_matches(" kB").parse().expect("a number");
    kilobytes << 10
}

/// Processor time that a process has used, in ticks of 10 ms.
fn ticks(pid: u32) -> u64 {
    let stat = fs::read_to_string(format!("/proc/{pid}/stat")).expect("the process lives");
    // The name is in brackets and may hold anything; user and system time are the 12th and 13th field behind it.
    let (_, fields) = stat.rsplit_once(") ").expect("the name is in brackets");
    fields.split(' ').skip(11).take(2).map(|time| time.parse::<u64>().expect("a number")).sum()
}

/// What a process uses in a second, once it has come to rest.
fn ticks_in_a_second(pid: u32) -> u64 {
    sleep(Duration::from_millis(200));
    let before = ticks(pid);
    sleep(Duration::from_secs(1));
    ticks(pid) - before
}

/// A wavy sheet of a million triangles.
fn sheet() -> (Vec<[f64; 3]>, Vec<u32>) {
    const SIDE: u32 = 708;
    let point = |index: u32| {
        let [x, y] = [index % SIDE, index / SIDE].map(|place| f64::from(place) / f64::from(SIDE));
        [x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()]
    };
    let square = |index: u32| {
        let [a, b, c, d] = [index, index + 1, index + SIDE + 1, index + SIDE];
        [a, b, c, a, c, d]
    };
    let corner = |index: &u32| index % SIDE < SIDE - 1 && index / SIDE < SIDE - 1;
    ((0..SIDE * SIDE).map(point).collect(), (0..SIDE * SIDE).filter(corner).flat_map(square).collect())
}

#[test]
fn an_object_is_held_once_however_many_processes_and_bodies_use_it() {
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let (vertices, corners) = sheet();
    let corner_counts = vec![3; corners.len() / 3];
    let mesh = Mesh { vertices: &vertices, corner_counts: &corner_counts, corners: &corners };
    let sheet = client.database("shared").upload("sheet", &mesh).expect("the mesh is good");
    let one_copy = sheet.info().memory;
    assert!(one_copy > 30_000_000, "a million triangles take {one_copy} bytes");
    let start = || SteppingClient::start_with(&daemon, "shared", "sheet", 1.0);
    let first = start();
    let with_one = memory(daemon.pid());
    assert!(with_one > one_copy, "the daemon holds the object: {with_one} bytes");
    let others: Vec<SteppingClient> = (0..5).map(|_| start()).collect();
    let mut scene = client.scene("many").create().expect("a scene");
    let specs: Vec<BodySpec> = (0..1000).map(|body| BodySpec::new(body.to_string(), &sheet)).collect();
    scene.add_bodies(&specs).expect("bodies can be added");
    let places: Vec<_> = (0..1000).map(|body| translation([0.0, 0.0, f64::from(body)])).collect();
    assert!(scene.step(&places).expect("the step is good").is_clear());
    let growth = memory(daemon.pid()).saturating_sub(with_one);
    // What there is besides is the memory of the scenes' steps.
    assert!(growth < one_copy, "5 more processes and 1,000 bodies cost {growth} bytes, one copy {one_copy}");
    for process in others.iter().chain([&first]) {
        let own = memory(process.pid() as u32);
        assert!(own < one_copy / 2, "a client process takes {own} bytes, one copy {one_copy}");
    }
}

#[test]
fn a_daemon_with_scenes_at_rest_and_a_client_that_waits_use_no_processor_time() {
    /// A thread that spins would use 100.
    const FEW: u64 = 3;
    let daemon = DaemonProcess::start();
    let client = daemon.client();
    let triangle = client.database("parts").upload("tri", &TRIANGLE).expect("the mesh is good");
    let mut scenes = ["one", "two", "three"].map(|name| client.scene(name).create().expect("a scene"));
    for scene in &mut scenes {
        scene.add_body("a", &triangle).expect("a body");
        scene.step(&[IDENTITY]).expect("the step is good");
    }
    let used = ticks_in_a_second(daemon.pid());
    assert!(used <= FEW, "the daemon used {used} ticks in a second");
    let stepping = SteppingClient::start(&daemon, "parts", "tri");
    daemon.pause();
    let used = ticks_in_a_second(stepping.pid() as u32);
    daemon.resume();
    assert!(used <= FEW, "the client that waits for its report used {used} ticks in a second");
    assert_eq!(stepping.finish().error, None);
}
