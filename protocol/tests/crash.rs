//! Turns a thousand kills at random moments into proof: no torn frame, no lost channel, at most one leftover segment.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod support;

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use photonstream_protocol::{
    AccessMode, ChannelName, ControlClient, ControlServer, Liveness, ProtocolError, Publisher, Reading,
    Runtime, Subscriber, channels_in, clean_in,
};
use rustix::process::{Pid, Signal, kill_process};
use support::{ChildGuard, Content, Random, check, child_root, spec};

/// Lights in the crash tests: about 260 KB a frame, so that most kills hit a frame half written.
const VSLS: usize = 4000;

/// Child: publishes without pause until it is killed.
#[test]
fn child_publishes() {
    let Some(root) = child_root() else { return };
    let channel = ChannelName::default();
    let mut publisher = Publisher::create_in(&Runtime::at(root), &channel, &spec(VSLS as u32)).unwrap();
    let _server = ControlServer::start(&publisher).unwrap();
    let mut content = Content::default();
    for frame in 1.. {
        content.advance(VSLS, frame);
        publisher.publish(&content.source(true)).unwrap();
        if frame == 4 {
            println!("publishing");
        }
    }
}

/// Child: reads and checks without pause until it is killed.
#[test]
fn child_reads() {
    let Some(root) = child_root() else { return };
    let runtime = Runtime::at(root);
    let wait = Duration::from_secs(60);
    let mut reader =
        Subscriber::attach_wait_in(&runtime, &ChannelName::default(), AccessMode::Mapped, wait, &|| false)
            .unwrap();
    println!("reading");
    loop {
        if reader.read().unwrap() == Reading::New {
            check(reader.frame().unwrap());
        }
    }
}

/// Child: takes the channel if it can and says so, then holds it.
#[test]
fn child_races() {
    let Some(root) = child_root() else { return };
    match Publisher::create_in(&Runtime::at(root), &ChannelName::default(), &spec(10)) {
        Ok(_publisher) => {
            println!("owner");
            std::thread::sleep(Duration::from_secs(60));
        }
        Err(ProtocolError::ChannelBusy { .. }) => println!("busy"),
        Err(error) => panic!("{error}"),
    }
}

/// Segments that a channel's files name and that exist.
fn leftovers(root: &Path) -> usize {
    let mut names = std::fs::read_to_string(root.join("default/journal")).unwrap_or_default();
    names.push('\n');
    let current = std::fs::read_to_string(root.join("default/current")).unwrap_or_default();
    names.extend(
        current.lines().find_map(|line| line.strip_prefix("segment = ")).map(|name| name.replace('"', "")),
    );
    let names: std::collections::BTreeSet<&str> = names.lines().filter(|name| !name.is_empty()).collect();
    names.iter().filter(|name| Path::new("/dev/shm").join(&name[1..]).exists()).count()
}

/// Reads until the outcome is no longer `Busy`: one call may run out of its 2 ms on a busy machine.
fn settled(reader: &mut Subscriber) -> Reading {
    loop {
        match reader.read().unwrap() {
            Reading::Busy => {}
            other => return other,
        }
    }
}

/// Reads the frame that must be there.
fn read(reader: &mut Subscriber) {
    assert_eq!(settled(reader), Reading::New);
}

/// Ends the other threads of a scope when this one fails, so that the failure is reported.
struct StopOnDrop<'a>(&'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

fn open_files(child: &ChildGuard) -> usize {
    std::fs::read_dir(format!("/proc/{}/fd", child.0.id())).unwrap().count()
}

/// 500 writers killed 0 to 6 ms after their first frames, two steady readers; seed 1.
///
/// After each kill the last frame is whole for a new reader, at most one segment is left, and the next writer starts.
fn kill_writers(root: &Path, kills: usize) {
    let stop = AtomicBool::new(false);
    let runtime = Runtime::at(root);
    let channel = ChannelName::default();
    std::thread::scope(|scope| {
        let _end = StopOnDrop(&stop);
        let mut random = Random(1);
        let mut first = ChildGuard::spawn("child_publishes", root);
        first.wait_for(&["publishing"]);
        let steady: Vec<_> = [AccessMode::Mapped, AccessMode::Strict]
            .into_iter()
            .map(|mode| {
                let mut reader = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
                let stop = &stop;
                scope.spawn(move || {
                    let (mut frames, mut epochs, mut last) = (0, 0, (0, 0));
                    while !stop.load(Ordering::Relaxed) {
                        if reader.read().unwrap() == Reading::New {
                            let frame = reader.frame().unwrap();
                            check(frame);
                            assert!((frame.epoch, frame.frame) > last, "frames go forward");
                            epochs += usize::from(frame.epoch != last.0);
                            last = (frame.epoch, frame.frame);
                            frames += 1;
                        }
                        std::thread::sleep(Duration::from_micros(300));
                    }
                    (frames, epochs)
                })
            })
            .collect();
        let mut writer = Some(first);
        for kill in 0..kills {
            let mut child = writer.take().unwrap_or_else(|| {
                let mut child = ChildGuard::spawn("child_publishes", root);
                // Every fourth is killed at any moment of its start.
                if kill % 4 != 0 {
                    child.wait_for(&["publishing"]);
                }
                child
            });
            std::thread::sleep(Duration::from_micros(random.below(6000)));
            child.kill();
            assert!(leftovers(root) <= 1, "kill {kill}");
            match Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped) {
                Ok(mut reader) => {
                    let reading = settled(&mut reader);
                    if reading == Reading::New {
                        check(reader.frame().unwrap());
                    } else {
                        assert!(
                            reading == Reading::Empty && kill % 4 == 0,
                            "a writer that had published left no frame"
                        );
                    }
                    // Before its control socket existed, only the age of the heartbeat tells.
                    assert!(kill % 4 == 0 || matches!(reader.liveness(), Liveness::Gone { .. }));
                }
                Err(ProtocolError::NotCreated { .. }) => assert_eq!(kill % 4, 0),
                Err(error) => panic!("kill {kill}: {error}"),
            }
        }
        stop.store(true, Ordering::Relaxed);
        for reader in steady {
            let (frames, epochs) = reader.join().unwrap();
            assert!(frames > 0 && epochs > 1, "steady readers followed: {frames} frames of {epochs} runs");
        }
    });
}

/// 560 readers killed 0 to 4 ms after they attached, under a writer that goes on; seed 2.
fn kill_readers(root: &Path, kills: usize) {
    let mut writer = ChildGuard::spawn("child_publishes", root);
    writer.wait_for(&["publishing"]);
    let files = open_files(&writer);
    let mut random = Random(2);
    for _ in 0..kills / 4 {
        let mut children: Vec<_> = (0..4).map(|_| ChildGuard::spawn("child_reads", root)).collect();
        for child in &mut children {
            child.wait_for(&["reading"]);
            std::thread::sleep(Duration::from_micros(random.below(4000)));
            assert!(child.0.try_wait().unwrap().is_none(), "a reader found a bad frame");
            child.kill();
        }
    }
    // The server closes the connections of the dead.
    while open_files(&writer) > files {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(writer.0.try_wait().unwrap().is_none(), "the writer goes on");
}

#[test]
fn writers_survive_500_kills() {
    let root = tempfile::tempdir().unwrap();
    kill_writers(root.path(), 500);
    let listed = channels_in(&Runtime::at(root.path())).unwrap();
    assert!(listed.iter().all(|channel| !channel.alive));
    let cleaned = clean_in(&Runtime::at(root.path())).unwrap();
    assert!(cleaned.len() == 1 && cleaned[0].segments.len() <= 1 && cleaned[0].folder.is_some());
    assert_eq!(leftovers(root.path()), 0);
}

#[test]
fn readers_survive_560_kills() {
    let root = tempfile::tempdir().unwrap();
    kill_readers(root.path(), 560);
    assert_eq!(leftovers(root.path()), 1);
    clean_in(&Runtime::at(root.path())).unwrap();
    assert_eq!(leftovers(root.path()), 0);
}

/// Death is seen through the socket's end, stopping through the heartbeat, and a reader can still attach to the dead.
#[test]
fn a_stopped_and_then_killed_writer_is_told_apart() {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let mut child = ChildGuard::spawn("child_publishes", root.path());
    child.wait_for(&["publishing"]);
    let pid = Pid::from_child(&child.0);
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    read(&mut reader);
    assert_eq!(reader.liveness(), Liveness::Live);
    let mut control = ControlClient::connect_in(&runtime, &channel).unwrap();
    kill_process(pid, Signal::STOP).unwrap();
    while !matches!(reader.liveness(), Liveness::Stalled { .. }) {
        let _ = reader.wait(Duration::from_millis(20));
        let _ = reader.read().unwrap();
    }
    // Attaching, reading and the control channel do not hang on it.
    let mut late = Subscriber::attach_in(&runtime, &channel, AccessMode::Strict).unwrap();
    read(&mut late);
    let answer = control.request(&photonstream_protocol::Request::Pause, Duration::from_millis(50));
    assert!(matches!(answer, Err(ProtocolError::TimedOut { .. })), "{answer:?}");
    let busy = Publisher::create_in(&runtime, &channel, &spec(10)).expect_err("it still owns the channel");
    assert!(
        matches!(busy, ProtocolError::ChannelBusy { pid: Some(found), .. } if found == child.0.id()),
        "{busy}"
    );
    assert!(clean_in(&runtime).unwrap().is_empty(), "a stopped simulator is not cleaned away");
    kill_process(pid, Signal::CONT).unwrap();
    while reader.liveness() != Liveness::Live {
        let _ = reader.read().unwrap();
    }
    child.kill();
    assert!(control.wait_closed(Duration::from_secs(60)) && !control.is_alive());
    assert!(matches!(reader.liveness(), Liveness::Gone { .. }));
    let last = reader.frame().unwrap().frame;
    let mut late = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    read(&mut late);
    check(late.frame().unwrap());
    assert!(late.frame().unwrap().frame >= last);
    assert!(matches!(late.liveness(), Liveness::Gone { .. }));
    assert_eq!(clean_in(&runtime).unwrap()[0].segments.len(), 1);
}

/// 40 rounds of four processes that start at once: exactly one owns the channel, none fails otherwise.
#[test]
fn one_of_several_writers_wins() {
    let root = tempfile::tempdir().unwrap();
    for round in 0..40 {
        let mut children: Vec<_> = (0..4).map(|_| ChildGuard::spawn("child_races", root.path())).collect();
        let mut owners = 0;
        for child in &mut children {
            let word = child.wait_for(&["owner", "busy"]);
            owners += usize::from(word.contains("owner"));
        }
        assert_eq!(owners, 1, "round {round}");
    }
    clean_in(&Runtime::at(root.path())).unwrap();
}

/// 1 000 restarts in one process, each with a reader: at most one segment at any time, as many open files as before.
#[test]
fn a_thousand_restarts_leave_nothing() {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let mut epochs = 0;
    for restart in 0..1000 {
        let mut publisher = Publisher::create_in(&runtime, &channel, &spec(10)).unwrap();
        assert!(publisher.epoch() > epochs);
        epochs = publisher.epoch();
        let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
        publisher.publish(&Content::new(10, 1).source(false)).unwrap();
        read(&mut reader);
        assert_eq!(leftovers(root.path()), 1, "restart {restart}");
    }
    assert_eq!(leftovers(root.path()), 0);
    // Other tests of this process hold files too, so the count is taken of this folder and of shared memory only.
    let held =
        std::fs::read_dir("/proc/self/fd").unwrap().filter_map(|fd| std::fs::read_link(fd.ok()?.path()).ok());
    assert_eq!(held.filter(|path| path.starts_with(root.path())).count(), 0);
}

/// Names removed under a live run (a logout does that): readers go on, and the publisher makes itself findable again.
#[test]
fn removed_names_are_made_again() {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let mut publisher = Publisher::create_in(&runtime, &channel, &spec(100)).unwrap();
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let mut frame = 0;
    for whole_folder in [false, true] {
        if whole_folder {
            std::fs::remove_dir_all(root.path().join("default")).unwrap();
        } else {
            let current = std::fs::read_to_string(root.path().join("default/current")).unwrap();
            let name = current.split("/").nth(1).unwrap().split('"').next().unwrap().to_owned();
            std::fs::remove_file(Path::new("/dev/shm").join(name)).unwrap();
        }
        assert!(matches!(
            Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped),
            Err(ProtocolError::NotCreated { .. })
        ));
        let start = Instant::now();
        loop {
            frame += 1;
            publisher.publish(&Content::new(100, frame).source(false)).unwrap();
            while reader.read().unwrap() == Reading::Busy {}
            if let Ok(mut late) = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped) {
                read(&mut late);
                break;
            }
            assert!(start.elapsed() < Duration::from_secs(60), "watchdog: never made again");
            std::thread::sleep(Duration::from_millis(20));
        }
        while reader.frame().map(|found| found.frame) != Some(frame) {
            let _ = reader.read().unwrap();
        }
    }
}

/// 2 000 readers attach, read and go, 200 of them at once.
#[test]
fn thousands_of_readers_come_and_go() {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let mut publisher = Publisher::create_in(&runtime, &channel, &spec(100)).unwrap();
    let _server = ControlServer::start(&publisher).unwrap();
    publisher.publish(&Content::new(100, 1).source(false)).unwrap();
    for _ in 0..10 {
        let mut readers: Vec<_> = (0..200)
            .map(|_| Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap())
            .collect();
        for reader in &mut readers {
            read(reader);
            check(reader.frame().unwrap());
        }
    }
    ControlClient::connect_in(&runtime, &channel).unwrap();
}
