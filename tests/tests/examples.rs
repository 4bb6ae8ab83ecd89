//! The examples: each client program against a daemon, and its scene file through `collided check`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use collided_tests::daemon_process::{DaemonProcess, RuntimeDirectory, program};
use serde_json::Value;

/// How far rounding may take a figure of the examples, whose sizes are about 1.
const ROUNDING: f64 = 1e-12;
const CLEARANCE: f64 = 0.03125;

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../client/examples")
}

/// What the example program tells.
fn told(example: &str) -> Vec<String> {
    let daemon = DaemonProcess::start();
    let mut command = Command::new(program(&format!("example-{}", example.replace('_', "-"))));
    let output = command.env("XDG_RUNTIME_DIR", daemon.runtime().path()).output().expect("the program starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("the story is UTF-8").lines().map(str::to_owned).collect()
}

/// The steps of the example's scene file, in which some pair interferes or meets.
fn checked(example: &str) -> Vec<Value> {
    let runtime = RuntimeDirectory::new();
    let scene = examples().join("scenes").join(example).with_extension("toml");
    let output =
        runtime.collided().args(["check", "--format", "json"]).arg(scene).output().expect("the program starts");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("JSON is UTF-8");
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

/// The numbers in `line` after the first `word`.
fn numbers_after(line: &str, word: &str) -> Vec<f64> {
    let (_, rest) = line.split_once(word).unwrap_or_else(|| panic!("no {word:?} in {line:?}"));
    rest.split([' ', ',', '[', ']']).filter_map(|part| part.parse().ok()).collect()
}

fn floats(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value} is no list")).iter().filter_map(Value::as_f64).collect()
}

#[track_caller]
fn assert_near(found: &[f64], expected: &[f64]) {
    let near = |(found, expected): (&f64, &f64)| (found - expected).abs() <= ROUNDING;
    assert!(found.len() == expected.len() && found.iter().zip(expected).all(near), "{found:?}, not {expected:?}");
}

#[test]
fn each_program_has_its_scene_file() {
    let stems = |folder: PathBuf, ending: &str| {
        let entries = fs::read_dir(folder).expect("the examples are there").flatten().map(|entry| entry.path());
        let files = entries.filter(|path| path.extension().is_some_and(|found| found == ending));
        let mut stems: Vec<_> = files.filter_map(|path| path.file_stem().map(ToOwned::to_owned)).collect();
        stems.sort();
        stems
    };
    let mut programs = stems(examples(), "rs");
    programs.retain(|program| program != "first");
    assert_eq!(programs, stems(examples().join("scenes"), "toml"));
    assert_eq!(programs, ["billiard_break", "bolt_through_plate", "peg_into_hole", "two_arms"]);
}

/// Above the plate the lower edges of the peg are nearest to the rim, in the hole the walls; then the peg touches.
fn peg_distances() -> [f64; 5] {
    [2f64.hypot(CLEARANCE), 0.25f64.hypot(CLEARANCE), CLEARANCE, 0.0, 0.0]
}

/// Centre, area and normal: half of the plate's thickness by the peg's side; a strip as wide as the clearance.
fn peg_contacts() -> [[f64; 7]; 2] {
    let side = 1.0 - 2.0 * CLEARANCE;
    [[0.5, 0.0, 0.75, 0.5 * side, -1.0, 0.0, 0.0], [0.5 + 0.5 * CLEARANCE, 0.0, 1.0, CLEARANCE * side, 0.0, 0.0, 1.0]]
}

#[test]
fn the_peg_nears_the_plate_and_touches_wall_and_rim() {
    let story = told("peg_into_hole");
    let (contacts, states): (Vec<_>, Vec<_>) = story.iter().partition(|line| line.starts_with("  contact"));
    let places = ["high above", "nearer", "in the hole", "pushed against the wall", "put down on the rim"];
    let expected = places.iter().zip(peg_distances()).map(|(place, distance)| {
        let verdict = if distance > 0.0 { "clear" } else { "interfering" };
        format!("{place}: {verdict}, distance {distance:.6}")
    });
    assert_eq!(states, expected.collect::<Vec<_>>().iter().collect::<Vec<_>>());
    assert_eq!(contacts.len(), 2);
    contacts.iter().zip(peg_contacts()).for_each(|(line, expected)| assert_near(&numbers_after(line, "at"), &expected));
}

#[test]
fn the_peg_of_the_scene_file_does_the_same() {
    let pairs: Vec<Value> = checked("peg_into_hole").iter().map(|step| step["pairs"][0].clone()).collect();
    let distances: Vec<f64> = pairs.iter().filter_map(|pair| pair["distance"]["value"].as_f64()).collect();
    assert_near(&distances, &peg_distances());
    let regions: Vec<&Value> = pairs.iter().flat_map(|pair| pair["contacts"].as_array()).flatten().collect();
    assert_eq!(regions.len(), 2);
    for (region, expected) in regions.into_iter().zip(peg_contacts()) {
        let area = region["area"].as_f64().expect("a number");
        assert_near(&[floats(&region["centre"]), vec![area], floats(&region["normal"])].concat(), &expected);
    }
}

const FOREARMS: [[&str; 2]; 3] = [["left 1", "right 2"], ["left 2", "right 1"], ["left 2", "right 2"]];

/// The arms are parallel, their shoulders 4.5 apart and their links 0.1 thick.
fn arms_meet(step: &u32) -> bool {
    let shoulder = 0.5 * (std::f64::consts::TAU * f64::from(*step) / 1000.0).cos();
    4.5 * shoulder.sin().abs() <= 0.1
}

#[test]
fn the_forearms_interfere_while_the_arms_cross_and_no_arm_with_itself() {
    let story = told("two_arms");
    assert!(story[0].ends_with(" of 1000 steps met the deadline of 1ms"), "{}", story[0]);
    let steps: Vec<u32> = (0..1000).filter(arms_meet).collect();
    let (count, first) = (steps.len(), steps[0]);
    let lines = FOREARMS.map(|[a, b]| format!("{a} and {b} interfere in {count} steps, first in step {first}"));
    assert_eq!(story[1..], lines);
}

#[test]
fn the_arms_of_the_scene_file_cross_in_the_middle_step() {
    let interfering = checked("two_arms").into_iter().map(|step| {
        let pairs = step["pairs"].as_array().expect("a list").clone();
        pairs
            .into_iter()
            .map(|pair| ["a", "b"].map(|body| pair[body].as_str().unwrap_or_default().to_owned()))
            .collect()
    });
    let interfering: Vec<Vec<[String; 2]>> = interfering.collect();
    let forearms = FOREARMS.map(|pair| pair.map(str::to_owned)).to_vec();
    assert_eq!(interfering, [vec![], forearms, vec![]]);
}

/// The tips start 5 above the plate's foot and fly 12 down; spinning about its own axis does not change that.
fn assert_is_bracket_of_the_bolt(bracket: &[f64]) {
    let meeting = (5.0 - 1.0 / 64.0) / 12.0;
    assert!(bracket.len() == 2 && bracket[1] - bracket[0] <= 1e-6, "{bracket:?}");
    assert!(bracket[0] <= meeting + ROUNDING && meeting <= bracket[1] + ROUNDING, "{bracket:?} without {meeting}");
}

#[test]
fn both_bolts_are_past_the_plate_and_went_through() {
    let story = told("bolt_through_plate");
    for (bolt, lines) in ["straight", "spinning"].into_iter().zip(story.chunks(3)) {
        assert_eq!(lines[0], format!("plate and {bolt}: clear at the end of the step"));
        let bracket: String = lines[1].replace(" of the step", "");
        assert_is_bracket_of_the_bolt(&numbers_after(&bracket, "between"));
    }
    assert_eq!(story.len(), 6);
}

#[test]
fn both_bolts_of_the_scene_file_went_through() {
    let steps = checked("bolt_through_plate");
    assert_eq!((steps.len(), &steps[0]["pairs"]), (2, &Value::Array(Vec::new())));
    let pairs = steps[1]["pairs"].as_array().expect("a list");
    assert_eq!(pairs.len(), 2, "the bolts do not meet each other");
    for (pair, bolt) in pairs.iter().zip(["straight", "spinning"]) {
        assert_eq!([&pair["a"], &pair["b"], &pair["verdict"]], ["plate", bolt, "clear"]);
        assert_is_bracket_of_the_bolt(&floats(&pair["time_of_contact"]));
    }
}

#[test]
fn the_break_moves_every_ball_and_keeps_the_momentum() {
    let story = told("billiard_break");
    let (before, after) = (&story[0], &story[story.len() - 1]);
    assert!(before.starts_with("before: 1 of 7") && after.starts_with("after: 7 of 7"), "{before}\n{after}");
    assert!(story[1].ends_with("cue and 1 collide"), "{}", story[1]);
    let [before, after] = [before, after].map(|line| numbers_after(line, "momentum"));
    assert_near(&before, &[0.17 * 5.0, 0.0, 0.0]);
    assert_near(&after, &before);
}

#[test]
fn the_break_of_the_scene_file_keeps_the_momentum_and_gains_no_energy() {
    let steps = checked("billiard_break");
    let velocities = steps[0]["velocities"].as_object().expect("balls were hit");
    assert_eq!(velocities.len(), 7, "each ball is reached, and all have the same mass");
    let (mut momentum, mut energy) = ([0.0; 3], 0.0);
    for velocity in velocities.values() {
        let [linear, angular] = ["linear", "angular"].map(|part| floats(&velocity[part]));
        (0..3).for_each(|axis| momentum[axis] += linear[axis]);
        let square = |parts: &[f64]| parts.iter().map(|part| part * part).sum::<f64>();
        energy += square(&linear) + 0.4 * 0.028 * 0.028 * square(&angular);
    }
    assert_near(&momentum, &[5.0, 0.0, 0.0]);
    assert!(energy <= 25.0 && energy > 0.0, "{energy} is not at most 25");
}
