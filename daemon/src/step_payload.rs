//! A step as it stands in shared memory, taken as transforms.

use collided_kernel::effects::response::Velocity;
use collided_kernel::{BodyId, RigidMotion, StepInput, Transforms};
use collided_protocol::limits::MAX_BODIES;
use collided_protocol::step::{
    MOTION_LINEAR, RigidRecord, Rows, STEP_DENSE, STEP_SPARSE, StepHeader, VelocityRecord, Word, id_words,
    payload_words, step_words,
};
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};

/// Memory for what is copied out of a step, kept from one to the next.
#[derive(Debug, Default)]
pub struct Copied {
    ids: Vec<u32>,
    rigid: Vec<(BodyId, RigidMotion)>,
    velocities: Vec<(BodyId, Velocity)>,
}

/// Takes the words of a step, the transforms where the client wrote them. Ids, motions and velocities are copied, for the client
/// can still write what it has sent; which bodies they name is for the scene to judge, as are the numbers.
///
/// # Errors
/// `ProtocolMismatch`, `LimitExceeded` and `BadStep` for a header that this version does not know, or that does not fit the
/// words.
pub fn read<'a>(header: &StepHeader, words: &'a [Word], copied: &'a mut Copied) -> Result<StepInput<'a>, WireError> {
    check(header, words.len())?;
    let count = header.transform_count as usize;
    let (transforms, rest) = words.split_at(step_words(header.kind, count));
    let velocity_words = payload_words(STEP_DENSE, 0, 0, header.velocity_count as usize);
    let (rigid, velocities) = rest.split_at(rest.len() - velocity_words);
    copied.rigid.clear();
    copied.rigid.extend(bytemuck::cast_slice::<Word, RigidRecord>(rigid).iter().map(rigid_motion));
    copied.velocities.clear();
    copied.velocities.extend(bytemuck::cast_slice::<Word, VelocityRecord>(velocities).iter().map(velocity));
    let transforms = if header.kind == STEP_DENSE {
        Transforms::Dense(bytemuck::cast_slice::<Word, Rows>(transforms))
    } else {
        let (id_part, rows) = transforms.split_at(id_words(count));
        copied.ids.clear();
        copied.ids.extend_from_slice(&bytemuck::cast_slice::<Word, u32>(id_part)[..count]);
        Transforms::Sparse { bodies: &copied.ids, rows: bytemuck::cast_slice(rows) }
    };
    Ok(StepInput { transforms, rigid: &copied.rigid, velocities: &copied.velocities })
}

fn rigid_motion(&RigidRecord { body, axis, centre, angle, translate, .. }: &RigidRecord) -> (BodyId, RigidMotion) {
    (BodyId(body), RigidMotion { axis, centre, angle, translate })
}

fn velocity(&VelocityRecord { body, linear, angular, .. }: &VelocityRecord) -> (BodyId, Velocity) {
    (BodyId(body), Velocity { linear, angular })
}

fn check(header: &StepHeader, words: usize) -> Result<(), WireError> {
    let bad = |fault: String, remedy: &str| Err(WireError::new(ErrorCode::BadStep, fault, remedy));
    let StepHeader { protocol, kind, transform_count, candidate_count, motion, .. } = *header;
    let StepHeader { rigid_count, velocity_count, .. } = *header;
    if protocol != PROTOCOL_VERSION {
        return Err(WireError::new(
            ErrorCode::ProtocolMismatch,
            format!("the step is of protocol {protocol}, the scene of {PROTOCOL_VERSION}"),
            "use client and daemon of the same release",
        ));
    }
    let counts = [("transforms", transform_count), ("rigid motions", rigid_count), ("velocities", velocity_count)];
    if let Some((what, count)) = counts.iter().find(|(_, count)| *count > MAX_BODIES) {
        return Err(WireError::new(
            ErrorCode::LimitExceeded,
            format!("the step has {count} {what}, more than the limit of {MAX_BODIES} bodies"),
            "split the scene",
        ));
    }
    if kind != STEP_DENSE && kind != STEP_SPARSE {
        return bad(format!("the step is of kind {kind}, which is not known"), "send a dense or a sparse step");
    }
    if candidate_count != 1 || motion != MOTION_LINEAR {
        return bad(
            format!("the step asks for {candidate_count} candidate poses and motion kind {motion}"),
            "send one pose and linear motion: this version knows no other",
        );
    }
    if kind == STEP_DENSE && rigid_count > 0 {
        return bad(
            format!("the step is dense, so every body has a transform, and has {rigid_count} rigid motions besides"),
            "send a sparse step, with transforms of the other bodies",
        );
    }
    let needed = payload_words(kind, transform_count as usize, rigid_count as usize, velocity_count as usize);
    if words != needed {
        return bad(
            format!(
                "the step's payload has {words} words, {transform_count} transforms, {rigid_count} rigid motions and {velocity_count} velocities take {needed}"
            ),
            "write as many words as the header says",
        );
    }
    Ok(())
}
