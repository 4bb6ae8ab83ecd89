//! Names that clients give.

use collided_protocol::limits::MAX_NAME;
use collided_protocol::{ErrorCode, WireError};

/// Checks the name of a `what`: not empty, at most [`MAX_NAME`] bytes, no control characters.
///
/// # Errors
/// [`ErrorCode::BadName`].
pub fn check(what: &str, name: &str) -> Result<(), WireError> {
    let fault = if name.is_empty() {
        "it is empty".to_owned()
    } else if name.len() > MAX_NAME {
        format!("it has {} bytes", name.len())
    } else if let Some(character) = name.chars().find(|character| character.is_control()) {
        format!("it has the control character {character:?}")
    } else {
        return Ok(());
    };
    let start: String = name.chars().take(40).collect();
    Err(WireError::new(
        ErrorCode::BadName,
        format!("the {what} name {start:?} cannot be used: {fault}"),
        format!("use 1 to {MAX_NAME} bytes without control characters"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_printable_names_of_a_fair_length_pass() {
        for good in ["a", "left arm", "größe", &"x".repeat(MAX_NAME)] {
            assert_eq!(check("body", good), Ok(()));
        }
        for bad in ["", "a\nb", "\u{7f}", &"x".repeat(MAX_NAME + 1)] {
            assert_eq!(check("body", bad).unwrap_err().code, ErrorCode::BadName);
        }
    }
}
