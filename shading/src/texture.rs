//! Turns texture coordinates into a colour: bilinear within a level, linear between levels, in linear RGB.
//!
//! Texels are four 16-bit fractions of one, linear: red and green in the first word, blue and alpha in the second, the
//! lower half first. Levels lie one after the other, the finest first; each has half the edges of the one before,
//! rounded down, and at least 1.

pub use crate::wrap::Wrap;
use crate::wrap::{neighbour, wrapped};
use glam::{Vec2, Vec3, Vec4};

/// Where the texels of a texture lie, and how it goes on beyond [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Number of the first texel of the finest level.
    pub first: u32,
    /// Columns of the finest level, at least 1.
    pub width: u32,
    /// Rows of the finest level, at least 1.
    pub height: u32,
    /// Number of levels, at least 1.
    pub levels: u32,
    /// How columns go on.
    pub wrap_u: Wrap,
    /// How rows go on.
    pub wrap_v: Wrap,
}

/// One level of a texture: number of its first texel, columns, rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Number of its first texel.
    pub first: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Layout {
    /// Level `index`, the coarsest for all beyond it.
    pub fn level(&self, index: u32) -> Level {
        let last = index.min(self.levels - 1);
        let mut first = self.first;
        for i in 0..last {
            first += (self.width >> i).max(1) * (self.height >> i).max(1);
        }
        Level { first, width: (self.width >> last).max(1), height: (self.height >> last).max(1) }
    }

    /// Number of texels in all levels.
    pub fn texels(&self) -> u32 {
        let last = self.level(self.levels - 1);
        last.first + last.width * last.height - self.first
    }
}

/// The level of which a texel is as wide as `width_m`, in m, on a surface with `density` texels of the finest level in a
/// metre; may lie between two. 0 for widths below a texel.
pub fn level_of_width(density: f32, width_m: f32) -> f32 {
    // What is no number becomes 1.
    let texels = (density * width_m).max(1.0);
    texels.min(f32::MAX).log2()
}

/// The width in m that a pixel spans on a surface at `distance` in m, seen under `cos_theta`: the geometric mean of its
/// width across and along the slope. `pixel` is its width at distance 1.
///
/// Source: Akenine-Möller et al., "Texture Level of Detail Strategies for Real-Time Ray Tracing", Ray Tracing Gems 2019,
/// §20.3.4: a cone along the ray of the pixel.
pub fn footprint(pixel: f32, distance: f32, cos_theta: f32) -> f32 {
    pixel * distance / cos_theta.max(0.01).sqrt()
}

/// RGB and alpha at `uv`, which is finite, in `level` and the one that follows it.
pub fn sample(texels: &[[u32; 2]], layout: &Layout, uv: Vec2, level: f32) -> Vec4 {
    let whole = level.floor();
    let fraction = level - whole;
    let fine = bilinear(texels, layout, uv, whole as u32);
    if fraction <= 0.0 {
        return fine;
    }
    fine + (bilinear(texels, layout, uv, whole as u32 + 1) - fine) * fraction
}

/// RGB and alpha at `uv`, which is finite, in one level: of the four texels around it, whose centres lie half a texel
/// inside their edges.
pub fn bilinear(texels: &[[u32; 2]], layout: &Layout, uv: Vec2, index: u32) -> Vec4 {
    let level = layout.level(index);
    let size = Vec2::new(level.width as f32, level.height as f32);
    let place = Vec2::new(wrapped(uv.x, layout.wrap_u), wrapped(uv.y, layout.wrap_v)) * size - 0.5;
    let low = place.floor();
    let fraction = place - low;
    let (column, row) = (low.x as i32, low.y as i32);
    let columns = [column, column + 1].map(|i| neighbour(i, level.width as i32, layout.wrap_u));
    let rows = [row, row + 1].map(|i| neighbour(i, level.height as i32, layout.wrap_v));
    let texel = |x: i32, y: i32| unpack(texels[(level.first as i32 + y * level.width as i32 + x) as usize]);
    let upper = texel(columns[0], rows[0]) * (1.0 - fraction.x) + texel(columns[1], rows[0]) * fraction.x;
    let lower = texel(columns[0], rows[1]) * (1.0 - fraction.x) + texel(columns[1], rows[1]) * fraction.x;
    upper * (1.0 - fraction.y) + lower * fraction.y
}

/// The four fractions of a texel.
pub fn unpack([a, b]: [u32; 2]) -> Vec4 {
    let fraction = |v: u32| v as f32 / 65535.0;
    Vec4::new(fraction(a & 0xffff), fraction(a >> 16), fraction(b & 0xffff), fraction(b >> 16))
}

/// A texel of four numbers, brought into [0, 1] and to the nearest fraction.
pub fn pack(value: Vec4) -> [u32; 2] {
    let [r, g, b, a] = (value.clamp(Vec4::ZERO, Vec4::ONE) * 65535.0).to_array().map(|v| v.round() as u32);
    [r | g << 16, b | a << 16]
}

/// Texels of a texture of `width` × `height` in a metre of a triangle with these corners and texture coordinates: the
/// root of the ratio of its areas. 0 for triangles without area in either.
pub fn density(corners: [Vec3; 3], uvs: [Vec2; 3], width: u32, height: u32) -> f32 {
    let [a, b, c] = corners;
    let area = (b - a).cross(c - a).length();
    let size = Vec2::new(width as f32, height as f32);
    let [p, q, r] = uvs.map(|uv| uv * size);
    let texels = (q - p).perp_dot(r - p).abs();
    let density = (texels / area).sqrt();
    if density.is_finite() { density } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4 × 2 texels of red = their number / 8, and the coarser levels 2 × 1 and 1 × 1 of means.
    fn counted() -> (Vec<[u32; 2]>, Layout) {
        let value = |v: f32| pack(Vec4::new(v, 0.25, 0.0, 1.0));
        let mut texels: Vec<_> = (0..8).map(|i| value(i as f32 / 8.0)).collect();
        texels.extend([2.5, 4.5].map(|v| value(v / 8.0)));
        texels.push(value(3.5 / 8.0));
        (
            texels,
            Layout { first: 0, width: 4, height: 2, levels: 3, wrap_u: Wrap::Repeat, wrap_v: Wrap::Clamp },
        )
    }

    /// Fractions are of 65535: a texel is off by half of one.
    const ROUNDING: f32 = 0.5 / 65535.0 + 2.0 * f32::EPSILON;

    #[test]
    fn levels_lie_one_after_the_other() {
        let layout = Layout { first: 10, width: 5, height: 3, levels: 3, ..Layout::default() };
        assert_eq!(layout.level(0), Level { first: 10, width: 5, height: 3 });
        assert_eq!(layout.level(1), Level { first: 25, width: 2, height: 1 });
        assert_eq!(layout.level(2), Level { first: 27, width: 1, height: 1 });
        assert_eq!(layout.level(99), layout.level(2));
        assert_eq!(layout.texels(), 18);
    }

    /// At a texel's centre its value; between two centres the mean; beyond the edges what the wrap says.
    #[test]
    fn texels_are_interpolated_between_their_centres() {
        let (texels, layout) = counted();
        let red = |u: f32, v: f32| bilinear(&texels, &layout, Vec2::new(u, v), 0).x * 8.0;
        let near = |a: f32, b: f32| assert!((a - b).abs() <= 8.0 * ROUNDING, "{a}, expected {b}");
        near(red(0.125, 0.25), 0.0);
        near(red(0.875, 0.75), 7.0);
        near(red(0.25, 0.25), 0.5);
        near(red(0.25, 0.5), 2.5);
        // Columns repeat, rows go on with the outermost.
        near(red(1.0, 0.25), 1.5);
        near(red(0.0, 0.25), 1.5);
        near(red(-7.875, 0.25), 0.0);
        near(red(0.125, -3.0), 0.0);
        near(red(0.125, 9.0), 4.0);
        let mirrored = Layout { wrap_u: Wrap::Mirror, ..layout };
        let red = |u: f32| bilinear(&texels, &mirrored, Vec2::new(u, 0.25), 0).x * 8.0;
        near(red(1.0), 3.0);
        near(red(1.125), 3.0);
        near(red(1.875), 0.0);
        near(red(-0.375), 1.0);
        near(red(2.375), 1.0);
    }

    #[test]
    fn levels_are_blended_and_end_with_the_coarsest() {
        let (texels, layout) = counted();
        let red = |level: f32| sample(&texels, &layout, Vec2::new(0.25, 0.5), level).x * 8.0;
        let near = |a: f32, b: f32| assert!((a - b).abs() <= 8.0 * ROUNDING, "{a}, expected {b}");
        near(red(0.0), 2.5);
        near(red(1.0), 2.5);
        near(red(2.0), 3.5);
        near(red(1.5), 3.0);
        near(red(40.0), 3.5);
        assert_eq!(level_of_width(100.0, 0.005), 0.0);
        assert_eq!(level_of_width(100.0, 0.08), 3.0);
        assert!(level_of_width(0.0, f32::INFINITY) == 0.0 && level_of_width(1e30, f32::INFINITY).is_finite());
    }

    #[test]
    fn densities_are_texels_in_a_metre() {
        let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0];
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y];
        assert_eq!(density(corners, uvs, 64, 64), 32.0);
        assert_eq!(density(corners, uvs, 64, 16), 16.0);
        assert_eq!(density(corners, [Vec2::ONE; 3], 64, 16), 0.0);
        assert_eq!(density([Vec3::ONE; 3], uvs, 64, 16), 0.0);
    }

    /// Packing and unpacking change nothing by more than half a fraction; numbers outside [0, 1] come inside.
    #[test]
    fn texels_come_back() {
        for i in 0..=65535u32 {
            let texel = [i | (65535 - i) << 16, i];
            assert_eq!(pack(unpack(texel)), texel);
        }
        assert_eq!(unpack(pack(Vec4::new(-1.0, 2.0, 0.0, 1.0))), Vec4::new(0.0, 1.0, 0.0, 1.0));
    }
}
