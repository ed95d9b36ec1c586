//! Turns requests into replies over the control socket, for friendly, slow, rude and absent clients.
#![allow(clippy::unwrap_used)]

mod support;

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use photonstream_protocol::{
    ABI_MAJOR, ChannelName, ControlClient, ControlServer, Incoming, ProtocolError, Publisher, Reply, Request,
    Runtime,
};
use support::{Content, spec};

const LIMIT: Duration = Duration::from_secs(60);

struct Simulator {
    root: tempfile::TempDir,
    runtime: Runtime,
    channel: ChannelName,
    publisher: Publisher,
    server: ControlServer,
}

fn start() -> Simulator {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let mut publisher = Publisher::create_in(&runtime, &channel, &spec(10)).unwrap();
    publisher.publish(&Content::new(10, 1).source(false)).unwrap();
    let server = ControlServer::start(&publisher).unwrap();
    Simulator { root, runtime, channel, publisher, server }
}

fn message(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
    bytes.extend_from_slice(text.as_bytes());
    bytes
}

fn reply(stream: &mut UnixStream) -> Reply {
    let mut length = [0; 4];
    stream.read_exact(&mut length).unwrap();
    let mut text = vec![0; u32::from_le_bytes(length) as usize];
    stream.read_exact(&mut text).unwrap();
    serde_json::from_slice(&text).unwrap()
}

/// Each request arrives as it was sent and gets the reply that was given; 200 in a row on one connection.
#[test]
fn requests_are_answered_in_order() {
    let simulator = start();
    let requests = simulator.server.requests().clone();
    let handler = std::thread::spawn(move || {
        while let Ok(Incoming { request, replier }) = requests.recv() {
            match request {
                Request::SetLight { name, .. } => replier.reply(Reply::Ok { frame: name.parse().unwrap() }),
                Request::Query => {
                    replier.reply(Reply::State { state: serde_json::json!({"paths_per_s": 1.5}) })
                }
                Request::Reload => drop(replier),
                Request::Step => replier.reply(Reply::State { state: "x".repeat(300_000).into() }),
                Request::Shutdown => {
                    replier.reply(Reply::Ok { frame: 0 });
                    break;
                }
                _ => replier.reply(Reply::error("refused", "not here")),
            }
        }
    });
    let mut client = ControlClient::connect_in(&simulator.runtime, &simulator.channel).unwrap();
    for frame in 0..200 {
        let request = Request::SetLight { name: frame.to_string(), values: Default::default() };
        assert_eq!(client.request(&request, LIMIT).unwrap(), Reply::Ok { frame });
    }
    let state = serde_json::json!({"paths_per_s": 1.5});
    assert_eq!(client.request(&Request::Query, LIMIT).unwrap(), Reply::State { state });
    for (request, expected) in
        [(Request::Reload, "unanswered"), (Request::Pause, "refused"), (Request::Step, "reply-too-long")]
    {
        let answer = client.request(&request, LIMIT).unwrap();
        assert!(matches!(&answer, Reply::Error { code, .. } if code == expected), "{expected}");
    }
    let long = Request::SetLight { name: "x".repeat(300_000), values: Default::default() };
    assert!(matches!(client.request(&long, LIMIT), Err(ProtocolError::Control { .. })));
    assert_eq!(client.request(&Request::Shutdown, LIMIT).unwrap(), Reply::Ok { frame: 0 });
    handler.join().unwrap();
    assert!(client.is_alive());
    drop(simulator.server);
    assert!(client.wait_closed(LIMIT) && !client.is_alive());
    assert!(matches!(client.request(&Request::Pause, LIMIT), Err(ProtocolError::PublisherGone { .. })));
    assert!(matches!(
        ControlClient::connect_in(&simulator.runtime, &simulator.channel),
        Err(ProtocolError::NotCreated { .. })
    ));
}

/// Raw bytes: split greetings, no greeting, another ABI, unknown types, no JSON, a length beyond the limit.
#[test]
fn rude_clients_get_typed_errors() {
    let simulator = start();
    let path = simulator.root.path().join("default/control.sock");
    let connect = || UnixStream::connect(&path).unwrap();
    let mut stream = connect();
    for byte in message(&format!(r#"{{"type":"hello","abi":{ABI_MAJOR}}}"#)) {
        stream.write_all(&[byte]).unwrap();
    }
    assert_eq!(reply(&mut stream), Reply::Ok { frame: simulator.publisher.frame() });
    for (text, expected) in
        [(r#"{"type":"explode"}"#, "unknown-request"), ("{", "malformed"), ("", "malformed")]
    {
        stream.write_all(&message(text)).unwrap();
        assert!(matches!(reply(&mut stream), Reply::Error { code, .. } if code == expected), "{text}");
    }
    let mut stream = connect();
    stream.write_all(&message(r#"{"type":"pause"}"#)).unwrap();
    assert!(matches!(reply(&mut stream), Reply::Error { code, .. } if code == "no-hello"));
    let mut stream = connect();
    stream.write_all(&message(r#"{"type":"hello","abi":9}"#)).unwrap();
    assert!(matches!(reply(&mut stream), Reply::Error { code, .. } if code == "abi-mismatch"));
    assert_eq!(stream.read(&mut [0]).unwrap(), 0);
    let mut stream = connect();
    stream.write_all(&u32::MAX.to_le_bytes()).unwrap();
    assert!(matches!(reply(&mut stream), Reply::Error { code, .. } if code == "too-long"));
    assert_eq!(stream.read(&mut [0]).unwrap(), 0);
    // A client that hangs up without waiting is still heard.
    let mut stream = connect();
    stream.write_all(&message(&format!(r#"{{"type":"hello","abi":{ABI_MAJOR}}}"#))).unwrap();
    stream.write_all(&message(r#"{"type":"resume"}"#)).unwrap();
    drop(stream);
    assert_eq!(simulator.server.requests().recv_timeout(LIMIT).unwrap().request, Request::Resume);
}

/// Nobody takes the requests: the queue holds 64, the 65th client is told at once; a late reply reaches nobody else.
#[test]
fn a_full_queue_says_so() {
    let simulator = start();
    let connect = || ControlClient::connect_in(&simulator.runtime, &simulator.channel).unwrap();
    let mut waiting: Vec<_> = (0..64).map(|_| connect()).collect();
    for client in &mut waiting {
        let answer = client.request(&Request::Pause, Duration::from_millis(5));
        assert!(matches!(answer, Err(ProtocolError::TimedOut { .. })), "{answer:?}");
    }
    // Those 64 may still be on their way to the queue.
    while simulator.server.requests().len() < 64 {
        std::thread::yield_now();
    }
    assert_eq!(connect().request(&Request::Pause, LIMIT).unwrap(), Reply::Overloaded);
    for Incoming { replier, .. } in simulator.server.requests().try_iter() {
        replier.reply(Reply::Ok { frame: 7 });
    }
    let answer = waiting[0].request(&Request::Query, LIMIT);
    assert!(
        matches!(answer, Err(ProtocolError::Control { .. })),
        "a late reply is not taken for another: {answer:?}"
    );
}

/// 50 simulators that end right after their last reply: each client gets it.
#[test]
fn the_last_reply_arrives_before_the_end() {
    for _ in 0..50 {
        let simulator = start();
        let mut client = ControlClient::connect_in(&simulator.runtime, &simulator.channel).unwrap();
        let asking = std::thread::spawn(move || client.request(&Request::Shutdown, LIMIT));
        let Incoming { replier, .. } = simulator.server.requests().recv_timeout(LIMIT).unwrap();
        replier.reply(Reply::Ok { frame: 7 });
        drop(simulator);
        assert_eq!(asking.join().unwrap().unwrap(), Reply::Ok { frame: 7 });
    }
}
