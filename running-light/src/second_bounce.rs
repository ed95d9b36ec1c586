//! Turns the first bounce of a light into one virtual light that stands for the second.

use crate::{
    error::LengthError,
    finite::saturated,
    light::{Light, Spot},
    vpl::{VirtualLight, Vpl},
};
use core::f32::consts::PI;
use glam::Vec3;

/// An imagined reflector that faces what is lit first, and lights it and its surroundings once more.
///
/// It has an area of π m², which is what makes paper B's factor ρ_ave/d_sec² one without a unit: it receives I/d_sec²
/// and sends ρ_ave (I/d_sec²) π/π.
///
/// Source: paper B §4.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondBounce {
    /// ρ_ave, the mean reflectance of the surroundings, 0 to 1; more is brighter.
    pub average_albedo: f32,
    /// d_sec in m, about the distance between facing surfaces; more is darker and further back. 0 or less turns it off.
    pub distance: f32,
}

impl Default for SecondBounce {
    /// 0.4 and 1 m, as in the authors' script.
    fn default() -> Self {
        Self { average_albedo: 0.4, distance: 1.0 }
    }
}

impl SecondBounce {
    /// The second bounce of static VPLs with the fluxes that [`crate::update`] gave them under `light`: at the mean of
    /// their positions, d_sec against the light's direction, facing against the mean of their normals, with
    /// ρ_ave/d_sec² of the mean of their fluxes; means are weighted by intensity (brightest channel). `None` if none
    /// shines. The mean, not the sum: the more VPLs share the light, the darker it is.
    ///
    /// The paper has one light: with several, update and call this for each alone. A point light has no direction; the
    /// one from it to the mean position is taken.
    ///
    /// # Errors
    /// If `flux` has another length than `vpls`.
    pub fn of_constellation(
        &self,
        vpls: &[Vpl],
        flux: &[Vec3],
        light: &Light,
    ) -> Result<Option<VirtualLight>, LengthError> {
        LengthError::check("flux", flux.len(), vpls.len())?;
        let brightest = flux.iter().fold(0.0f32, |most, flux| most.max(flux.max_element()));
        let (mut sum, mut position, mut normal, mut colour) = (0.0, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        for (vpl, &flux) in vpls.iter().zip(flux) {
            let share = flux.max_element() / brightest;
            sum += share;
            position += vpl.position * share;
            normal += vpl.normal * share;
            colour += flux * share;
        }
        // Without any light the shares are 0/0, and the sum is not a number.
        if sum > 0.0 {
            let (position, colour) = (position / sum, colour / sum);
            let normal = normal.try_normalize();
            let direction = light.direction_towards(position).or(normal.map(|n| -n));
            return Ok(direction.and_then(|direction| self.facing(position, normal, colour, direction)));
        }
        Ok(None)
    }

    /// The second bounce of a phantom, from the phantom alone; off with it.
    pub fn of_phantom(&self, phantom: &VirtualLight, spot: &Spot) -> Option<VirtualLight> {
        self.facing(phantom.position, Some(phantom.normal), phantom.flux, spot.direction)
    }

    /// The reflector for light of the given flux at `position`, which came along `direction`.
    fn facing(&self, x: Vec3, normal: Option<Vec3>, flux: Vec3, direction: Vec3) -> Option<VirtualLight> {
        let factor = self.average_albedo / (self.distance * self.distance);
        let light = VirtualLight {
            position: x - direction * self.distance,
            normal: normal.map_or(direction, |n| -n),
            flux: saturated(flux * factor),
            area: PI,
        };
        let on = self.distance > 0.0 && light.flux != Vec3::ZERO && light.position.is_finite();
        on.then_some(light)
    }
}

#[cfg(test)]
mod tests;
