//! Turns the index of a virtual surface light into a colour, and says which lights may own a point.

use glam::Vec3;

/// Smallest cosine between the normals of a point and of its owner; without such a light the nearest of the same side.
pub const COMPATIBLE_COS: f32 = 0.5;

/// A colour for each index that neighbours do not share: a hue far from that of the indices around it.
pub fn colour(index: usize) -> Vec3 {
    // Golden-ratio steps spread any run of hues, and two more of other irrationals the brightness and saturation.
    let part = |step: f64| ((index as f64 + 0.5) * step).fract() as f32;
    let hue = part(0.618_033_988_749_895);
    let value = 0.5 + 0.5 * part(0.754_877_666_246_693);
    let saturation = 0.45 + 0.5 * part(0.569_840_290_998_053);
    let channel = |offset: f32| {
        let x = (hue + offset).fract() * 6.0;
        let ramp = ((x - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        value * (1.0 - saturation + saturation * ramp)
    };
    Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_valid_and_distinct() {
        let colours: Vec<_> = (0..1000).map(colour).collect();
        for (i, a) in colours.iter().enumerate() {
            assert!(a.min_element() >= 0.0 && a.max_element() <= 1.0);
            // Neighbouring indices are told apart at a glance.
            assert!(colours[..i].iter().rev().take(4).all(|b| a.distance(*b) > 0.1), "{i}");
        }
    }
}
