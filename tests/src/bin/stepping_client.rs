//! A client process: places one object at the identity, and once more above it, and steps until its standard input ends, or a step
//! fails. Prints the scene's id after the first step, and a [`Summary`] at the end.
//!
//! Arguments: rendezvous directory, database, object, how far above.

use std::collections::BTreeSet;
use std::io::Read;
use std::sync::atomic::{AtomicBool, Ordering};

use collided_client::{Client, Effect, Error, IDENTITY, Rows, Scene, translation};
use collided_tests::client_process::Summary;

static TOLD_TO_END: AtomicBool = AtomicBool::new(false);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [directory, database, object, above] = arguments.as_slice() else {
        return Err("arguments: directory, database, object, how far above".into());
    };
    let transforms = [IDENTITY, translation([0.0, 0.0, above.parse()?])];
    std::thread::spawn(|| {
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        TOLD_TO_END.store(true, Ordering::Relaxed);
    });
    let client = Client::builder().directory(directory).connect()?;
    let object = client.database(database).get(object)?;
    let mut scene = client.scene("stepping").effects([Effect::PolygonPairs]).create()?;
    scene.add_body("a", &object)?;
    scene.add_body("b", &object)?;
    let mut counts = BTreeSet::from([count(&mut scene, &transforms)?]);
    println!("{}", scene.id());
    let (mut steps, mut error) = (1, None);
    while error.is_none() && !TOLD_TO_END.load(Ordering::Relaxed) {
        match count(&mut scene, &transforms) {
            Ok(polygon_pairs) => {
                steps += 1;
                counts.insert(polygon_pairs);
            }
            Err(failure) => error = Some(failure.to_string()),
        }
    }
    let summary = Summary { steps, polygon_pairs: counts.into_iter().collect(), error };
    println!("{}", serde_json::to_string(&summary)?);
    Ok(())
}

fn count(scene: &mut Scene, transforms: &[Rows]) -> Result<usize, Error> {
    scene.step(transforms).map(|report| report.polygon_pair_count())
}
