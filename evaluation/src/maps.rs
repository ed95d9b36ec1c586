//! Turns errors of pixels into colours, and pixels into PNG files.

use crate::flip::Flip;
use glam::Vec3;
use image::ImageEncoder;
use photonstream_shading::tone::luminance;

/// A picture of 8-bit sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Three bytes a pixel, row by row from the top left.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// As a PNG file.
    ///
    /// # Errors
    /// Those of the encoder.
    ///
    /// # Panics
    /// If there are not three bytes for each pixel.
    pub fn png(&self) -> Result<Vec<u8>, image::ImageError> {
        let mut png = Vec::new();
        let encoder = image::codecs::png::PngEncoder::new(&mut png);
        encoder.write_image(&self.rgb, self.width, self.height, image::ExtendedColorType::Rgb8)?;
        Ok(png)
    }
}

/// Too bright is orange, too dark is blue, right is grey; `scale` (W m⁻² sr⁻¹, above 0) is the difference in luminance that has
/// the full colour.
pub fn signed_error(width: u32, height: u32, a: &[Vec3], b: &[Vec3], scale: f32) -> Picture {
    let rgb = a.iter().zip(b).flat_map(|(&a, &b)| signed_colour((luminance(a) - luminance(b)) / scale));
    Picture { width, height, rgb: rgb.collect() }
}

/// Mean luminance of a picture of linear radiance, W m⁻² sr⁻¹.
pub fn mean_luminance(pixels: &[Vec3]) -> f32 {
    pixels.iter().map(|&p| luminance(p)).sum::<f32>() / pixels.len().max(1) as f32
}

/// The colour of a signed error in [−1, 1]; beyond it is clipped.
pub fn signed_colour(error: f32) -> [u8; 3] {
    const RIGHT: Vec3 = Vec3::new(236.0, 236.0, 236.0);
    const BRIGHT: Vec3 = Vec3::new(190.0, 60.0, 0.0);
    const DARK: Vec3 = Vec3::new(10.0, 70.0, 190.0);
    let end = if error > 0.0 { BRIGHT } else { DARK };
    // The root shows small errors, too.
    RIGHT.lerp(end, error.abs().min(1.0).sqrt()).round().to_array().map(|x| x as u8)
}

/// FLIP in the colours of its paper (magma): black is no difference.
pub fn flip_picture(width: u32, height: u32, flip: &Flip) -> Picture {
    let colours = nv_flip::magma_lut().to_vec();
    let last = colours.len() / 3 - 1;
    let rgb = flip.map.iter().flat_map(|&value| {
        let i = (value.clamp(0.0, 1.0) * last as f32).round() as usize;
        // NVIDIA's images hold red, green and blue in this order.
        [colours[3 * i], colours[3 * i + 1], colours[3 * i + 2]]
    });
    Picture { width, height, rgb: rgb.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_have_colours() {
        assert_eq!(signed_colour(0.0), [236, 236, 236]);
        assert_eq!(signed_colour(1.0), [190, 60, 0]);
        assert_eq!(signed_colour(-3.0), [10, 70, 190]);
        let picture = signed_error(2, 1, &[Vec3::ONE, Vec3::ZERO], &[Vec3::ZERO, Vec3::ZERO], 1.0);
        assert_eq!(picture.rgb, [190, 60, 0, 236, 236, 236]);
    }

    #[test]
    fn a_png_is_read_back() {
        let picture = Picture { width: 2, height: 1, rgb: vec![1, 2, 3, 250, 100, 0] };
        let png = picture.png().unwrap();
        assert_eq!(image::load_from_memory(&png).unwrap().to_rgb8().into_raw(), picture.rgb);
    }

    #[test]
    fn no_difference_is_black() {
        let flip = Flip { mean: 0.5, map: vec![0.0, 1.0] };
        let picture = flip_picture(2, 1, &flip);
        assert!(picture.rgb[..3].iter().all(|&x| x < 8), "{:?}", picture.rgb);
        // The end of magma is a light yellow.
        assert!(picture.rgb[3] > 240 && picture.rgb[4] > 240 && picture.rgb[5] > 150, "{:?}", picture.rgb);
    }
}
