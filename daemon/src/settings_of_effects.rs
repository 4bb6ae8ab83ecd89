//! Accuracy and mass, as a client gives them, in the kernel's terms.

use std::iter;
use std::time::Duration;

use collided_kernel as kernel;
use collided_kernel::affine::IDENTITY;
use collided_kernel::effects::distance::DistanceSettings;
use collided_kernel::effects::response::{
    MassProperties, Response, ResponseBody, ResponseError, ResponsePair, Velocity,
};
use collided_kernel::effects::time_of_contact::TimeSettings;
use collided_protocol::control::{Accuracy, Dynamics, Mass};
use collided_protocol::report::Level;
use collided_protocol::{ErrorCode, WireError};

/// The settings, where they are given, and the kernel's defaults where not.
///
/// # Errors
/// `BadAccuracy` names the field and its range.
pub fn accuracy(given: &Accuracy) -> Result<kernel::Accuracy, WireError> {
    let (distance, time) = (DistanceSettings::default(), TimeSettings::default());
    let relative_tolerance = given.distance_tolerance.unwrap_or(distance.relative_tolerance);
    let up_to = given.distance_up_to.unwrap_or(distance.up_to);
    let tolerance = given.time_tolerance.unwrap_or(time.tolerance);
    let iterations = given.iterations.unwrap_or(time.iterations);
    Ok(kernel::Accuracy {
        level: given.level.map_or(kernel::Level::Polygons, level),
        order: order(given)?,
        distance: DistanceSettings {
            relative_tolerance: within(
                "distance_tolerance",
                relative_tolerance,
                (0.0..1.0).contains(&relative_tolerance),
                "a share of the distance, from 0 to below 1",
            )?,
            up_to: within("distance_up_to", up_to, up_to >= 0.0, "a length, 0 or more, or leave it out")?,
        },
        time: TimeSettings {
            tolerance: within(
                "time_tolerance",
                tolerance,
                tolerance > 0.0 && tolerance <= 1.0,
                "a share of the step, above 0 and up to 1",
            )?,
            iterations: within("iterations", f64::from(iterations), iterations > 0, "a number from 1 on")? as u32,
        },
    })
}

/// What a step may take; `None`: whatever it takes.
///
/// # Errors
/// `BadAccuracy` when it is not a time above 0.
pub fn budget(given: &Accuracy) -> Result<Option<Duration>, WireError> {
    let Some(budget) = given.budget_us else { return Ok(None) };
    within(
        "budget_us",
        budget,
        budget > 0.0 && budget.is_finite(),
        "a time above 0, in microseconds, or leave it out",
    )?;
    Ok(Some(Duration::try_from_secs_f64(budget * 1e-6).unwrap_or(Duration::MAX)))
}

fn order(given: &Accuracy) -> Result<Option<u32>, WireError> {
    match (given.order, given.level) {
        (Some(order), level) if level != Some(Level::Voxels) => Err(WireError::new(
            ErrorCode::BadAccuracy,
            format!("order is {order}, but the level is {}", level.unwrap_or(Level::Polygons).name()),
            "give an order with the level voxels only",
        )),
        (order, _) => Ok(order),
    }
}

fn within(field: &str, value: f64, holds: bool, range: &str) -> Result<f64, WireError> {
    match holds {
        true => Ok(value),
        false => Err(WireError::new(ErrorCode::BadAccuracy, format!("{field} is {value}"), format!("give {range}"))),
    }
}

fn level(level: Level) -> kernel::Level {
    match level {
        Level::GlobalBoxes => kernel::Level::GlobalBoxes,
        Level::Containers => kernel::Level::Containers,
        Level::Voxels => kernel::Level::Voxels,
        Level::Polygons => kernel::Level::Polygons,
    }
}

/// The mass of a body of that object.
///
/// # Errors
/// [`ResponseError`] says what is out of range; the body it names is 0.
pub fn dynamics(object: &kernel::Object, given: &Dynamics) -> Result<kernel::Dynamics, ResponseError> {
    let mass = match given.mass {
        Mass::Given { mass, .. } if !mass.is_finite() => return Err(ResponseError::Mass { body: 0, mass }),
        Mass::Given { mass, centre, inertia } => MassProperties { mass, centre, inertia },
        Mass::Static => MassProperties::STATIC,
        Mass::Density { density } => MassProperties::of_closed_mesh(object, density)?,
    };
    let Dynamics { restitution, friction, .. } = *given;
    let body = ResponseBody { mass, restitution, friction, rows: IDENTITY, velocity: Velocity::default() };
    // The solver checks its bodies before it looks at pairs.
    Response::default().solve(&[body], iter::empty::<ResponsePair<'_>>())?;
    Ok(kernel::Dynamics { mass, restitution, friction })
}
