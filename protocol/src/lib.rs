//! Bytes between processes: virtual surface lights over shared memory, and a control socket.
