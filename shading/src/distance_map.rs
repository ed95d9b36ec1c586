//! Turns the distances that a virtual surface light sees around itself into what of it a receiver sees: octahedral maps.
//!
//! The half space above a light is folded onto a square (the hemispherical variant of Cigolle et al., "A Survey of Efficient
//! Representations for Independent Unit Vectors", JCGT 3(2), 2014), and each texel holds how far away the first surface is in
//! the direction of its centre. Distances are in the 1-norm, m = |x| + |y| + |z| in the light's own axes: over a plane 1/m is a
//! linear function of the place on the octahedron, so that the plane of a receiver is followed exactly from texel to texel.

use crate::basis;
use glam::{Vec2, Vec3};

/// Edges that maps may have, in texels.
pub const EDGES: [u32; 4] = [8, 16, 32, 64];

/// A surface hides a receiver if it is nearer to the light than the receiver, and than the receiver's plane, by more than so
/// many halves of a texel's width: 1/m of `BIAS_TEXELS`/edge. Measured over five scenes: 3 leaves faces in corners too dark, 8
/// loses the shadows of contacts.
pub const BIAS_TEXELS: f32 = 4.0;

/// Texels of a published word, the first in its lower half.
pub const TEXELS_PER_WORD: u32 = 2;

/// Bits of an f32's mantissa that a texel does not keep.
pub const SHIFT: u32 = 23 - 10;
/// Upper bits of 2⁻³², the smallest inverse distance: a texel is how many steps another is above it.
pub const LEAST: u32 = (127 - 32) << 10;

/// An inverse distance (m⁻¹) as 16 bits: 6 of exponent, from 2⁻³² to 2³², and 10 of mantissa, rounded towards zero: a surface
/// is never taken for a nearer one. 0 stands for all that is farther than 2³² m.
#[inline]
pub fn pack(inverse: f32) -> u16 {
    let bits = inverse.to_bits() >> SHIFT;
    // What is negative or no number ends at the largest value.
    bits.saturating_sub(LEAST).min(0xffff) as u16
}

/// The inverse distance of 16 bits, m⁻¹: at least 2⁻³².
#[inline(always)]
pub fn unpack(texel: u16) -> f32 {
    f32::from_bits((u32::from(texel) + LEAST) << SHIFT)
}

/// The share by which a surface has to be nearer to hide a receiver in a map of `edge`² texels.
#[inline(always)]
pub fn bias(edge: u32) -> f32 {
    BIAS_TEXELS / edge as f32
}

/// The middle of a texel of a map of `edge`² texels as a point of the octahedron |x| + |y| + |z| = 1, z ≥ 0 (axes of the light).
#[inline]
pub fn centre(edge: u32, x: u32, y: u32) -> Vec3 {
    let step = 2.0 / edge as f32;
    lift(Vec2::new((x as f32 + 0.5) * step - 1.0, (y as f32 + 0.5) * step - 1.0))
}

/// From the square [-1, 1]² to the upper half of the octahedron.
#[inline]
fn lift(square: Vec2) -> Vec3 {
    let (x, y) = (0.5 * (square.x + square.y), 0.5 * (square.x - square.y));
    Vec3::new(x, y, 1.0 - x.abs() - y.abs())
}

/// The axes of a light's map: two tangents and its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// First tangent.
    pub tangent: Vec3,
    /// Second tangent.
    pub bitangent: Vec3,
    /// The light's unit normal.
    pub normal: Vec3,
}

impl Axes {
    /// The axes of the light with the unit normal `normal`.
    #[inline]
    pub fn of(normal: Vec3) -> Self {
        let (tangent, bitangent) = basis::tangents(normal);
        Self { tangent, bitangent, normal }
    }

    /// A vector of the scene's space in these axes.
    #[inline]
    pub fn local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.tangent.dot(v), self.bitangent.dot(v), self.normal.dot(v))
    }

    /// A vector of these axes in the scene's space.
    #[inline]
    pub fn world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

/// What is to be compared for one receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// Places of four texels in the map, row by row.
    pub texels: [u32; 4],
    /// How much each of them counts; 1 in all.
    pub weights: [f32; 4],
    /// The light is seen through a texel that holds no larger inverse distance, m⁻¹.
    pub limits: [f32; 4],
}

impl Lookup {
    /// The comparisons for a receiver at `to` from the light, in m, with the unit normal `normal`, both in the light's axes, in
    /// a map of `edge`² texels.
    #[inline(always)]
    pub fn new(edge: u32, to: Vec3, normal: Vec3) -> Self {
        let size = edge as f32;
        let m = (to.x.abs() + to.y.abs() + to.z.max(0.0)).max(f32::MIN_POSITIVE);
        let height = normal.dot(to);
        // A receiver whose plane the light's middle lies behind, as a polygon's may, is taken for a point.
        let (is_point, inverse_height) = (height >= 0.0, 1.0 / height);
        let own = 1.0 / m;
        let place = |p: f32| (0.5 * size * (p * own) + (0.5 * size + 0.5)).clamp(0.0, size);
        let (x, y) = (place(to.x + to.y), place(to.x - to.y));
        // One more than the lower texel's, so that it is truncated as it is floored.
        let (column, row) = (x as i32, y as i32);
        let (share_x, share_y) = (x - column as f32, y - row as f32);
        let last = edge as i32 - 1;
        let step = 2.0 / size;
        let scale = 1.0 + bias(edge);
        let mut lookup = Self { texels: [0; 4], weights: [0.0; 4], limits: [0.0; 4] };
        for corner in 0..4 {
            let (right, up) = (corner as i32 & 1, corner as i32 >> 1);
            let (u, v) = ((column - 1 + right).clamp(0, last), (row - 1 + up).clamp(0, last));
            let across = if right == 1 { share_x } else { 1.0 - share_x };
            let along = if up == 1 { share_y } else { 1.0 - share_y };
            let (a, b) = ((u as f32 + 0.5) * step - 1.0, (v as f32 + 0.5) * step - 1.0);
            let (px, py) = (0.5 * (a + b), 0.5 * (a - b));
            let pz = 1.0 - px.abs() - py.abs();
            let plane = (normal.x * px + normal.y * py + normal.z * pz) * inverse_height;
            let nearest = if !is_point && plane > own { plane } else { own };
            lookup.texels[corner] = (v * edge as i32 + u) as u32;
            lookup.weights[corner] = across * along;
            lookup.limits[corner] = nearest * scale;
        }
        lookup
    }

    /// The share of the light, in [0, 1], that is seen where the texels hold these inverse distances.
    #[inline(always)]
    pub fn seen(&self, inverses: [f32; 4]) -> f32 {
        let corners = inverses.iter().zip(&self.limits).zip(&self.weights);
        corners.map(|((inverse, limit), weight)| if inverse <= limit { *weight } else { 0.0 }).sum()
    }
}

/// The share of the light, in [0, 1], that a receiver sees by the light's map of `edge`² texels: 1 where there is no map.
///
/// `to` leads from the light to the receiver, in m, and `normal` is the receiver's, both in the light's axes. The four texels
/// around the receiver's direction are compared with the receiver's plane, each where it lies, and with the receiver itself, and
/// weighted (percentage-closer filtering: Reeves, Salesin & Cook, "Rendering Antialiased Shadows with Depth Maps", SIGGRAPH
/// 1987).
#[inline]
pub fn visibility(map: &[u16], edge: u32, to: Vec3, normal: Vec3) -> f32 {
    let lookup = Lookup::new(edge, to, normal);
    lookup.seen(lookup.texels.map(|index| unpack(map.get(index as usize).copied().unwrap_or(0))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{sampling, sobol::Sequence};

    /// Every texel is told from its neighbours, and an inverse distance is never made larger, nor smaller by more than 2⁻¹⁰ of it.
    #[test]
    fn inverse_distances_come_back_rounded_down() {
        for texel in 0..=u16::MAX {
            assert_eq!(pack(unpack(texel)), texel);
        }
        for i in 0..10_000 {
            let inverse = (-22.0 + 44.0 * (i as f32 / 10_000.0)).exp();
            let found = unpack(pack(inverse));
            assert!(found <= inverse && found >= inverse * (1.0 - 1.0 / 1024.0), "{inverse:e}: {found:e}");
        }
        assert_eq!([0.0, 1e-20, f32::MIN_POSITIVE].map(pack), [0; 3]);
        assert_eq!([1e20, f32::INFINITY, f32::NAN].map(pack), [u16::MAX; 3]);
    }

    /// The middle of each texel is above the horizon, and looked up where it lies.
    #[test]
    fn texels_are_found_where_they_lie() {
        for edge in EDGES {
            for i in 0..edge * edge {
                let p = centre(edge, i % edge, i / edge);
                assert!(p.z > 0.0 && (p.x.abs() + p.y.abs() + p.z - 1.0).abs() < 1e-6);
                let lookup = Lookup::new(edge, p * 3.0, -p.normalize());
                let weight: f32 = (0..4).filter(|&c| lookup.texels[c] == i).map(|c| lookup.weights[c]).sum();
                assert!((weight - 1.0).abs() < 1e-4, "{edge}, {i}: {lookup:?}");
                assert!((lookup.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            }
        }
    }

    /// The map of what `distance` says, in m along unit vectors.
    fn map(edge: u32, distance: impl Fn(Vec3) -> f32) -> Vec<u16> {
        let texel = |i: u32| {
            let p = centre(edge, i % edge, i / edge);
            // So far away in the 1-norm.
            pack(p.length() / distance(p.normalize()))
        };
        (0..edge * edge).map(texel).collect()
    }

    /// A plane alone, however steeply the light looks at it, shows all of its points: N = 20 planes of 1 000 points, seed 4, in maps
    /// of 8² to 64² texels. Behind a screen at a quarter of the way none is seen where the plane is steep enough: a texel's middle p_i
    /// is at most 2√2/edge from the receiver's place p on the octahedron, and |p| ≥ 1/√3, so that the screen's inverse distance,
    /// 4 n·p_i over the plane's height, is beyond the limit, n·p (1 + bias), where cos θ > (2√6/edge) / (1 − (1 + bias)/4). That is
    /// 0.98 in the coarsest map, where these planes are held to 0.8.
    #[test]
    fn planes_do_not_hide_themselves() {
        for edge in EDGES {
            for plane in 0..20 {
                let mut sample = Sequence::new(4, plane).sample(0);
                let n = -sampling::cosine_hemisphere(Vec3::Z, sample.next_2d());
                let height = 0.1 + sample.next_1d();
                let wall = move |w: Vec3| if w.dot(n) < 0.0 { height / -w.dot(n) } else { f32::INFINITY };
                let open = map(edge, wall);
                let hidden = map(edge, |w| 0.25 * wall(w));
                let steep = 24f32.sqrt() / edge as f32 / (1.0 - 0.25 * (1.0 + bias(edge)));
                for i in 0..1000 {
                    let mut sample = Sequence::new(4, 100 + plane).sample(i);
                    let w = sampling::cosine_hemisphere(Vec3::Z, sample.next_2d());
                    if w.dot(n) > -0.02 || w.z < 0.02 {
                        continue;
                    }
                    let to = w * wall(w);
                    let seen = visibility(&open, edge, to, n);
                    assert!((seen - 1.0).abs() < 1e-5, "{edge}: {to} on {n}: {seen}");
                    let seen = visibility(&hidden, edge, to, n);
                    assert!(seen == 0.0 || -w.dot(n) < steep.min(0.8), "{edge}: {to} on {n}: {seen}");
                }
            }
        }
    }

    /// Without a map, and behind the light's plane where it does not look, nothing hides anything; nothing is no number.
    #[test]
    fn what_is_not_known_hides_nothing() {
        for to in [Vec3::ZERO, Vec3::NEG_Z, Vec3::X, Vec3::splat(5e8), Vec3::new(0.3, -0.2, 1.0)] {
            for normal in [Vec3::NEG_Z, Vec3::Z, Vec3::X] {
                let open = visibility(&[], 8, to, normal);
                assert!((open - 1.0).abs() < 1e-6, "{to}, {normal}: {open}");
                let seen = visibility(&[u16::MAX; 64], 8, to, normal);
                assert!((0.0..=1.0).contains(&seen), "{to}, {normal}: {seen}");
            }
        }
    }
}
