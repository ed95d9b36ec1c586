//! Turns two pictures, as a display shows them, into FLIP: how different a viewer finds them who swaps one for the other.
//!
//! Source: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020, in NVIDIA's own
//! implementation. Pictures are exposed and tone mapped first; viewing conditions are the paper's (67 pixels a degree).

use glam::Vec3;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};
use photonstream_shading::tone::{ToneMap, to_srgb8};

/// How radiance becomes what a display shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure in stops.
    pub ev: f32,
    /// The tone map.
    pub tone_map: ToneMap,
}

impl Exposure {
    /// 8-bit sRGB of each pixel (linear radiance), row by row.
    pub fn srgb8(&self, pixels: &[Vec3]) -> Vec<u8> {
        pixels.iter().flat_map(|&p| to_srgb8(self.tone_map.apply(p, self.ev))).collect()
    }
}

/// FLIP of a picture: its mean, and what it is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Mean over all pixels, in [0, 1]; 0 for equal pictures.
    pub mean: f64,
    /// The value of each pixel, in [0, 1], row by row.
    pub map: Vec<f32>,
}

/// FLIP of picture `a` against the reference `b`, both `width` × `height` pixels of linear radiance.
///
/// # Panics
/// If a picture has another number of pixels.
pub fn flip(width: u32, height: u32, a: &[Vec3], b: &[Vec3], exposure: Exposure) -> Flip {
    let count = width as usize * height as usize;
    assert!(a.len() == count && b.len() == count, "invariant: both pictures are {width} x {height}");
    let image = |pixels: &[Vec3]| FlipImageRgb8::with_data(width, height, &exposure.srgb8(pixels));
    let map = nv_flip::flip(image(b), image(a), DEFAULT_PIXELS_PER_DEGREE).to_vec();
    let mean = map.iter().map(|&x| f64::from(x)).sum::<f64>() / count.max(1) as f64;
    Flip { mean, map }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINEAR: Exposure = Exposure { ev: 0.0, tone_map: ToneMap::Linear };

    #[test]
    fn equal_pictures_differ_by_nothing_and_opposite_ones_by_nearly_all() {
        let (black, white) = (vec![Vec3::ZERO; 64 * 48], vec![Vec3::ONE; 64 * 48]);
        let grey: Vec<Vec3> = (0..64 * 48).map(|i| Vec3::splat((i % 64) as f32 / 64.0)).collect();
        assert_eq!(flip(64, 48, &grey, &grey, LINEAR).mean, 0.0);
        let opposite = flip(64, 48, &black, &white, LINEAR);
        // Black against white is the largest difference of the measure but for the blurred border.
        assert!(opposite.mean > 0.9 && opposite.mean <= 1.0, "{}", opposite.mean);
        assert_eq!(opposite.map.len(), 64 * 48);
    }

    #[test]
    fn the_map_shows_where_the_difference_is() {
        let b = vec![Vec3::splat(0.2); 64 * 64];
        let mut a = b.clone();
        for y in 0..16 {
            a[y * 64..y * 64 + 16].fill(Vec3::new(0.9, 0.1, 0.1));
        }
        let map = flip(64, 64, &a, &b, LINEAR).map;
        let mean = |x0: usize, y0: usize| {
            (0..8)
                .flat_map(|y| (0..8).map(move |x| (x, y)))
                .map(|(x, y)| map[(y0 + y) * 64 + x0 + x])
                .sum::<f32>()
                / 64.0
        };
        assert!(mean(4, 4) > 0.3, "{}", mean(4, 4));
        // 40 pixels away: beyond the filters of the measure (a few tenths of a degree, 67 pixels a degree).
        assert!(mean(54, 54) < 0.01, "{}", mean(54, 54));
    }
}
