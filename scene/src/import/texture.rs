//! Turns a picture file into linear texels.

use crate::picture::Picture;
use glam::{Vec3, Vec4};
use image::{DynamicImage, ImageDecoder, ImageReader, Limits};
use std::io::Cursor;

/// Most pixels of a texture: 2²⁶, 8192 × 8192.
const MAX_PIXELS: u64 = 1 << 26;

/// A decoded picture file: linear RGB and alpha within [0, 1], row by row from the top.
#[derive(Debug)]
pub(super) struct Decoded {
    width: u32,
    height: u32,
    pixels: Vec<Vec4>,
}

impl Decoded {
    /// With `holes`, its alpha says what is there.
    pub(super) fn picture(self, holes: bool) -> Picture {
        Picture::new(self.width, self.height, self.pixels, holes)
    }

    /// The picture with holes of the colours of `colour` (white where there is none) where this one is there: its alpha, if
    /// it has one, else how bright its sRGB values are. Each has as many pixels as the finer of both, the other's repeated.
    ///
    /// # Errors
    /// If these are more than 2²⁶.
    pub(super) fn masking(self, colour: Option<&Self>) -> Result<Picture, String> {
        let (width, height) = colour
            .map_or((self.width, self.height), |c| (c.width.max(self.width), c.height.max(self.height)));
        check_size(width, height)?;
        let has_alpha = self.pixels.iter().any(|p| p.w < 1.0);
        let there = |p: Vec4| match has_alpha {
            true => p.w,
            false => encoded(p.truncate().dot(LUMINANCE)),
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = pixels.map(|(x, y)| {
            let at = |of: &Self| of.at(x, y, width, height);
            colour.map_or(Vec4::ONE, at).truncate().extend(there(at(&self)))
        });
        Ok(Picture::new(width, height, pixels.collect(), true))
    }

    /// The pixel that lies where (x, y) does among `width` × `height`.
    fn at(&self, x: u32, y: u32, width: u32, height: u32) -> Vec4 {
        let place = |i: u32, of: u32, to: u32| (u64::from(i) * u64::from(to) / u64::from(of)) as usize;
        self.pixels[place(y, height, self.height) * self.width as usize + place(x, width, self.width)]
    }
}

/// Shares of linear RGB in luminance. Source: ITU-R BT.709.
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

fn check_size(width: u32, height: u32) -> Result<(), String> {
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("{width} × {height} pixels are more than {MAX_PIXELS}"));
    }
    Ok(())
}

/// Reads a PNG or JPEG file of sRGB values.
///
/// # Errors
/// If it is no such file, or has more than 2²⁶ pixels.
pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    check_size(width, height)?;
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
    Ok(Decoded { width, height, pixels })
}

/// sRGB to linear, both in [0, 1]. Source: IEC 61966-2-1.
fn linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Linear to sRGB, both in [0, 1]. Source: IEC 61966-2-1.
fn encoded(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

    fn read(bytes: &[u8], holes: bool) -> Result<Picture, String> {
        decode(bytes).map(|decoded| decoded.picture(holes))
    }

    fn file(picture: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        picture.into().write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    /// Half black, half white: the linear mean is one half, where that of the sRGB values would be 0.21. f32 and a 65535th.
    #[test]
    fn means_are_of_linear_values() {
        let picture = RgbImage::from_fn(8, 8, |x, _| if x < 4 { Rgb([0; 3]) } else { Rgb([255, 255, 0]) });
        let deep = DynamicImage::from(picture.clone()).into_rgb16();
        for bytes in [file(picture, ImageFormat::Png), file(deep, ImageFormat::Png)] {
            let mean = read(&bytes, false).unwrap().mean();
            assert!((mean - Vec4::new(0.5, 0.5, 0.0, 1.0)).abs().max_element() < 1e-5, "{mean}");
        }
        // sRGB 188 is 0.5029 linear.
        let grey = read(&file(RgbImage::from_pixel(4, 4, Rgb([188; 3])), ImageFormat::Png), false).unwrap();
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
        let bytes = file(picture, ImageFormat::Png);
        assert_eq!(read(&bytes, true).unwrap().mean(), Vec4::new(1.0, 0.0, 0.0, 0.5));
        assert_eq!(read(&bytes, false).unwrap().mean(), Vec4::new(0.5, 0.0, 0.5, 0.5));
    }

    /// A mask of 2 × 1 greys beside a picture of 1 × 2 colours: 2 × 2 of both. Half of grey 128 is there, of 127 not.
    #[test]
    fn masks_are_alpha_or_brightness() {
        let colours =
            RgbImage::from_fn(1, 2, |_, y| if y == 0 { Rgb([255, 0, 0]) } else { Rgb([0, 0, 255]) });
        let greys = RgbImage::from_fn(2, 1, |x, _| Rgb([if x == 0 { 128 } else { 127 }; 3]));
        let decoded = |picture: RgbImage| decode(&file(picture, ImageFormat::Png)).unwrap();
        let masked = decoded(greys.clone()).masking(Some(&decoded(colours))).unwrap();
        assert_eq!(masked.pixels(), 4);
        let texel = |picture: &Picture, i: usize| photonstream_shading::texture::unpack(picture.texels()[i]);
        for (i, colour) in [Vec3::X, Vec3::X, Vec3::Z, Vec3::Z].into_iter().enumerate() {
            let found = texel(&masked, i);
            assert!(
                (found.truncate() - colour).length() < 1e-4 && (found.w > 0.5) == (i % 2 == 0),
                "{found}"
            );
        }
        // Without colours white; with an alpha that counts, not the brightness.
        let white = decoded(greys).masking(None).unwrap();
        assert_eq!((texel(&white, 1).truncate(), white.pixels()), (Vec3::ONE, 2));
        let clear = RgbaImage::from_fn(2, 1, |x, _| Rgba([0, 0, 0, if x == 0 { 255 } else { 0 }]));
        let clear = decode(&file(clear, ImageFormat::Png)).unwrap().masking(None).unwrap();
        assert_eq!([texel(&clear, 0).w, texel(&clear, 1).w], [1.0, 0.0]);
    }

    /// The header of a PNG alone, of 65 000 × 65 000 pixels: refused before they are allocated.
    #[test]
    fn huge_and_damaged_pictures_are_refused() {
        let mut bytes = file(RgbImage::new(1, 1), ImageFormat::Png);
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
