//! Turns a request into bytes on the control socket, and waits for its one reply.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use crate::control::message::{Reply, Request, encode};
use crate::control::wire::{MAX_MESSAGE, Next, put_message, take_message};
use crate::error::ProtocolError;
use crate::layout::ABI_MAJOR;
use crate::local_socket::{SOCKET, connect_now, is_closed};
use crate::runtime::{ChannelName, Runtime};

/// How long the greeting may take.
const HELLO_LIMIT: Duration = Duration::from_secs(2);

/// A connection to a channel's simulator.
#[derive(Debug)]
pub struct ControlClient {
    channel: ChannelName,
    stream: UnixStream,
    buffer: Vec<u8>,
    /// A request timed out: its late reply must not be taken for that of another one.
    broken: bool,
}

impl ControlClient {
    /// Connects to a channel of the environment's runtime folder and exchanges versions.
    ///
    /// # Errors
    /// `NotCreated` where no simulator listens, `Control` where it speaks another ABI, `TimedOut` where it is stopped.
    pub fn connect(channel: &ChannelName) -> Result<Self, ProtocolError> {
        Self::connect_in(&Runtime::from_env(), channel)
    }

    /// The same, in a runtime folder of the caller's choice.
    ///
    /// # Errors
    /// As `connect`.
    pub fn connect_in(runtime: &Runtime, channel: &ChannelName) -> Result<Self, ProtocolError> {
        let dir = runtime.open_channel(channel)?;
        let stream = connect_now(&dir.file(SOCKET)).map_err(|error| match error {
            ProtocolError::Io { source, .. }
                if matches!(source.kind(), ErrorKind::NotFound | ErrorKind::ConnectionRefused) =>
            {
                dir.not_created(SOCKET)
            }
            other => other,
        })?;
        let prepared = stream.set_nonblocking(false);
        prepared.map_err(|error| ProtocolError::io("prepare", dir.file(SOCKET), error))?;
        let mut client = Self { channel: channel.clone(), stream, buffer: Vec::new(), broken: false };
        match client.request(&Request::Hello { abi: ABI_MAJOR }, HELLO_LIMIT)? {
            Reply::Ok { .. } => Ok(client),
            Reply::Error { code, message } => {
                Err(ProtocolError::Control { message: format!("greeting refused ({code}): {message}") })
            }
            Reply::Overloaded => Err(ProtocolError::Control {
                message: "the simulator has too many connections; try again later".to_owned(),
            }),
            other @ Reply::State { .. } => Err(ProtocolError::Control {
                message: format!("greeting answered by {other:?}, expected ok"),
            }),
        }
    }

    /// Sends a request and waits for its reply.
    ///
    /// # Errors
    /// `PublisherGone` when the simulator ends meanwhile, `TimedOut`, `Control` for a request that is too long or a reply
    /// that makes no sense. After `TimedOut` the connection refuses further requests: connect again.
    pub fn request(&mut self, request: &Request, timeout: Duration) -> Result<Reply, ProtocolError> {
        if self.broken {
            let message = "an earlier request on this connection timed out; connect again".to_owned();
            return Err(ProtocolError::Control { message });
        }
        let start = Instant::now();
        let mut bytes = Vec::new();
        let text = encode(request)?;
        if !put_message(&mut bytes, &text) {
            let message = format!("request of {} bytes, expected at most {MAX_MESSAGE}", text.len());
            return Err(ProtocolError::Control { message });
        }
        self.broken = true;
        let reply = self.exchange(&bytes, start, timeout);
        self.broken = reply.is_err();
        let reply = reply?;
        serde_json::from_slice(&reply)
            .map_err(|error| ProtocolError::Control { message: format!("reply not understood: {error}") })
    }

    /// Whether the simulator still holds its end of the connection.
    pub fn is_alive(&self) -> bool {
        !is_closed(&self.stream)
    }

    /// Waits until the simulator closes the connection; false after `timeout`.
    pub fn wait_closed(&self, timeout: Duration) -> bool {
        let start = Instant::now();
        while !is_closed(&self.stream) {
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return false;
            }
            use rustix::event::{PollFd, PollFlags, Timespec, poll};
            let mut fds = [PollFd::new(&self.stream, PollFlags::IN)];
            let left = Timespec { tv_sec: left.as_secs() as i64, tv_nsec: i64::from(left.subsec_nanos()) };
            // An interrupted poll looks again.
            let _ = poll(&mut fds, Some(&left));
        }
        true
    }

    fn exchange(
        &mut self,
        bytes: &[u8],
        start: Instant,
        timeout: Duration,
    ) -> Result<Vec<u8>, ProtocolError> {
        let timed_out = |channel: &ChannelName| ProtocolError::TimedOut {
            what: format!("reply of channel '{channel}'"),
            milliseconds: timeout.as_millis(),
        };
        let left = |channel: &ChannelName| {
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() { Err(timed_out(channel)) } else { Ok(left) }
        };
        let failed = |channel: &ChannelName, error: std::io::Error| match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => timed_out(channel),
            ErrorKind::BrokenPipe | ErrorKind::ConnectionReset | ErrorKind::UnexpectedEof => {
                ProtocolError::PublisherGone { channel: channel.to_string() }
            }
            _ => ProtocolError::io("talk to", SOCKET, error),
        };
        let channel = &self.channel;
        self.stream
            .set_write_timeout(Some(left(channel)?))
            .and_then(|()| self.stream.write_all(bytes))
            .map_err(|error| failed(channel, error))?;
        loop {
            match take_message(&mut self.buffer) {
                Next::Message(message) => return Ok(message),
                Next::TooLong(length) => {
                    let message = format!("reply of {length} bytes, expected at most {MAX_MESSAGE}");
                    return Err(ProtocolError::Control { message });
                }
                Next::Incomplete => {}
            }
            let mut part = [0; 4096];
            let read =
                self.stream.set_read_timeout(Some(left(channel)?)).and_then(|()| self.stream.read(&mut part));
            match read {
                Ok(0) => return Err(ProtocolError::PublisherGone { channel: channel.to_string() }),
                Ok(count) => self.buffer.extend_from_slice(&part[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(failed(channel, error)),
            }
        }
    }
}
