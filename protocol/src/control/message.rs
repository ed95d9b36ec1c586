//! Turns control messages into JSON and back, with errors that name what was expected.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::error::ProtocolError;

/// What a client may ask for; JSON with the field `type` in snake case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// First message of a connection: the client's major ABI version. Answered by the server itself.
    Hello {
        /// Major version.
        abi: u64,
    },
    /// Stop simulated time; frames may still be published.
    Pause,
    /// Let simulated time run.
    Resume,
    /// Advance simulated time by one step while paused.
    Step,
    /// Load the configuration again.
    Reload,
    /// Report the simulator's state.
    Query,
    /// End the simulator.
    Shutdown,
    /// Change properties of a light, by the keys of the configuration.
    SetLight {
        /// Name of the light.
        name: String,
        /// New values by key.
        values: Map<String, Value>,
    },
    /// Change the place of an object, by the keys of the configuration.
    MoveObject {
        /// Name of the object.
        name: String,
        /// New values by key.
        values: Map<String, Value>,
    },
    /// Change properties of a material, by the keys of the configuration.
    SetMaterial {
        /// Name of the material.
        name: String,
        /// New values by key.
        values: Map<String, Value>,
    },
    /// Replace the virtual point lights, blockers, proxies or settings of a method of few lights, by the tables of the
    /// configuration.
    SetVpls {
        /// Any of `vpl`, `blocker` and `proxy`, each a list of tables, and `vpls`, a table.
        values: Map<String, Value>,
    },
    /// Write the virtual point lights, blockers and proxies into the configuration that is simulated.
    SaveVpls {},
    /// Change streaming settings, by the keys of the configuration.
    SetStreaming {
        /// New values by key.
        values: Map<String, Value>,
    },
}

/// What a client is told; JSON with the field `type` in snake case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Reply {
    /// Done, and visible from this frame on.
    Ok {
        /// Frame number.
        frame: u64,
    },
    /// The answer to a query.
    State {
        /// Whatever the simulator reports.
        state: Value,
    },
    /// Refused.
    Error {
        /// One word for programs, such as `unknown-name`.
        code: String,
        /// One sentence for people.
        message: String,
    },
    /// The simulator has too many requests waiting; ask again later.
    Overloaded,
}

impl Reply {
    /// A refusal.
    pub fn error(code: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Error { code: code.into(), message: message.into() }
    }
}

/// Types of requests, for the message to those who sent another one.
const REQUEST_TYPES: &str = "hello, pause, resume, step, reload, query, shutdown, set_light, move_object, set_material, set_vpls, save_vpls, set_streaming";

impl Request {
    /// Parses one message; the error is the reply that its sender gets.
    pub(crate) fn parse(bytes: &[u8]) -> Result<Self, Reply> {
        serde_json::from_slice(bytes).map_err(|error| {
            let code = if error.is_data() { "unknown-request" } else { "malformed" };
            Reply::error(code, format!("{error}; expected JSON with \"type\" one of {REQUEST_TYPES}"))
        })
    }
}

/// Text of a message.
pub(crate) fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, ProtocolError> {
    serde_json::to_vec(message).map_err(|error| ProtocolError::Control { message: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_survive_the_wire() {
        let values: Map<String, Value> =
            [("power_w".to_owned(), serde_json::json!([80.0, 60.0, 40.0]))].into_iter().collect();
        for request in [
            Request::Hello { abi: 2 },
            Request::Pause,
            Request::SetLight { name: "lamp".into(), values: values.clone() },
            Request::SetMaterial { name: "red".into(), values: values.clone() },
            Request::SetVpls { values: values.clone() },
            Request::SaveVpls {},
            Request::SetStreaming { values },
        ] {
            assert_eq!(Request::parse(&encode(&request).unwrap()).unwrap(), request);
        }
        assert_eq!(Request::parse(br#"{"type":"pause"}"#).unwrap(), Request::Pause);
    }

    #[test]
    fn unknown_and_malformed_requests_are_told_apart() {
        for (text, expected) in [
            (&br#"{"type":"explode"}"#[..], "unknown-request"),
            (br#"{"type":"hello"}"#, "unknown-request"),
            (br#"{"type":"hello","abi":1,"x":2}"#, "unknown-request"),
            (b"[1]", "unknown-request"),
            (b"{", "malformed"),
            (b"", "malformed"),
            (b"\xff\xfe", "malformed"),
        ] {
            let Err(Reply::Error { code, message }) = Request::parse(text) else {
                panic!("{text:?} accepted")
            };
            assert_eq!(code, expected, "{message}");
            assert!(message.contains("set_light"));
        }
    }
}
