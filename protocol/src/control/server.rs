//! Turns connections to `control.sock` into a bounded queue of requests, from one thread that never blocks on a client.

use std::collections::BTreeMap;
use std::fs::symlink_metadata;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use crate::control::message::{Reply, Request};
use crate::error::ProtocolError;
use crate::local_socket::SOCKET;
use crate::publisher::Publisher;

mod connection;
mod event_loop;

/// Requests that may wait for the simulator.
const QUEUE: usize = 64;

/// A request and the way to answer it.
#[derive(Debug)]
pub struct Incoming {
    /// What is asked for; `Hello` is answered by the server and never arrives here.
    pub request: Request,
    /// Where the answer goes.
    pub replier: Replier,
}

/// Answers one request; dropped unused it answers with an error.
#[derive(Debug)]
pub struct Replier {
    connection: u64,
    outbox: flume::Sender<(u64, Reply)>,
    waker: Waker,
    answered: bool,
}

impl Replier {
    /// Sends the reply; never blocks on the client.
    pub fn reply(mut self, reply: Reply) {
        self.send(reply);
    }

    fn send(&mut self, reply: Reply) {
        self.answered = true;
        // A server that has ended has no connection left to answer.
        let _ = self.outbox.send((self.connection, reply));
        self.waker.wake();
    }
}

impl Drop for Replier {
    fn drop(&mut self) {
        if !self.answered {
            self.send(Reply::error("unanswered", "the simulator dropped the request"));
        }
    }
}

/// Makes the server's thread look at its queues.
#[derive(Debug, Clone)]
struct Waker(Arc<UnixStream>);

impl Waker {
    fn wake(&self) {
        // A full pipe wakes just as well.
        let _ = (&*self.0).write(&[1]);
    }
}

/// The simulator's end of the control socket.
#[derive(Debug)]
pub struct ControlServer {
    requests: flume::Receiver<Incoming>,
    stop: Arc<AtomicBool>,
    waker: Waker,
    thread: Option<JoinHandle<()>>,
    path: PathBuf,
    socket_id: (u64, u64),
}

impl ControlServer {
    /// Listens on the publisher's channel. Clients of other users are turned away.
    ///
    /// # Errors
    /// `Io` where the socket cannot be made (a path beyond about 100 bytes, for one).
    pub fn start(publisher: &Publisher) -> Result<Self, ProtocolError> {
        let dir = publisher.dir();
        let path = dir.file(SOCKET);
        let failed = |action| {
            let path = path.clone();
            move |error: std::io::Error| ProtocolError::io(action, path, error)
        };
        // The channel is ours: what lies here was left by a crash.
        dir.remove(SOCKET)?;
        let listener = UnixListener::bind(&path).map_err(failed("listen on"))?;
        let private = std::os::unix::fs::PermissionsExt::from_mode(0o600);
        std::fs::set_permissions(&path, private).map_err(failed("make private"))?;
        let socket_id = symlink_metadata(&path).map(|m| (m.dev(), m.ino())).map_err(failed("look at"))?;
        listener.set_nonblocking(true).map_err(failed("prepare"))?;
        let (waker, wakened) = UnixStream::pair().map_err(failed("make a waker for"))?;
        waker.set_nonblocking(true).map_err(failed("prepare"))?;
        wakened.set_nonblocking(true).map_err(failed("prepare"))?;
        let waker = Waker(Arc::new(waker));
        let (inbox, requests) = flume::bounded(QUEUE);
        let (outbox, replies) = flume::unbounded();
        let stop = Arc::new(AtomicBool::new(false));
        let event_loop = event_loop::EventLoop {
            listener,
            wakened,
            inbox,
            outbox,
            replies,
            waker: waker.clone(),
            stop: Arc::clone(&stop),
            frame: publisher.frame_counter(),
            connections: BTreeMap::new(),
            next_connection: 0,
        };
        let thread = std::thread::Builder::new().name("control".to_owned());
        let thread = thread.spawn(move || event_loop.run()).map_err(failed("start the thread of"))?;
        Ok(Self { requests, stop, waker, thread: Some(thread), path, socket_id })
    }

    /// The requests, in order of arrival; bounded, clients beyond the bound are told `Overloaded`.
    pub fn requests(&self) -> &flume::Receiver<Incoming> {
        &self.requests
    }
}

impl Drop for ControlServer {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.waker.wake();
        if let Some(thread) = self.thread.take() {
            // A panic of that thread has been printed already.
            let _ = thread.join();
        }
        if symlink_metadata(&self.path).is_ok_and(|m| (m.dev(), m.ino()) == self.socket_id) {
            // What cannot be removed now is removed by the next publisher.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}
