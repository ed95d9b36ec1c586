//! Turns a picture file into linear texels.

use crate::picture::Picture;
use glam::Vec4;
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// Most pixels of a texture: 2²⁶, 8192 × 8192.
const MAX_PIXELS: u64 = 1 << 26;

/// Reads a PNG or JPEG file of sRGB values; with `holes`, its alpha says what is there.
///
/// # Errors
/// If it is no such file, or has more than 2²⁶ pixels.
pub(super) fn read(bytes: &[u8], holes: bool) -> Result<Picture, String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("{width} × {height} pixels are more than {MAX_PIXELS}"));
    }
    if width == 0 || height == 0 {
        return Err("it has no pixels".into());
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(16 * MAX_PIXELS);
    decoder.set_limits(limits).map_err(|e| e.to_string())?;
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| e.to_string())?;
    let deep = picture.color().bytes_per_pixel() > picture.color().channel_count();
    let pixels: Vec<Vec4> = if deep {
        let of = |v: u16| linear(f64::from(v) / 65535.0) as f32;
        let pixels = picture.into_rgba16();
        pixels.pixels().map(|p| Vec4::new(of(p[0]), of(p[1]), of(p[2]), f32::from(p[3]) / 65535.0)).collect()
    } else {
        let table: [f32; 256] = std::array::from_fn(|i| linear(i as f64 / 255.0) as f32);
        let of = |v: u8| table[usize::from(v)];
        let pixels = picture.into_rgba8();
        pixels.pixels().map(|p| Vec4::new(of(p[0]), of(p[1]), of(p[2]), f32::from(p[3]) / 255.0)).collect()
    };
    Ok(Picture::new(width, height, pixels, holes))
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

    /// Half black, half white: the linear mean is one half, where that of the sRGB values would be 0.21. f32 and a 65535th.
    #[test]
    fn means_are_of_linear_values() {
        let picture = RgbImage::from_fn(8, 8, |x, _| if x < 4 { Rgb([0; 3]) } else { Rgb([255, 255, 0]) });
        let deep = DynamicImage::from(picture.clone()).into_rgb16();
        for bytes in [encoded(picture, ImageFormat::Png), encoded(deep, ImageFormat::Png)] {
            let mean = read(&bytes, false).unwrap().mean();
            assert!((mean - Vec4::new(0.5, 0.5, 0.0, 1.0)).abs().max_element() < 1e-5, "{mean}");
        }
        // sRGB 188 is 0.5029 linear.
        let grey =
            read(&encoded(RgbImage::from_pixel(4, 4, Rgb([188; 3])), ImageFormat::Png), false).unwrap();
        assert!((grey.mean() - Vec4::new(0.502886, 0.502886, 0.502886, 1.0)).abs().max_element() < 1e-5);
    }

    #[test]
    fn transparent_pixels_weigh_nothing_where_there_are_holes() {
        let picture =
            RgbaImage::from_fn(
                2,
                1,
                |x, _| if x == 0 { Rgba([255, 0, 0, 255]) } else { Rgba([0, 0, 255, 0]) },
            );
        let bytes = encoded(picture, ImageFormat::Png);
        assert_eq!(read(&bytes, true).unwrap().mean(), Vec4::new(1.0, 0.0, 0.0, 0.5));
        assert_eq!(read(&bytes, false).unwrap().mean(), Vec4::new(0.5, 0.0, 0.5, 0.5));
    }

    /// The header of a PNG alone, of 65 000 × 65 000 pixels: refused before they are allocated.
    #[test]
    fn huge_and_damaged_pictures_are_refused() {
        let mut bytes = encoded(RgbImage::new(1, 1), ImageFormat::Png);
        assert!(read(&bytes[..20], false).is_err());
        assert!(read(b"no picture", false).is_err());
        bytes[16..24].copy_from_slice(&[0, 0, 0xfd, 0xe8, 0, 0, 0xfd, 0xe8]);
        let crc = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&crc.to_be_bytes());
        let error = read(&bytes, false).unwrap_err();
        assert!(error.contains("65000 × 65000 pixels"), "{error}");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0, |crc, byte| {
            (0..8)
                .fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
        })
    }
}
