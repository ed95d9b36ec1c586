//! Turns headers of files and records into bytes with a checksum, and back.

use crc::{CRC_64_XZ, Crc, Table};
use photonstream_protocol::{ABI_MAJOR, ENDIAN_TAG, LAYOUT_HASH};

/// Version of the file format: another one cannot be read.
pub const VERSION: u64 = 1;
/// First eight bytes of every recording.
pub(crate) const MAGIC: [u8; 8] = *b"PHOTREC1";
/// Bytes of the file's header.
pub(crate) const FILE_HEADER: usize = 48;
/// Bytes of a record's header.
pub(crate) const RECORD_HEADER: usize = 48;
/// Most bytes of a frame before compression.
pub(crate) const MAX_FRAME: u64 = 1 << 30;

static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_XZ);

/// CRC-64/XZ of several pieces.
pub(crate) fn checksum(pieces: &[&[u8]]) -> u64 {
    let mut digest = CRC.digest();
    pieces.iter().for_each(|piece| digest.update(piece));
    digest.finalize()
}

/// The header of a file of this build.
pub(crate) fn file_header() -> [u8; FILE_HEADER] {
    let mut words = [u64::from_ne_bytes(MAGIC), ENDIAN_TAG, VERSION, ABI_MAJOR, LAYOUT_HASH, 0];
    words[5] = checksum(&[bytemuck::cast_slice(&words[..5])]);
    bytemuck::cast(words)
}

/// What a header is found to be.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum FileHeader {
    /// One of this build.
    Ours,
    /// None at all.
    Foreign(String),
    /// One of another build: field, found, expected.
    Other(&'static str, u64, u64),
}

/// Checks the header of a file.
pub(crate) fn check_file_header(bytes: &[u8]) -> FileHeader {
    let Ok(bytes) = <[u8; FILE_HEADER]>::try_from(bytes) else {
        return FileHeader::Foreign(format!("{} bytes", bytes.len()));
    };
    if bytes[..8] != MAGIC {
        return FileHeader::Foreign(format!("\"{}\"", bytes[..8].escape_ascii()));
    }
    let words: [u64; FILE_HEADER / 8] = bytemuck::cast(bytes);
    if words[1] == ENDIAN_TAG && words[5] != checksum(&[&bytes[..40]]) {
        return FileHeader::Foreign("a wrong checksum".into());
    }
    let expected = [
        ("byte order", ENDIAN_TAG),
        ("format version", VERSION),
        ("ABI", ABI_MAJOR),
        ("layout hash", LAYOUT_HASH),
    ];
    let other = expected.iter().zip(&words[1..5]).find(|((_, expected), found)| *found != expected);
    other.map_or(FileHeader::Ours, |((field, expected), found)| FileHeader::Other(field, *found, *expected))
}

/// What a record holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum RecordKind {
    /// A frame by itself.
    Whole = 0x4c4f_4857,
    /// What changed since the frame before.
    Changes = 0x4646_4944,
    /// Nothing follows.
    End = 0x2e44_4e45,
}

/// The header of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RecordHeader {
    pub(crate) kind: RecordKind,
    /// Number of the frame in the file, from 1; of the end: one more than there are frames.
    pub(crate) index: u64,
    /// Bytes before compression.
    pub(crate) raw_bytes: u64,
    /// Bytes that follow the header.
    pub(crate) bytes: u64,
    /// Over the five words before and the bytes that follow.
    pub(crate) checksum: u64,
}

impl RecordHeader {
    /// The header of a record with this payload.
    pub(crate) fn new(kind: RecordKind, index: u64, raw_bytes: u64, payload: &[u8]) -> Self {
        let mut header = Self { kind, index, raw_bytes, bytes: payload.len() as u64, checksum: 0 };
        header.checksum = header.checksum_with(payload);
        header
    }

    /// The checksum that it has to have.
    pub(crate) fn checksum_with(&self, payload: &[u8]) -> u64 {
        checksum(&[&self.to_bytes()[..40], payload])
    }

    pub(crate) fn to_bytes(self) -> [u8; RECORD_HEADER] {
        bytemuck::cast([self.kind as u64, self.index, self.raw_bytes, self.bytes, 0, self.checksum])
    }

    /// Reads a header; the error says what is impossible in it, and what would be possible.
    pub(crate) fn from_bytes(bytes: [u8; RECORD_HEADER], index: u64) -> Result<Self, (String, String)> {
        let [kind, found_index, raw_bytes, bytes, zero, checksum]: [u64; 6] = bytemuck::cast(bytes);
        let kinds = [RecordKind::Whole, RecordKind::Changes, RecordKind::End];
        let Some(kind) = kinds.into_iter().find(|k| *k as u64 == kind) else {
            return Err((format!("a record of kind {kind:#x}"), "a frame, or the end".into()));
        };
        if found_index != index {
            return Err((format!("frame number {found_index}"), index.to_string()));
        }
        if zero != 0 {
            return Err((format!("{zero:#x} in an unused word"), "zero".into()));
        }
        // What does not compress grows a little.
        for (found, most) in [(raw_bytes, MAX_FRAME), (bytes, MAX_FRAME + MAX_FRAME / 64)] {
            if found > most {
                return Err((format!("{found} bytes"), format!("at most {most}")));
            }
        }
        Ok(Self { kind, index, raw_bytes, bytes, checksum })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_are_told_apart() {
        let ours = file_header();
        assert_eq!(check_file_header(&ours), FileHeader::Ours);
        assert!(matches!(check_file_header(&ours[..47]), FileHeader::Foreign(_)));
        assert!(matches!(check_file_header(&[b'x'; FILE_HEADER]), FileHeader::Foreign(_)));
        for byte in 0..FILE_HEADER {
            let mut bytes = ours;
            bytes[byte] ^= 1;
            assert_ne!(check_file_header(&bytes), FileHeader::Ours, "byte {byte}");
        }
        let mut words: [u64; 6] = bytemuck::cast(ours);
        words[2] = 7;
        words[5] = checksum(&[bytemuck::cast_slice(&words[..5])]);
        let bytes: [u8; FILE_HEADER] = bytemuck::cast(words);
        assert_eq!(check_file_header(&bytes), FileHeader::Other("format version", 7, VERSION));
    }

    #[test]
    fn record_headers_survive_their_bytes() {
        let header = RecordHeader::new(RecordKind::Changes, 3, 100, b"payload");
        assert_eq!(RecordHeader::from_bytes(header.to_bytes(), 3), Ok(header));
        assert_eq!(header.checksum, header.checksum_with(b"payload"));
        assert_ne!(header.checksum, header.checksum_with(b"paylaod"));
        assert!(RecordHeader::from_bytes(header.to_bytes(), 4).is_err());
        assert!(RecordHeader::from_bytes([0; RECORD_HEADER], 0).is_err());
        let large = RecordHeader { raw_bytes: MAX_FRAME + 1, ..header };
        assert!(RecordHeader::from_bytes(large.to_bytes(), 3).is_err());
    }
}
