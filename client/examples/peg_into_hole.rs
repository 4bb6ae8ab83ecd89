//! A square peg and a plate with a square hole: the distance on the way down, and the contacts where it touches.
//! Start `collided serve`, then `cargo run -p collided-client --example peg_into_hole`.

use collided_client::{Client, Effect, Error, Mesh, Pair, translation};

/// Half the side of the hole.
const HOLE: f64 = 0.5;
/// Between the sides of the peg and those of the hole, when the peg is in the middle.
const CLEARANCE: f64 = 0.03125;

fn main() -> Result<(), Error> {
    let client = Client::connect()?;
    let parts = client.database("peg into hole");
    let (vertices, corners) = plate();
    let mesh = Mesh { vertices: &vertices, corner_counts: &[4; 16], corners: &corners };
    let plate = parts.loading("plate").replace(true).mesh(&mesh)?;
    let half = HOLE - CLEARANCE;
    let (vertices, corners) = cuboid([-half, -half, 0.0], [half, half, 2.0]);
    let mesh = Mesh { vertices: &vertices, corner_counts: &[4; 6], corners: &corners };
    let peg = parts.loading("peg").replace(true).mesh(&mesh)?;

    let mut scene = client.scene("peg into hole").effects([Effect::Distance, Effect::Contacts]).create()?;
    let plate = scene.add_body("plate", &plate)?;
    let peg = scene.add_body("peg", &peg)?;
    scene.step_sparse(&[(plate, translation([0.0, 0.0, 0.0]))])?;
    // The peg's lower end is at `height`; the plate reaches from 0 to 1.
    for (what, aside, height) in [
        ("high above", 0.0, 3.0),
        ("nearer", 0.0, 1.25),
        ("in the hole", 0.0, 0.5),
        ("pushed against the wall", CLEARANCE, 0.5),
        ("put down on the rim", 2.0 * CLEARANCE, 1.0),
    ] {
        let report = scene.step_sparse(&[(peg, translation([aside, 0.0, height]))])?;
        report.pairs().for_each(|pair| tell(what, &pair));
    }
    Ok(())
}

fn tell(what: &str, pair: &Pair<'_>) {
    let distance = pair.distance().map_or(f64::INFINITY, |distance| distance.value);
    println!("{what}: {}, distance {distance:.6}", pair.verdict().name());
    for region in pair.contacts() {
        println!("  contact at {:?}, area {}, normal {:?}", region.centre(), region.area(), region.normal());
    }
}

/// Vertices, and the corners of six quadrilaterals seen counterclockwise from outside.
fn cuboid([x0, y0, z0]: [f64; 3], [x1, y1, z1]: [f64; 3]) -> (Vec<[f64; 3]>, Vec<u32>) {
    let ring = |z: f64| [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]];
    let faces = [[3, 2, 1, 0], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    ([ring(z0), ring(z1)].concat(), faces.concat())
}

/// A plate of 4 by 4 by 1 with a square hole: 16 quadrilaterals, four on each of the top, the bottom, the outer and the inner
/// walls.
fn plate() -> (Vec<[f64; 3]>, Vec<u32>) {
    let ring = |half: f64, z: f64| [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]];
    let vertices = [ring(2.0, 0.0), ring(2.0, 1.0), ring(HOLE, 0.0), ring(HOLE, 1.0)].concat();
    let corners = (0..4u32).flat_map(|side| {
        // The first corner of the side on each ring, and the second.
        let [below, above, inner_below, inner_above] = [0, 4, 8, 12].map(|ring| [ring + side, ring + (side + 1) % 4]);
        let wall = [below[0], below[1], above[1], above[0]];
        let top = [above[0], above[1], inner_above[1], inner_above[0]];
        let inner_wall = [inner_above[0], inner_above[1], inner_below[1], inner_below[0]];
        let bottom = [inner_below[0], inner_below[1], below[1], below[0]];
        [wall, top, inner_wall, bottom].concat()
    });
    (vertices, corners.collect())
}
