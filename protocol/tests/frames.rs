//! Turns published frames back into records through another map of the same memory: nothing torn, nothing lost.
#![allow(clippy::unwrap_used)]

mod support;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use photonstream_protocol::{
    AccessMode, ChannelName, ChunkSet, ControlServer, FrameSource, Liveness, ProtocolError, Publisher,
    Reading, Runtime, Subscriber, VslRecord, Wake, clean_in,
};
use support::{Content, check, spec, version};

const MODES: [AccessMode; 2] = [AccessMode::Mapped, AccessMode::Strict];

fn start(vsls: u32) -> (tempfile::TempDir, Runtime, ChannelName, Publisher) {
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let publisher = Publisher::create_in(&runtime, &channel, &spec(vsls)).unwrap();
    (root, runtime, channel, publisher)
}

/// Reads until a frame is complete: one call may run out of its 2 ms on a busy machine.
fn read(subscriber: &mut Subscriber) -> Reading {
    loop {
        match subscriber.read().unwrap() {
            Reading::Busy => {}
            other => return other,
        }
    }
}

/// 200 frames of 1 000 lights, by comparison and by named chunks, every word checked, in both modes.
#[test]
fn every_word_arrives_in_lockstep() {
    for named in [false, true] {
        let (_root, runtime, channel, mut publisher) = start(1000);
        let mut readers = MODES.map(|mode| Subscriber::attach_in(&runtime, &channel, mode).unwrap());
        let mut content = Content::default();
        for frame in 1..=200 {
            content.advance(1000, frame);
            assert_eq!(publisher.publish(&content.source(named)).unwrap(), frame);
            for (r, reader) in readers.iter_mut().enumerate() {
                // The second reader takes every third frame only.
                if r == 0 || frame % 3 == 0 {
                    assert_eq!(read(reader), Reading::New);
                    assert_eq!(reader.read().unwrap(), Reading::Unchanged);
                    let found = reader.frame().unwrap();
                    assert_eq!((found.frame, found.vsls.len(), found.scene_hash), (frame, 1000, 0xabc));
                    check(found);
                }
            }
        }
    }
}

/// The set of changed chunks is exactly that of the versions that moved since the reader's last frame.
#[test]
fn changed_chunks_are_exact() {
    let (_root, runtime, channel, mut publisher) = start(1000);
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let (mut content, mut last) = (Content::default(), 0);
    for frame in 1..=60 {
        content.advance(1000, frame);
        publisher.publish(&content.source(true)).unwrap();
        if frame % 3 != 2 {
            assert_eq!(read(&mut reader), Reading::New);
            let expected: Vec<usize> =
                (0..16).filter(|c| last == 0 || version(*c, frame) != version(*c, last)).collect();
            assert_eq!(reader.changed_chunks().iter().collect::<Vec<_>>(), expected, "frame {frame}");
            last = frame;
        }
    }
}

/// Devices copy from the map by themselves: they are told where the newest frame lies, and whether it is still there.
/// Frames 1 to 6 in three slots; frame f is overwritten by frame f + 3, and by none before.
#[test]
fn a_mapped_frame_holds_until_its_slot_is_written_again() {
    let (_root, runtime, channel, mut publisher) = start(1000);
    let strict = Subscriber::attach_in(&runtime, &channel, AccessMode::Strict).unwrap();
    assert!(strict.mapped().is_none(), "nothing is mapped");
    let mapped = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap().mapped().unwrap();
    assert_eq!((mapped.vsl_capacity(), mapped.bytes() % 4096), (1000, 0));
    assert_eq!(mapped.address().addr() % 4096, 0);
    assert_eq!(mapped.newest().unwrap(), None);
    let (mut content, mut frames) = (Content::default(), Vec::new());
    for frame in 1..=6 {
        content.advance(1000 - frame as usize, frame);
        publisher.publish(&content.source(true)).unwrap();
        let newest = mapped.newest().unwrap().unwrap();
        assert_eq!((newest.frame, newest.vsl_count), (frame, 1000 - frame as u32));
        assert!(newest.vsl_offset.is_multiple_of(64) && newest.vsl_offset + 64_000 <= mapped.bytes());
        frames.push(newest);
        for (f, place) in (1..).zip(&frames) {
            assert_eq!(mapped.holds(place).unwrap(), f + 3 > frame, "frame {f} after frame {frame}");
        }
    }
    drop(publisher);
    assert!(mapped.holds(&frames[5]).unwrap(), "the map outlives publisher and subscriber");
}

/// Three readers under a writer that never pauses, 1 s: each frame they get is whole, and they get many.
#[test]
fn nothing_is_torn_in_a_storm() {
    let (_root, runtime, channel, mut publisher) = start(3000);
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let stop = &stop;
        let mut readers = Vec::new();
        for mode in [AccessMode::Mapped, AccessMode::Mapped, AccessMode::Strict] {
            let mut reader = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
            readers.push(scope.spawn(move || {
                let (mut frames, mut last) = (0, 0);
                while !stop.load(Ordering::Relaxed) {
                    if reader.read().unwrap() == Reading::New {
                        let frame = reader.frame().unwrap();
                        assert!(frame.frame > last, "frames go forward");
                        last = frame.frame;
                        check(frame);
                        frames += 1;
                    }
                }
                frames
            }));
        }
        let mut content = Content::default();
        let end = std::time::Instant::now() + Duration::from_secs(1);
        let mut frame = 0;
        while std::time::Instant::now() < end {
            frame += 1;
            content.advance(3000, frame);
            publisher.publish(&content.source(true)).unwrap();
        }
        stop.store(true, Ordering::Relaxed);
        for reader in readers {
            assert!(reader.join().unwrap() > 0, "a reader starved");
        }
    });
}

/// A million records exceed the 2 ms of one call; verified chunks survive, so that calls add up to a frame.
#[test]
fn a_frame_larger_than_one_call_converges() {
    let (_root, runtime, channel, mut publisher) = start(1_000_000);
    let vsls = vec![VslRecord { area: 1.0, ..VslRecord::default() }; 1_000_000];
    let statistics = Default::default();
    let mut source = FrameSource { vsls: &vsls, ..Content::default_source(&statistics) };
    publisher.publish(&source).unwrap();
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let none = ChunkSet::for_records(vsls.len());
    source.changed = Some(&none);
    let mut calls = 0;
    while reader.read().unwrap() != Reading::New {
        // A frame in between moves the slot, and with it all that was not verified.
        publisher.publish(&source).unwrap();
        calls += 1;
        assert!(calls < 100_000, "no progress");
    }
    assert_eq!(reader.frame().unwrap().vsls.len(), vsls.len());
    assert!(reader.frame().unwrap().vsls.iter().all(|record| record.area == 1.0));
}

/// The number of lights changes by every kind of step; no stale record appears.
#[test]
fn counts_may_change_in_every_frame() {
    let (_root, runtime, channel, mut publisher) = start(1000);
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let mut random = support::Random(7);
    let statistics = Default::default();
    for frame in 1..=300u32 {
        let count = random.below(1001) as usize;
        let vsls = vec![VslRecord { generation: frame, ..VslRecord::default() }; count];
        let unchanged = frame % 4 == 0;
        let vsls = if unchanged { vec![VslRecord::default(); count] } else { vsls };
        publisher.publish(&FrameSource { vsls: &vsls, ..Content::default_source(&statistics) }).unwrap();
        if random.below(2) == 0 {
            assert_eq!(read(&mut reader), Reading::New);
            let found = &reader.frame().unwrap().vsls;
            let expected = if unchanged { 0 } else { frame };
            assert!(found.len() == count && found.iter().all(|record| record.generation == expected));
        }
    }
}

/// A NaN is refused with record and field, readers keep what they have, and the next good frame is complete.
#[test]
fn a_refused_frame_leaves_no_trace() {
    let (_root, runtime, channel, mut publisher) = start(1000);
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    for frame in 1..=12 {
        let good = Content::new(1000, frame);
        let mut bad = Content::new(1000, frame + 500);
        bad.vsls[700].flux[1] = f32::NAN;
        for named in [false, true] {
            match publisher.publish(&bad.source(named)) {
                Err(ProtocolError::NonFinite { record: "vsl", index: 700, field: "flux", .. }) => {}
                other => panic!("{other:?}"),
            }
        }
        assert_ne!(reader.read().unwrap(), Reading::New);
        assert_eq!(publisher.publish(&good.source(true)).unwrap(), frame);
        assert_eq!(read(&mut reader), Reading::New);
        let found = reader.frame().unwrap();
        assert!(found.vsls.iter().zip(&good.vsls).all(|(a, b)| a.flux == b.flux && a.position == b.position));
        assert!(found.vsls.iter().all(|record| record.changed_frame == frame));
    }
    let too_many = vec![VslRecord::default(); 1001];
    let statistics = Default::default();
    let source = FrameSource { vsls: &too_many, ..Content::default_source(&statistics) };
    assert!(matches!(
        publisher.publish(&source),
        Err(ProtocolError::TooMany { found: 1001, capacity: 1000, .. })
    ));
    let text = "x".repeat(4097);
    let source = FrameSource { scene_text: &text, ..Content::default_source(&statistics) };
    assert!(matches!(publisher.publish(&source), Err(ProtocolError::TooMany { found: 4097, .. })));
    let source = FrameSource { simulation_time_s: f64::INFINITY, ..Content::default_source(&statistics) };
    assert!(matches!(publisher.publish(&source), Err(ProtocolError::NonFinite { .. })));
}

/// The text stays the same allocation until it changes.
#[test]
fn scene_text_is_read_again_only_when_it_changed() {
    let (_root, runtime, channel, mut publisher) = start(10);
    let mut reader = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let statistics = Default::default();
    let mut texts = Vec::new();
    for text in ["a", "a", "a", "a", "ab", "ab\0", "", ""] {
        publisher.publish(&FrameSource { scene_text: text, ..Content::default_source(&statistics) }).unwrap();
        assert_eq!(read(&mut reader), Reading::New);
        assert_eq!(&*reader.frame().unwrap().scene_text, text);
        texts.push(reader.frame().unwrap().scene_text.clone());
    }
    assert!(std::sync::Arc::ptr_eq(&texts[0], &texts[3]) && std::sync::Arc::ptr_eq(&texts[6], &texts[7]));
}

/// Replacing the segment: readers follow by themselves, keep the last frame meanwhile, and see all chunks changed.
#[test]
fn readers_follow_a_replaced_segment() {
    for mode in MODES {
        let (_root, runtime, channel, mut publisher) = start(100);
        let mut reader = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
        publisher.publish(&Content::new(100, 1).source(false)).unwrap();
        assert_eq!(read(&mut reader), Reading::New);
        publisher.set_paused(true);
        let epoch = reader.epoch();
        publisher.replace_segment(&spec(5000)).unwrap();
        while reader.epoch() == epoch {
            assert!(matches!(reader.read().unwrap(), Reading::Unchanged | Reading::Empty));
        }
        assert_eq!(reader.frame().unwrap().frame, 1);
        assert_eq!(reader.liveness(), Liveness::Paused);
        let mut content = Content::new(5000, 1);
        content.advance(5000, 2);
        assert_eq!(publisher.publish(&content.source(false)).unwrap(), 2);
        assert_eq!(read(&mut reader), Reading::New);
        assert_eq!(reader.changed_chunks().len(), 79);
        assert_eq!(reader.frame().unwrap().vsls.len(), 5000);
        assert!(reader.frame().unwrap().epoch > epoch);
        // A segment that cannot be made leaves the old one in use.
        let huge = photonstream_protocol::SegmentSpec { slots: 9, ..spec(1) };
        assert!(matches!(
            publisher.replace_segment(&huge),
            Err(ProtocolError::InvalidSpec { field: "slots", .. })
        ));
        content.advance(5000, 3);
        assert_eq!(publisher.publish(&content.source(true)).unwrap(), 3);
        assert_eq!(read(&mut reader), Reading::New);
    }
}

/// `wait` returns for a frame, for an end in order, and otherwise at its limit.
#[test]
fn waiting_ends_for_each_reason() {
    for mode in MODES {
        let (_root, runtime, channel, mut publisher) = start(100);
        let server = ControlServer::start(&publisher).unwrap();
        let mut reader = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
        assert_eq!(reader.wait(Duration::from_millis(20)), Wake::TimedOut);
        let sender = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(20));
            publisher.publish(&Content::new(100, 1).source(false)).unwrap();
            publisher
        });
        assert_eq!(reader.wait(Duration::from_secs(60)), Wake::NewFrame);
        let publisher = sender.join().unwrap();
        assert_eq!(read(&mut reader), Reading::New);
        publisher.set_paused(true);
        assert_eq!(reader.wait(Duration::from_secs(60)), Wake::StateChanged);
        assert_eq!(reader.liveness(), Liveness::Paused);
        publisher.set_paused(false);
        assert_eq!(reader.wait(Duration::from_secs(60)), Wake::StateChanged);
        drop(server);
        publisher.close();
        assert_eq!(reader.wait(Duration::from_secs(60)), Wake::StateChanged);
        assert_eq!(reader.liveness(), Liveness::Retired);
        assert_eq!(reader.frame().unwrap().frame, 1);
        assert_eq!(reader.wait(Duration::from_millis(20)), Wake::TimedOut);
        assert!(matches!(
            Subscriber::attach_in(&runtime, &channel, mode),
            Err(ProtocolError::NotCreated { .. })
        ));
    }
}

/// A channel that is left findable at its end shows its last frame to who comes late, until somebody removes it or the
/// next publisher comes.
#[test]
fn a_channel_that_is_left_findable_has_its_last_frame() {
    for mode in MODES {
        let (_root, runtime, channel, mut publisher) = start(10);
        let statistics = Default::default();
        publisher.publish(&Content::default_source(&statistics)).unwrap();
        publisher.close_findable();
        let mut late = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
        assert_eq!(late.liveness(), Liveness::Retired);
        assert_eq!(read(&mut late), Reading::New);
        assert_eq!(late.frame().unwrap().frame, 1);
        assert_eq!(late.wait(Duration::from_secs(60)), Wake::StateChanged);
        assert_eq!(late.wait(Duration::from_millis(20)), Wake::TimedOut);
        let successor = Publisher::create_in(&runtime, &channel, &spec(10)).unwrap();
        assert_eq!(late.wait(Duration::from_secs(60)), Wake::StateChanged);
        assert_eq!(late.liveness(), Liveness::Live);
        successor.close_findable();
        let removed = clean_in(&runtime).unwrap();
        assert_eq!(removed.iter().map(|found| found.segments.len()).sum::<usize>(), 1);
        assert!(matches!(
            Subscriber::attach_in(&runtime, &channel, mode),
            Err(ProtocolError::NotCreated { .. })
        ));
    }
}

/// A notice comes and goes without anything else, is cut where it is too long, and follows into another segment.
#[test]
fn notices_come_and_go() {
    for mode in MODES {
        let (_root, runtime, channel, mut publisher) = start(10);
        let mut reader = Subscriber::attach_in(&runtime, &channel, mode).unwrap();
        let statistics = Default::default();
        let long = "ä".repeat(200);
        let mut found = Vec::new();
        for notice in ["", "room.toml:3:7", "room.toml:3:7", &long, "room.toml:3:7", ""] {
            publisher.publish(&FrameSource { notice, ..Content::default_source(&statistics) }).unwrap();
            assert_eq!(read(&mut reader), Reading::New);
            found.push(std::sync::Arc::clone(&reader.frame().unwrap().notice));
        }
        // 256 bytes: 126 letters of two bytes, and four bytes that say that there was more.
        let cut = format!("{} …", "ä".repeat(126));
        let texts: Vec<&str> = found.iter().map(|text| &**text).collect();
        assert_eq!(texts, ["", "room.toml:3:7", "room.toml:3:7", &cut, "room.toml:3:7", ""]);
        assert!(std::sync::Arc::ptr_eq(&found[1], &found[2]));
        let none = photonstream_protocol::SegmentSpec { notice_capacity: 0, ..spec(10) };
        publisher.replace_segment(&none).unwrap();
        let source = FrameSource { notice: "cannot be told", ..Content::default_source(&statistics) };
        publisher.publish(&source).unwrap();
        while reader.read().unwrap() != Reading::New {}
        assert_eq!(&*reader.frame().unwrap().notice, "");
    }
}
