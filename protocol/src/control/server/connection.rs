//! Turns one client's bytes into messages, and replies into bytes as fast as that client takes them.

use std::io::{ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;

use crate::control::message::{Reply, encode};
use crate::control::wire::{MAX_MESSAGE, Next, put_message, take_message};

/// Bytes of replies that may wait for a client; beyond, it is dropped.
const MAX_UNSENT: usize = 4 * MAX_MESSAGE;

/// One client.
pub(super) struct Connection {
    pub(super) stream: UnixStream,
    received: Vec<u8>,
    unsent: Vec<u8>,
    /// The versions have been exchanged.
    pub(super) greeted: bool,
    /// A request is with the simulator; the next one waits for its reply.
    pub(super) waiting: bool,
    /// To be closed once everything is sent.
    pub(super) ending: bool,
    /// The client sends no more; what it sent is still answered.
    hung_up: bool,
}

impl Connection {
    pub(super) fn new(stream: UnixStream) -> Self {
        Self {
            stream,
            received: Vec::new(),
            unsent: Vec::new(),
            greeted: false,
            waiting: false,
            ending: false,
            hung_up: false,
        }
    }

    /// Whether bytes wait to be sent.
    pub(super) fn has_unsent(&self) -> bool {
        !self.unsent.is_empty()
    }

    /// Whether more bytes should be taken from the client.
    pub(super) fn wants_input(&self) -> bool {
        !self.ending && !self.hung_up && self.received.len() < 4 + MAX_MESSAGE
    }

    /// Takes what the client sent.
    pub(super) fn receive(&mut self) {
        let mut part = [0; 4096];
        while self.wants_input() {
            match self.stream.read(&mut part) {
                Ok(0) => self.hung_up = true,
                Ok(count) => self.received.extend_from_slice(&part[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    self.hung_up = error.kind() != ErrorKind::WouldBlock;
                    return;
                }
            }
        }
    }

    /// The next whole message, unless an earlier one is unanswered.
    pub(super) fn next_message(&mut self) -> Option<Vec<u8>> {
        if self.waiting || self.ending {
            return None;
        }
        match take_message(&mut self.received) {
            Next::Message(message) => Some(message),
            Next::Incomplete => None,
            Next::TooLong(length) => {
                let message = format!("message of {length} bytes, expected at most {MAX_MESSAGE}");
                self.queue(&Reply::error("too-long", message));
                self.ending = true;
                None
            }
        }
    }

    /// Appends a reply to what waits to be sent.
    pub(super) fn queue(&mut self, reply: &Reply) {
        let fits = encode(reply).is_ok_and(|text| put_message(&mut self.unsent, &text));
        if !fits {
            let message = format!("the reply is longer than {MAX_MESSAGE} bytes");
            let text = encode(&Reply::error("reply-too-long", message)).unwrap_or_default();
            put_message(&mut self.unsent, &text);
        }
    }

    /// Sends what the client takes now; false once the connection is over.
    pub(super) fn send(&mut self) -> bool {
        while !self.unsent.is_empty() {
            match self.stream.write(&self.unsent) {
                Ok(0) => return false,
                Ok(count) => {
                    self.unsent.drain(..count);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    return self.unsent.len() <= MAX_UNSENT;
                }
                Err(_) => return false,
            }
        }
        !self.ending && (!self.hung_up || self.waiting)
    }
}
