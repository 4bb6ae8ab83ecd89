//! What goes through shared memory to a real daemon process.

use std::path::{Path, PathBuf};

use collided_client::{Batch, BodyId, Effect, Rows, Scene, Verdict};
use collided_tests::daemon_process::DaemonProcess;
use collided_tests::npy;
use collided_tests::shared_memory::{Bench, Measured, SHAPES};
use serde_json::{Value, json};

use crate::AnyError;
use crate::turns::{Limits, Record, in_turns, timed};
use crate::work::{Model, OURS, Poses, on_one_thread, parrys_booleans, print};

/// Both bodies have a pose in each candidate. Ours is told by what the whole batch took, the fastest of the passes, for each pose.
pub fn batch(paths: [&PathBuf; 2], poses: &Path, limits: &Limits) -> Result<(), AnyError> {
    let rows = npy::read_pose_pairs(poses)?;
    let daemon = DaemonProcess::start_with(&["--threads", "2"]);
    let mut scene = scene(&daemon, paths)?;
    let bodies = scene.bodies().to_vec();
    let mut ours = Record { library: OURS, us: Vec::new(), answers: Vec::new() };
    for _ in 0..limits.passes {
        let (us, answers) = timed(|| ask(&mut scene, &bodies, rows.as_flattened()));
        ours.answers = answers?;
        let of_each = us / rows.len() as f64;
        ours.us = vec![ours.us.first().map_or(of_each, |fastest| fastest.min(of_each)); rows.len()];
    }
    drop((scene, daemon));
    let models = paths.map(|path| Model::read(path));
    let poses = Poses::new(rows);
    let theirs = on_one_thread(|| in_turns(parrys_booleans(&models, &poses), poses.count(), limits));
    print(&std::iter::once(ours).chain(theirs).collect::<Vec<_>>(), json!({}));
    Ok(())
}

fn scene(daemon: &DaemonProcess, paths: [&PathBuf; 2]) -> Result<Scene, AnyError> {
    let client = daemon.client();
    let database = client.database("peers");
    let mut scene = client.scene("peers").effects([Effect::Interference]).create()?;
    for (name, path) in ["a", "b"].into_iter().zip(paths) {
        scene.add_body(name, &database.load(name, std::path::absolute(path)?)?)?;
    }
    Ok(scene)
}

/// 1 for each candidate that interferes.
fn ask(scene: &mut Scene, bodies: &[BodyId], candidates: &[Rows]) -> Result<Vec<f64>, AnyError> {
    let report = scene.step_batch(&Batch { bodies, candidates, stop_at: None })?;
    Ok(report.verdicts().map(|verdict| f64::from(verdict == Some(Verdict::Interfering))).collect())
}

/// Prints, for each shape of a step, the medians of a round.
pub fn shared_memory(steps: usize) -> Result<(), AnyError> {
    let bench = Bench::new();
    let rounds: Vec<Measured> = SHAPES.iter().map(|shape| bench.round(shape, steps)).collect();
    println!("{}", Value::from_iter([("steps", json!(rounds))]));
    Ok(())
}
