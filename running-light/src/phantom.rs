//! Turns the place where the axis of a spot light ends into one virtual light that follows it.

use crate::{
    finite::saturated,
    light::{Light, Spot},
    vpl::{VirtualLight, Vpl},
};
use glam::Vec3;

/// How a phantom takes its properties from the static VPLs, and how fast it follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhantomSettings {
    /// The area in m² of a VPL of weight 1 (paper B's a).
    pub area_per_weight: f32,
    /// δ in m²: VPLs closer than √δ count as if they were there; more blurs, and 0 is taken as 10⁻¹² m².
    pub softening: f32,
    /// Time in s after which 63 % (1 − 1/e) of a jump has been followed; more is smoother and lags, 0 follows at once.
    pub time_constant: f32,
}

impl Default for PhantomSettings {
    /// 1 m²; δ = 0.005 m² as in the authors' script; 24 ms, which is that script's half way per frame at 60 frames/s.
    fn default() -> Self {
        Self { area_per_weight: 1.0, softening: 0.005, time_constant: 0.024 }
    }
}

/// A virtual light where the axis of one spot light meets the scene, instead of the static VPLs.
///
/// What it needs to know of the surface is interpolated from the static VPLs, so that one ray against a rough proxy of
/// the scene is enough. It stands for the interpolated area in the brightness of the beam's axis, whatever the beam's
/// width: where the beam is narrower (a spot close to a wall) it is brighter than it should be, where wider, darker.
///
/// Source: paper B §4.3.
#[derive(Clone, Debug, Default)]
pub struct Phantom {
    followed: Option<State>,
}

/// All that is smoothed: everything but the light's own strength, so that a light that goes off is dark at once.
#[derive(Clone, Copy, Debug)]
struct State {
    position: Vec3,
    /// Not of unit length between two targets, so that following is linear.
    normal: Vec3,
    /// Flux per intensity of the axis in sr, linear RGB: ρ A cosθ/d².
    reflected: Vec3,
    /// In m².
    area: f32,
}

impl Phantom {
    /// One that is off.
    pub const fn new() -> Self {
        Self { followed: None }
    }

    /// Follows the axis of `spot` to where it meets the scene, `hit` (world space, m), for `dt` seconds since the last
    /// call, and returns the light to shade with.
    ///
    /// Following is exponential in time: n steps of dt/n and one of dt end in the same place. A miss (`None`), or a set
    /// without VPLs, turns it off at once; after that it starts anew at its target.
    ///
    /// Source: paper B §4.3, b_i = (|x − x_i|² + δ)⁻¹ over their sum; deviates: the paper does not say how it smooths,
    /// its script does per frame.
    pub fn update(
        &mut self,
        spot: &Spot,
        hit: Option<Vec3>,
        vpls: &[Vpl],
        settings: &PhantomSettings,
        dt: f32,
    ) -> Option<VirtualLight> {
        self.followed = hit.and_then(|x| State::target(spot, x, vpls, settings)).map(|target| {
            let share = share_followed(dt, settings.time_constant);
            self.followed.and_then(|state| state.towards(target, share)).unwrap_or(target)
        });
        self.followed.map(|state| VirtualLight {
            position: state.position,
            normal: state.normal.normalize_or(-spot.direction),
            flux: saturated(spot.intensity * state.reflected),
            area: state.area,
        })
    }
}

impl State {
    /// Where a phantom at `x` ends if nothing moves; none where nothing can be interpolated.
    fn target(spot: &Spot, x: Vec3, vpls: &[Vpl], settings: &PhantomSettings) -> Option<Self> {
        let (normal, albedo, weight) = interpolated(vpls, x, settings.softening)?;
        let area = weight * settings.area_per_weight;
        let normal = normal.normalize_or(-spot.direction);
        // The hit is on the axis but for the caller's rounding: full intensity, and the direction that it has.
        let axis = Light::Point { position: spot.position, intensity: Vec3::ONE };
        let reflected = axis.arrival(x).map_or(Vec3::ZERO, |arrival| {
            let cos_theta = normal.dot(arrival.wi).max(0.0);
            saturated(arrival.irradiance * cos_theta * albedo * area)
        });
        Self { position: x, normal, reflected, area }.finite()
    }

    /// The given share of the way to `target`; none if it leads beyond what an `f32` can hold.
    fn towards(self, target: Self, share: f32) -> Option<Self> {
        let follow = |from: Vec3, to: Vec3| from + (to - from) * share;
        Self {
            position: follow(self.position, target.position),
            normal: follow(self.normal, target.normal),
            reflected: follow(self.reflected, target.reflected),
            area: self.area + (target.area - self.area) * share,
        }
        .finite()
    }

    fn finite(self) -> Option<Self> {
        let finite = self.position.is_finite()
            && self.normal.is_finite()
            && self.reflected.is_finite()
            && self.area.is_finite();
        finite.then_some(self)
    }
}

/// 1 − exp(−dt/τ), 0 to 1: the share of a jump that is followed within `dt` seconds.
fn share_followed(dt: f32, time_constant: f32) -> f32 {
    if time_constant > 0.0 { -libm::expm1f(-dt.max(0.0) / time_constant) } else { 1.0 }
}

/// Normal (not of unit length), albedo and weight at `x` from all VPLs; none if there are none within the range of f32.
fn interpolated(vpls: &[Vpl], x: Vec3, softening: f32) -> Option<(Vec3, Vec3, f32)> {
    let softening = softening.max(1e-12);
    let (mut sum, mut normal, mut albedo, mut weight) = (0.0, Vec3::ZERO, Vec3::ZERO, 0.0);
    for vpl in vpls {
        let b = 1.0 / (x.distance_squared(vpl.position) + softening);
        sum += b;
        normal += vpl.normal * b;
        albedo += vpl.albedo * b;
        weight += vpl.weight * b;
    }
    (sum > 0.0).then(|| (normal / sum, albedo / sum, weight / sum))
}

#[cfg(test)]
mod tests;
