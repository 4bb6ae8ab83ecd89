//! The result section of fixed scenes, as it travels on the wire, by its hash: the same bytes in every build, on one thread and
//! on two, this year and next.
//!
//! When the format or the answers change on purpose,
//! `COLLIDED_WRITE_GOLDEN=1 cargo test -p collided-tests --test golden_reports` writes the file of hashes anew.

use std::fmt;
use std::path::{Path, PathBuf};

use collided_client::{Client, Effect, Mesh, Object, Rows, Scene};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::{crowd, hardcases, meshes, small_meshes};

/// What each scene asks for, in the order of the file's columns.
const EFFECTS: [Effect; 2] = [Effect::Interference, Effect::PolygonPairs];

/// FNV-1a, 64 bits (Fowler, Noll, Vo, Eastlake, "The FNV Non-Cryptographic Hash Algorithm", RFC 9923, 2026).
fn fnv1a(bytes: &[u8]) -> u64 {
    const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    bytes.iter().fold(OFFSET_BASIS, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME))
}

/// A line of the file: a scene, and the hash of its report for each of [`EFFECTS`].
#[derive(Debug, Clone, PartialEq, Eq)]
struct Golden {
    scene: String,
    hashes: [u64; EFFECTS.len()],
}

impl fmt::Display for Golden {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [alone, with_pairs] = self.hashes;
        write!(f, "{:<32} {alone:016x} {with_pairs:016x}", self.scene)
    }
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/golden/reports.txt")
}

/// A scene of bodies of some objects for each of [`EFFECTS`].
type Scenes = [Scene; EFFECTS.len()];

fn scenes(client: &Client, objects: &[&Object]) -> Scenes {
    EFFECTS.map(|effect| {
        let mut scene = client.scene("golden").effects([effect]).create().unwrap();
        for (body, object) in objects.iter().enumerate() {
            scene.add_body(&body.to_string(), object).unwrap();
        }
        scene
    })
}

/// The line of a step.
fn golden(name: String, scenes: &mut Scenes, rows: &[Rows]) -> Golden {
    let hashes = scenes.each_mut().map(|scene| fnv1a(scene.step(rows).unwrap().result_bytes()));
    Golden { scene: name, hashes }
}

fn upload(client: &Client, name: &str, mesh: &hardcases::Mesh) -> Object {
    let corner_counts: Vec<u32> = mesh.polygons.iter().map(|polygon| polygon.len() as u32).collect();
    let mesh = Mesh { vertices: &mesh.vertices, corner_counts: &corner_counts, corners: &mesh.polygons.concat() };
    client.database("hard-cases").loading(name).replace(true).mesh(&mesh).unwrap()
}

/// One pair of bodies, whose objects are replaced from case to case.
fn hard_cases(client: &Client) -> Vec<Golden> {
    let cases: Vec<_> = hardcases::static_cases().into_iter().filter(|case| case.answer().is_some()).collect();
    let objects = |case: &hardcases::Case| [upload(client, "a", &case.a), upload(client, "b", &case.b)];
    let mut scenes = scenes(client, &objects(&cases[0]).each_ref());
    let golden = |case: &hardcases::Case| {
        objects(case);
        golden(case.id.clone(), &mut scenes, &[case.rows_a, case.rows_b])
    };
    cases.iter().map(golden).collect()
}

fn load(client: &Client, mesh: &str) -> Object {
    client.database("shipped").loading(mesh).replace(true).file(meshes::path(mesh)).unwrap()
}

/// Deep in each other, mirrored, flattened, and far apart; the last is clear.
const POSES: [Rows; 4] = [
    [[0.5, 0.1, 0.0, 0.2], [0.0, 0.4, 0.2, 0.1], [0.1, 0.0, 0.6, 0.3]],
    [[1.0, 0.0, 0.0, 0.25], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]],
    [[1.0, 0.0, 0.0, 0.125], [0.0, 1.0, 0.0, 0.25], [0.5, 0.25, 0.0, 0.0]],
    [[1.0, 0.0, 0.0, 1e5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
];

fn real_meshes(client: &Client) -> Vec<Golden> {
    let of_pair = |[a, b]: [&str; 2]| {
        let mut scenes = scenes(client, &[&load(client, a), &load(client, b)]);
        let at = |(number, rows): (usize, &Rows)| {
            golden(format!("{a}-{b}/{number}"), &mut scenes, &[small_meshes::at(0.0, 0.0, 0.0), *rows])
        };
        POSES.iter().enumerate().map(at).collect::<Vec<_>>()
    };
    let pairs = [["spot", "low_poly_bunny"], ["spot", "spot"], ["env", "rob"], ["low_poly_bunny", "low_poly_bunny"]];
    pairs.into_iter().flat_map(of_pair).collect()
}

fn moving_crowd(client: &Client) -> Vec<Golden> {
    const BODIES: usize = 100;
    let size = 1.0 / meshes::longest_side(&meshes::shipped("low_poly_bunny", Some(0)));
    let mut steps = crowd::moving_within(3.5, BODIES, 5, 11);
    steps
        .iter_mut()
        .flatten()
        .flatten()
        .for_each(|[x, y, z, _]| [x, y, z].into_iter().for_each(|entry| *entry *= size));
    let mut scenes = scenes(client, &[&load(client, "low_poly_bunny"); BODIES]);
    steps.iter().enumerate().map(|(number, rows)| golden(format!("crowd/{number}"), &mut scenes, rows)).collect()
}

fn all(threads: &str) -> Vec<Golden> {
    let daemon = DaemonProcess::start_with(&["--threads", threads]);
    let client = daemon.client();
    [hard_cases(&client), real_meshes(&client), moving_crowd(&client)].concat()
}

fn text(golden: &[Golden]) -> String {
    let head = format!("{:<32} {:<16} {:<16}", "# scene", "interference", "polygon_pairs");
    let lines = golden.iter().map(Golden::to_string);
    [head].into_iter().chain(lines).map(|line| line.trim_end().to_owned() + "\n").collect()
}

/// The lines in which two texts differ, one below the other.
fn difference(expected: &str, found: &str) -> String {
    let (expected, found): (Vec<_>, Vec<_>) = (expected.lines().collect(), found.lines().collect());
    let line = |lines: &[&str], number: usize| lines.get(number).copied().unwrap_or("(no line)").to_owned();
    let numbers = 0..expected.len().max(found.len());
    let differing = numbers.map(|number| (line(&expected, number), line(&found, number))).filter(|(e, f)| e != f);
    differing.map(|(expected, found)| format!("expected {expected}\n   found {found}\n")).collect()
}

#[test]
fn reports_have_the_bytes_that_they_always_had() {
    let [one, two] = ["1", "2"].map(|threads| text(&all(threads)));
    assert!(one == two, "on 1 thread (expected) and on 2 (found):\n{}", difference(&one, &two));
    if std::env::var_os("COLLIDED_WRITE_GOLDEN").is_some() {
        std::fs::write(file(), &one).expect("the file of hashes can be written");
    }
    let expected = std::fs::read_to_string(file()).expect("the file of hashes can be read");
    assert!(one == expected, "{}: other bytes than in it:\n{}", file().display(), difference(&expected, &one));
}

#[test]
fn the_hash_is_the_published_one() {
    for (input, hash) in [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
    {
        assert_eq!(fnv1a(input.as_bytes()), hash, "{input}");
    }
}
