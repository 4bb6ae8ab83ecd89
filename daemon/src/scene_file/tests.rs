use std::path::{Path, PathBuf};

use collided_protocol::control::{Interest, Mass};
use collided_protocol::{Effect, Effects};

use super::{SceneFile, SceneFileError, Source, document, validate};

/// The text as a scene, or the whole message of what is wrong with it.
fn scene(text: &str, json: bool) -> Result<SceneFile, String> {
    let document = if json { document::from_json(text)? } else { document::from_toml(text)? };
    validate::scene(document, Path::new("cell")).map_err(|invalid| invalid.to_string())
}

const JSON: &str = r#"{
  "objects": { "bunny": { "mesh": "bunny.obj", "order": 18 },
               "tri": { "vertices": [[0,0,0],[1,0,0],[0,1,0.1]], "polygons": [[0,1,2]] } },
  "bodies": [ { "name": "a", "object": "bunny", "group": "arm" }, { "name": "b", "object": "tri" }, { "name": "c", "object": "tri" } ],
  "effects": ["interference", "polygon_pairs"],
  "interest": [ { "pair": ["b", "a"], "effects": ["interference"] }, { "pair": ["b", "c"], "ignore": true } ],
  "accuracy": { "level": "polygons" },
  "steps": [ { "a": [[1,0,0,0],[0,1,0,0],[0,0,1,0]], "b": [[1,0,0,0.5],[0,1,0,0],[0,0,1,0]] },
             { "poses": { "b": [[1,0,0,0],[0,1,0,0],[0,0,1,-2]] }, "delta_time": 0.01 }, {} ]
}"#;

const TOML: &str = r#"
effects = ["interference", "polygon_pairs"]
accuracy.level = "polygons"
[objects]
bunny = { mesh = "bunny.obj", order = 18 }
tri = { vertices = [[0,0,0],[1,0,0],[0,1,0.1]], polygons = [[0,1,2]] }
[[bodies]]
name = "a"
object = "bunny"
group = "arm"
[[bodies]]
name = "b"
object = "tri"
[[bodies]]
name = "c"
object = "tri"
[[interest]]
pair = ["b", "a"]
effects = ["interference"]
[[interest]]
pair = ["b", "c"]
ignore = true
[[steps]]
a = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]
b = [[1,0,0,0.5],[0,1,0,0],[0,0,1,0]]
[[steps]]
delta_time = 0.01
poses.b = [[1,0,0,0],[0,1,0,0],[0,0,1,-2]]
[[steps]]
"#;

#[test]
fn json_and_toml_mean_the_same() {
    let scene_json = scene(JSON, true).unwrap();
    assert_eq!(scene_json, scene(TOML, false).unwrap());
    assert_eq!(scene_json.objects[0].source, Source::File(PathBuf::from("cell/bunny.obj")));
    assert_eq!(scene_json.objects[0].order, Some(18));
    let Source::Inline(mesh) = &scene_json.objects[1].source else { panic!("an inline mesh") };
    assert_eq!((mesh.vertices[2], mesh.corners.as_slice()), ([0.0, 1.0, 0.1], &[0, 1, 2][..]));
    assert_eq!(scene_json.bodies[0].group.as_deref(), Some("arm"));
    assert_eq!(scene_json.effects, Effects::NONE.with(Effect::Interference).with(Effect::PolygonPairs));
    let interest: Vec<_> = scene_json.interest.iter().map(|rule| (rule.a, rule.b, rule.interest)).collect();
    assert_eq!(interest, [(1, 0, Interest::Effects(Effect::Interference.into())), (1, 2, Interest::Ignore)]);
    let steps: Vec<Vec<_>> = scene_json
        .steps
        .iter()
        .map(|step| step.poses.iter().map(|pose| (pose.body, pose.rows[2][3])).collect())
        .collect();
    assert_eq!(steps, [vec![(0, 0.0), (1, 0.0)], vec![(1, -2.0)], vec![]]);
}

/// A scene of one triangle, two bodies and the step given.
fn one_step(step: &str) -> String {
    format!(
        r#"{{"objects":{{"tri":{{"vertices":[[0,0,0],[1,0,0],[0,1,0]],"polygons":[[0,1,2]]}}}},
        "bodies":[{{"name":"poses","object":"tri"}},{{"name":"b","object":"tri"}}],"steps":[{step}]}}"#
    )
}

#[test]
fn numbers_are_rounded_once_and_may_be_infinite() {
    let text = one_step(
        r#"{"b":[[0.1,123456789012345678,9007199254740993,0.3e-1],["NaN","Infinity","-Infinity",8.41470984807896506652502321630298999622563060798371065672751709991910404391239668948639743543052695],[18446744073709551616,-9223372036854775808,-0.0,2.2250738585072011e-308]]}"#,
    );
    let rows = scene(&text, true).unwrap().steps[0].poses[0].rows;
    assert_eq!(rows[0], [0.1, 123456789012345680.0, 9007199254740992.0, 0.03]);
    assert!(rows[1][0].is_nan());
    assert_eq!(rows[1][1..], [f64::INFINITY, f64::NEG_INFINITY, 8.414709848078965]);
    assert_eq!(rows[2], [18446744073709551616.0, -9223372036854775808.0, 0.0, 2.225073858507201e-308]);
    assert!(rows[2][2].is_sign_negative());
}

#[test]
fn toml_numbers_may_be_infinite_too() {
    let text = TOML.replace("[0,0,1,-2]", r#"[nan, inf, "-Infinity", 0.1]"#);
    let row = scene(&text, false).unwrap().steps[1].poses[0].rows[2];
    assert!(row[0].is_nan());
    assert_eq!(row[1..], [f64::INFINITY, f64::NEG_INFINITY, 0.1]);
}

#[test]
fn a_body_may_be_called_poses() {
    let text = one_step(r#"{"poses":[[1,0,0,7],[0,1,0,0],[0,0,1,0]]}"#);
    assert_eq!(scene(&text, true).unwrap().steps[0].poses[0].rows[0][3], 7.0);
}

#[test]
fn effects_left_out_mean_the_verdict() {
    assert_eq!(scene(&one_step("{}"), true).unwrap().effects, Effect::Interference.into());
}

/// `JSON` with `from` replaced by `to` is refused with a message that has all of `parts`.
fn refused(from: &str, to: &str, parts: &[&str]) {
    assert!(JSON.contains(from), "{from}");
    let message = scene(&JSON.replacen(from, to, 1), true).expect_err(to);
    for part in parts {
        assert!(message.contains(part), "{message}\ndoes not say\n{part}");
    }
}

#[test]
fn what_does_not_fit_is_named() {
    refused("\"objects\"", "\"objets\"", &["unknown field `objets`", "line 2"]);
    refused("\"steps\"", "\"interest\"", &["duplicate field `interest`"]);
    refused("\"tri\":", "\"bunny\":", &["\"bunny\" stands twice"]);
    refused("0.5]", "0.5", &["line"]);
    refused("0.5]", "\"half\"]", &["\"half\"", "a number, \"NaN\""]);
    refused("\"order\": 18", "\"order\": -1", &["-1", "u32"]);
    refused("\"mesh\": \"bunny.obj\"", "\"polygons\": []", &["object \"bunny\"", "not given"]);
    refused("\"polygons\"", "\"mesh\": \"x.obj\", \"polygons\"", &["object \"tri\"", "given twice"]);
    refused("[1,0,0],", "[1,0],", &["object \"tri\": vertex 1 has 2 coordinates"]);
    refused("[[0,1,2]]", "[[0,1,-2]]", &["object \"tri\": corner 2 of polygon 0 names vertex -2", "3 vertices"]);
    refused("[[0,1,2]]", "[[0,1,4294967296]]", &["corner 2 of polygon 0 names vertex 4294967296"]);
    refused("\"name\": \"c\"", "\"name\": \"b\"", &["body \"b\": there are two"]);
    refused("\"object\": \"bunny\"", "\"object\": \"hare\"", &["body \"a\": there is no object \"hare\""]);
    refused("\"group\"", "\"grope\"", &["unknown field `grope`"]);
}

#[test]
fn interest_that_does_not_fit_is_named() {
    refused("\"ignore\": true", "\"ignore\": false", &["interest 1, pair [\"b\", \"c\"]: the rule says nothing"]);
    refused("\"ignore\": true", "\"ignore\": true, \"effects\": []", &["interest 1", "or two things"]);
    refused("[\"b\", \"c\"]", "[\"b\", \"d\"]", &["interest 1", "there is no body \"d\""]);
    refused("[\"b\", \"c\"]", "[\"b\", \"b\"]", &["interest 1", "a body with itself"]);
    refused("[\"b\", \"c\"]", "[\"a\", \"b\"]", &["interest 1", "has a rule already"]);
    refused(
        "\"effects\": [\"interference\"]",
        "\"effects\": [\"distances\"]",
        &["interest 0", "no effect \"distances\"", "\"distance\""],
    );
}

#[test]
fn what_a_later_version_computes_is_refused_by_name() {
    refused("\"polygon_pairs\"]", "\"contact\"]", &["effects: there is no effect \"contact\""]);
    refused("\"polygons\" }", "\"exact\" }", &["accuracy: there is no level \"exact\"", "\"containers\""]);
    refused("\"polygons\" }", "\"polygons\", \"budget_us\": \"NaN\" }", &["accuracy: \"budget_us\" is NaN"]);
}

#[test]
fn motions_velocities_and_mass_are_read() {
    let text = one_step(
        r#"{ "poses": {}, "motion": { "b": { "axis": [0,0,2], "angle": 3.5 } }, "velocities": { "b": { "linear": [1,0,0] } }, "delta_time": 0.5 }"#,
    );
    let body = r#""name":"b","dynamics":{"density":2,"friction":0.5},"velocity":{"angular":[0,0,1]},"#;
    let scene = scene(&text.replacen(r#""name":"b","#, body, 1), true).unwrap();
    let step = &scene.steps[0];
    assert_eq!((step.motions[0].0, step.motions[0].1.angle, step.motions[0].1.axis), (1, 3.5, [0.0, 0.0, 2.0]));
    assert_eq!((step.velocities.len(), step.velocities[0].1.linear, step.delta_time), (1, [1.0, 0.0, 0.0], 0.5));
    let (body, dynamics) = scene.dynamics[0];
    assert_eq!((body, dynamics.mass, dynamics.friction), (1, Mass::Density { density: 2.0 }, 0.5));
}

#[test]
fn motions_and_mass_that_do_not_fit_are_named() {
    let motion = |text: &str| format!("\"motion\": {{\"a\": {text}}}, \"delta_time\"");
    let refused_motion = |text: &str, parts: &[&str]| refused("\"delta_time\"", &motion(text), parts);
    refused_motion("{\"axis\": [1, 2]}", &["step 1, motion of \"a\": \"axis\" has 2 numbers"]);
    refused("\"delta_time\"", "\"motion\": {\"d\": {}}, \"delta_time\"", &["step 1", "there is no body \"d\""]);
    refused("\"object\": \"tri\"", "\"object\": \"tri\", \"dynamics\": {\"mass\": 1}", &["dynamics", "inertia"]);
}

#[test]
fn steps_that_do_not_fit_are_named() {
    refused("\"a\": [[1,0,0,0],", "\"d\": [[1,0,0,0],", &["step 0: there is no body \"d\""]);
    refused("[[1,0,0,0.5],", "[", &["step 0, body \"b\": the transform has 2 rows"]);
    refused("[1,0,0,0.5]", "[1,0,0]", &["step 0, body \"b\": row 0 of the transform has 3 numbers"]);
    refused("\"b\": [[1,0,0,0.5]", "\"a\": [[1,0,0,0.5]", &["\"a\" stands twice"]);
    refused("\"delta_time\": 0.01", "\"delta_time\": -1", &["step 1: \"delta_time\""]);
    refused("\"delta_time\": 0.01", "\"delta_time\": {}", &["a number"]);
    refused(
        "\"delta_time\": 0.01",
        "\"c\": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]",
        &["step 1: the transform of \"c\" stands beside \"poses\""],
    );
}

#[test]
fn files_that_are_no_scene_files_are_named() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let missing = SceneFile::read(&folder.join("no such.json")).unwrap_err();
    assert!(matches!(missing, SceneFileError::Unreadable { .. }) && missing.to_string().contains("no such.json"));
    let ending = SceneFile::read(&folder.join("meshes/spot.obj")).unwrap_err();
    assert!(matches!(ending, SceneFileError::UnknownEnding { .. }) && ending.to_string().contains(".toml"));
    let shape = SceneFile::read(&folder.join("Cargo.toml")).unwrap_err();
    assert!(matches!(shape, SceneFileError::Syntax { .. }) && shape.to_string().contains("unknown field"));
}
