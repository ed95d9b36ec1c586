//! Turns rows of linear RGBA into a picture with all its levels, ready to be looked up.

use glam::{Vec2, Vec4};
use photonstream_shading::texture::{self, Layout, Wrap};
use std::sync::Arc;

/// A picture with its levels, each the mean of the one before. Immutable; shared by all that use it.
#[derive(Debug)]
pub struct Picture {
    texels: Vec<[u32; 2]>,
    layout: Layout,
    mean: Vec4,
    full: u32,
    content: blake3::Hash,
}

/// Pictures are equal that have the same texels.
impl PartialEq for Picture {
    fn eq(&self, other: &Self) -> bool {
        self.content == other.content && self.layout == other.layout
    }
}

/// What a material takes from a picture: the colour that multiplies its albedo, and where it has holes.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The texels.
    pub picture: Arc<Picture>,
    /// Where in the picture's texels, with the wraps of this use.
    pub layout: Layout,
    /// Where the alpha is below this number light passes straight through; `None` where there are no holes.
    pub cutoff: Option<f32>,
}

/// At or above this reflectance a texel counts as white: a path in a closed room of it ends by the cap on survival only.
const WHITE: f32 = 0.999;

impl Picture {
    /// A picture of `width` × `height` pixels, row by row from the top, in linear RGB and alpha within [0, 1].
    ///
    /// With `holes`, a coarse texel's colour is the mean over what is there of it: the alpha is a weight.
    ///
    /// # Panics
    /// If the number of pixels is not `width` × `height`, or is 0.
    pub(crate) fn new(width: u32, height: u32, pixels: Vec<Vec4>, holes: bool) -> Self {
        assert!(width > 0 && height > 0 && pixels.len() == width as usize * height as usize);
        let levels = width.max(height).ilog2() + 1;
        let layout = Layout { first: 0, width, height, levels, ..Layout::default() };
        let full = pixels.iter().filter(|p| p.truncate().max_element() >= WHITE).count() as u32;
        let mut texels = Vec::with_capacity(layout.texels() as usize);
        let mut level = pixels;
        if holes {
            // Colour times alpha, so that what is not there has no colour.
            level.iter_mut().for_each(|p| *p *= Vec4::new(p.w, p.w, p.w, 1.0));
        }
        let plain = |p: &Vec4| match holes {
            true if p.w > 0.0 => (p.truncate() / p.w).extend(p.w),
            _ => *p,
        };
        let mut size = [width, height];
        for index in 0..levels {
            if index > 0 {
                let next = layout.level(index);
                level = halved(&level, size, [next.width, next.height]);
                size = [next.width, next.height];
            }
            texels.extend(level.iter().map(|p| texture::pack(plain(p))));
        }
        let mean = plain(&level[0]);
        let content = blake3::hash(bytemuck::cast_slice(&texels));
        Self { texels, layout, mean, full, content }
    }

    /// All texels, level by level.
    pub fn texels(&self) -> &[[u32; 2]] {
        &self.texels
    }

    /// The mean linear RGB and alpha; the colour is that of what is there.
    pub fn mean(&self) -> Vec4 {
        self.mean
    }

    /// Number of pixels whose reflectance is 1, or as good as that.
    pub(crate) fn full(&self) -> u32 {
        self.full
    }

    /// Number of pixels of the finest level.
    pub(crate) fn pixels(&self) -> u32 {
        self.layout.width * self.layout.height
    }
}

impl Texture {
    /// A use of `picture`.
    pub(crate) fn new(picture: Arc<Picture>, wrap: [Wrap; 2], cutoff: Option<f32>) -> Self {
        let layout = Layout { wrap_u: wrap[0], wrap_v: wrap[1], ..picture.layout };
        Self { picture, layout, cutoff }
    }

    /// RGB and alpha at `uv` in a level, which may lie between two.
    #[inline]
    pub fn sample(&self, uv: Vec2, level: f32) -> Vec4 {
        texture::sample(&self.picture.texels, &self.layout, uv, level)
    }

    /// RGB and alpha at `uv` in one level.
    #[inline]
    pub fn bilinear(&self, uv: Vec2, level: u32) -> Vec4 {
        texture::bilinear(&self.picture.texels, &self.layout, uv, level)
    }

    /// Whether there is a hole at `uv`.
    #[inline]
    pub fn is_hole(&self, uv: Vec2) -> bool {
        self.cutoff.is_some_and(|cutoff| self.bilinear(uv, 0).w < cutoff)
    }
}

/// The means over the rectangles of `to` into which a level of size `from` is cut: exact, also where edges are odd.
fn halved(level: &[Vec4], from: [u32; 2], to: [u32; 2]) -> Vec<Vec4> {
    let columns: Vec<_> = (0..to[0]).map(|x| shares(x, from[0], to[0])).collect();
    let mut coarse = Vec::with_capacity(to[0] as usize * to[1] as usize);
    for y in 0..to[1] {
        let (first_row, rows) = shares(y, from[1], to[1]);
        for (first_column, columns) in &columns {
            let mut sum = Vec4::ZERO;
            for (j, &by_row) in rows.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                let row = &level[(first_row + j) * from[0] as usize + first_column..];
                let in_row = columns.iter().zip(row).fold(Vec4::ZERO, |sum, (share, p)| sum + *p * *share);
                sum += in_row * by_row;
            }
            coarse.push(sum);
        }
    }
    coarse
}

/// The first of `from` texels that texel `index` of `to` covers, and the share of it that each of at most three has; the last
/// may be none at all.
fn shares(index: u32, from: u32, to: u32) -> (usize, [f32; 3]) {
    let ratio = from as f32 / to as f32;
    let (low, high) = (index as f32 * ratio, (index + 1) as f32 * ratio);
    let first = low.floor();
    let mut shares = [0.0; 3];
    for (i, share) in shares.iter_mut().enumerate() {
        let at = first + i as f32;
        *share = ((at + 1.0).min(high) - at.max(low)).max(0.0) / ratio;
    }
    (first as usize, shares)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of every level is that of the picture, odd edges included: shares and sums are rounded in f32, 1e-5, and
    /// texels to 1/65535.
    #[test]
    fn levels_keep_the_mean() {
        for [width, height] in [[1, 1], [8, 4], [5, 3], [7, 1], [1, 6], [37, 19]] {
            let value = |i: u32| ((i * 7919) % 101) as f32 / 101.0;
            let pixels: Vec<_> =
                (0..width * height).map(|i| Vec4::new(value(i), value(i + 3), value(i + 5), 1.0)).collect();
            let mean = pixels.iter().sum::<Vec4>() / pixels.len() as f32;
            let picture = Picture::new(width, height, pixels, false);
            assert!((picture.mean() - mean).abs().max_element() < 1e-5);
            for index in 0..picture.layout.levels {
                let level = picture.layout.level(index);
                let texels =
                    &picture.texels()[level.first as usize..][..(level.width * level.height) as usize];
                // Texels of a level have equal areas.
                let of_level = texels.iter().map(|t| texture::unpack(*t)).sum::<Vec4>() / texels.len() as f32;
                assert!(
                    (of_level - mean).abs().max_element() < 2e-5,
                    "{width}x{height}, {index}: {of_level}"
                );
            }
        }
    }

    /// Half of it holes, black there: what is left is white, and half is there.
    #[test]
    fn holes_have_no_colour() {
        let pixels = (0..16).map(|i| if i % 2 == 0 { Vec4::ONE } else { Vec4::ZERO }).collect();
        let picture = Arc::new(Picture::new(4, 4, pixels, true));
        assert_eq!(picture.mean(), Vec4::new(1.0, 1.0, 1.0, 0.5));
        assert_eq!((picture.full(), picture.pixels()), (8, 16));
        let texture = Texture::new(picture, [Wrap::Repeat; 2], Some(0.5));
        assert!(!texture.is_hole(Vec2::splat(0.125)) && texture.is_hole(Vec2::new(0.375, 0.125)));
        let opaque = Texture { cutoff: None, ..texture };
        assert!(!opaque.is_hole(Vec2::new(0.375, 0.125)));
    }
}
