//! The steps of a scene file.

use std::collections::HashMap;

use collided_client::{RigidMotion, Velocity};
use collided_protocol::step::Rows;

use super::{body, fixed};
use crate::scene_file::error::Invalid;
use crate::scene_file::values::{self, Number, Table};
use crate::scene_file::{Pose, Step};

pub(super) fn step(index: usize, step: values::Step, places: &HashMap<&str, usize>) -> Result<Step, Invalid> {
    let place = format!("step {index}");
    let delta_time = step.delta_time.map_or(0.0, |time| time.0);
    if !(delta_time.is_finite() && delta_time >= 0.0) {
        return Err(Invalid::new(place, "\"delta_time\" is negative or not finite", "give the length of the step"));
    }
    let transforms = match step.poses {
        None => step.transforms,
        Some(poses) if step.transforms.is_empty() => poses.0,
        Some(_) => {
            let problem = format!("the transform of \"{}\" stands beside \"poses\"", step.transforms[0].0);
            return Err(Invalid::new(place, problem, "write all transforms of the step under \"poses\""));
        }
    };
    let poses = transforms.into_iter().map(|(name, table)| {
        let body = body(&place, &name, places)?;
        Ok(Pose { body, rows: rows(&format!("{place}, body \"{name}\""), &table)? })
    });
    let motions = step.motion.into_iter().flat_map(|motions| motions.0).map(|(name, given)| {
        let body = body(&place, &name, places)?;
        Ok((body, motion(&format!("{place}, motion of \"{name}\""), &given)?))
    });
    let velocities = step.velocities.into_iter().flat_map(|velocities| velocities.0).map(|(name, given)| {
        let body = body(&place, &name, places)?;
        Ok((body, velocity(&format!("{place}, velocity of \"{name}\""), &given)?))
    });
    Ok(Step {
        poses: poses.collect::<Result<_, Invalid>>()?,
        motions: motions.collect::<Result<_, Invalid>>()?,
        velocities: velocities.collect::<Result<_, Invalid>>()?,
        delta_time,
    })
}

fn rows(place: &str, table: &Table) -> Result<Rows, Invalid> {
    let remedy = "give 3 rows of 4 numbers (rotation, scale, shear | translation)";
    let wrong = |problem: String| Invalid::new(place, problem, remedy);
    let [a, b, c] = table.as_slice() else {
        return Err(wrong(format!("the transform has {} rows", table.len())));
    };
    let row = |number: usize, row: &Vec<Number>| {
        fixed::<4>(row).ok_or_else(|| wrong(format!("row {number} of the transform has {} numbers", row.len())))
    };
    Ok([row(0, a)?, row(1, b)?, row(2, c)?])
}

fn motion(place: &str, given: &values::Motion) -> Result<RigidMotion, Invalid> {
    let still = RigidMotion::default();
    Ok(RigidMotion {
        axis: vector(place, "axis", given.axis.as_deref(), still.axis)?,
        centre: vector(place, "centre", given.centre.as_deref(), still.centre)?,
        angle: given.angle.map_or(still.angle, |angle| angle.0),
        translate: vector(place, "translate", given.translate.as_deref(), still.translate)?,
    })
}

pub(super) fn velocity(place: &str, given: &values::Velocity) -> Result<Velocity, Invalid> {
    Ok(Velocity {
        linear: vector(place, "linear", given.linear.as_deref(), [0.0; 3])?,
        angular: vector(place, "angular", given.angular.as_deref(), [0.0; 3])?,
    })
}

/// Three numbers, or `otherwise` when they are not given.
pub(super) fn vector(
    place: &str,
    name: &str,
    given: Option<&[Number]>,
    otherwise: [f64; 3],
) -> Result<[f64; 3], Invalid> {
    let Some(numbers) = given else { return Ok(otherwise) };
    fixed::<3>(numbers).ok_or_else(|| {
        Invalid::new(place, format!("\"{name}\" has {} numbers", numbers.len()), "give three: [x, y, z]")
    })
}
