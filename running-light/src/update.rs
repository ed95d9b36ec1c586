//! Turns lights into the flux of all static VPLs, and into the list of those that are worth shading with.

use crate::{
    error::LengthError,
    finite::saturated,
    light::Light,
    visibility::Visibility,
    vpl::{Vpl, VplId},
};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;

/// Intensity below which a VPL is culled unless told otherwise, in W sr⁻¹.
///
/// Source: paper B §4.1, I_cull.
pub const CULL_INTENSITY: f32 = 0.01;

/// What holds for a whole set of VPLs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpdateSettings {
    /// The area in m² of a VPL of weight 1 (paper B's a); more makes all indirect light brighter.
    pub area_per_weight: f32,
    /// VPLs whose brightest channel has less intensity, in W sr⁻¹, are culled; more culls more.
    pub cull_intensity: f32,
}

impl Default for UpdateSettings {
    /// 1 m², and paper B's I_cull.
    fn default() -> Self {
        Self { area_per_weight: 1.0, cull_intensity: CULL_INTENSITY }
    }
}

/// The flux of all VPLs under all lights, Φ = ρ A Σ E, and which of them shine: their number is returned, their ids are
/// the beginning of `active`, ascending. The flux of the others is exactly 0.
///
/// `flux` (W, linear RGB) and `active` have one entry for each VPL; whatever was in them is overwritten. With
/// E = I cosθ V/d² for lights with a place and E cosθ V for directional ones; the intensity of a VPL along its normal
/// is I = Φ/π.
///
/// # Errors
/// If `flux` or `active` has another length than `vpls`.
///
/// Source: paper B §4.1 and §4.2; deviates: the paper has one light, several add up here before culling; intensities
/// are RGB, and the brightest channel decides about culling.
pub fn update(
    vpls: &[Vpl],
    lights: &[Light],
    visibility: &mut Visibility<'_>,
    settings: &UpdateSettings,
    flux: &mut [Vec3],
    active: &mut [VplId],
) -> Result<usize, LengthError> {
    LengthError::check("flux", flux.len(), vpls.len())?;
    LengthError::check("active", active.len(), vpls.len())?;
    let mut shining = 0;
    for ((id, vpl), flux) in (0..).map(VplId).zip(vpls).zip(flux) {
        let area = vpl.weight * settings.area_per_weight;
        let lit = saturated(irradiance(vpl, lights, visibility) * vpl.albedo * area);
        let brightest = lit.max_element() * FRAC_1_PI;
        let shines = brightest > 0.0 && brightest >= settings.cull_intensity;
        *flux = if shines { lit } else { Vec3::ZERO };
        if shines {
            active[shining] = id;
            shining += 1;
        }
    }
    Ok(shining)
}

/// Irradiance E of a VPL's front under all lights in W m⁻².
#[inline]
fn irradiance(vpl: &Vpl, lights: &[Light], visibility: &mut Visibility<'_>) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for light in lights {
        let Some(arrival) = light.arrival(vpl.position) else { continue };
        let cos_theta = vpl.normal.dot(arrival.wi);
        if cos_theta > 0.0 && arrival.irradiance != Vec3::ZERO {
            let passing = visibility.passing(vpl.position, &arrival);
            sum += arrival.irradiance * (cos_theta * passing);
        }
    }
    saturated(sum)
}

#[cfg(test)]
mod tests;
