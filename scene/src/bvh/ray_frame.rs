//! Turns a ray into the constants that box and triangle tests share, or into nothing where it cannot hit.

use glam::{Vec3, Vec3A};

use super::Ray;

/// Largest magnitude of a coordinate in metres (about 10¹²) for which no intermediate product overflows `f32`.
pub const MAX_COORDINATE: f32 = 1_099_511_627_776.0;

/// Unit round-off of `f32`, 2⁻²⁴.
const ROUND_OFF: f32 = f32::EPSILON * 0.5;

/// Padding of a triangle's own box, as a multiple of the largest distance of its vertices from the origin.
///
/// The sheared vertices are off by ≤ 6.01 round-offs of that distance, so the exact ray meets a triangle whose
/// vertices moved by no more; subtracting the origin, the reciprocal and the product add ≤ 4; 16 leaves a reserve.
pub const TRIANGLE_PAD: f32 = 16.0 * ROUND_OFF;

/// Padding of node boxes as a multiple of the distance from the origin to the farthest corner of the scene:
/// a triangle's own padding, 4 round-offs between exact and computed own box, and 2 of the node test itself.
const NODE_PAD_DISTANCE: f32 = 24.0 * ROUND_OFF;
/// Padding of node boxes as a multiple of the origin's largest coordinate: rounding `origin` and `origin · inverse`.
pub const NODE_PAD_ORIGIN: f32 = 4.0 * ROUND_OFF;

/// Components of the direction below this part of the largest are taken for that size in box tests, so that
/// reciprocals stay finite: within the scene such a ray moves sideways by < 2⁻³⁹ of its length, far below the padding.
pub const SMALLEST_COMPONENT: f32 = 1.0 / MAX_COORDINATE;

/// Directions with all components from this to [`USUAL_UP_TO`] are not scaled: that would change nothing, as powers of
/// two are exact, and no component is below [`SMALLEST_COMPONENT`] of the largest.
const USUAL_FROM: f32 = 1.0 / 1_073_741_824.0;
const USUAL_UP_TO: f32 = 512.0;

/// A ray whose direction is scaled by a power of two (exactly) to a largest component in [1, 2).
#[derive(Clone, Copy, Debug)]
pub(super) struct RayFrame {
    /// Reciprocal of the scaled direction, finite and not zero.
    pub(super) inverse: Vec3A,
    /// Origins for the near and the far planes of node boxes.
    pub(super) near_origin: Vec3A,
    pub(super) far_origin: Vec3A,
    /// These origins times `inverse`.
    pub(super) near_offset: Vec3A,
    pub(super) far_offset: Vec3A,
    /// Axes: `axis[2]` is the direction's largest, `axis[0]` and `axis[1]` follow it cyclically.
    pub(super) axis: [usize; 3],
    /// Origin and `inverse` in the order of `axis`.
    pub(super) origin_turned: [f32; 3],
    pub(super) inverse_turned: [f32; 3],
    /// Shear that takes the direction to `axis[2]`, and the reciprocal of its length there.
    pub(super) shear: [f32; 2],
    pub(super) inverse_z: f64,
    /// End of the ray in units of the scaled direction.
    pub(super) t_max: f32,
    /// Scaled distance × this = the caller's distance.
    pub(super) t_scale: f32,
}

impl RayFrame {
    /// `None` if anything is not finite (`t_max` may be +∞), the direction is zero, `t_max` ≤ 0 or the origin is
    /// beyond [`MAX_COORDINATE`].
    #[inline(always)]
    pub(super) fn new(ray: &Ray, lo: Vec3, hi: Vec3) -> Option<Self> {
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let largest = direction.abs().max_element();
        // Comparisons with NaN are false.
        let sound = direction.abs().cmple(Vec3A::MAX).all()
            & origin.abs().cmple(Vec3A::splat(MAX_COORDINATE)).all()
            & (largest > 0.0)
            & (ray.t_max > 0.0);
        if !sound {
            return None;
        }
        // Most rays need no scaling, and no wait for their largest component: a branch that is nearly always predicted.
        let usual = (direction.abs().cmpge(Vec3A::splat(USUAL_FROM))
            & direction.abs().cmple(Vec3A::splat(USUAL_UP_TO)))
        .all();
        let (direction, component, t_max, scale) =
            if usual { (direction, direction, ray.t_max, 1.0) } else { scaled(direction, ray.t_max) };
        let distance = (Vec3A::from(lo) - origin).abs().max((Vec3A::from(hi) - origin).abs()).max_element();
        let pad = distance * NODE_PAD_DISTANCE + origin.abs().max_element() * NODE_PAD_ORIGIN;
        let inverse = component.recip();
        let outwards = Vec3A::splat(pad).copysign(component);
        let (near_origin, far_origin) = (origin + outwards, origin - outwards);
        let axis = largest_axis(direction);
        let [kx, ky, kz] = axis;
        let (o, i, d) = (origin.to_array(), inverse.to_array(), direction.to_array());
        Some(Self {
            inverse,
            near_origin,
            far_origin,
            near_offset: near_origin * inverse,
            far_offset: far_origin * inverse,
            axis,
            origin_turned: [o[kx], o[ky], o[kz]],
            inverse_turned: [i[kx], i[ky], i[kz]],
            shear: [d[kx] / d[kz], d[ky] / d[kz]],
            inverse_z: 1.0 / f64::from(d[kz]),
            t_max,
            t_scale: scale,
        })
    }
}

/// A direction scaled by a power of two to a largest component in [1, 2), the same without components that are too
/// small for a reciprocal, `t_max` in its units, and the scale.
#[cold]
#[inline(never)]
fn scaled(direction: Vec3A, t_max: f32) -> (Vec3A, Vec3A, f32, f32) {
    let largest = direction.abs().max_element();
    // 2^-e and 2^e for largest in [2^e, 2^(e+1)); the ends of the exponent range stay within a factor of 2^22.
    let exponent = (largest.to_bits() >> 23).clamp(1, 253);
    let scale = f32::from_bits((254 - exponent) << 23);
    let t_rescale = f32::from_bits(exponent << 23);
    let direction = direction * scale;
    let smallest = largest * scale * SMALLEST_COMPONENT;
    let component = direction.abs().max(Vec3A::splat(smallest)).copysign(direction);
    (direction, component, t_max * t_rescale, scale)
}

/// The largest component's axis last, the others before it in cyclic order; no branch, as rays are incoherent.
#[inline(always)]
fn largest_axis(direction: Vec3A) -> [usize; 3] {
    const ENDING_IN: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];
    let d = direction.abs();
    let y_over_x = usize::from(d.y > d.x);
    let z_over_both = usize::from(d.z > d.x) & usize::from(d.z > d.y);
    ENDING_IN[(z_over_both << 1) | (y_over_x & !z_over_both & 1)]
}
