//! A step, or a batch, as it stands in shared memory, taken as transforms.

use collided_kernel::effects::response::Velocity;
use collided_kernel::{BatchInput, BodyId, RigidMotion, StepInput, Transforms, Verdict};
use collided_protocol::limits::{MAX_BATCH_TRANSFORMS, MAX_BODIES};
use collided_protocol::step::{
    MOTION_LINEAR, RigidRecord, Rows, STEP_BATCH, STEP_DENSE, STEP_SPARSE, STOP_NEVER, StepHeader, VelocityRecord,
    Word, batch_words, id_words, payload_words, step_words,
};
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};

/// What a client asks on the step channel.
#[derive(Debug, Clone, Copy)]
pub enum Message<'a> {
    /// Bodies move.
    Step(StepInput<'a>),
    /// Candidates are judged.
    Batch(BatchInput<'a>),
}

/// Memory for what is copied out of a step, kept from one to the next.
#[derive(Debug, Default)]
pub struct Copied {
    ids: Vec<u32>,
    named: Vec<BodyId>,
    rigid: Vec<(BodyId, RigidMotion)>,
    velocities: Vec<(BodyId, Velocity)>,
}

/// Takes the words of a step, the transforms where the client wrote them. Ids, motions and velocities are copied, for the client
/// can still write what it has sent; which bodies they name is for the scene to judge, as are the numbers.
///
/// # Errors
/// `ProtocolMismatch`, `LimitExceeded` and `BadStep` for a header that this version does not know, or that does not fit the
/// words.
pub fn read<'a>(header: &StepHeader, words: &'a [Word], copied: &'a mut Copied) -> Result<Message<'a>, WireError> {
    check_kind(header)?;
    if header.kind == STEP_BATCH {
        return batch(header, words, &mut copied.named).map(Message::Batch);
    }
    check_step(header, words.len())?;
    Ok(Message::Step(step(header, words, copied)))
}

fn step<'a>(header: &StepHeader, words: &'a [Word], copied: &'a mut Copied) -> StepInput<'a> {
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
    StepInput { transforms, rigid: &copied.rigid, velocities: &copied.velocities }
}

fn batch<'a>(header: &StepHeader, words: &'a [Word], named: &'a mut Vec<BodyId>) -> Result<BatchInput<'a>, WireError> {
    let stop_at = check_batch(header, words.len())?;
    let count = header.transform_count as usize;
    let (id_part, rows) = words.split_at(id_words(count));
    named.clear();
    named.extend(bytemuck::cast_slice::<Word, u32>(id_part)[..count].iter().map(|&id| BodyId(id)));
    Ok(BatchInput { bodies: named, rows: bytemuck::cast_slice(rows), stop_at })
}

fn rigid_motion(&RigidRecord { body, axis, centre, angle, translate, .. }: &RigidRecord) -> (BodyId, RigidMotion) {
    (BodyId(body), RigidMotion { axis, centre, angle, translate })
}

fn velocity(&VelocityRecord { body, linear, angular, .. }: &VelocityRecord) -> (BodyId, Velocity) {
    (BodyId(body), Velocity { linear, angular })
}

fn bad<T>(fault: String, remedy: &str) -> Result<T, WireError> {
    Err(WireError::new(ErrorCode::BadStep, fault, remedy))
}

/// What holds of steps and batches.
fn check_kind(header: &StepHeader) -> Result<(), WireError> {
    let StepHeader { protocol, kind, transform_count, rigid_count, velocity_count, .. } = *header;
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
    if ![STEP_DENSE, STEP_SPARSE, STEP_BATCH].contains(&kind) {
        return bad(
            format!("the step is of kind {kind}, which is not known"),
            "send a dense or a sparse step, or a batch",
        );
    }
    Ok(())
}

fn check_step(header: &StepHeader, words: usize) -> Result<(), WireError> {
    let StepHeader { kind, transform_count, candidate_count, motion, rigid_count, velocity_count, .. } = *header;
    if candidate_count != 1 || motion != MOTION_LINEAR {
        return bad(
            format!("the step asks for {candidate_count} candidate poses and motion kind {motion}"),
            "send one pose and linear motion, or a batch: this version knows no other",
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

/// Says at which verdict the batch stops.
fn check_batch(header: &StepHeader, words: usize) -> Result<Option<Verdict>, WireError> {
    let StepHeader { transform_count, candidate_count, motion, rigid_count, velocity_count, stop_at, .. } = *header;
    if transform_count == 0 {
        return bad("the batch names no body".to_owned(), "name the bodies whose poses vary");
    }
    if motion != MOTION_LINEAR || rigid_count > 0 || velocity_count > 0 {
        return bad(
            format!("the batch has motion kind {motion}, {rigid_count} rigid motions and {velocity_count} velocities"),
            "send ids and transforms alone: no body moves in a batch",
        );
    }
    let transforms = u64::from(transform_count) * u64::from(candidate_count);
    if transforms > MAX_BATCH_TRANSFORMS {
        return Err(WireError::new(
            ErrorCode::LimitExceeded,
            format!(
                "the batch has {candidate_count} candidates of {transform_count} transforms, more than the limit of {MAX_BATCH_TRANSFORMS} transforms together"
            ),
            "send fewer candidates at once",
        ));
    }
    let needed = batch_words(transform_count as usize, candidate_count as usize);
    if words != needed {
        return bad(
            format!(
                "the batch's payload has {words} words, {candidate_count} candidates of {transform_count} transforms take {needed}"
            ),
            "write as many words as the header says",
        );
    }
    let verdicts = [Verdict::Clear, Verdict::Interfering, Verdict::Possible];
    match stop_at.checked_sub(STOP_NEVER + 1).map(|code| verdicts.get(code as usize)) {
        None => Ok(None),
        Some(Some(&verdict)) => Ok(Some(verdict)),
        Some(None) => bad(
            format!("the batch stops at verdict {stop_at}, which is not known"),
            "send 0, or 1 plus the code of a verdict",
        ),
    }
}
