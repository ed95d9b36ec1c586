//! Turns a channel's `control.sock` into connections that never block on connecting, and tells a closed one.

use std::io::ErrorKind;
use std::os::unix::net::UnixStream;
use std::path::Path;

use rustix::io::Errno;
use rustix::net::{AddressFamily, RecvFlags, SocketAddrUnix, SocketType, connect, recv, socket};

use crate::error::ProtocolError;

/// Name of the socket in the channel's folder.
pub(crate) const SOCKET: &str = "control.sock";

/// Connects at once or not at all: a stopped process with a full backlog must not hold a reader up.
pub(crate) fn connect_now(path: &Path) -> Result<UnixStream, ProtocolError> {
    let failed = |error: Errno| ProtocolError::io("connect to", path, error);
    let socket = socket(AddressFamily::UNIX, SocketType::STREAM, None).map_err(failed)?;
    let stream = UnixStream::from(socket);
    rustix::io::fcntl_setfd(&stream, rustix::io::FdFlags::CLOEXEC).map_err(failed)?;
    stream.set_nonblocking(true).map_err(|error| ProtocolError::io("connect to", path, error))?;
    connect(&stream, &SocketAddrUnix::new(path).map_err(failed)?).map_err(failed)?;
    Ok(stream)
}

/// A connection whose only purpose is that the system ends it with the simulator's process.
pub(crate) struct Lifeline {
    stream: Option<UnixStream>,
    /// The socket was there and nobody listened: its process has probably ended.
    refused: bool,
}

impl Lifeline {
    /// Connects, if there is something to connect to.
    pub(crate) fn connect(path: &Path) -> Self {
        match connect_now(path) {
            Ok(stream) => Self { stream: Some(stream), refused: false },
            Err(ProtocolError::Io { source, .. }) => {
                Self { stream: None, refused: source.kind() == ErrorKind::ConnectionRefused }
            }
            Err(_) => Self { stream: None, refused: false },
        }
    }

    /// Whether there is reason to ask if the process still runs: the other end closed, or nobody listened.
    pub(crate) fn is_cut(&self) -> bool {
        self.refused || self.stream.as_ref().is_some_and(is_closed)
    }

    /// Whether there is a connection, or was one.
    pub(crate) fn is_connected(&self) -> bool {
        self.stream.is_some()
    }
}

/// Whether the other end has closed; looks, and takes nothing.
pub(crate) fn is_closed(stream: &UnixStream) -> bool {
    let mut byte = [0u8; 1];
    match recv(stream, &mut byte, RecvFlags::PEEK | RecvFlags::DONTWAIT) {
        Ok((_, count)) => count == 0,
        Err(error) => {
            let kind = std::io::Error::from(error).kind();
            !matches!(kind, ErrorKind::WouldBlock | ErrorKind::Interrupted)
        }
    }
}
