//! A step as it stands in shared memory, taken as transforms.

use collided_kernel::Transforms;
use collided_protocol::limits::MAX_BODIES;
use collided_protocol::step::{MOTION_LINEAR, Rows, STEP_DENSE, STEP_SPARSE, StepHeader, Word, id_words, step_words};
use collided_protocol::{ErrorCode, PROTOCOL_VERSION, WireError};

/// Takes the words of a step as transforms, where the client wrote them. The ids of a sparse step are copied into `ids`, for
/// the client can still write what it has sent; which bodies they name is for the scene to judge, as are the numbers.
///
/// # Errors
/// `ProtocolMismatch`, `LimitExceeded` and `BadStep` for a header that this version does not know, or that does not fit the
/// words.
pub fn read<'a>(header: &StepHeader, words: &'a [Word], ids: &'a mut Vec<u32>) -> Result<Transforms<'a>, WireError> {
    check(header, words.len())?;
    if header.kind == STEP_DENSE {
        return Ok(Transforms::Dense(bytemuck::cast_slice::<Word, Rows>(words)));
    }
    let count = header.transform_count as usize;
    let (id_part, rows) = words.split_at(id_words(count));
    ids.clear();
    ids.extend_from_slice(&bytemuck::cast_slice::<Word, u32>(id_part)[..count]);
    Ok(Transforms::Sparse { bodies: ids, rows: bytemuck::cast_slice(rows) })
}

fn check(header: &StepHeader, words: usize) -> Result<(), WireError> {
    let bad = |fault: String, remedy: &str| Err(WireError::new(ErrorCode::BadStep, fault, remedy));
    let StepHeader { protocol, kind, transform_count, candidate_count, motion, .. } = *header;
    if protocol != PROTOCOL_VERSION {
        return Err(WireError::new(
            ErrorCode::ProtocolMismatch,
            format!("the step is of protocol {protocol}, the scene of {PROTOCOL_VERSION}"),
            "use client and daemon of the same release",
        ));
    }
    if transform_count > MAX_BODIES {
        return Err(WireError::new(
            ErrorCode::LimitExceeded,
            format!("the step has {transform_count} transforms, more than the limit of {MAX_BODIES} bodies"),
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
    let needed = step_words(kind, transform_count as usize);
    if words != needed {
        return bad(
            format!("the step's payload has {words} words, {transform_count} transforms take {needed}"),
            "write as many words as the header says",
        );
    }
    Ok(())
}
