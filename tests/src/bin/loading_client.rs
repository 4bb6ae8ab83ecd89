//! A client process: uploads a mesh of several parts, prints the stage when it has come as far as told, and then waits to be
//! killed, in the middle of its upload or of the daemon's work.
//!
//! Arguments: rendezvous directory, stage (`upload` or `build`).

use collided_client::{Client, Mesh};
use collided_protocol::limits::MAX_UPLOAD_PART_WORDS;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [directory, last_stage] = arguments.as_slice() else {
        return Err("arguments: directory, stage".into());
    };
    let client = Client::builder().directory(directory).connect()?;
    let (vertices, corners) = strip(MAX_UPLOAD_PART_WORDS / 2);
    let corner_counts = vec![3; corners.len() / 3];
    let database = client.database("parts");
    let loading = database.loading("long").on_progress(|stage, _, _| {
        if stage == last_stage {
            println!("{stage}");
            loop {
                std::thread::park();
            }
        }
    });
    loading.mesh(&Mesh { vertices: &vertices, corner_counts: &corner_counts, corners: &corners })?;
    Err(format!("the upload came to its end without the stage {last_stage:?}").into())
}

/// A strip of `count` triangles.
fn strip(count: usize) -> (Vec<[f64; 3]>, Vec<u32>) {
    let vertices = (0..count + 2).map(|index| [index as f64, (index % 2) as f64, 0.0]).collect();
    (vertices, (0..count as u32).flat_map(|index| [index, index + 1, index + 2]).collect())
}
