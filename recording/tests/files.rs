//! Recordings of random frames: read back bit for bit, and up to the damage where they are damaged.
#![allow(clippy::unwrap_used)]

use photonstream_protocol::{LightRecord, ObjectRecord, StatisticsRecord, VslFrame, VslRecord};
use photonstream_recording::{Recorder, Recording, RecordingError, WHOLE_EVERY};
use proptest::prelude::*;
use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

/// A small deterministic generator (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    fn float(&mut self) -> f32 {
        f32::from_bits(self.next() as u32)
    }

    fn text(&mut self, most: u64) -> Arc<str> {
        (0..self.below(most))
            .map(|_| ['a', '\n', 'ä', '💡'][self.below(4) as usize])
            .collect::<String>()
            .into()
    }
}

/// Changes a frame as a simulator might, and as none would.
fn advance(frame: &mut VslFrame, random: &mut Random) {
    frame.frame += 1 + random.below(3);
    frame.publish_time_ns += random.below(1 << 30);
    frame.simulation_time_s += 0.1;
    frame.statistics.paths_total = random.next();
    match random.below(8) {
        0 => frame.vsls.resize_with(random.below(300) as usize, VslRecord::default),
        1 => {
            frame.objects =
                vec![ObjectRecord { id: 7, ..ObjectRecord::default() }; random.below(130) as usize]
        }
        2 => {
            frame.lights = vec![
                LightRecord { power: [random.float(); 3], ..LightRecord::default() };
                random.below(5) as usize
            ]
        }
        3 => frame.scene_text = random.text(9000),
        4 => frame.notice = random.text(200),
        5 => (frame.epoch, frame.scene_hash) = (frame.epoch + 1, random.next()),
        _ => {}
    }
    for _ in 0..random.below(100).min(frame.vsls.len() as u64) {
        let at = random.below(frame.vsls.len() as u64) as usize;
        let number = frame.frame;
        for vsl in &mut frame.vsls[at / 64 * 64..] {
            vsl.changed_frame = number;
        }
        frame.vsls[at].flux = [random.float(), random.float(), random.float()];
    }
    frame.chunk_frames = frame.vsls.iter().step_by(64).map(|vsl| vsl.changed_frame).collect();
}

/// All bits of a frame.
fn bits(frame: &VslFrame) -> Vec<u8> {
    let head = [frame.epoch, frame.frame, frame.publish_time_ns, frame.simulation_time_s.to_bits()];
    let more = [frame.config_generation, frame.scene_hash];
    let statistics: &[StatisticsRecord] = std::slice::from_ref(&frame.statistics);
    let parts: [&[u8]; 9] = [
        bytemuck::cast_slice(&head),
        bytemuck::cast_slice(&more),
        bytemuck::cast_slice(&frame.vsls),
        bytemuck::cast_slice(&frame.chunk_frames),
        bytemuck::cast_slice(&frame.objects),
        bytemuck::cast_slice(&frame.lights),
        bytemuck::cast_slice(statistics),
        frame.scene_text.as_bytes(),
        frame.notice.as_bytes(),
    ];
    let mut all = Vec::new();
    for part in parts {
        all.extend((part.len() as u64).to_le_bytes());
        all.extend_from_slice(part);
    }
    all
}

/// A recording of `count` frames in `folder`: its path, the bits of each frame, and the length of the file after each.
fn record(folder: &Path, seed: u64, count: u64) -> (PathBuf, Vec<Vec<u8>>, Vec<u64>) {
    let path = folder.join("frames.photons");
    let mut recorder = Recorder::create(&path).unwrap();
    let (mut random, mut frame) =
        (Random(seed), VslFrame { epoch: 1, config_generation: 4, ..VslFrame::default() });
    frame.vsls = vec![VslRecord::default(); 200];
    let (mut frames, mut lengths) = (Vec::new(), vec![recorder.bytes()]);
    for _ in 0..count {
        advance(&mut frame, &mut random);
        recorder.write(&frame).unwrap();
        frames.push(bits(&frame));
        lengths.push(recorder.bytes());
    }
    assert_eq!(recorder.frames(), count);
    recorder.finish().unwrap();
    lengths.push(fs::metadata(&path).unwrap().len());
    (path, frames, lengths)
}

/// Reads frames up to the end or an error.
fn read(path: &Path) -> (Vec<Vec<u8>>, Option<RecordingError>) {
    let mut recording = Recording::open(path).unwrap();
    let mut frames = Vec::new();
    loop {
        assert_eq!(recording.position(), frames.len() as u64 + 1);
        match recording.next_frame() {
            Ok(Some(frame)) => frames.push(bits(frame)),
            Ok(None) => return (frames, None),
            Err(error) => {
                let again = recording.next_frame().expect_err("it stays damaged");
                assert_eq!(again.to_string(), error.to_string());
                return (frames, Some(error));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// 24 recordings of up to 150 random frames: every bit comes back, in order, and from any frame on.
    #[test]
    fn frames_come_back_bit_for_bit(seed: u64, count in 0u64..150, starts in prop::collection::vec(1u64..150, 6)) {
        let folder = tempfile::tempdir().unwrap();
        let (path, frames, _) = record(folder.path(), seed, count);
        let (read, error) = read(&path);
        prop_assert!(error.is_none());
        prop_assert!(read == frames);
        let mut recording = Recording::open(&path).unwrap();
        for start in starts {
            match recording.seek(start) {
                Ok(()) if start <= count => {
                    prop_assert!(bits(recording.next_frame().unwrap().unwrap()) == frames[start as usize - 1]);
                }
                // One behind the last frame is the end.
                Ok(()) => prop_assert!(start == count + 1 && recording.next_frame().unwrap().is_none()),
                Err(RecordingError::NoSuchFrame { frames: found, .. }) => prop_assert!(start > count && found == count),
                Err(error) => prop_assert!(false, "{error}"),
            }
        }
    }
}

/// 70 frames (two that stand by themselves), seed 5: cut at every boundary of a record, one byte beside each, and in the
/// middle of each record, the file gives every frame before the cut and names the byte.
#[test]
fn a_file_that_was_cut_gives_what_is_before_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let (path, frames, lengths) = record(folder.path(), 5, WHOLE_EVERY + 6);
    let whole = fs::read(&path).unwrap();
    let mut cuts: Vec<u64> =
        lengths.iter().flat_map(|&length| [length.saturating_sub(1), length, length + 1]).collect();
    cuts.extend(lengths.windows(2).map(|pair| (pair[0] + pair[1]) / 2));
    for cut in cuts.into_iter().filter(|cut| *cut >= lengths[0] && (*cut as usize) < whole.len()) {
        fs::write(&path, &whole[..cut as usize]).unwrap();
        let before = lengths[1..].iter().filter(|length| **length <= cut).count();
        let (read, error) = read(&path);
        assert!(read == frames[..before], "cut at {cut}: {} frames", read.len());
        match error {
            Some(RecordingError::Truncated { byte, frame, .. }) => {
                assert_eq!((byte, frame), (cut, before as u64 + 1))
            }
            other => panic!("cut at {cut}: {other:?}"),
        }
    }
}

/// 10 frames, seed 6: one bit flipped in each 7th byte of the file is found in the record where it is; the frames before
/// are given.
#[test]
fn a_flipped_bit_is_found_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let (path, frames, lengths) = record(folder.path(), 6, 10);
    let whole = fs::read(&path).unwrap();
    for at in (0..whole.len()).step_by(7) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        fs::write(&path, &bytes).unwrap();
        if (at as u64) < lengths[0] {
            assert!(matches!(
                Recording::open(&path),
                Err(RecordingError::NotARecording { .. } | RecordingError::OtherRelease { .. })
            ));
            continue;
        }
        let before = lengths[1..].iter().filter(|length| **length <= at as u64).count();
        let (read, error) = read(&path);
        assert!(read == frames[..before], "byte {at}: {} frames", read.len());
        match error {
            Some(RecordingError::Damaged { byte, frame, .. }) => {
                assert_eq!((byte, frame), (lengths[before], before as u64 + 1), "byte {at}");
            }
            // A greater length leads beyond the end.
            Some(RecordingError::Truncated { byte, frame, .. }) => {
                assert_eq!((byte, frame), (whole.len() as u64, before as u64 + 1), "byte {at}");
            }
            other => panic!("byte {at}: {other:?}"),
        }
    }
}

/// What is no recording, or one of another release, is told in words.
#[test]
fn other_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x");
    assert!(matches!(Recording::open(&path), Err(RecordingError::Io { action: "open", .. })));
    for bytes in [&b""[..], b"PHOTREC1", &[b'x'; 100]] {
        fs::write(&path, bytes).unwrap();
        assert!(matches!(Recording::open(&path), Err(RecordingError::NotARecording { .. })), "{bytes:?}");
    }
    assert!(matches!(Recorder::create(folder.path()), Err(RecordingError::Io { action: "create", .. })));
}

/// A scene that stands still costs a few hundred bytes a frame beside the frames that stand by themselves.
#[test]
fn what_stays_costs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("still");
    let mut random = Random(1);
    let vsls = (0..10_000).map(|_| VslRecord {
        flux: [random.float(); 3],
        position: [random.float(); 3],
        ..VslRecord::default()
    });
    let mut frame = VslFrame { vsls: vsls.collect(), ..VslFrame::default() };
    let mut recorder = Recorder::create(&path).unwrap();
    recorder.write(&frame).unwrap();
    let whole = recorder.bytes();
    for number in 1..WHOLE_EVERY {
        frame.frame = number;
        recorder.write(&frame).unwrap();
    }
    // Head, seven arrays without changes but the statistics' chunk, headers: under 600 bytes before compression.
    assert!(recorder.bytes() - whole < (WHOLE_EVERY - 1) * 600, "{} and {whole}", recorder.bytes());
}
