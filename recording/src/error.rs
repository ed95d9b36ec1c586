//! Turns what can be wrong with a recording into errors that name file and byte.

use std::path::PathBuf;

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// Something else than a recording.
    #[error("{path}: {found} in the first bytes, expected a recording; make one with `photonstream record`")]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// A recording of another release.
    #[error(
        "{path}: {field} is {found:#x}, expected {expected:#x}; replay it with the release that recorded it"
    )]
    OtherRelease {
        /// The file.
        path: PathBuf,
        /// Field of the header.
        field: &'static str,
        /// Its value.
        found: u64,
        /// That of this build.
        expected: u64,
    },
    /// The file ends before the recording does.
    #[error(
        "{path}: the file ends at byte {byte}, within or before frame {frame}, without the mark of its end; \
         the {} frames before are whole", frame - 1
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Its length.
        byte: u64,
        /// The first frame that is missing, from 1.
        frame: u64,
    },
    /// Bytes that no recorder writes.
    #[error(
        "{path}: damaged at byte {byte}, in the record of frame {frame}: {found}, expected {expected}; the frames before are whole"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// First byte of the record.
        byte: u64,
        /// The frame that is lost, from 1.
        frame: u64,
        /// What was found.
        found: String,
        /// What would have been right.
        expected: String,
    },
    /// A frame that does not fit into a record.
    #[error("{path}: a frame of {bytes} bytes, expected at most {most}; reduce the number of lights")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Bytes of the frame.
        bytes: u64,
        /// What fits.
        most: u64,
    },
    /// A frame beyond the end was asked for.
    #[error("{path}: frame {frame} asked for, there are {frames}")]
    NoSuchFrame {
        /// The file.
        path: PathBuf,
        /// Number of the frame, from 1.
        frame: u64,
        /// Frames of the recording.
        frames: u64,
    },
    /// The operating system refused.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
}
