//! Writes the scene files of docs/accuracy.md: the same bytes on every machine.
//!
//! `cargo run --release -p collided-tests --bin accuracy_scenes`

use std::path::{Path, PathBuf};

use clap::Parser;
use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::time_of_contact::{Memory, TimeOfContact, TimeSettings, time_of_contact};
use collided_kernel::{Motion, Object};
use collided_protocol::step::Rows;
use collided_tests::near_contact::{Approach, Pose, random_poses};
use collided_tests::{crowd, meshes};
use serde_json::{Map, Value, json};

/// Write the scene files of docs/accuracy.md.
#[derive(Parser)]
struct Arguments {
    /// Folder of the scene files; meshes are named relative to it
    #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/accuracy/scenes"))]
    out: PathBuf,
}

fn main() -> std::io::Result<()> {
    let out = Arguments::parse().out;
    std::fs::create_dir_all(&out)?;
    write(&out, "near_contact", &near_contact())?;
    write(&out, "env_rob", &env_rob())?;
    write(&out, "thousand_bodies", &thousand_bodies())?;
    write(&out, "thin_transversal", &flights(&transversal()))?;
    write(&out, "thin_grazing", &flights(&grazing()))
}

/// A line a step.
fn write(folder: &Path, name: &str, scene: &Value) -> std::io::Result<()> {
    let mut head = scene.clone();
    let steps = head["steps"].take();
    head.as_object_mut().and_then(|members| members.remove("steps"));
    let steps: Vec<String> = steps.as_array().into_iter().flatten().map(Value::to_string).collect();
    let head = head.to_string();
    let text = format!(
        "{},\n\"steps\": [\n{}\n]}}\n",
        head.trim_end_matches('}').to_owned() + &tail(&head),
        steps.join(",\n")
    );
    std::fs::write(folder.join(name).with_extension("json"), text)
}

/// The closing braces of the text but the last one.
fn tail(text: &str) -> String {
    let braces = text.len() - text.trim_end_matches('}').len();
    "}".repeat(braces - 1)
}

fn mesh(name: &str) -> Value {
    json!({ "mesh": format!("../../../daemon/meshes/{name}.obj") })
}

/// Two cows that almost touch, or just meet, from eight directions, as near as one ulp; and one laid onto the other, or shifted by
/// next to nothing.
fn near_contact() -> Value {
    const GAPS: [f64; 11] = [0.2, 0.1, 0.05, 0.02, 0.01, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12, 0.0];
    const DEPTHS: [f64; 4] = [0.0, 1e-9, 1e-3, 0.05];
    const SHIFTS: [f64; 4] = [0.0, 1e-15, 1e-12, 1e-8];
    let spot = meshes::shipped("spot", None);
    let poses = |approach: &Approach| {
        let clear = GAPS.map(|gap| approach.clear + gap);
        let meets = DEPTHS.map(|depth| approach.meets - depth);
        clear.into_iter().chain(meets).map(|out| approach.at(out)).collect::<Vec<_>>()
    };
    let approaches = Approach::random([&spot, &spot], 1.0, 5.0, 8, 3);
    let mut steps: Vec<Value> = approaches.iter().flat_map(poses).map(|rows| json!({ "b": rows })).collect();
    steps[0]["a"] = json!(IDENTITY);
    steps.extend(SHIFTS.iter().map(|&shift| {
        let laid_on = Approach { middle: [0.0; 3], ..approaches[0] };
        json!({ "a": laid_on.at(0.0), "b": laid_on.at(shift) })
    }));
    json!({
        "objects": { "spot": mesh("spot") },
        "bodies": [{ "name": "a", "object": "spot" }, { "name": "b", "object": "spot" }],
        "effects": ["interference", "distance"],
        "steps": steps,
    })
}

/// A piano at a hundred random places of a room.
fn env_rob() -> Value {
    let mut places = crowd::moving_within(5200.0, 100, 1, 11).swap_remove(0);
    places.iter_mut().for_each(|rows| {
        // The room goes from -3004.5, -3004.5, -14.5 to 2987.5, 3004.5, 2987.5.
        rows[2][3] *= 0.5;
        [-2600.0, -2600.0, 200.0].into_iter().zip(rows).for_each(|(from, row)| row[3] += from);
    });
    let mut steps: Vec<Value> = places.iter().map(|rows| json!({ "rob": rounded(rows, 1e6) })).collect();
    steps[0]["env"] = json!(IDENTITY);
    json!({
        "objects": { "env": mesh("env"), "rob": mesh("rob") },
        "bodies": [{ "name": "env", "object": "env" }, { "name": "rob", "object": "rob" }],
        "effects": ["interference", "distance"],
        "steps": steps,
    })
}

/// Bunnies, cows and pianos of unit size that turn and drift.
fn thousand_bodies() -> Value {
    const KINDS: [&str; 3] = ["low_poly_bunny", "spot", "rob"];
    let sizes = KINDS.map(|name| meshes::longest_side(&meshes::shipped(name, Some(0))));
    let kind = |body: usize| body % KINDS.len();
    let place = |(body, rows): (usize, &Rows)| {
        let scaled = rows.map(|[x, y, z, at]| {
            [x, y, z].map(|x| x / sizes[kind(body)]).into_iter().chain([at]).collect::<Vec<f64>>()
        });
        let scaled = scaled.map(|row| [row[0], row[1], row[2], row[3]]);
        (format!("b{body}"), json!(rounded(&scaled, 1e7)))
    };
    let step = |rows: Vec<Rows>| Value::Object(rows.iter().enumerate().map(place).collect::<Map<_, _>>());
    let steps: Vec<Value> = crowd::moving_within(12.0, 1000, 2, 7).into_iter().map(step).collect();
    let bodies: Vec<Value> =
        (0..1000).map(|body| json!({ "name": format!("b{body}"), "object": KINDS[kind(body)] })).collect();
    let objects: Map<String, Value> = KINDS.iter().map(|name| ((*name).to_owned(), mesh(name))).collect();
    json!({ "objects": objects, "bodies": bodies, "effects": ["interference"], "steps": steps })
}

/// Numbers with few digits are shorter to write.
fn rounded(rows: &Rows, scale: f64) -> Rows {
    rows.map(|row| row.map(|x| (x * scale).round() / scale))
}

/// A flight of a thin body past, or through, the cow: its linear part, and where it starts and ends.
struct Flight {
    linear: [[f64; 3]; 3],
    start: [f64; 3],
    end: [f64; 3],
}

impl Flight {
    /// Along `way` at `beside` the middle of the cow.
    fn new(rotation: [[f64; 3]; 3], way: [f64; 3], beside: [f64; 3]) -> Flight {
        const FAR: f64 = 4.0;
        // The bunny is 3 units long; flattened, it is a plate of a thousandth of its length.
        let linear = rotation.map(|[x, y, z]| [0.2 * x, 0.2 * y, 2e-4 * z]);
        let at = |side: f64| std::array::from_fn(|axis| beside[axis] + side * FAR * way[axis]);
        Flight { linear, start: at(-1.0), end: at(1.0) }
    }

    fn rows(&self, position: &[f64; 3]) -> Rows {
        std::array::from_fn(|row| {
            let [x, y, z] = self.linear[row];
            [x, y, z, position[row]]
        })
    }

    fn meets(&self, plate: &Object, cow: &Object, memory: &mut Memory) -> bool {
        let motion = Motion::Linear { from: self.rows(&self.start), to: self.rows(&self.end) };
        let settings = TimeSettings { tolerance: 1e-6, ..TimeSettings::default() };
        time_of_contact((plate, &motion), (cow, &Motion::Still(IDENTITY)), settings, memory) != TimeOfContact::Free
    }
}

/// Twenty-four plates through the cow, from all sides.
fn transversal() -> Vec<Flight> {
    let poses = random_poses(24, 17);
    let offsets = random_poses(24, 18);
    poses
        .into_iter()
        .zip(offsets)
        .map(|((rotation, way), (_, beside))| Flight::new(rotation, way, beside.map(|x| 0.1 * x)))
        .collect()
}

/// Two lines past the cow that just meet it, and what is a little farther in.
fn grazing() -> Vec<Flight> {
    let (plate, cow) = (meshes::shipped("low_poly_bunny", None), meshes::shipped("spot", None));
    let mut memory = Memory::default();
    let line = |((rotation, way), (_, towards)): (Pose, Pose)| {
        let aside = across(way, towards);
        let flight = |out: f64| Flight::new(rotation, way, aside.map(|x| out * x));
        let (mut meets, mut free) = (0.0, 4.0);
        while let middle = 0.5 * (meets + free)
            && middle > meets
            && middle < free
        {
            *(if flight(middle).meets(&plate, &cow, &mut memory) { &mut meets } else { &mut free }) = middle;
        }
        [free, meets, meets - 1e-9, meets - 1e-6, meets - 1e-4, meets - 1e-2].map(flight)
    };
    random_poses(4, 21).into_iter().zip(random_poses(4, 22)).take(2).flat_map(line).collect()
}

/// The part of a direction that is at right angles to `way`, of length 1.
fn across(way: [f64; 3], direction: [f64; 3]) -> [f64; 3] {
    let along: f64 = way.iter().zip(direction).map(|(x, y)| x * y).sum();
    let rest: [f64; 3] = std::array::from_fn(|axis| direction[axis] - along * way[axis]);
    let length = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
    rest.map(|x| x / length)
}

/// All at once: the first step places the plates, the second one lets them fly.
fn flights(flights: &[Flight]) -> Value {
    let name = |number: usize| format!("plate{number}");
    let plates = (0..flights.len()).map(|number| json!({ "name": name(number), "object": "plate", "group": "plates" }));
    let bodies: Vec<Value> = [json!({ "name": "cow", "object": "cow" })].into_iter().chain(plates).collect();
    let step = |position: fn(&Flight) -> &[f64; 3]| {
        flights
            .iter()
            .enumerate()
            .map(|(number, flight)| (name(number), json!(flight.rows(position(flight)))))
            .collect::<Map<_, _>>()
    };
    json!({
        "objects": { "cow": mesh("spot"), "plate": mesh("low_poly_bunny") },
        "bodies": bodies,
        "effects": ["time_of_contact"],
        "steps": [step(|flight| &flight.start), step(|flight| &flight.end)],
    })
}
