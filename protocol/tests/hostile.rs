//! Turns every damaged, foreign or malicious segment into a typed error: no crash, no torn or non-finite frame.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

mod support;

use std::fs::OpenOptions;
use std::os::unix::fs::{FileExt, PermissionsExt};
use std::path::PathBuf;

use photonstream_protocol::{
    ABI_MAJOR, AccessMode, ChannelName, ProtocolError, Publisher, Reading, Runtime, Subscriber,
};
use proptest::prelude::*;
use support::{Content, Random, check, spec};

const HEADER_BYTES: usize = 121 * 8;
const STATE_BYTE: u64 = 2048;

/// A segment with one frame, its publisher gone, so that tests may write to it.
struct Victim {
    _root: tempfile::TempDir,
    runtime: Runtime,
    channel: ChannelName,
    publisher: Publisher,
    file: PathBuf,
    bytes: Vec<u8>,
}

impl Victim {
    fn new() -> Self {
        let root = tempfile::tempdir().unwrap();
        let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
        let mut publisher = Publisher::create_in(&runtime, &channel, &spec(200)).unwrap();
        for frame in 1..=4 {
            publisher.publish(&Content::new(200, frame).source(false)).unwrap();
        }
        let current = std::fs::read_to_string(root.path().join("default/current")).unwrap();
        let name =
            current.lines().find_map(|line| line.strip_prefix("segment = \"/")).unwrap().trim_matches('"');
        let file = PathBuf::from("/dev/shm").join(name);
        let bytes = std::fs::read(&file).unwrap();
        Self { _root: root, runtime, channel, publisher, file, bytes }
    }

    fn write(&self, at: u64, bytes: &[u8]) {
        OpenOptions::new().write(true).open(&self.file).unwrap().write_all_at(bytes, at).unwrap();
    }

    fn word(&self, at: usize) -> u64 {
        u64::from_ne_bytes(self.bytes[at..at + 8].try_into().unwrap())
    }

    /// Writes header words, with a checksum that is right.
    fn write_header(&self, words: &[(usize, u64)]) {
        let mut header = self.bytes[..HEADER_BYTES].to_vec();
        for (word, value) in words {
            header[word * 8..word * 8 + 8].copy_from_slice(&value.to_ne_bytes());
        }
        let crc = crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(&header[..HEADER_BYTES - 8]);
        header[HEADER_BYTES - 8..].copy_from_slice(&crc.to_ne_bytes());
        self.write(0, &header);
    }

    fn restore(&self) {
        self.write(0, &self.bytes[..4096]);
    }

    fn attach(&self, mode: AccessMode) -> Result<Subscriber, ProtocolError> {
        Subscriber::attach_in(&self.runtime, &self.channel, mode)
    }

    fn set_current(&self, line: &str, value: &str) {
        let path = self.runtime.root().join("default/current");
        let text = std::fs::read_to_string(&path).unwrap();
        let lines: Vec<String> = text
            .lines()
            .map(|l| if l.starts_with(line) { format!("{line} = {value}") } else { l.to_owned() })
            .collect();
        std::fs::write(path, lines.join("\n")).unwrap();
    }
}

/// All 7 744 bits of the header, one at a time: each is noticed.
#[test]
fn every_flipped_header_bit_is_refused() {
    let victim = Victim::new();
    victim.attach(AccessMode::Strict).unwrap();
    for bit in 0..HEADER_BYTES * 8 {
        let byte = victim.bytes[bit / 8] ^ (1 << (bit % 8));
        victim.write(bit as u64 / 8, &[byte]);
        let error = victim.attach(AccessMode::Strict).expect_err(&format!("bit {bit}"));
        assert!(
            matches!(
                error,
                ProtocolError::Corrupt { .. }
                    | ProtocolError::VersionMismatch { .. }
                    | ProtocolError::EndianMismatch { .. }
            ),
            "{error}"
        );
        victim.write(bit as u64 / 8, &victim.bytes[bit / 8..=bit / 8]);
    }
    victim.attach(AccessMode::Strict).unwrap();
}

/// Wrong versions, byte order and layouts have errors of their own, with a right checksum.
#[test]
fn foreign_segments_are_told_apart() {
    let victim = Victim::new();
    victim.write_header(&[(1, ABI_MAJOR + 1)]);
    assert!(matches!(
        victim.attach(AccessMode::Mapped),
        Err(ProtocolError::VersionMismatch { found_major, expected: ABI_MAJOR, .. }) if found_major == ABI_MAJOR + 1
    ));
    victim.write_header(&[(2, 9)]);
    victim.attach(AccessMode::Mapped).unwrap();
    victim.write_header(&[(3, 0x0807_0605_0403_0201)]);
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::EndianMismatch { .. })));
    victim.write_header(&[(4, 1)]);
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::LayoutMismatch { found: 1, .. })));
    victim.restore();
    for state in [0u64, 1] {
        victim.write(STATE_BYTE, &state.to_ne_bytes());
        assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::NotInitialised { .. })));
    }
    victim.write(STATE_BYTE, &77u64.to_ne_bytes());
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Corrupt { .. })));
    victim.restore();
    victim.set_current("epoch", "99");
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Corrupt { .. })));
}

/// Each place and size of the header, set to each of these values with a right checksum: refused, or still readable.
#[test]
fn hostile_headers_never_lead_out_of_the_segment() {
    let victim = Victim::new();
    let stride = victim.word(11 * 8);
    let values = [
        0,
        1,
        7,
        8,
        63,
        64,
        4096,
        stride - 64,
        stride,
        stride + 4096,
        1 << 32,
        1 << 63,
        u64::MAX - 63,
        u64::MAX,
    ];
    for word in (5..13).chain(24..24 + 30) {
        for value in values {
            victim.write_header(&[(word, value)]);
            for mode in [AccessMode::Mapped, AccessMode::Strict] {
                if let Ok(mut reader) = victim.attach(mode) {
                    let _ = reader.read();
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    /// Random words anywhere in the slots, 64 cases of up to 8 words: an error, or a frame of finite numbers.
    #[test]
    fn hostile_slots_give_errors_or_finite_frames(writes in prop::collection::vec((0usize..1_000_000, prop_oneof![any::<u64>(), 0..300u64, Just(u64::MAX)]), 1..8)) {
        let victim = Victim::new();
        let slots = victim.bytes.len() - 4096;
        // Half of the writes go to heads and tables, where they matter most.
        for (i, (place, value)) in writes.iter().enumerate() {
            let span = if i % 2 == 0 { 256 } else { victim.word(11 * 8) as usize };
            let slot = (place % 3) * victim.word(11 * 8) as usize;
            let at = 4096 + (slot + place / 3 % span) % slots;
            victim.write((at & !7) as u64, &value.to_ne_bytes());
        }
        for mode in [AccessMode::Mapped, AccessMode::Strict] {
            let mut reader = victim.attach(mode).unwrap();
            if let Ok(Reading::New) = reader.read() {
                let frame = reader.frame().unwrap();
                prop_assert!(frame.vsls.iter().all(|r| r.flux.iter().chain(&r.position).all(|v| v.is_finite())));
                prop_assert!(frame.lights.iter().all(|r| r.power.iter().all(|v| v.is_finite())));
            }
        }
    }
}

/// A NaN, a broken text, a frame number that goes back: named, and the last frame stays.
#[test]
fn damage_under_a_reader_is_named_and_the_last_frame_stays() {
    let mut victim = Victim::new();
    let mut reader = victim.attach(AccessMode::Mapped).unwrap();
    assert_eq!(reader.read().unwrap(), Reading::New);
    victim.write(2176, &2u64.to_ne_bytes());
    let error = reader.read().expect_err("went back").to_string();
    assert!(error.contains("latest is 2, expected at least 4"), "{error}");
    check(reader.frame().unwrap());
    victim.publisher.publish(&Content::new(200, 5).source(false)).unwrap();
    let stride = victim.word(11 * 8);
    let data = victim.word((24 + 3) * 8);
    victim.write(4096 + 2 * stride + data + 16, &f32::NAN.to_ne_bytes());
    let error = reader.read().expect_err("NaN").to_string();
    assert!(error.contains("position of vsl record 0 is NaN"), "{error}");
    assert_eq!(reader.frame().unwrap().frame, 4);
    // The next good frame repairs what the bad one broke.
    victim.publisher.publish(&Content::new(200, 6).source(false)).unwrap();
    while reader.read().unwrap() != Reading::New {}
    check(reader.frame().unwrap());
}

/// Cut at each page: refused at attach, and an error (not a signal) under a strict reader.
#[test]
fn truncation_at_each_page_is_an_error() {
    let victim = Victim::new();
    // A copy: the publisher lives in this process and must not touch what is no longer there.
    let copy = PathBuf::from(format!("/dev/shm/ps-{:024x}", std::process::id()));
    std::fs::copy(&victim.file, &copy).unwrap();
    std::fs::set_permissions(&copy, PermissionsExt::from_mode(0o600)).unwrap();
    victim.set_current("segment", &format!("\"/ps-{:024x}\"", std::process::id()));
    let file = OpenOptions::new().write(true).open(&copy).unwrap();
    let mut reader = victim.attach(AccessMode::Strict).unwrap();
    for pages in (0..victim.bytes.len() as u64 / 4096).rev() {
        file.set_len(pages * 4096).unwrap();
        for mode in [AccessMode::Mapped, AccessMode::Strict] {
            assert!(matches!(victim.attach(mode), Err(ProtocolError::Corrupt { .. })), "{pages} pages");
        }
        let _ = reader.liveness();
        if pages == 0 {
            assert!(matches!(reader.read(), Err(ProtocolError::Corrupt { .. })));
        }
    }
    std::fs::remove_file(copy).unwrap();
}

/// Symbolic link, FIFO, folder, empty file, too open a mode, another owner: refused before anything is mapped.
#[test]
fn what_is_no_private_file_is_refused() {
    let victim = Victim::new();
    std::fs::set_permissions(&victim.file, PermissionsExt::from_mode(0o644)).unwrap();
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Insecure { field: "mode", .. })));
    std::fs::set_permissions(&victim.file, PermissionsExt::from_mode(0o600)).unwrap();
    if rustix::process::geteuid().is_root() {
        std::os::unix::fs::chown(&victim.file, Some(12345), None).unwrap();
        assert!(matches!(
            victim.attach(AccessMode::Mapped),
            Err(ProtocolError::Insecure { field: "owner", .. })
        ));
        std::os::unix::fs::chown(&victim.file, Some(0), None).unwrap();
    } else {
        eprintln!("SKIP: the test of another owner needs root");
    }
    victim.attach(AccessMode::Mapped).unwrap();
    let moved = victim.file.with_file_name(format!("{}-moved", victim.file.file_name().unwrap().display()));
    std::fs::rename(&victim.file, &moved).unwrap();
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::NotCreated { .. })));
    std::os::unix::fs::symlink(&moved, &victim.file).unwrap();
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Insecure { field: "type", .. })));
    std::fs::remove_file(&victim.file).unwrap();
    let fifo = std::process::Command::new("mkfifo").arg("-m").arg("600").arg(&victim.file).status().unwrap();
    assert!(fifo.success());
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Insecure { field: "type", .. })));
    std::fs::remove_file(&victim.file).unwrap();
    let empty = std::fs::File::create(&victim.file).unwrap();
    empty.set_permissions(PermissionsExt::from_mode(0o600)).unwrap();
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Corrupt { .. })));
    std::fs::remove_file(&victim.file).unwrap();
    std::fs::rename(&moved, &victim.file).unwrap();
    victim.attach(AccessMode::Mapped).unwrap();
}

/// The pointer file: garbage, too long, a path out of shared memory, a link.
#[test]
fn a_hostile_pointer_file_is_refused() {
    let victim = Victim::new();
    let path = victim.runtime.root().join("default/current");
    victim.set_current("segment", "\"/../../etc/passwd\"");
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Corrupt { .. })));
    let mut random = Random(3);
    for length in [0, 1, 100, 512, 513, 100_000] {
        let garbage: Vec<u8> = (0..length).map(|_| random.below(256) as u8).collect();
        std::fs::write(&path, garbage).unwrap();
        assert!(
            matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Corrupt { .. })),
            "{length} bytes"
        );
    }
    std::fs::remove_file(&path).unwrap();
    std::os::unix::fs::symlink("/etc/passwd", &path).unwrap();
    assert!(matches!(victim.attach(AccessMode::Mapped), Err(ProtocolError::Insecure { field: "type", .. })));
}

/// More than the file system of shared memory can hold is an error that says how much there is; nothing is left.
#[test]
fn full_shared_memory_is_an_error() {
    let fs = rustix::fs::statvfs("/dev/shm").unwrap();
    let root = tempfile::tempdir().unwrap();
    let (runtime, channel) = (Runtime::at(root.path()), ChannelName::default());
    let needed = fs.f_blocks * fs.f_frsize / (3 * 64) + 1_000_000;
    if fs.f_blocks == 0 || needed > 1 << 26 {
        let large = photonstream_protocol::SegmentSpec { slots: 8, ..spec(1 << 26) };
        if fs.f_blocks == 0 || fs.f_blocks * fs.f_frsize > (8u64 << 26) * 64 {
            eprintln!("SKIP: shared memory is larger than the largest segment");
            return;
        }
        let error = Publisher::create_in(&runtime, &channel, &large).expect_err("cannot fit");
        assert!(matches!(error, ProtocolError::NoSpace { .. }), "{error}");
    } else {
        let error = Publisher::create_in(&runtime, &channel, &spec(needed as u32)).expect_err("cannot fit");
        assert!(matches!(error, ProtocolError::NoSpace { .. }), "{error}");
    }
    assert!(!root.path().join("default/journal").exists() && !root.path().join("default/current").exists());
    // The channel is free again.
    Publisher::create_in(&runtime, &channel, &spec(100)).unwrap();
}
