//! Turns unit vectors into two numbers and back: the sphere folded onto a square.

use glam::{Vec2, Vec3};

/// A unit vector as a point of [-1, 1]².
///
/// Source: Meyer et al., "On Floating-Point Normal Vectors", EGSR 2010.
pub fn encode(n: Vec3) -> Vec2 {
    let p = Vec2::new(n.x, n.y) / (n.x.abs() + n.y.abs() + n.z.abs());
    if n.z >= 0.0 { p } else { fold(p) }
}

/// The unit vector of [`encode`]'s point.
pub fn decode(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let xy = if z >= 0.0 { p } else { fold(p) };
    Vec3::new(xy.x, xy.y, z).normalize()
}

fn fold(p: Vec2) -> Vec2 {
    Vec2::new((1.0 - p.y.abs()) * 1.0f32.copysign(p.x), (1.0 - p.x.abs()) * 1.0f32.copysign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling;

    /// 10 000 directions and the axes come back to within 4 ulps of 1: a handful of roundings.
    #[test]
    fn directions_come_back() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|a| [a, -a]);
        let spread = (0..10_000u32).map(|i| {
            sampling::sphere([crate::sobol::van_der_corput(i), (i as f32 * 0.618_034).fract()]).normalize()
        });
        for n in axes.chain(spread) {
            let p = encode(n);
            assert!(p.abs().max_element() <= 1.0);
            assert!((decode(p) - n).length() <= 4.0 * f32::EPSILON, "{n}");
        }
    }
}
