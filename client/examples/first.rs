//! Two bodies, one step. Start `collided serve`, then run this with the path of a mesh.

use collided_client::{Client, Effect, Error, IDENTITY};

fn main() -> Result<(), Error> {
    let mesh = std::env::args().nth(1).unwrap_or_else(|| "bunny.obj".to_owned());
    let client = Client::connect()?;
    let object = client.database("first").loading("object").replace(true).file(mesh)?;
    let mut scene = client.scene("first").effects([Effect::PolygonPairs]).create()?;
    scene.add_body("left", &object)?;
    scene.add_body("right", &object)?;
    for pair in scene.step(&[IDENTITY, IDENTITY])?.pairs() {
        println!(
            "{} and {}: {}, {} polygon pairs",
            pair.a(),
            pair.b(),
            pair.verdict().name(),
            pair.polygon_pairs().len()
        );
    }
    Ok(())
}
