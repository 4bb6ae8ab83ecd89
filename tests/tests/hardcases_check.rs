//! Every hard case as a scene file through the real `collided check`.

use std::path::{Path, PathBuf};
use std::process::Output;

use collided_protocol::step::Rows;
use collided_tests::daemon_process::RuntimeDirectory;
use collided_tests::hardcases::{self, Answer, Case, Mesh, Number};
use serde_json::{Value, json};

fn object(mesh: &Mesh) -> Value {
    let vertices: Vec<_> = mesh.vertices.iter().map(|vertex| vertex.map(Number)).collect();
    json!({ "vertices": vertices, "polygons": mesh.polygons })
}

fn scene(case: &Case) -> Value {
    let rows = |rows: Rows| rows.map(|row| row.map(Number));
    json!({
        "objects": { "a": object(&case.a), "b": object(&case.b) },
        "bodies": [{ "name": "a", "object": "a" }, { "name": "b", "object": "b" }],
        "effects": ["interference", "polygon_pairs", "containment"],
        "steps": [{ "a": rows(case.rows_a), "b": rows(case.rows_b) }],
    })
}

fn write(case: &Case, directory: &Path) -> PathBuf {
    let path = directory.join(&case.id).with_extension("json");
    std::fs::write(&path, scene(case).to_string()).expect("the scene file can be written");
    path
}

fn check(runtime: &RuntimeDirectory, scenes: &[PathBuf]) -> Output {
    let mut command = runtime.collided();
    command.args(["check", "--format", "json"]).args(scenes).output().expect("the program starts")
}

/// What the line of a case must say.
fn expected_pairs(answer: &Answer) -> Value {
    if !answer.interfering {
        return json!([]);
    }
    json!([{
        "a": "a", "b": "b", "verdict": "interfering", "relation": answer.relation.name(),
        "polygon_pairs": answer.polygon_pairs, "containment": answer.containment.as_deref().unwrap_or("none"),
    }])
}

/// The pairs of a line that are not clear, without what the table says nothing of: the level, and the relations of single polygon pairs.
fn found_pairs(line: &Value) -> Value {
    let pairs = line["pairs"].as_array().expect("the pairs are an array");
    let mut pairs: Vec<Value> = pairs.iter().filter(|pair| pair["verdict"] != "clear").cloned().collect();
    for pair in &mut pairs {
        assert_eq!(pair["level"], "polygons");
        pair.as_object_mut().expect("a pair is an object").remove("level");
        for polygons in pair["polygon_pairs"].as_array_mut().into_iter().flatten() {
            polygons.as_array_mut().expect("a polygon pair is an array").truncate(2);
        }
    }
    pairs.into()
}

#[test]
fn every_valid_case_in_one_stream() {
    let runtime = RuntimeDirectory::new();
    let cases: Vec<Case> = hardcases::static_cases().into_iter().filter(|case| case.answer().is_some()).collect();
    let scenes: Vec<PathBuf> = cases.iter().map(|case| write(case, runtime.path())).collect();
    let output = check(&runtime, &scenes);
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("JSON is UTF-8");
    assert_eq!(text.lines().count(), cases.len());
    let (mut faults, mut unknown) = (Vec::new(), Vec::new());
    for ((case, scene), line) in cases.iter().zip(&scenes).zip(text.lines()) {
        let line: Value = serde_json::from_str(line).expect("each line is a JSON value");
        assert_eq!((&line["scene"], &line["step"]), (&json!(scene), &json!(0)));
        if line["pairs"][0]["containment"] == "unknown" {
            assert_eq!(
                line["pairs"][0]["containment_reason"].as_str().map(|reason| reason.contains("open")),
                Some(true)
            );
            unknown.push(case.id.as_str());
        }
        let (found, expected) = (found_pairs(&line), case.answer().map(expected_pairs));
        if Some(&found) != expected.as_ref() {
            faults.push(format!("{}: {found}, not {expected:?}", case.id));
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    assert!(unknown.contains(&"open-box-inside"), "{unknown:?}");
}

#[test]
fn each_invalid_case_is_refused_by_name() {
    let runtime = RuntimeDirectory::new();
    let cases: Vec<Case> = hardcases::static_cases().into_iter().filter(|case| case.answer().is_none()).collect();
    assert_eq!(cases.len(), 8);
    for case in cases {
        let scene = write(&case, runtime.path());
        let output = check(&runtime, std::slice::from_ref(&scene));
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{}: {message}", case.id);
        assert!(message.contains(scene.to_str().expect("the path is UTF-8")), "{}: {message}", case.id);
        assert!(output.stdout.is_empty(), "{}: {}", case.id, String::from_utf8_lossy(&output.stdout));
    }
}
