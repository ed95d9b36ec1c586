//! Turns one layer of a picture into an 8-bit sRGB PNG file: exposure, tone map, transfer function.

use crate::{Film, FilmError, atomic};
use image::ImageEncoder;
use photonstream_shading::tone::{ToneMap, to_srgb8};
use std::path::Path;

/// How a layer's values become display colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Display {
    /// Radiance: exposed by so many stops and tone mapped.
    Radiance {
        /// Exposure in stops.
        exposure_ev: f32,
        /// The tone map.
        tone_map: ToneMap,
    },
    /// Values in [0, 1] to be shown as they are: albedo, normals, identities.
    Data,
    /// Values from 0 to whatever the largest one is, which becomes white: distances.
    Scaled,
}

impl Film {
    /// Writes the layer called `layer` as PNG, with the metadata as `tEXt` chunks; `path` is replaced at once or not
    /// at all.
    ///
    /// # Errors
    /// [`FilmError::NoSuchLayer`], [`FilmError::NotFinite`], [`FilmError::Encode`], [`FilmError::Write`].
    pub fn write_png(&self, path: &Path, layer: &str, display: Display) -> Result<(), FilmError> {
        self.check_finite()?;
        let pixels = &self.layer(layer)?.pixels;
        let (exposure_ev, tone_map) = match display {
            Display::Radiance { exposure_ev, tone_map } => (exposure_ev, tone_map),
            Display::Data => (0.0, ToneMap::Linear),
            Display::Scaled => {
                let largest = pixels.iter().map(|p| p.max_element()).fold(f32::MIN_POSITIVE, f32::max);
                (-largest.log2(), ToneMap::Linear)
            }
        };
        let rgb: Vec<u8> = pixels.iter().flat_map(|&p| to_srgb8(tone_map.apply(p, exposure_ev))).collect();
        let mut png = Vec::new();
        image::codecs::png::PngEncoder::new(&mut png)
            .write_image(&rgb, self.width(), self.height(), image::ExtendedColorType::Rgb8)
            .map_err(|e| FilmError::Encode { path: path.into(), reason: e.to_string() })?;
        let texts = self.metadata.to_texts();
        atomic::write(path, &with_texts(&png, &texts))
    }
}

/// The PNG file `png` with a `tEXt` chunk for each text, placed behind its header chunk.
fn with_texts(png: &[u8], texts: &[(&'static str, String)]) -> Vec<u8> {
    // Signature (8 bytes), then the header chunk: length, type, 13 bytes of data, checksum.
    const HEADER_END: usize = 8 + 4 + 4 + 13 + 4;
    const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut out = png[..HEADER_END].to_vec();
    for (name, text) in texts {
        let mut chunk = b"tEXt".to_vec();
        chunk.extend_from_slice(name.as_bytes());
        chunk.push(0);
        // The chunk is Latin-1 by definition and must not hold a zero.
        chunk.extend(text.chars().map(|c| match u32::from(c) {
            0 => b' ',
            code => u8::try_from(code).unwrap_or(b'?'),
        }));
        out.extend_from_slice(&(chunk.len() as u32 - 4).to_be_bytes());
        out.extend_from_slice(&chunk);
        out.extend_from_slice(&CHECKSUM.checksum(&chunk).to_be_bytes());
    }
    out.extend_from_slice(&png[HEADER_END..]);
    out
}
