//! `collided accuracy` from the outside: what it writes, what it says, and how it fails.

use std::collections::HashMap;
use std::fs;
use std::process::Command;

use collided_tests::daemon_process::{RuntimeDirectory, program};
use collided_tests::program_run::ProgramRun;
use serde_json::{Value, json};

const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

fn moved(x: f64, z: f64) -> Value {
    json!([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.3], [0.0, 0.0, 1.0, z]])
}

/// A pyramid and a plate that come near, touch and pass each other.
fn scene() -> Value {
    json!({
        "objects": {
            "pyramid": { "vertices": [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0.5,0.5,1]],
                         "polygons": [[0,3,2,1],[0,1,4],[1,2,4],[2,3,4],[3,0,4]], "order": 6 },
            "plate": { "vertices": [[0,0,0],[1,0,0],[1,1,0],[0,1,0]], "polygons": [[0,1,2],[0,2,3]], "order": 4 },
        },
        "bodies": [{ "name": "a", "object": "pyramid" }, { "name": "b", "object": "plate" }, { "name": "c", "object": "plate" }],
        "effects": ["interference", "distance", "time_of_contact"],
        "steps": [
            { "a": IDENTITY, "b": moved(0.2, 1.5), "c": moved(5.0, 0.9) },
            { "b": moved(0.2, 0.5), "c": moved(0.9, 0.9) },
            { "b": moved(0.2, -0.5), "c": moved(0.9, 0.95) },
            { "b": moved(0.2, 1.0), "c": moved(0.3, 0.95) },
        ],
    })
}

struct Folder(RuntimeDirectory);

impl Folder {
    fn new() -> Folder {
        Folder(RuntimeDirectory::new())
    }

    fn write(&self, name: &str, scene: &Value) {
        fs::write(self.0.path().join(name), scene.to_string()).expect("a file for the test can be written");
    }

    fn run(&self, arguments: &[&str]) -> ProgramRun {
        let mut command = Command::new(program("collided-under-test"));
        ProgramRun::of(command.arg("accuracy").args(arguments).current_dir(self.0.path()))
    }

    /// A quick study of the scene; it must succeed.
    fn study(&self, scene: &Value, more: &[&str]) -> ProgramRun {
        self.write("scene.json", scene);
        let run = self.run(&[&["scene.json", "--quick", "--repetitions", "1"], more].concat());
        assert_eq!(run.status, Some(0), "{}", run.stderr);
        run
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }
}

/// The rows of a CSV file, by heading.
fn rows(csv: &str) -> Vec<HashMap<&str, &str>> {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let headings = lines.next().expect("there is a line of headings");
    let row = |cells: Vec<_>| {
        assert_eq!(cells.len(), headings.len());
        headings.iter().copied().zip(cells).collect()
    };
    lines.map(row).collect()
}

/// Every tag that is opened is closed in its turn, or at once.
fn is_well_formed(xml: &str) -> bool {
    let mut open = Vec::new();
    for tag in xml.split('<').skip(1) {
        let Some((tag, text)) = tag.split_once('>') else { return false };
        if text.contains('>') || tag.matches('"').count() % 2 != 0 {
            return false;
        }
        let name = tag.trim_start_matches('/').split_whitespace().next().unwrap_or_default();
        match (tag.starts_with('/'), tag.ends_with('/')) {
            (true, _) if open.pop() != Some(name) => return false,
            (false, false) => open.push(name),
            _ => {}
        }
    }
    open.is_empty()
}

#[test]
fn a_study_writes_tables_diagrams_and_a_page() {
    let folder = Folder::new();
    let run = folder.study(&scene(), &[]);
    let csv = folder.read("collided-accuracy/study.csv");
    let rows = rows(&csv);
    for family in ["level", "budget", "matrix", "distance", "time_of_contact", "effect", "arithmetic"] {
        let of_family: Vec<_> = rows.iter().filter(|row| row["family"] == family).collect();
        assert!(!of_family.is_empty(), "{family} was not run");
        assert!(of_family.iter().all(|row| row["time_us"].parse::<f64>().is_ok_and(|time| time > 0.0)), "{family}");
        if family != "effect" {
            let svg = folder.read(&format!("collided-accuracy/{family}.svg"));
            assert!(svg.starts_with("<svg ") && is_well_formed(&svg), "{family}.svg is not well formed");
        }
        if family != "arithmetic" {
            let threads = |count: &str| of_family.iter().any(|row| row["threads"] == count);
            assert!(threads("1") && threads("2"), "{family} was not run in one and in two threads");
        }
    }
    let page = folder.read("collided-accuracy/study.html");
    let parts = ["scene.json", "accuracy scene.json --quick", "<svg ", "<table>", "processor"];
    parts.iter().for_each(|part| assert!(page.contains(part), "the page does not have {part}"));
    assert!(!page.contains("src=") && !page.contains("href="), "the page needs other files");
    let advice = run.stdout.lines().last().expect("something is printed");
    assert!(advice.contains("polygons decide all in "), "{advice}");
}

#[test]
fn no_level_budget_or_order_says_anything_wrong_and_polygons_leave_nothing_open() {
    let folder = Folder::new();
    folder.study(&scene(), &["--out", "out"]);
    let csv = folder.read("out/study.csv");
    let rows = rows(&csv);
    let number = |row: &HashMap<&str, &str>, column: &str| row[column].parse::<u64>().expect("a count");
    assert!(rows.iter().filter(|row| row["family"] == "level").all(|row| number(row, "pairs") > 2));
    for row in rows.iter().filter(|row| row["family"] != "arithmetic" || row["curve"] == "exact") {
        assert_eq!(number(row, "wrong"), 0, "{row:?}");
    }
    let exact = rows.iter().filter(|row| row["curve"] == "polygons" || row["family"] == "matrix");
    assert!(exact.clone().count() > 4);
    exact.for_each(|row| assert_eq!(number(row, "open"), 0, "{row:?}"));
    // A coarser level never leaves fewer pairs open.
    let levels = rows.iter().filter(|row| row["family"] == "level" && row["threads"] == "1");
    let open: Vec<u64> = levels.map(|row| number(row, "open")).collect();
    assert!(open.is_sorted_by(|coarse, fine| coarse >= fine) && open[0] > 0, "{open:?}");
    let within = |row: &&HashMap<&str, &str>, times: f64| {
        let tolerance: f64 = row["value"].parse().expect("a tolerance");
        row["error_largest"].parse::<f64>().is_ok_and(|error| error <= times * tolerance + 1e-11)
    };
    let of = |family: &'static str| rows.iter().filter(move |row| row["family"] == family);
    // A share of the value that is found, which is the larger one.
    assert!(of("distance").all(|row| within(&row, 1.0 / 0.9)) && of("time_of_contact").all(|row| within(&row, 1.0)));
}

#[test]
fn json_has_a_line_a_measurement_and_the_advice() {
    let folder = Folder::new();
    let run = folder.study(&scene(), &["--format", "json"]);
    let lines: Vec<Value> =
        run.stdout.lines().map(|line| serde_json::from_str(line).expect("each line is JSON")).collect();
    let (last, measured) = lines.split_last().expect("there are lines");
    assert_eq!(measured.len(), folder.read("collided-accuracy/study.csv").lines().count() - 1);
    assert!(measured.iter().all(|line| line["family"].is_string() && line["time_us"].is_number()));
    assert_eq!((last["scene"].as_str(), last["advice"].is_array()), (Some("scene.json"), true));
}

#[test]
fn only_what_the_scene_asks_for_is_run() {
    let folder = Folder::new();
    let mut plain = scene();
    plain["effects"] = json!(["interference"]);
    folder.study(&plain, &[]);
    let csv = folder.read("collided-accuracy/study.csv");
    assert!(rows(&csv).iter().all(|row| row["family"] != "distance" && row["family"] != "time_of_contact"));
    assert!(!folder.0.path().join("collided-accuracy/distance.svg").exists());
}

#[test]
fn trouble_names_the_file_and_the_remedy() {
    let folder = Folder::new();
    let trouble = |scene: &Value, parts: &[&str]| {
        folder.write("bad.json", scene);
        let run = folder.run(&["bad.json", "--quick"]);
        assert_eq!(run.status, Some(2), "{}", run.stderr);
        for part in ["bad.json"].iter().chain(parts) {
            assert!(run.stderr.contains(part), "{} does not say {part}", run.stderr);
        }
    };
    let with = |key: &str, value: Value| {
        let mut scene = scene();
        scene[key] = value;
        scene
    };
    trouble(&with("steps", json!([])), &["at least one step"]);
    let mut alone = with("bodies", json!([{ "name": "a", "object": "plate" }]));
    alone["steps"] = json!([{ "a": IDENTITY }]);
    trouble(&alone, &["pair of bodies"]);
    let group = ["a", "b", "c"].map(|name| json!({ "name": name, "object": "plate", "group": "g" }));
    trouble(&with("bodies", json!(group)), &["no pair to decide", "groups"]);
    trouble(&with("accuracy", json!({ "time_tolerance": -1.0 })), &["time_tolerance", "-1"]);
    trouble(
        &with("objects", json!({ "pyramid": { "mesh": "none.obj" }, "plate": { "mesh": "none.obj" } })),
        &["none.obj"],
    );
    trouble(&with("steps", json!([{ "a": [[1e308, 0, 0, 1e308], [0, 1, 0, 0], [0, 0, 1, 0]] }])), &["step 0", "a"]);
    let missing = folder.run(&["missing.json"]);
    assert_eq!(missing.status, Some(2));
    assert!(missing.stderr.contains("missing.json") && missing.stderr.contains("check the path"), "{}", missing.stderr);
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = Folder::new();
    folder.write("scene.json", &scene());
    let run = folder.run(&["scene.json", "--quick", "--repetitions", "1", "--out", "scene.json/out"]);
    assert_eq!(run.status, Some(2));
    assert!(run.stderr.contains("scene.json/out") && run.stderr.contains("--out"), "{}", run.stderr);
}
