//! Turns a recording back into its frames, one after another, up to the first damage.

use crate::{
    error::RecordingError,
    format::{FILE_HEADER, FileHeader, RECORD_HEADER, RecordHeader, RecordKind, check_file_header},
    frame_words::FrameWords,
};
use photonstream_protocol::VslFrame;
use std::{
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

/// A recording that is read.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    file: BufReader<File>,
    /// First byte of the next record.
    at: u64,
    /// Number of the next frame, from 1.
    next: u64,
    words: FrameWords,
    frame: VslFrame,
    payload: Vec<u8>,
    raw: Vec<u64>,
}

impl Recording {
    /// Opens a recording and stands before its first frame.
    ///
    /// # Errors
    /// `NotARecording`, `OtherRelease`, `Io`.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let io = |action| move |source| RecordingError::Io { action, path: path.to_owned(), source };
        let mut file = BufReader::new(File::open(path).map_err(io("open"))?);
        let mut header = Vec::new();
        file.by_ref().take(FILE_HEADER as u64).read_to_end(&mut header).map_err(io("read"))?;
        match check_file_header(&header) {
            FileHeader::Ours => {}
            FileHeader::Foreign(found) => {
                return Err(RecordingError::NotARecording { path: path.to_owned(), found });
            }
            FileHeader::Other(field, found, expected) => {
                return Err(RecordingError::OtherRelease { path: path.to_owned(), field, found, expected });
            }
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            at: FILE_HEADER as u64,
            next: 1,
            words: FrameWords::default(),
            frame: VslFrame::default(),
            payload: Vec::new(),
            raw: Vec::new(),
        })
    }

    /// The next frame; `None` at the end.
    ///
    /// # Errors
    /// `Truncated` and `Damaged`, which further calls give again; all frames before have been given. `Io`.
    pub fn next_frame(&mut self) -> Result<Option<&VslFrame>, RecordingError> {
        self.file.seek(SeekFrom::Start(self.at)).map_err(|e| self.io("read", e))?;
        let header = self.header()?;
        self.payload.clear();
        self.file
            .by_ref()
            .take(header.bytes)
            .read_to_end(&mut self.payload)
            .map_err(|source| RecordingError::Io { action: "read", path: self.path.clone(), source })?;
        if (self.payload.len() as u64) < header.bytes {
            return Err(self.truncated(RECORD_HEADER as u64 + self.payload.len() as u64));
        }
        let expected = header.checksum_with(&self.payload);
        if header.checksum != expected {
            return Err(
                self.damaged(format!("checksum {:#018x}", header.checksum), format!("{expected:#018x}"))
            );
        }
        if header.kind == RecordKind::End {
            return Ok(None);
        }
        // The checksum has vouched for the lengths.
        self.raw.clear();
        self.raw.resize(header.raw_bytes.div_ceil(8) as usize, 0);
        let raw = &mut bytemuck::cast_slice_mut(&mut self.raw)[..header.raw_bytes as usize];
        let length = lz4_flex::block::decompress_into(&self.payload, raw);
        if length.as_ref().ok() != Some(&raw.len()) {
            let found = length.map_or_else(|e| e.to_string(), |length| format!("{length} bytes"));
            return Err(self.damaged(found, format!("{} bytes after decompression", header.raw_bytes)));
        }
        if header.kind == RecordKind::Whole {
            self.words = FrameWords::default();
        }
        let decoded = self.words.decode(&self.raw).and_then(|()| self.words.write_to(&mut self.frame));
        decoded.map_err(|found| self.damaged(found, "a frame".into()))?;
        self.at += RECORD_HEADER as u64 + header.bytes;
        self.next += 1;
        Ok(Some(&self.frame))
    }

    /// The frame that `next_frame` gave last; an empty one before the first.
    pub fn frame(&self) -> &VslFrame {
        &self.frame
    }

    /// Number of the frame that `next_frame` gives next, from 1.
    pub fn position(&self) -> u64 {
        self.next
    }

    /// Makes `next_frame` give frame `frame` (from 1) next. Frames that are passed over are looked at no more than needed.
    ///
    /// # Errors
    /// `NoSuchFrame`, and those of `next_frame`.
    pub fn seek(&mut self, frame: u64) -> Result<(), RecordingError> {
        let frame = frame.max(1);
        if frame < self.next {
            (self.at, self.next) = (FILE_HEADER as u64, 1);
        }
        // Where to begin: here, or at the last frame before that stands by itself.
        let (mut at, mut next) = (self.at, self.next);
        while self.next < frame {
            self.file.seek(SeekFrom::Start(self.at)).map_err(|e| self.io("read", e))?;
            let header = self.header()?;
            if header.kind == RecordKind::End {
                let frames = self.next - 1;
                return Err(RecordingError::NoSuchFrame { path: self.path.clone(), frame, frames });
            }
            self.at += RECORD_HEADER as u64 + header.bytes;
            self.next += 1;
            if header.kind == RecordKind::Whole {
                (at, next) = (self.at - RECORD_HEADER as u64 - header.bytes, self.next - 1);
            }
        }
        (self.at, self.next) = (at, next);
        while self.next < frame {
            if self.next_frame()?.is_none() {
                let frames = self.next - 1;
                return Err(RecordingError::NoSuchFrame { path: self.path.clone(), frame, frames });
            }
        }
        Ok(())
    }

    fn header(&mut self) -> Result<RecordHeader, RecordingError> {
        let mut bytes = Vec::with_capacity(RECORD_HEADER);
        let read = self.file.by_ref().take(RECORD_HEADER as u64).read_to_end(&mut bytes);
        read.map_err(|e| self.io("read", e))?;
        let header = bytes.try_into().map_err(|bytes: Vec<u8>| self.truncated(bytes.len() as u64))?;
        RecordHeader::from_bytes(header, self.next).map_err(|(found, expected)| self.damaged(found, expected))
    }

    fn truncated(&self, beyond: u64) -> RecordingError {
        // Lengths that were passed over may reach beyond the end.
        let length = self.file.get_ref().metadata().map_or(u64::MAX, |metadata| metadata.len());
        let byte = (self.at + beyond).min(length);
        RecordingError::Truncated { path: self.path.clone(), byte, frame: self.next }
    }

    fn damaged(&self, found: String, expected: String) -> RecordingError {
        RecordingError::Damaged { path: self.path.clone(), byte: self.at, frame: self.next, found, expected }
    }

    fn io(&self, action: &'static str, source: std::io::Error) -> RecordingError {
        RecordingError::Io { action, path: self.path.clone(), source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::file_header;

    /// A file of fewer than 200 bytes with right checksums that speaks of 2²⁶ virtual surface lights (17 GB for the arrays) is damaged, and
    /// nothing is allocated for them.
    #[test]
    fn a_small_file_demands_little_memory() {
        let mut raw = vec![0u64; 8];
        for _ in 0..6 {
            raw.extend([1 << 26, 0]);
        }
        let payload = lz4_flex::block::compress(bytemuck::cast_slice(&raw));
        let header = RecordHeader::new(RecordKind::Whole, 1, raw.len() as u64 * 8, &payload);
        let file = [&file_header()[..], &header.to_bytes(), &payload].concat();
        assert!(file.len() < 200, "{}", file.len());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small");
        std::fs::write(&path, file).unwrap();
        let mut recording = Recording::open(&path).unwrap();
        let error = recording.next_frame().unwrap_err();
        assert!(matches!(error, RecordingError::Damaged { frame: 1, .. }), "{error}");
        assert!(error.to_string().contains("67108864 vsl records in 10 words"), "{error}");
    }
}
