//! The motions of `ccd.json` as scene files through the real `collided check`.

use std::path::PathBuf;

use collided_tests::ccd::{self, Case, CaseMotion};
use collided_tests::daemon_process::RuntimeDirectory;
use serde_json::{Map, Value, json};

const TOLERANCE: f64 = 1e-6;
/// Rounded positions may meet some ulp before or after exact ones; near a tangent the time answers to the square root of that.
const BOUND: f64 = 1e-13;
const GRAZING_BOUND: f64 = 1e-6;
/// Rounding hides whether these touch at one instant or pass by.
const GRAZING: [&str; 2] = ["rot-graze-tip", "rot-screw-hit"];

fn start(motion: &CaseMotion) -> Value {
    match motion {
        CaseMotion::Linear { m0, .. } | CaseMotion::Rigid { m0, .. } => json!(m0),
    }
}

fn scene(case: &Case) -> Value {
    let (mut poses, mut motions) = (Map::new(), Map::new());
    for (name, motion) in [("a", &case.motion_a), ("b", &case.motion_b)] {
        match motion {
            CaseMotion::Linear { m1, .. } => poses.insert(name.to_owned(), json!(m1)),
            CaseMotion::Rigid { axis, center, angle, translate, .. } => motions.insert(
                name.to_owned(),
                json!({ "axis": axis, "centre": center, "angle": angle, "translate": translate }),
            ),
        };
    }
    let object =
        |mesh: &collided_tests::hardcases::Mesh| json!({ "vertices": mesh.vertices, "polygons": mesh.polygons });
    json!({
        "objects": { "a": object(&case.a), "b": object(&case.b) },
        "bodies": [{ "name": "a", "object": "a" }, { "name": "b", "object": "b" }],
        "effects": ["time_of_contact", "containment"],
        "accuracy": { "time_tolerance": TOLERANCE },
        "steps": [{ "a": start(&case.motion_a), "b": start(&case.motion_b) }, { "poses": poses, "motion": motions }],
    })
}

/// What is wrong with the line of the moving step.
fn fault(case: &Case, line: &Value) -> Option<String> {
    let pair = &line["pairs"][0];
    let is_possible = !pair["time_of_contact_possible"].is_null();
    let grazing = GRAZING.contains(&case.id.as_str());
    let bound = if grazing { GRAZING_BOUND } else { BOUND };
    let bracket = pair["time_of_contact"].as_array().map(|ends| [&ends[0], &ends[1]].map(|end| end.as_f64()));
    let right = match (case.expected.toc, bracket) {
        (None, None) => true,
        (Some(toc), Some([Some(lo), Some(hi)])) => {
            lo <= toc + bound && toc <= hi + bound && hi - lo <= TOLERANCE && is_possible <= grazing
        }
        _ => false,
    };
    (!right).then(|| format!("{}: {line}, but the truth is {:?}", case.id, case.expected.toc))
}

#[test]
fn every_motion_in_one_stream() {
    let runtime = RuntimeDirectory::new();
    let cases = ccd::cases();
    let write = |case: &Case| {
        let path = runtime.path().join(&case.id).with_extension("json");
        std::fs::write(&path, scene(case).to_string()).expect("the scene file can be written");
        path
    };
    let scenes: Vec<PathBuf> = cases.iter().map(write).collect();
    let output =
        runtime.collided().args(["check", "--format", "json"]).args(&scenes).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("JSON is UTF-8");
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 2 * cases.len());
    let faults: Vec<String> =
        cases.iter().zip(lines.chunks(2)).filter_map(|(case, lines)| fault(case, &lines[1])).collect();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    // The first step places the bodies: they have not moved.
    let moved = lines.iter().step_by(2).filter(|line| line["pairs"][0]["time_of_contact"][1].as_f64() > Some(0.0));
    assert_eq!(moved.count(), 0);
}
