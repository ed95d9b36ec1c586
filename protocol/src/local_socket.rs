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
