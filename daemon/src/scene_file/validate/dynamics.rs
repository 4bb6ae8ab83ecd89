//! Mass and first velocities of the bodies of a scene file.

use collided_client::Velocity;
use collided_protocol::control::{Dynamics, Mass};

use super::steps::{vector, velocity};
use crate::scene_file::document::{self, Body};
use crate::scene_file::error::Invalid;

/// The bodies with mass, by their places.
pub(super) fn of_bodies(bodies: &[Body]) -> Result<Vec<(usize, Dynamics)>, Invalid> {
    let given = bodies.iter().enumerate().filter_map(|(place, body)| Some((place, body, body.dynamics.as_ref()?)));
    given
        .map(|(place, body, given)| Ok((place, dynamics(&format!("body \"{}\", dynamics", body.name), given)?)))
        .collect()
}

/// The velocities that bodies have before any step brings one, by their places.
pub(super) fn first_velocities(bodies: &[Body]) -> Result<Vec<(usize, Velocity)>, Invalid> {
    let given = bodies.iter().enumerate().filter_map(|(place, body)| Some((place, body, body.velocity.as_ref()?)));
    given
        .map(|(place, body, given)| Ok((place, velocity(&format!("body \"{}\", velocity", body.name), given)?)))
        .collect()
}

fn dynamics(place: &str, given: &document::Dynamics) -> Result<Dynamics, Invalid> {
    let remedy = "give \"static\": true, or \"density\", or \"mass\" and \"inertia\" (and \"centre\" where it is not the object's origin)";
    let mass = match (given.mass, &given.inertia, given.density, given.is_static) {
        (None, None, None, true) => Mass::Static,
        (Some(mass), Some(inertia), None, false) => Mass::Given {
            mass: mass.0,
            centre: vector(place, "centre", given.centre.as_deref(), [0.0; 3])?,
            inertia: match inertia.as_slice() {
                [x, y, z] => [
                    vector(place, "inertia", Some(x), [0.0; 3])?,
                    vector(place, "inertia", Some(y), [0.0; 3])?,
                    vector(place, "inertia", Some(z), [0.0; 3])?,
                ],
                rows => {
                    let problem = format!("\"inertia\" has {} rows", rows.len());
                    return Err(Invalid::new(place, problem, "give three rows of three numbers"));
                }
            },
        },
        (None, None, Some(density), false) => Mass::Density { density: density.0 },
        _ => return Err(Invalid::new(place, "the mass is not given, or given twice", remedy)),
    };
    let dynamics = Dynamics {
        mass,
        restitution: given.restitution.map_or(0.0, |value| value.0),
        friction: given.friction.map_or(0.0, |value| value.0),
    };
    match non_finite(&dynamics) {
        // The control channel carries finite numbers only; what range these must be in is the daemon's to say.
        Some(value) => Err(Invalid::new(place, format!("there is the number {value}"), "give finite numbers")),
        None => Ok(dynamics),
    }
}

fn non_finite(dynamics: &Dynamics) -> Option<f64> {
    let mut numbers = vec![dynamics.restitution, dynamics.friction];
    match dynamics.mass {
        Mass::Given { mass, centre, inertia } => {
            numbers.push(mass);
            numbers.extend(centre);
            numbers.extend(inertia.as_flattened());
        }
        Mass::Static => {}
        Mass::Density { density } => numbers.push(density),
    }
    numbers.into_iter().find(|number| !number.is_finite())
}
