//! A publisher that cannot have another segment: its last scene goes on, and says why.
#![allow(clippy::unwrap_used)]

use super::*;
use photonstream_protocol::{AccessMode, ChannelName, Reading, Runtime, Subscriber, VslFrame};
use photonstream_scene::SceneConfig;
use std::{fs, path::Path};

const PATIENCE: Duration = Duration::from_secs(60);

fn scene(size: f64) -> Scene {
    let text = format!(
        "[camera]\nposition_m = [0, 0, 5]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n\
         [material.a]\nalbedo = 0.5\n[object.room]\nmaterial = \"a\"\nbox = {{ size_m = [{size}, 1, 1] }}\n"
    );
    SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap()
}

fn snapshot(scene: &Scene, vsls: usize) -> Snapshot {
    Snapshot {
        room: 0,
        vsls: PlacedRecords { records: vec![VslRecord::default(); vsls], version: 0, placement: 0 },
        patches: Arc::default(),
        maps: None,
        still: Arc::new(Still::new(scene)),
        statistics: StatisticsRecord::default(),
        paused: false,
    }
}

/// The next new frame.
fn frame(subscriber: &mut Subscriber) -> VslFrame {
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if subscriber.read().unwrap() == Reading::New {
            return subscriber.frame().unwrap().clone();
        }
        subscriber.wait(Duration::from_millis(20));
    }
    panic!("no frame within {PATIENCE:?}");
}

/// The journal cannot be written, so that no segment can be made: the last scene is published with the reason, also
/// where it is another scene of the same size, and each record comes back. Once it can, the new scene is shown.
#[test]
fn the_last_scene_goes_on_where_there_is_no_room() {
    let folder = tempfile::tempdir().unwrap();
    let runtime = Runtime::at(folder.path().to_owned());
    let channel: ChannelName = "full".parse().unwrap();
    let (small, large) = (scene(1.0), scene(2.0));
    let first = snapshot(&small, 5);
    let publisher = Publisher::create_in(&runtime, &channel, &first.still.spec(5, 0, None)).unwrap();
    let (sender, snapshots) = flume::bounded(1);
    let emptied = Arc::new(ArrayQueue::new(RECORD_SETS));
    let actor = PublisherActor {
        publisher,
        snapshots,
        emptied: Arc::clone(&emptied),
        latest_frame: Arc::new(AtomicU64::new(0)),
        orderly: Arc::new(AtomicBool::new(true)),
        stays_findable: false,
        refused: None,
        patches: None,
        maps: PublishedMaps::default(),
    };
    let thread = std::thread::spawn(move || actor.run());
    let mut subscriber =
        Subscriber::attach_wait_in(&runtime, &channel, AccessMode::Mapped, PATIENCE, &|| false).unwrap();
    sender.send(first).unwrap();
    let shown = frame(&mut subscriber);
    assert_eq!((shown.vsls.len(), &*shown.notice, shown.scene_hash), (5, "", small.hash));

    let journal = folder.path().join("full/journal");
    fs::remove_file(&journal).unwrap();
    fs::create_dir(&journal).unwrap();
    for vsls in [9, 5] {
        sender.send(snapshot(&large, vsls)).unwrap();
        let refused = frame(&mut subscriber);
        assert_eq!((refused.vsls.len(), refused.scene_hash), (5, small.hash));
        assert!(refused.notice.contains("the changed scene is not shown"), "{}", refused.notice);
        assert!(refused.notice.contains("journal"), "{}", refused.notice);
        let begun = Instant::now();
        while emptied.pop().is_none_or(|records| records.records.len() != vsls) {
            assert!(begun.elapsed() < PATIENCE, "the records of the refused scene come back");
            std::thread::yield_now();
        }
    }
    fs::remove_dir(&journal).unwrap();
    let begun = Instant::now();
    let mended = loop {
        sender.send(snapshot(&large, 9)).unwrap();
        let frame = frame(&mut subscriber);
        if frame.scene_hash == large.hash {
            break frame;
        }
        assert!(begun.elapsed() < PATIENCE, "{}", frame.notice);
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!((mended.vsls.len(), &*mended.notice), (9, ""));
    drop(sender);
    thread.join().unwrap().unwrap();
}
