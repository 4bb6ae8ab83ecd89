//! Requests out of the JSON of a frame, and what is said of those that cannot be read.

use collided_client::frame::FrameError;
use collided_protocol::control::Request;
use collided_protocol::{Effect, ErrorCode, WireError};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Reads a request.
///
/// # Errors
/// `UnknownEffect` when it asks for an effect that there is not, else `BadMessage`.
pub fn parse(json: &[u8]) -> Result<Request, WireError> {
    serde_json::from_slice(json).map_err(|error| match unknown_effect(json) {
        Some(name) => unknown_effect_error(&name),
        None => WireError::new(
            ErrorCode::BadMessage,
            format!("the control message cannot be read: {error}"),
            "send one JSON request of the protocol a frame",
        ),
    })
}

/// For a frame beyond the limit.
pub fn too_large(error: &FrameError) -> WireError {
    WireError::new(ErrorCode::LimitExceeded, error.to_string(), "send it in several requests")
}

/// Where a request names effects, whatever else it holds.
#[derive(Deserialize)]
struct Naming {
    #[serde(default)]
    effects: Vec<String>,
    #[serde(default)]
    rules: Vec<Rule>,
}

#[derive(Deserialize)]
struct Rule {
    interest: Interest,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Interest {
    Naming { effects: Vec<String> },
    Other(IgnoredAny),
}

/// The first effect named in a request that there is not.
fn unknown_effect(json: &[u8]) -> Option<String> {
    let naming: Naming = serde_json::from_slice(json).ok()?;
    let of_rules = naming.rules.into_iter().flat_map(|rule| match rule.interest {
        Interest::Naming { effects } => effects,
        Interest::Other(_) => Vec::new(),
    });
    naming.effects.into_iter().chain(of_rules).find(|name| Effect::named(name).is_none())
}

fn unknown_effect_error(name: &str) -> WireError {
    let known = Effect::ALL.map(|effect| format!("{:?}", effect.name())).join(", ");
    WireError::new(
        ErrorCode::UnknownEffect,
        format!("there is no effect {name:?} in this version"),
        format!("ask for some of {known}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn refused(json: &str) -> WireError {
        parse(json.as_bytes()).expect_err("the request is bad")
    }

    #[test]
    fn an_unknown_effect_is_named_with_the_known_ones() {
        for request in [
            r#"{"request":"create_scene","name":"s","effects":["interference","smell"]}"#,
            r#"{"request":"set_effects","scene":0,"effects":["smell"]}"#,
            r#"{"request":"set_interest","scene":0,"rules":[
                {"a":0,"b":1,"interest":"ignore"},{"a":0,"b":2,"interest":{"effects":["smell"]}}]}"#,
        ] {
            let error = refused(request);
            assert_eq!(error.code, ErrorCode::UnknownEffect, "{request}");
            for part in ["\"smell\"", "\"interference\"", "\"polygon_pairs\""] {
                assert!(error.to_string().contains(part), "{error} does not say {part}");
            }
        }
    }

    #[test]
    fn what_is_wrong_otherwise_is_a_bad_message() {
        for request in [
            "",
            "[]",
            r#"{"request":"dance"}"#,
            r#"{"request":"create_scene","name":"s","effects":["interference"],"colour":"red"}"#,
            r#"{"request":"create_scene","name":"s","effects":[7]}"#,
            r#"{"request":"set_interest","scene":0,"rules":[{"a":0,"b":1,"interest":"always"}]}"#,
        ] {
            assert_eq!(refused(request).code, ErrorCode::BadMessage, "{request}");
        }
    }
}
