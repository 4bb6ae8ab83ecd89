//! The kernel's errors in words for the wire: with the names of objects and bodies, and a remedy.

use collided_kernel::effects::response::ResponseError;
use collided_kernel::{ObjectError, StepError};
use collided_protocol::control::Target;
use collided_protocol::{ErrorCode, WireError};

/// Why an object could not be built.
pub fn object_error(error: &ObjectError, target: &Target) -> WireError {
    let (code, remedy) = match error {
        ObjectError::NonFiniteVertex { .. } => (ErrorCode::NonFiniteVertex, "write finite numbers into the mesh"),
        ObjectError::TooFewCorners { .. } => (ErrorCode::TooFewCorners, "give each polygon 3 or more corners"),
        ObjectError::IndexOutOfRange { .. } => {
            (ErrorCode::IndexOutOfRange, "name vertices by their index from 0, below the number of vertices")
        }
        ObjectError::CornerCount { .. } => {
            (ErrorCode::BadMessage, "make the numbers of corners add up to the corners that are sent")
        }
        ObjectError::TooManyElements { .. } => (ErrorCode::LimitExceeded, "split the mesh into several objects"),
        ObjectError::OrderOutOfRange { .. } => {
            (ErrorCode::OrderOutOfRange, "ask for an order within the limit, or leave it to the daemon")
        }
        ObjectError::MatrixTooLarge { .. } => {
            (ErrorCode::MatrixTooLarge, "ask for a smaller order, or leave it to the daemon")
        }
        _ => (ErrorCode::Internal, "report this as a bug"),
    };
    WireError::new(code, format!("object {:?} of database {:?}: {error}", target.object, target.database), remedy)
}

/// Why a step was refused. `name` tells the name of a body, `bodies` the number of living ones.
pub fn step_error(error: &StepError, name: &dyn Fn(u32) -> String) -> WireError {
    match *error {
        StepError::TransformCount { expected, found } => WireError::new(
            ErrorCode::BadStep,
            format!("the step has {found} transforms for {expected} bodies"),
            "send one transform per living body, in ascending order of body id, or a sparse step",
        ),
        StepError::UnknownBody { what, position, body } => WireError::new(
            ErrorCode::UnknownBody,
            format!("{what} {position} is for body {body}, which the scene does not have"),
            "use the ids that came when the bodies were added, and none that was removed",
        ),
        StepError::BodyTwice { what, position, body } => WireError::new(
            ErrorCode::BadStep,
            format!(
                "{what} {position} is for body {} (id {body}), which has a transform or a motion in this step already",
                name(body)
            ),
            "send one transform or one rigid motion per body",
        ),
        StepError::NonFiniteTransform { body, row, column, value } => WireError::new(
            ErrorCode::NonFiniteTransform,
            format!("the transform of body {} (id {}) has {value} in row {row}, column {column}", name(body.0), body.0),
            "send finite numbers; no body has moved",
        ),
        StepError::WorldOverflow { body, vertex, axis, position } => WireError::new(
            ErrorCode::WorldOverflow,
            format!(
                "the transform of body {} (id {}) carries vertex {vertex} at {position:?} beyond the range of f64 along axis {axis}",
                name(body.0),
                body.0
            ),
            "send a transform that keeps the body within about 1e308; no body has moved",
        ),
        StepError::BadMotion { body, ref motion } => WireError::new(
            ErrorCode::BadMotion,
            format!("body {} (id {}): {motion}", name(body.0), body.0),
            "send an axis of any length but zero and finite numbers; no body has moved",
        ),
        StepError::NonFiniteVelocity { body, value } => WireError::new(
            ErrorCode::BadDynamics,
            format!("the velocity of body {} (id {}) has the number {value}", name(body.0), body.0),
            "send finite numbers; no body has moved",
        ),
        StepError::BadCandidate { candidate, ref fault } => {
            let fault = step_error(fault, name);
            WireError { message: format!("candidate {candidate}: {}", fault.message), ..fault }
        }
        ref other => WireError::new(ErrorCode::Internal, format!("the step failed: {other}"), "report this as a bug"),
    }
}

/// Why a body cannot have the mass it was given. `name` is the body's, quoted.
pub fn dynamics_error(error: &ResponseError, name: &str, id: u32) -> WireError {
    let about = format!("body {name} (id {id})");
    let bad = |fault: String, remedy: &str| WireError::new(ErrorCode::BadDynamics, format!("{about} {fault}"), remedy);
    match error {
        ResponseError::Mass { mass, .. } => {
            bad(format!("has mass {mass}"), "give a positive number, or no mass at all for a body that never moves")
        }
        ResponseError::Inertia { .. } => bad(
            "has an inertia tensor that is not symmetric and positive definite".to_owned(),
            "give the tensor about the centre of mass, along the object's axes",
        ),
        ResponseError::Restitution { restitution, .. } => {
            bad(format!("has restitution {restitution}"), "give a number from 0 to 1")
        }
        ResponseError::Friction { friction, .. } => {
            bad(format!("has friction {friction}"), "give a finite number, 0 or more")
        }
        ResponseError::NotFinite { .. } => {
            bad("has a centre of mass or a velocity that is not finite".to_owned(), "give finite numbers")
        }
        ResponseError::Density { density } => bad(format!("has density {density}"), "give a positive finite number"),
        ResponseError::OpenMesh { edges } => bad(
            format!("has a density, and its mesh is open or not consistently oriented at {edges} edges"),
            "close the mesh, or give mass, centre and inertia",
        ),
        _ => bad(format!("has a density, but {error}"), "give mass, centre and inertia"),
    }
}
