//! `collided check` from the outside: what it prints, its exit status, and what it leaves behind.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use collided_tests::daemon_process::{DaemonProcess, RuntimeDirectory};
use collided_tests::program_run::ProgramRun;
use serde_json::{Value, json};

const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

/// A folder with scene files, and the runtime directory of the daemons that check them.
struct Folder {
    runtime: RuntimeDirectory,
}

impl Folder {
    fn new() -> Folder {
        Folder { runtime: RuntimeDirectory::new() }
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.runtime.path().join(name), text).expect("a file for the test can be written");
    }

    fn write_scene(&self, name: &str, scene: &Value) {
        self.write(name, &scene.to_string());
    }

    /// Runs `check` in the folder through a private daemon, which must leave nothing behind.
    fn check(&self, arguments: &[&str]) -> ProgramRun {
        let run = run(self.runtime.collided(), &self.runtime, arguments);
        assert!(!self.runtime.path().join("collided").exists(), "the private daemon left its directory");
        run
    }

    /// Checks one scene, given as a value, as JSON.
    fn check_scene(&self, scene: &Value) -> ProgramRun {
        self.write_scene("scene.json", scene);
        self.check(&["scene.json", "--format", "json"])
    }
}

fn run(mut command: Command, runtime: &RuntimeDirectory, arguments: &[&str]) -> ProgramRun {
    ProgramRun::of(command.arg("check").args(arguments).current_dir(runtime.path()))
}

/// The lines of JSON output, without stage counts, which depend on how the daemon works.
fn lines_of(run: &ProgramRun) -> Vec<Value> {
    let line = |text: &str| {
        let mut line: Value = serde_json::from_str(text).expect("each line is JSON");
        line.as_object_mut().expect("each line is an object").remove("stages").expect("each line has stages");
        line
    };
    run.stdout.lines().map(line).collect()
}

fn moved(x: f64, z: f64) -> Value {
    json!([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, z]])
}

/// Two squares, four corners each, and the steps given.
fn two_squares(steps: Value) -> Value {
    json!({
        "objects": { "square": { "vertices": [[0,0,0],[1,0,0],[1,1,0],[0,1,0]], "polygons": [[0,1,2,3]] } },
        "bodies": [{ "name": "a", "object": "square" }, { "name": "b", "object": "square" }],
        "effects": ["interference", "polygon_pairs"],
        "steps": steps,
    })
}

#[test]
fn each_step_is_a_line_with_keys_in_order() {
    let folder = Folder::new();
    let run = folder.check_scene(&two_squares(json!([
        { "a": IDENTITY, "b": moved(0.5, 0.0) },
        { "b": moved(1.0, 0.0) },
        {},
        { "b": moved(1.0, 0.25) },
        { "b": [[1, 0, 0, 0.5], [0, 0, -1, 0.5], [0, 1, 0, -0.5]] },
    ])));
    assert_eq!(run.status, Some(1), "{}", run.stderr);
    let pair = |relation: &str| {
        json!([{ "a": "a", "b": "b", "verdict": "interfering", "level": "polygons", "relation": relation,
                 "polygon_pairs": [[0, 0, relation]] }])
    };
    let expected = [pair("coplanar"), pair("touch"), pair("touch"), json!([]), pair("cross")];
    let expected: Vec<Value> = expected
        .into_iter()
        .enumerate()
        .map(|(step, pairs)| json!({ "scene": "scene.json", "step": step, "pairs": pairs }))
        .collect();
    assert_eq!(lines_of(&run), expected);
    let first = run.stdout.lines().next().expect("there is a line");
    let begin = r#"{"scene":"scene.json","step":0,"pairs":[{"a":"a","b":"b","verdict":"interfering","level":"polygons","relation":"coplanar","polygon_pairs":[[0,0,"coplanar"]]}],"stages":{"boxes":2,"broad_pairs":1,"interest_pairs":1,"container_pairs":1,"#;
    assert!(first.starts_with(begin), "{first}");
}

#[test]
fn a_motion_in_the_first_step_is_not_looked_at_and_both_formats_say_so() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([
        { "poses": { "a": IDENTITY }, "motion": { "b": { "translate": [0, 0, 0.5] } } },
        { "b": moved(0.0, -0.5) },
    ]));
    scene["effects"] = json!(["time_of_contact"]);
    let lines = lines_of(&folder.check_scene(&scene));
    assert_eq!((&lines[0]["time_fault"], &lines[1]["time_fault"]), (&json!("a"), &Value::Null));
    let met = &lines[1]["pairs"][0];
    let lo = met["time_of_contact"][0].as_f64().expect("they meet on the way");
    assert!(lo > 0.49 && met["at_contact"] == json!({ "a": IDENTITY, "b": moved(0.0, 0.5 - lo) }), "{met}");
    let table = folder.check(&["scene.json"]).stdout;
    assert!(table.contains("a counts as still"), "{table}");
    // Without a motion, the first step is no fault: it places the bodies.
    scene["steps"][0] = json!({ "a": IDENTITY, "b": moved(0.0, 0.5) });
    assert_eq!(lines_of(&folder.check_scene(&scene))[0]["time_fault"], Value::Null);
}

#[test]
fn what_keeps_a_response_from_being_exact_is_told() {
    let folder = Folder::new();
    let cube = json!({ "vertices": [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]],
        "polygons": [[3,2,1,0],[4,5,6,7],[0,1,5,4],[1,2,6,5],[2,3,7,6],[3,0,4,7]] });
    let body = |i: usize| {
        let restitution = if i == 20 { 1.0 } else { 0.01 };
        json!({ "name": format!("b{i}"), "object": "cube", "velocity": { "linear": [0, 0, -1] },
            "dynamics": { "density": 1, "restitution": restitution } })
    };
    let mut bodies: Vec<Value> = (0..21).map(body).collect();
    bodies[0] = json!({ "name": "b0", "object": "cube" });
    let poses = (0..21).map(|i| (format!("b{i}"), moved(0.0, f64::from(i)))).collect();
    let scene = json!({ "objects": { "cube": cube }, "bodies": bodies, "effects": ["response"],
        "steps": [Value::Object(poses), { "b1": [[1, 0, 0, 0], [0, 0, 0, 0.5], [0, 0, 0, 1]] }] });
    let lines = lines_of(&folder.check_scene(&scene));
    assert_eq!((&lines[0]["response_capped"], &lines[0]["response_fault"]), (&json!(true), &Value::Null));
    assert_eq!((&lines[1]["response_capped"], &lines[1]["response_fault"]), (&Value::Null, &json!("b1")));
    let table = folder.check(&["scene.json"]).stdout;
    assert!(table.contains("ended by a cap") && table.contains("the inertia of b1"), "{table}");
}

#[test]
fn what_was_not_asked_for_is_absent() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}]));
    scene["effects"] = json!(["interference"]);
    let run = folder.check_scene(&scene);
    assert_eq!(run.status, Some(1), "{}", run.stderr);
    let pairs = json!([{ "a": "a", "b": "b", "verdict": "interfering", "level": "polygons" }]);
    assert_eq!(lines_of(&run), [json!({ "scene": "scene.json", "step": 0, "pairs": pairs })]);
}

#[test]
fn a_scene_and_a_pair_have_an_accuracy() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}]));
    scene["effects"] = json!(["interference"]);
    scene["accuracy"] = json!({ "level": "voxels", "order": 0 });
    let run = folder.check_scene(&scene);
    assert_eq!(run.status, Some(1), "what may interfere counts: {}", run.stderr);
    let pair = &lines_of(&run)[0]["pairs"][0];
    assert_eq!((&pair["verdict"], &pair["level"]), (&json!("possible"), &json!("voxels")));
    assert_eq!(pair["bound"]["orders"], json!([0, 0]));
    let apart = pair["bound"]["apart_at_most"].as_f64().expect("a bound");
    assert!((apart - 8f64.sqrt()).abs() < 1e-9, "two diagonals of a unit square: {apart}");
    let table = folder.check(&["scene.json"]);
    assert!(table.stdout.contains("voxels, orders 0 and 0: at most 2.828e0 apart"), "{}", table.stdout);
    scene["interest"] = json!([{ "pair": ["b", "a"], "accuracy": { "level": "polygons" } }]);
    let pair = lines_of(&folder.check_scene(&scene))[0]["pairs"][0].clone();
    assert_eq!((&pair["verdict"], pair.get("bound")), (&json!("interfering"), None));
}

#[test]
fn an_order_above_that_of_an_object_is_said_to_be_clamped() {
    const NOTE: &str = "scene.json: accuracy: order 9 is above order 0 of object \"square\", which counts";
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}]));
    scene["effects"] = json!(["interference"]);
    let accuracy = json!({ "level": "voxels", "order": 9 });
    scene["accuracy"] = accuracy.clone();
    let run = folder.check_scene(&scene);
    assert_eq!((run.status, run.stderr.matches(NOTE).count()), (Some(1), 1), "{}", run.stderr);
    assert_eq!(lines_of(&run)[0]["pairs"][0]["bound"]["orders"], json!([0, 0]));
    scene["accuracy"] = json!({});
    scene["interest"] = json!([{ "pair": ["b", "a"], "accuracy": accuracy }]);
    let run = folder.check_scene(&scene);
    assert!(run.stderr.contains(NOTE), "{}", run.stderr);
    scene["interest"] = json!([{ "pair": ["b", "a"], "accuracy": { "level": "voxels", "order": 0 } }]);
    let run = folder.check_scene(&scene);
    assert!(!run.stderr.contains("above"), "{}", run.stderr);
}

#[test]
fn a_bad_accuracy_is_named_with_its_place_and_remedy() {
    let folder = Folder::new();
    let cases = [
        (json!({ "level": "exact" }), ["accuracy: there is no level \"exact\"", "choose from \"global_boxes\""]),
        (json!({ "level": "voxels", "order": -1 }), ["invalid value", "-1"]),
        (json!({ "order": 4 }), ["order is 4, but the level is polygons", "level voxels only"]),
        (json!({ "budget_us": 0 }), ["budget_us is 0", "above 0, in microseconds"]),
        (json!({ "budget_us": -5 }), ["budget_us is -5", "above 0, in microseconds"]),
        (json!({ "distance_tolerance": -1 }), ["distance_tolerance is -1", "from 0 to below 1"]),
    ];
    for (accuracy, parts) in cases {
        let mut scene = two_squares(json!([{}]));
        scene["accuracy"] = accuracy.clone();
        folder.check_scene(&scene).is_trouble(&parts);
        scene["accuracy"] = json!({});
        scene["interest"] = json!([{ "pair": ["a", "b"], "accuracy": accuracy }]);
        folder.check_scene(&scene).is_trouble(&parts[..0]);
    }
}

#[test]
fn interest_and_groups_decide_what_a_pair_has() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}]));
    scene["bodies"] = json!([
        { "name": "a", "object": "square" }, { "name": "b", "object": "square", "group": "g" },
        { "name": "c", "object": "square", "group": "g" }, { "name": "d", "object": "square" },
    ]);
    scene["effects"] = json!(["interference"]);
    scene["interest"] =
        json!([{ "pair": ["d", "a"], "ignore": true }, { "pair": ["c", "a"], "effects": ["polygon_pairs"] }]);
    let pairs = lines_of(&folder.check_scene(&scene))[0]["pairs"].clone();
    let pairs: Vec<_> = pairs
        .as_array()
        .expect("pairs are a list")
        .iter()
        .map(|pair| (pair["a"].as_str().unwrap_or(""), pair["b"].as_str().unwrap_or(""), pair["relation"].as_str()))
        .collect();
    assert_eq!(pairs, [("a", "b", None), ("a", "c", Some("coplanar")), ("b", "d", None), ("c", "d", None)]);
}

#[test]
fn several_scenes_make_one_stream_and_one_status() {
    let folder = Folder::new();
    folder.write_scene("far.json", &two_squares(json!([{ "b": moved(5.0, 0.0) }])));
    folder.write_scene("near.json", &two_squares(json!([{}])));
    let clear = folder.check(&["far.json", "--format", "json"]);
    assert_eq!((clear.status, lines_of(&clear).len()), (Some(0), 1), "{}", clear.stderr);
    let both = folder.check(&["near.json", "far.json", "--format", "json"]);
    let scenes: Vec<Value> = lines_of(&both).iter().map(|line| line["scene"].clone()).collect();
    assert_eq!((both.status, scenes), (Some(1), vec![json!("near.json"), json!("far.json")]));
    let trouble = folder.check(&["near.json", "missing.json", "far.json", "--format", "json"]);
    trouble.is_trouble(&["missing.json"]);
    assert_eq!(lines_of(&trouble), lines_of(&both), "the scenes beside it are checked all the same");
}

#[test]
fn meshes_are_found_beside_the_scene_file_and_toml_is_read() {
    let folder = Folder::new();
    fs::create_dir(folder.runtime.path().join("cell")).expect("a folder can be made");
    folder.write("cell/tri.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let text = "effects = [\"polygon_pairs\"]\nbodies = [{name = \"a\", object = \"tri\"}, {name = \"b\", object = \"tri\"}]\n\
        [objects]\ntri = {mesh = \"tri.off\", order = 3}\n[[steps]]\nb = [[1,0,0,0],[0,1,0,0],[0,0,1,0.1]]\n";
    folder.write("cell/scene.toml", text);
    let run = folder.check(&["cell/scene.toml", "--format", "json"]);
    assert_eq!(run.status, Some(0), "{}", run.stderr);
    assert_eq!(lines_of(&run), [json!({ "scene": "cell/scene.toml", "step": 0, "pairs": [] })]);
}

#[test]
fn scenes_without_pairs_are_clear() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}, {}]));
    scene["objects"]["square"] = json!({ "vertices": [], "polygons": [] });
    assert_eq!(folder.check_scene(&scene).status, Some(0), "empty meshes");
    scene["bodies"] = json!([]);
    let nobody = folder.check_scene(&scene);
    assert_eq!((nobody.status, lines_of(&nobody).len()), (Some(0), 2), "no bodies: {}", nobody.stderr);
    scene["steps"] = json!([]);
    let nothing = folder.check_scene(&scene);
    assert_eq!((nothing.status, nothing.stdout.as_str()), (Some(0), ""), "no steps: {}", nothing.stderr);
}

#[test]
fn the_table_is_aligned() {
    let folder = Folder::new();
    folder.write_scene("s.json", &two_squares(json!([{ "b": moved(0.5, 0.0) }, { "b": moved(5.0, 0.0) }])));
    let run = folder.check(&["s.json"]);
    let table = "s.json: 2 bodies, 2 steps\n  \
          step  body a  body b  verdict      relation  polygon pairs\n     \
             0  a       b       interfering  coplanar              1\n     \
             1  -       -       clear\n\
        pairs interfere in 1 of 2 steps\n";
    assert_eq!((run.status, run.stdout.as_str()), (Some(1), table), "{}", run.stderr);
}

#[test]
fn bad_numbers_are_named_with_file_step_and_body() {
    let folder = Folder::new();
    let steps = |value: Value| json!([{}, { "b": [[1, 0, 0, value], [0, 1, 0, 0], [0, 0, 1, 0]] }]);
    for (value, named) in [("NaN", "NaN"), ("Infinity", "inf"), ("-Infinity", "-inf")] {
        let run = folder.check_scene(&two_squares(steps(json!(value))));
        run.is_trouble(&["scene.json", "step 1", "\"b\"", "row 0", "column 3", named]);
        assert_eq!(lines_of(&run).len(), 1, "the step before is answered");
    }
    let mut scene = two_squares(steps(json!(1e308)));
    scene["objects"]["square"]["vertices"][1][0] = json!(1.7e308);
    folder.check_scene(&scene).is_trouble(&["scene.json", "step 1", "\"b\"", "vertex 1"]);
}

#[test]
fn bad_meshes_are_named_with_file_and_object() {
    let folder = Folder::new();
    let with_object = |object: Value| {
        let mut scene = two_squares(json!([{}]));
        scene["objects"]["square"] = object;
        scene
    };
    folder.write("cut.off", "OFF 3 1 0\n0 0 0\n");
    let vertices = json!([[0, 0, 0], [1, 0, 0], [0, "NaN", 0]]);
    for (object, parts) in [
        (json!({ "vertices": vertices, "polygons": [[0, 1, 2]] }), &["vertex 2", "NaN"][..]),
        (json!({ "vertices": [[0, 0, 0]], "polygons": [[0, 0, 7]] }), &["polygon 0", "7"]),
        (json!({ "vertices": [[0, 0, 0]], "polygons": [[0, 0, -1]] }), &["polygon 0", "-1"]),
        (json!({ "vertices": [[0, 0, 0]], "polygons": [[0, 0, 0], [0, 0]] }), &["polygon 1", "2"]),
        (json!({ "vertices": [[0, 0, 0]], "polygons": [], "order": 31 }), &["31", "30"]),
        (json!({ "mesh": "no such.obj" }), &["no such.obj"]),
        (json!({ "mesh": "cut.off" }), &["cut.off", "line 2", "vertex 1 of 3"]),
        (json!({ "mesh": "scene.json" }), &["scene.json", ".ply"]),
    ] {
        let run = folder.check_scene(&with_object(object));
        run.is_trouble(&["scene file scene.json", "object \"square\""]);
        run.is_trouble(parts);
        assert_eq!(run.stdout, "");
    }
}

#[test]
fn bad_scene_files_are_named() {
    let folder = Folder::new();
    let mut scene = two_squares(json!([{}]));
    scene["bodies"][1]["object"] = json!("circle");
    folder.check_scene(&scene).is_trouble(&["scene.json", "body \"b\"", "circle"]);
    scene = two_squares(json!([{ "c": IDENTITY }]));
    folder.check_scene(&scene).is_trouble(&["scene.json", "step 0", "\"c\""]);
    scene = two_squares(json!([{}]));
    scene["effects"] = json!(["respond"]);
    folder.check_scene(&scene).is_trouble(&["scene.json", "no effect \"respond\"", "\"response\""]);
    folder.write("broken.json", "{");
    folder.check(&["broken.json"]).is_trouble(&["broken.json", "line 1"]);
    folder.write("broken.toml", "objects = ");
    folder.check(&["broken.toml"]).is_trouble(&["broken.toml", "line 1"]);
    folder.check(&["broken.yaml"]).is_trouble(&["broken.yaml", ".toml"]);
}

#[test]
fn no_daemon_to_connect_to_is_trouble() {
    let folder = Folder::new();
    folder.write_scene("s.json", &two_squares(json!([{}])));
    folder.check(&["s.json", "--connect", "--instance", "nobody"]).is_trouble(&["no daemon", "nobody"]);
}

#[test]
fn a_running_daemon_is_used_and_left_as_it_was() {
    let daemon = DaemonProcess::start();
    let path: PathBuf = daemon.runtime().path().join("s.json");
    fs::write(path, two_squares(json!([{}])).to_string()).expect("a file for the test can be written");
    let instance = daemon.directory().file_name().map(|name| name.to_string_lossy().into_owned());
    let instance = instance.expect("the instance has a name");
    let arguments = ["s.json", "--connect", "--instance", &instance, "--format", "json"];
    let found = run(daemon.runtime().collided(), daemon.runtime(), &arguments);
    assert_eq!((found.status, lines_of(&found).len()), (Some(1), 1), "{}", found.stderr);
    let client = daemon.client_builder().connect().expect("the daemon goes on");
    assert_eq!(client.list().expect("the daemon answers"), [], "the objects of the check are gone");
    assert_eq!(client.status().expect("the daemon answers").scenes, []);
}
