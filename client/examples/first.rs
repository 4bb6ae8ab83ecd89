//! Two bodies, one step. Start `collided serve`, then run this with the path of a mesh.

use collided_client::{Client, Effect, Error, IDENTITY, translation};

fn main() -> Result<(), Error> {
    let mesh = std::env::args().nth(1).unwrap_or_else(|| "daemon/meshes/spot.obj".to_owned());
    let client = Client::connect()?;
    let cow = client.database("first").loading("cow").replace(true).file(mesh)?;
    let mut scene = client.scene("first").effects([Effect::PolygonPairs]).create()?;
    scene.add_body("left", &cow)?;
    scene.add_body("right", &cow)?;
    let moved = translation([0.5, 0.0, 0.0]);
    for pair in scene.step(&[IDENTITY, moved])?.pairs() {
        let polygons = pair.polygon_pairs().len();
        println!("{} and {}: {}, {polygons} polygon pairs", pair.a(), pair.b(), pair.verdict().name());
    }
    Ok(())
}
