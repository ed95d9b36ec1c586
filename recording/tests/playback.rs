//! Recorded frames are published again: a subscriber reads what was recorded, also where the segment changes.
#![allow(clippy::unwrap_used)]

use photonstream_protocol::{AccessMode, ChannelName, Reading, Runtime, Subscriber, VslFrame, VslRecord};
use photonstream_recording::{Playback, Recorder, Recording};

/// A frame of `vsls` lights from segment `epoch`, published a second after its change arrived.
fn frame(number: u64, epoch: u64, vsls: usize) -> VslFrame {
    let record = VslRecord { flux: [number as f32; 3], area: 0.5, ..VslRecord::default() };
    let mut frame = VslFrame {
        epoch,
        frame: 100 + number,
        publish_time_ns: 5_000_000_000 * number,
        scene_hash: epoch,
        scene_text: format!("scene {epoch}").into(),
        notice: if number == 2 { "a notice".into() } else { "".into() },
        vsls: vec![record; vsls],
        ..VslFrame::default()
    };
    frame.statistics.edit_received_ns = frame.publish_time_ns - 1_000_000_000;
    frame.statistics.published_ns = frame.publish_time_ns;
    frame
}

/// Six frames of three segments: growing, shrinking, and of the same size with another scene.
#[test]
fn a_subscriber_reads_what_was_recorded_through_changes_of_the_segment() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames");
    let frames = [
        frame(1, 1, 100),
        frame(2, 1, 100),
        frame(3, 2, 900),
        frame(4, 2, 900),
        frame(5, 3, 70),
        frame(6, 3, 70),
    ];
    let mut recorder = Recorder::create(&path).unwrap();
    frames.iter().for_each(|frame| recorder.write(frame).unwrap());
    recorder.finish().unwrap();

    let mut recording = Recording::open(&path).unwrap();
    let (runtime, channel) = (Runtime::at(folder.path().join("run")), ChannelName::default());
    let first = recording.next_frame().unwrap().unwrap();
    let mut playback = Playback::start_in(&runtime, &channel, first).unwrap();
    playback.show(first).unwrap();
    let mut subscriber = Subscriber::attach_in(&runtime, &channel, AccessMode::Mapped).unwrap();
    let mut epochs = Vec::new();
    for (number, expected) in (1..).zip(&frames) {
        if number > 1 {
            let next = recording.next_frame().unwrap().unwrap();
            assert_eq!(playback.show(next).unwrap(), number, "frames are numbered anew");
        }
        while subscriber.read().unwrap() != Reading::New {}
        let found = subscriber.frame().unwrap();
        let light = |frame: &VslFrame| frame.vsls.iter().map(|v| (v.flux, v.area)).collect::<Vec<_>>();
        assert_eq!(light(found), light(expected));
        assert_eq!((&found.scene_text, &found.notice), (&expected.scene_text, &expected.notice));
        assert_eq!((found.frame, found.scene_hash), (number, expected.scene_hash));
        let (published, received) = (found.statistics.published_ns, found.statistics.edit_received_ns);
        // The publisher looks at the clock a moment after the playback did.
        assert!((1_000_000_000..60_000_000_000).contains(&(published - received)), "{published} {received}");
        epochs.push(found.epoch);
    }
    assert!(recording.next_frame().unwrap().is_none());
    let changed: Vec<bool> = epochs.windows(2).map(|pair| pair[0] != pair[1]).collect();
    assert_eq!(changed, [false, true, false, true, false]);
}
