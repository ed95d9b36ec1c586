//! Turns quantities of light that left the range of `f32` into ones that are inside it.

use glam::Vec3;

/// Each channel as it is, or the nearest value that light can have: 0 below 0 and for NaN, the largest `f32` above it.
#[inline]
pub(crate) fn saturated(light: Vec3) -> Vec3 {
    let channel = |x: f32| if x > 0.0 { if x < f32::MAX { x } else { f32::MAX } } else { 0.0 };
    Vec3::new(channel(light.x), channel(light.y), channel(light.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_light_cannot_be_changes() {
        let (inf, nan, max) = (f32::INFINITY, f32::NAN, f32::MAX);
        assert_eq!(saturated(Vec3::new(0.25, 0.0, max)), Vec3::new(0.25, 0.0, max));
        assert_eq!(saturated(Vec3::new(inf, nan, -1.0)), Vec3::new(max, 0.0, 0.0));
        assert_eq!(saturated(Vec3::splat(-inf)), Vec3::ZERO);
    }
}
