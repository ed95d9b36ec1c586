//! Turns a sky into beams that stand for it, and each beam into the view from which its shadow map is drawn.

use super::{Frame, box_view, light_uniform, margin};
use crate::layout::{LightUniform, MAP_SEED, ShadowView};
use core::f32::consts::PI;
use glam::Vec3;
use photonstream_shading::{LightShape, Sky, sobol::Sequence};

/// Directions of a sky for each point of an area light.
pub(super) const SKY_POINTS: u32 = 4;

/// Directions drawn by a sky's importance as parallel lights without maps, of `count` those with the number `sample`.
pub(super) fn sky_suns(sky: &Sky, power: Vec3, index: usize, count: u32, sample: u32) -> Vec<LightUniform> {
    let sequence = Sequence::new(MAP_SEED.into(), index as u32);
    let sun = |k: u32| {
        let u = sequence.sample(u64::from(sample) * u64::from(count) + u64::from(k)).next_2d();
        let drawn = sky.sample(u);
        let irradiance = drawn.relative * (4.0 * PI / sky.importance(drawn.relative) / count as f32);
        let shape = LightShape::Directional { direction: -drawn.wi };
        light_uniform(&shape, if irradiance.is_finite() { power * irradiance } else { Vec3::ZERO })
    };
    (0..count).map(sun).collect()
}

/// The view of a beam that covers a box, given by its lowest and highest corner: along the ground its texels are as fine for
/// low beams as for steep ones.
pub(super) fn fitted_view(direction: Vec3, [lo, hi]: [Vec3; 2], resolution: u32) -> ShadowView {
    let right = Vec3::Y.cross(direction).try_normalize().unwrap_or(Vec3::X);
    let frame = Frame { position: (lo + hi) * 0.5, right, up: direction.cross(right), forward: direction };
    let half = (hi - lo) * 0.5;
    // What is flat has some depth, too.
    let least = (half.length() * 1e-3).max(f32::MIN_POSITIVE);
    let reach = [frame.right, frame.up, frame.forward].map(|axis| axis.abs().dot(half).max(least));
    box_view(&frame, reach.map(|r| r * margin(resolution)), resolution)
}

#[cfg(test)]
mod tests {
    use super::{super::tests::seen, *};

    /// A box is seen whole from everywhere, and from low above the horizon with texels as fine on the ground as from above.
    #[test]
    fn a_sky_sees_the_whole_box() {
        let extent = [Vec3::new(-3.0, 0.0, -2.0), Vec3::new(4.0, 1.0, 5.0)];
        for direction in [Vec3::NEG_Y, Vec3::new(0.6, -0.8, 0.0), Vec3::new(0.99, -0.1, 0.1), Vec3::Y] {
            let view = fitted_view(direction.normalize(), extent, 256);
            for corner in 0..8 {
                let pick = |axis: usize| extent[corner >> axis & 1][axis];
                let p = seen(&view, Vec3::new(pick(0), pick(1), pick(2)));
                assert!(
                    p.x.abs() <= 1.0 && p.y.abs() <= 1.0 && (0.0..=1.0).contains(&p.z),
                    "{direction}: {p}"
                );
            }
        }
        // Two points of the ground 1 m apart along a beam 6° above it.
        let direction = Vec3::new(0.995, -0.1, 0.0).normalize();
        let view = fitted_view(direction, [Vec3::new(-6.0, 0.0, -6.0), Vec3::new(6.0, 0.1, 6.0)], 256);
        let texels = (seen(&view, Vec3::X) - seen(&view, Vec3::ZERO)).y.abs() * 128.0;
        assert!(texels > 18.0, "{texels}");
    }
}
