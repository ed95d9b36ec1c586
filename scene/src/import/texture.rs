//! Turns a picture file into its mean colour.

use glam::{DVec3, DVec4};
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// Most pixels of a texture: 2²⁶, 8192 × 8192.
const MAX_PIXELS: u64 = 1 << 26;

/// How the alpha of a texture counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Alpha {
    /// Not at all.
    Ignored,
    /// As the weight of a pixel: what is transparent has no colour.
    Weighs,
}

/// The mean linear RGB of a PNG or JPEG file with sRGB values.
///
/// # Errors
/// If it is no such file, or has more than 2²⁶ pixels.
pub(super) fn mean_colour(bytes: &[u8], alpha: Alpha) -> Result<DVec3, String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("{width} × {height} pixels are more than {MAX_PIXELS}"));
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(16 * MAX_PIXELS);
    decoder.set_limits(limits).map_err(|e| e.to_string())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    let deep = picture.color().bytes_per_pixel() > picture.color().channel_count();
    let sum: DVec4 = if deep {
        picture
            .into_rgba16()
            .pixels()
            .map(|p| weighted(p.0.map(|v| f64::from(v) / 65535.0), alpha, linear))
            .sum()
    } else {
        let table: [f64; 256] = std::array::from_fn(|i| linear(i as f64 / 255.0));
        let look_up = |v: f64| table[v as usize];
        let pixels = picture.into_rgba8();
        pixels.pixels().map(|p| weighted([p[0], p[1], p[2], p[3]].map(f64::from), alpha, look_up)).sum()
    };
    // All of it transparent: no colour is to be seen.
    Ok(if sum.w > 0.0 { sum.truncate() / sum.w } else { DVec3::ZERO })
}

/// Linear RGB times the pixel's weight, and the weight; its unit cancels.
fn weighted([r, g, b, a]: [f64; 4], alpha: Alpha, linear: impl Fn(f64) -> f64) -> DVec4 {
    let weight = if alpha == Alpha::Weighs { a } else { 1.0 };
    DVec3::new(linear(r), linear(g), linear(b)).extend(1.0) * weight
}

/// sRGB to linear, both in [0, 1]. Source: IEC 61966-2-1.
fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

    fn encoded(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.into().write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    /// Half black, half white: the linear mean is one half, where that of the sRGB values would be 0.21.
    #[test]
    fn means_are_of_linear_values() {
        let picture = RgbImage::from_fn(8, 8, |x, _| if x < 4 { Rgb([0; 3]) } else { Rgb([255, 255, 0]) });
        let mean = mean_colour(&encoded(picture.clone(), ImageFormat::Png), Alpha::Ignored).unwrap();
        assert_eq!(mean, DVec3::new(0.5, 0.5, 0.0));
        let deep = DynamicImage::from(picture).into_rgb16();
        let mean = mean_colour(&encoded(deep, ImageFormat::Png), Alpha::Ignored).unwrap();
        // A sum of 64 values: a few ulps.
        assert!((mean - DVec3::new(0.5, 0.5, 0.0)).abs().max_element() < 1e-14, "{mean}");
        // sRGB 188 is 0.5029 linear.
        let grey = RgbImage::from_pixel(4, 4, Rgb([188; 3]));
        let mean = mean_colour(&encoded(grey, ImageFormat::Png), Alpha::Ignored).unwrap();
        assert!((mean - DVec3::splat(0.502886)).abs().max_element() < 1e-6, "{mean}");
    }

    #[test]
    fn transparent_pixels_weigh_nothing_where_alpha_counts() {
        let picture =
            RgbaImage::from_fn(
                2,
                1,
                |x, _| if x == 0 { Rgba([255, 0, 0, 255]) } else { Rgba([0, 0, 255, 0]) },
            );
        let bytes = encoded(picture, ImageFormat::Png);
        assert_eq!(mean_colour(&bytes, Alpha::Weighs).unwrap(), DVec3::X);
        assert_eq!(mean_colour(&bytes, Alpha::Ignored).unwrap(), DVec3::new(0.5, 0.0, 0.5));
    }

    /// The header of a PNG alone, of 65 000 × 65 000 pixels: refused before they are allocated.
    #[test]
    fn huge_and_damaged_pictures_are_refused() {
        let mut bytes = encoded(RgbImage::new(1, 1), ImageFormat::Png);
        assert!(mean_colour(&bytes[..20], Alpha::Ignored).is_err());
        assert!(mean_colour(b"no picture", Alpha::Ignored).is_err());
        bytes[16..24].copy_from_slice(&[0, 0, 0xfd, 0xe8, 0, 0, 0xfd, 0xe8]);
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = mean_colour(&bytes, Alpha::Ignored).unwrap_err();
        assert!(error.contains("65000 × 65000 pixels"), "{error}");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, byte| {
            (0..8)
                .fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
        })
    }
}
