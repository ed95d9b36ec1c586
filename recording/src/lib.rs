//! Published frames as a file, and a file as published frames: record and replay.
//!
//! A [`Recorder`] appends frames to a file as they are published; a [`Recording`] reads them back one after another, with
//! the memory of two frames however long the file is; a [`Playback`] publishes them again, so that any renderer shows
//! them. The format is described byte by byte in this crate's `README.md`.
#![forbid(unsafe_code)]

mod error;
mod format;
mod frame_words;
mod playback;
mod recorder;
mod recording;

pub use error::RecordingError;
pub use format::VERSION;
pub use playback::Playback;
pub use recorder::{Recorder, WHOLE_EVERY};
pub use recording::Recording;
