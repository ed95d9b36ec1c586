//! Turns everything that can go wrong between two processes into one typed error that names the remedy.

use std::path::PathBuf;

/// What a publisher, a subscriber or a control connection can report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// No publisher has created the channel.
    #[error(
        "channel '{channel}' does not exist: {path} not found; start a simulator on it, or list what runs with `photonstream channels`"
    )]
    NotCreated {
        /// The channel.
        channel: String,
        /// The file that was looked for.
        path: PathBuf,
    },
    /// The segment exists, and its publisher has not finished preparing it.
    #[error(
        "segment {segment}: state is {found}, expected 2 (live), 3 or 4; the publisher is starting, try again"
    )]
    NotInitialised {
        /// Name of the segment.
        segment: String,
        /// State word found.
        found: u64,
    },
    /// Another publisher owns the channel.
    #[error(
        "channel '{channel}' is in use by {}; choose another --channel or end that process",
        pid.map_or_else(|| "another process".to_owned(), |pid| format!("process {pid}"))
    )]
    ChannelBusy {
        /// The channel.
        channel: String,
        /// Process that holds the channel, where it could be read.
        pid: Option<u32>,
    },
    /// A channel name that cannot be a folder name.
    #[error("channel name '{found}': expected 1 to 32 of a-z, 0-9 and '-', not starting with '-'")]
    InvalidName {
        /// What was given.
        found: String,
    },
    /// A file or folder that somebody else could have written.
    #[error(
        "{path}: {field} is {found}, expected {expected}; remove it or set PHOTONSTREAM_RUNTIME_DIR to a private folder"
    )]
    Insecure {
        /// The file or folder.
        path: PathBuf,
        /// Property that was checked.
        field: &'static str,
        /// Value found.
        found: String,
        /// Value expected.
        expected: String,
    },
    /// The publisher speaks another ABI.
    #[error(
        "ABI {found_major}.{found_minor} found, {expected} expected; use a renderer and a simulator of one release"
    )]
    VersionMismatch {
        /// Major version in the segment.
        found_major: u64,
        /// Minor version in the segment.
        found_minor: u64,
        /// Major version of this build.
        expected: u64,
    },
    /// The records differ in name, offset, size or type of a field.
    #[error(
        "layout hash {found:#018x} found, {expected:#018x} expected; use a renderer and a simulator of one release"
    )]
    LayoutMismatch {
        /// Hash in the segment.
        found: u64,
        /// Hash of this build.
        expected: u64,
    },
    /// The segment was written by a machine of other byte order.
    #[error(
        "endian tag {found:#018x} found, {expected:#018x} expected; segments are not portable between byte orders"
    )]
    EndianMismatch {
        /// Tag in the segment.
        found: u64,
        /// Tag of this machine.
        expected: u64,
    },
    /// Bytes that no correct publisher writes.
    #[error("corrupt segment: {field} is {found}, expected {expected}; restart the simulator")]
    Corrupt {
        /// The field.
        field: String,
        /// Value found.
        found: String,
        /// Values that would have been accepted.
        expected: String,
    },
    /// The publisher ended before it answered.
    #[error("the simulator of channel '{channel}' is gone; restart it (the last frame stays readable)")]
    PublisherGone {
        /// The channel.
        channel: String,
    },
    /// Shared memory cannot hold the segment.
    #[error(
        "shared memory: {bytes} bytes needed, {available} available; enlarge /dev/shm, or reduce the number of lights"
    )]
    NoSpace {
        /// Size of the segment.
        bytes: u64,
        /// Free bytes of the shared-memory file system.
        available: u64,
    },
    /// A record holds NaN or an infinity.
    #[error("{record} record {index}: {field} is {value}, expected a finite number; nothing was published")]
    NonFinite {
        /// Kind of the record.
        record: &'static str,
        /// Index within its array.
        index: usize,
        /// Name of the field.
        field: &'static str,
        /// The value.
        value: f64,
    },
    /// More content than the segment was created for.
    #[error("{field}: {found} given, at most {capacity} fit; replace the segment by a larger one first")]
    TooMany {
        /// What there is too much of.
        field: &'static str,
        /// Number given.
        found: usize,
        /// Capacity of the segment.
        capacity: usize,
    },
    /// A segment specification outside the limits of the ABI.
    #[error("segment specification: {field} is {found}, expected {expected}")]
    InvalidSpec {
        /// The field.
        field: &'static str,
        /// Value given.
        found: u64,
        /// Values that are accepted.
        expected: String,
    },
    /// The operating system refused.
    #[error("cannot {action} {path}: {source}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which file.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// A wait ended at its limit.
    #[error("{what}: nothing within {milliseconds} ms; is the simulator running or stopped?")]
    TimedOut {
        /// What was waited for.
        what: String,
        /// The limit.
        milliseconds: u128,
    },
    /// The caller asked the wait to stop.
    #[error("cancelled while waiting for {what}")]
    Cancelled {
        /// What was waited for.
        what: String,
    },
    /// A control message that cannot be sent or understood.
    #[error("control message: {message}")]
    Control {
        /// What is wrong, and what was expected.
        message: String,
    },
}

impl ProtocolError {
    pub(crate) fn io(
        action: &'static str,
        path: impl Into<PathBuf>,
        source: impl Into<std::io::Error>,
    ) -> Self {
        Self::Io { action, path: path.into(), source: source.into() }
    }

    pub(crate) fn corrupt(field: impl Into<String>, found: impl ToString, expected: impl ToString) -> Self {
        Self::Corrupt { field: field.into(), found: found.to_string(), expected: expected.to_string() }
    }
}
