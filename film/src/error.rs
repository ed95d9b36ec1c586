//! Gathers what can go wrong with a picture: its pixels, its layers, its files.

use std::path::PathBuf;

/// Why a picture could not be made, written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// The size has no pixels, or more than [`crate::Film::MAX_PIXELS`].
    #[error(
        "picture size: found {width} x {height}, expected 1 x 1 up to {} pixels in all; choose another --size",
        crate::Film::MAX_PIXELS
    )]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A layer's number of pixels is not the picture's.
    #[error("layer {layer}: found {found} pixels, expected {expected} (width x height)")]
    PixelCount {
        /// Name of the layer.
        layer: String,
        /// Pixels in the layer.
        found: usize,
        /// Pixels of the picture.
        expected: usize,
    },
    /// A layer's name is empty, used twice, or has characters other than `a-z`, `0-9`, `_` and `-`.
    #[error("layer name: found \"{name}\", expected a new name of a-z, 0-9, _ and -")]
    LayerName {
        /// The name.
        name: String,
    },
    /// The picture has no such layer.
    #[error("layer \"{name}\" is not in the picture; it has: {present}")]
    NoSuchLayer {
        /// The name asked for.
        name: String,
        /// Names of the layers that are there.
        present: String,
    },
    /// A value is infinite or not a number.
    #[error(
        "layer {layer}, pixel ({x}, {y}), channel {channel}: found {value}, expected a finite number; the file was \
         not written (this is a fault of the renderer: please report the scene)"
    )]
    NotFinite {
        /// Name of the layer.
        layer: String,
        /// Column, from the left.
        x: u32,
        /// Row, from the top.
        y: u32,
        /// `R`, `G` or `B`.
        channel: char,
        /// What was found.
        value: f32,
    },
    /// The file could not be written.
    #[error("{path}: cannot be written: {source}; check the folder and its free space")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file could not be read.
    #[error("{path}: cannot be read: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is no OpenEXR picture, or one with features that are not read here (deep data, sub-sampling).
    #[error("{path}: not a readable OpenEXR picture: {reason}")]
    Decode {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        reason: String,
    },
    /// The file holds no layer with the channels R, G and B.
    #[error("{path}: found the channels {found}, expected R, G and B")]
    Channels {
        /// The file.
        path: PathBuf,
        /// Names of the channels that are there.
        found: String,
    },
    /// The picture could not be encoded.
    #[error("{path}: cannot be encoded: {reason}")]
    Encode {
        /// The file that was to be written.
        path: PathBuf,
        /// What the encoder said.
        reason: String,
    },
}
