//! Turns published frames into a file that grows by what changed.

use crate::{
    error::RecordingError,
    format::{FILE_HEADER, MAX_FRAME, RECORD_HEADER, RecordHeader, RecordKind, file_header},
    frame_words::FrameWords,
};
use photonstream_protocol::VslFrame;
use std::{
    fs::File,
    io::Write,
    path::{Path, PathBuf},
};

/// Every so many frames one is written by itself, so that a reader can begin there.
pub const WHOLE_EVERY: u64 = 64;

/// Writes a recording. Each frame is in the file when `write` returns: what was recorded before a crash can be replayed.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    file: File,
    /// The frame written last, and the one being written.
    previous: FrameWords,
    current: FrameWords,
    raw: Vec<u64>,
    record: Vec<u8>,
    frames: u64,
    bytes: u64,
}

impl Recorder {
    /// Begins a recording; a file that is there is replaced.
    ///
    /// # Errors
    /// `Io`.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let io = |action, source| RecordingError::Io { action, path: path.to_owned(), source };
        let mut file = File::create(path).map_err(|e| io("create", e))?;
        file.write_all(&file_header()).map_err(|e| io("write", e))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            previous: FrameWords::default(),
            current: FrameWords::default(),
            raw: Vec::new(),
            record: Vec::new(),
            frames: 0,
            bytes: FILE_HEADER as u64,
        })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// `TooLarge`, and `Io` where the file cannot grow: it keeps the frames before.
    pub fn write(&mut self, frame: &VslFrame) -> Result<(), RecordingError> {
        self.current.set(frame);
        self.raw.clear();
        let kind =
            if self.frames.is_multiple_of(WHOLE_EVERY) { RecordKind::Whole } else { RecordKind::Changes };
        match kind {
            RecordKind::Changes => self.current.encode(&self.previous, &mut self.raw),
            _ => self.current.encode(&FrameWords::default(), &mut self.raw),
        }
        let raw: &[u8] = bytemuck::cast_slice(&self.raw);
        let bytes = raw.len() as u64;
        if bytes > MAX_FRAME {
            return Err(RecordingError::TooLarge { path: self.path.clone(), bytes, most: MAX_FRAME });
        }
        self.record.clear();
        self.record.resize(RECORD_HEADER + lz4_flex::block::get_maximum_output_size(raw.len()), 0);
        let length = lz4_flex::block::compress_into(raw, &mut self.record[RECORD_HEADER..])
            .expect("invariant: there is room for what does not compress");
        self.record.truncate(RECORD_HEADER + length);
        self.append(kind, bytes)?;
        std::mem::swap(&mut self.previous, &mut self.current);
        self.frames += 1;
        Ok(())
    }

    /// Marks the end of the recording.
    ///
    /// # Errors
    /// `Io`.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.record.clear();
        self.record.resize(RECORD_HEADER, 0);
        self.append(RecordKind::End, 0)
    }

    /// Frames written.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Bytes of the file.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Appends the record whose payload has been prepared behind the place of its header.
    fn append(&mut self, kind: RecordKind, raw_bytes: u64) -> Result<(), RecordingError> {
        let (header, payload) = self.record.split_at_mut(RECORD_HEADER);
        header.copy_from_slice(&RecordHeader::new(kind, self.frames + 1, raw_bytes, payload).to_bytes());
        if let Err(source) = self.file.write_all(&self.record) {
            // A record cut short is as good as none; without it the file is whole.
            let _ = self.file.set_len(self.bytes);
            return Err(RecordingError::Io { action: "write", path: self.path.clone(), source });
        }
        self.bytes += self.record.len() as u64;
        Ok(())
    }
}
