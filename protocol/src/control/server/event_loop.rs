//! Turns readiness of sockets into accepted clients, queued requests and sent replies.

use std::collections::BTreeMap;
use std::io::Read;
use std::os::unix::net::{UnixListener, UnixStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::connection::Connection;
use super::{Incoming, Replier, Waker};
use crate::control::message::{Reply, Request};
use crate::layout::{ABI_MAJOR, ABI_MINOR};

/// Clients at once; further ones are told `Overloaded` and closed.
const MAX_CONNECTIONS: usize = 1024;
/// Wait after the system refused a new connection (too many open files).
const ACCEPT_AGAIN: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

pub(super) struct EventLoop {
    pub(super) listener: UnixListener,
    pub(super) wakened: UnixStream,
    pub(super) inbox: flume::Sender<Incoming>,
    pub(super) outbox: flume::Sender<(u64, Reply)>,
    pub(super) replies: flume::Receiver<(u64, Reply)>,
    pub(super) waker: Waker,
    pub(super) stop: Arc<AtomicBool>,
    pub(super) frame: Arc<AtomicU64>,
    pub(super) connections: BTreeMap<u64, Connection>,
    pub(super) next_connection: u64,
}

impl EventLoop {
    pub(super) fn run(mut self) {
        let mut refused = false;
        while !self.stop.load(Ordering::Relaxed) {
            let ready = self.wait(refused);
            refused = false;
            let mut bytes = [0; 256];
            // Only its arrival matters.
            while self.wakened.read(&mut bytes).is_ok_and(|count| count == bytes.len()) {}
            if ready.listener {
                refused = !self.accept();
            }
            for id in ready.connections {
                if let Some(connection) = self.connections.get_mut(&id) {
                    connection.receive();
                }
            }
            self.take_replies();
            let ids: Vec<u64> = self.connections.keys().copied().collect();
            for id in ids {
                self.serve(id);
            }
        }
        // Who asked for the end is told that it comes, if there is room for it in the socket.
        self.take_replies();
        for connection in self.connections.values_mut() {
            connection.send();
        }
    }

    /// Hands the replies that were given to their connections.
    fn take_replies(&mut self) {
        while let Ok((id, reply)) = self.replies.try_recv() {
            if let Some(connection) = self.connections.get_mut(&id) {
                connection.waiting = false;
                connection.queue(&reply);
            }
        }
    }

    /// Sleeps until a socket is ready or somebody wakes the loop.
    fn wait(&self, refused: bool) -> Ready {
        let listening = if refused { PollFlags::empty() } else { PollFlags::IN };
        let mut fds = vec![
            PollFd::new(&self.wakened, PollFlags::IN),
            PollFd::from_borrowed_fd(std::os::fd::AsFd::as_fd(&self.listener), listening),
        ];
        let mut polled = Vec::with_capacity(self.connections.len());
        for (id, connection) in &self.connections {
            let mut flags = PollFlags::empty();
            flags.set(PollFlags::IN, connection.wants_input());
            flags.set(PollFlags::OUT, connection.has_unsent());
            // A client that hung up would be reported without end, while its last request is still being answered.
            if !flags.is_empty() {
                fds.push(PollFd::new(&connection.stream, flags));
                polled.push(*id);
            }
        }
        if poll(&mut fds, refused.then_some(&ACCEPT_AGAIN)).is_err() {
            // Interrupted: nothing is known to be ready.
            return Ready { listener: false, connections: Vec::new() };
        }
        let is_ready =
            |fd: &PollFd<'_>| fd.revents().intersects(PollFlags::IN | PollFlags::HUP | PollFlags::ERR);
        let ready = polled.iter().zip(&fds[2..]).filter(|(_, fd)| is_ready(fd));
        Ready { listener: is_ready(&fds[1]), connections: ready.map(|(id, _)| *id).collect() }
    }

    /// Accepts who waits; false where the system has no room for more.
    fn accept(&mut self) -> bool {
        loop {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) => {
                    return matches!(
                        error.kind(),
                        std::io::ErrorKind::WouldBlock
                            | std::io::ErrorKind::Interrupted
                            | std::io::ErrorKind::ConnectionAborted
                    );
                }
            };
            if !is_same_user(&stream) || stream.set_nonblocking(true).is_err() {
                continue;
            }
            let mut connection = Connection::new(stream);
            if self.connections.len() >= MAX_CONNECTIONS {
                connection.queue(&Reply::Overloaded);
                connection.send();
                continue;
            }
            self.connections.insert(self.next_connection, connection);
            self.next_connection += 1;
        }
    }

    /// Hands on the messages of a client and sends what waits for it.
    fn serve(&mut self, id: u64) {
        let Some(connection) = self.connections.get_mut(&id) else { return };
        while let Some(message) = connection.next_message() {
            match Request::parse(&message) {
                Err(reply) => connection.queue(&reply),
                Ok(Request::Hello { abi }) if abi == ABI_MAJOR => {
                    connection.greeted = true;
                    connection.queue(&Reply::Ok { frame: self.frame.load(Ordering::Relaxed) });
                }
                Ok(Request::Hello { abi }) => {
                    let message =
                        format!("ABI {abi} asked for, {ABI_MAJOR}.{ABI_MINOR} spoken; use one release");
                    connection.queue(&Reply::error("abi-mismatch", message));
                    connection.ending = true;
                }
                Ok(_) if !connection.greeted => {
                    let message = format!("send {{\"type\":\"hello\",\"abi\":{ABI_MAJOR}}} first");
                    connection.queue(&Reply::error("no-hello", message));
                }
                Ok(request) => {
                    let (outbox, waker) = (self.outbox.clone(), self.waker.clone());
                    let replier = Replier { connection: id, outbox, waker, answered: false };
                    match self.inbox.try_send(Incoming { request, replier }) {
                        Ok(()) => connection.waiting = true,
                        Err(error) => {
                            let mut incoming = error.into_inner();
                            incoming.replier.answered = true;
                            connection.queue(&Reply::Overloaded);
                        }
                    }
                }
            }
        }
        if !connection.send() {
            self.connections.remove(&id);
        }
    }
}

struct Ready {
    listener: bool,
    connections: Vec<u64>,
}

/// Whether the other end belongs to our user (where the system tells; the folder is private in any case).
fn is_same_user(stream: &UnixStream) -> bool {
    #[cfg(target_os = "linux")]
    {
        rustix::net::sockopt::socket_peercred(stream).is_ok_and(|peer| peer.uid == rustix::process::geteuid())
    }
    #[cfg(not(target_os = "linux"))]
    {
        let _ = stream;
        true
    }
}
