//! Where the daemon of an instance is found.

use std::path::PathBuf;

use collided_protocol::limits::MAX_INSTANCE_NAME;
use collided_protocol::{ErrorCode, WireError};

/// The rendezvous directory of an instance: `$XDG_RUNTIME_DIR/collided/<instance>`, else `/tmp/collided-<uid>/<instance>`.
///
/// # Errors
/// [`ErrorCode::BadName`] when the instance's name is empty, too long, or not made of letters, digits, `-`, `_` and `.`.
pub fn directory(instance: &str) -> Result<PathBuf, WireError> {
    check_name(instance)?;
    Ok(base_directory().join(instance))
}

fn base_directory() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from) {
        Some(runtime) if runtime.is_absolute() => runtime.join("collided"),
        _ => PathBuf::from(format!("/tmp/collided-{}", rustix::process::getuid().as_raw())),
    }
}

fn check_name(instance: &str) -> Result<(), WireError> {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.');
    let good = !instance.is_empty()
        && instance.len() <= MAX_INSTANCE_NAME
        && !instance.starts_with('.')
        && instance.bytes().all(plain);
    if good {
        return Ok(());
    }
    Err(WireError::new(
        ErrorCode::BadName,
        format!("the instance name {instance:?} cannot be used"),
        format!("use 1 to {MAX_INSTANCE_NAME} letters, digits, '-', '_' or '.', not beginning with '.'"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_would_leave_the_directory_are_refused() {
        for bad in ["", ".", "..", "a/b", "../x", "a b", "ä", &"x".repeat(MAX_INSTANCE_NAME + 1)] {
            assert_eq!(directory(bad).unwrap_err().code, ErrorCode::BadName, "{bad:?}");
        }
        for good in ["default", "cell7", "a-b_c.d", &"x".repeat(MAX_INSTANCE_NAME)] {
            assert!(directory(good).unwrap().ends_with(good));
        }
    }
}
