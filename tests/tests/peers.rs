//! The benchmark beside another library, on so little work that it is a test: it runs, and the libraries agree.
//!
//! `cargo test -p collided-tests --features parry --test peers`

use std::path::Path;
use std::process::Command;

use collided_tests::daemon_process::RuntimeDirectory;
use collided_tests::meshes;
use serde_json::Value;

fn peers(arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_peers")).args(arguments).output().expect("the program starts")
}

/// Poses of a bunny and the answers to a question, by the names of the libraries.
fn ask(directory: &Path, question: &[&str]) -> (Value, Vec<(String, Vec<f64>)>) {
    let (mesh, poses) = (meshes::path("low_poly_bunny"), directory.join("poses.npy"));
    let [mesh, poses] = [&mesh, &poses].map(|path| path.to_str().expect("a plain path"));
    let generated = peers(&["generate", "poses", "--mesh-a", mesh, "--count", "30", "--out", poses]);
    assert!(generated.status.success(), "{}", String::from_utf8_lossy(&generated.stderr));
    let arguments = ["--mesh-a", mesh, "--poses", poses, "--passes", "1", "--seconds", "600"];
    let asked = peers(&[question, &arguments].concat());
    assert!(asked.status.success(), "{}", String::from_utf8_lossy(&asked.stderr));
    let about: Value = serde_json::from_slice(&asked.stdout).expect("JSON");
    let numbers = |values: &Value| serde_json::from_value::<Vec<f64>>(values.clone()).expect("numbers");
    let libraries = about["libraries"].as_array().expect("libraries").iter();
    let answers = libraries
        .map(|record| {
            let (times, answers) = (numbers(&record["us"]), numbers(&record["answers"]));
            assert_eq!(times.len(), answers.len());
            (record["library"].as_str().expect("a name").to_owned(), answers)
        })
        .collect();
    (about, answers)
}

#[test]
fn verdicts_agree_on_poses_of_every_class() {
    let directory = RuntimeDirectory::new();
    let (about, answers) = ask(directory.path(), &["pair", "boolean"]);
    let classes = about["classes"].as_array().expect("classes");
    assert!([0.0, 1.0, 2.0].iter().all(|class| classes.iter().any(|is| is == class)), "{classes:?}");
    assert_eq!(
        answers.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        ["ours", "parry stock", "parry dual"]
    );
    for (name, answers_of_it) in &answers {
        assert_eq!((answers_of_it.len(), answers_of_it), (30, &answers[0].1), "{name}");
    }
}

#[test]
fn the_verdicts_of_a_batch_agree() {
    let directory = RuntimeDirectory::new();
    let (_, answers) = ask(directory.path(), &["batch"]);
    assert_eq!(answers.len(), 3);
    for (name, answers_of_it) in &answers {
        assert_eq!((answers_of_it.len(), answers_of_it), (30, &answers[0].1), "{name}");
    }
}

#[test]
fn steps_through_shared_memory_are_measured_beside_raw_ones() {
    let measured = peers(&["shared-memory", "--steps", "10"]);
    assert!(measured.status.success(), "{}", String::from_utf8_lossy(&measured.stderr));
    let measured: Value = serde_json::from_slice(&measured.stdout).expect("JSON");
    let steps = measured["steps"].as_array().expect("a list");
    let is_time = |value: &Value| value.as_f64().is_some_and(|us| us >= 0.0);
    assert!(steps.len() > 3 && steps.iter().all(|step| is_time(&step["raw"]) && is_time(&step["ours"])), "{measured}");
}

#[test]
fn distances_agree() {
    let directory = RuntimeDirectory::new();
    let (_, answers) = ask(directory.path(), &["pair", "distance"]);
    for (ours, parry) in answers[0].1.iter().zip(&answers[1].1) {
        assert!(*ours > 0.0 && (ours - parry).abs() <= 1e-6 * ours, "{ours} {parry}");
    }
}

#[test]
fn missing_poses_are_trouble() {
    let mesh = meshes::path("rob");
    let asked = peers(&["pair", "boolean", "--mesh-a", mesh.to_str().expect("a plain path"), "--poses", "none.npy"]);
    assert_eq!(asked.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&asked.stderr).contains("none.npy"));
}
