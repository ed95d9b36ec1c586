//! Turns requests to the simulator of a channel into the frames from which they are seen, or into why they were refused.

use crate::{assignment::title, error::LauncherError};
use photonstream_protocol::{ChannelName, ControlClient, Reply, Request};
use std::time::Duration;

/// How long the simulator may take to answer: it may have to load a scene.
const REPLY_LIMIT: Duration = Duration::from_secs(60);
/// Pause before a request that the simulator had no room for is sent again.
const RETRY_AFTER: Duration = Duration::from_millis(20);
/// How often it is sent again.
const RETRIES: u32 = 250;

/// Sends `request` and returns the number of the first frame in which it is seen.
///
/// # Errors
/// [`LauncherError::Refused`] with the simulator's reason; those of the control socket.
pub(crate) fn send(
    client: &mut ControlClient,
    channel: &ChannelName,
    request: &Request,
) -> Result<u64, LauncherError> {
    let refused = |code: String, message: String| LauncherError::Refused {
        what: title(request),
        channel: channel.to_string(),
        code,
        message,
    };
    for _ in 0..=RETRIES {
        match client.request(request, REPLY_LIMIT)? {
            Reply::Ok { frame } => return Ok(frame),
            Reply::Error { code, message } => return Err(refused(code, message)),
            Reply::Overloaded => std::thread::sleep(RETRY_AFTER),
            Reply::State { state } => {
                return Err(refused("unexpected-reply".into(), format!("the answer was {state}")));
            }
        }
    }
    Err(refused("overloaded".into(), "too many requests wait there; try again later".into()))
}
