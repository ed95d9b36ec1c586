//! Turns virtual surface lights into irradiance with a shadow ray to each.

use crate::{
    cull::{Culling, Emitter, Selection},
    patched,
    tile::Tile,
};
use glam::Vec3;
use photonstream_renderer::shadow_rays::SHADOW_REACH;
use photonstream_scene::{Scene, bvh::Ray};
use photonstream_shading::{Kernel, surface::RELATIVE_OFFSET};

/// What shadow rays have done.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shadowed {
    /// Number of rays.
    pub(crate) rays: u64,
    /// Sum over pixels of the upper bounds of what was skipped, in W m⁻² sr⁻¹.
    pub(crate) skipped: f64,
}

/// Adds the irradiance of the selected lights, where visible, to `tile`.
///
/// A record does not say which triangle carries its light, so its end of the ray is moved off its surface by the
/// largest coordinate of the whole scene times [`RELATIVE_OFFSET`]: no triangle's own offset is larger, and a scene
/// that is scaled as a whole behaves alike.
pub(crate) fn accumulate(
    scene: &Scene,
    culling: &Culling,
    selection: &Selection,
    tile: &mut Tile,
) -> Shadowed {
    let mut result = Shadowed::default();
    let offset = culling.magnitude * RELATIVE_OFFSET;
    // One light at a time: the rays of neighbouring pixels to one light walk the same part of the scene.
    for light in selection.near.iter().chain(&selection.partial) {
        let target = light.position - light.inverse_normal * offset;
        for i in 0..tile.used {
            let normal = tile.normal.get(i);
            let d = light.position - tile.position.get(i);
            let transfer = transfer(light, d, normal);
            if transfer == 0.0 {
                continue;
            }
            let r_sq = d.length_squared();
            if r_sq > light.range_sq {
                result.skipped += f64::from(light.bound / r_sq);
                continue;
            }
            let Some(surface) = &tile.surfaces[i] else { continue };
            result.rays += 1;
            let direction = target - surface.ray_origin;
            let ray = Ray { origin: surface.ray_origin, direction, t_max: SHADOW_REACH };
            if !scene.bvh.occluded(&ray) {
                let arriving = light.flux * (transfer * light.weight(r_sq));
                tile.irradiance.set(i, tile.irradiance.get(i) + arriving);
            }
        }
    }
    for (light, patch) in &selection.patched {
        for i in 0..tile.used {
            let normal = tile.normal.get(i);
            let d = light.position - tile.position.get(i);
            let Some(surface) = &tile.surfaces[i] else { continue };
            let seen = patched::seen(light, patch, d, light.position - surface.ray_origin, normal);
            if seen.transfer == 0.0 {
                continue;
            }
            let r_sq = d.length_squared();
            if r_sq > light.range_sq {
                result.skipped += f64::from(light.bound / r_sq);
                continue;
            }
            result.rays += 1;
            // To the middle of what is above the horizon: the light's own place may lie below it.
            let target = surface.ray_origin + seen.middle - light.inverse_normal * offset;
            let ray = Ray {
                origin: surface.ray_origin,
                direction: target - surface.ray_origin,
                t_max: SHADOW_REACH,
            };
            if !scene.bvh.occluded(&ray) {
                let arriving = light.flux * (seen.transfer * light.weight(r_sq));
                tile.irradiance.set(i, tile.irradiance.get(i) + arriving);
            }
        }
    }
    result
}

#[inline]
fn transfer(light: &Emitter, d: Vec3, normal: Vec3) -> f32 {
    // The disc kernel of area 0 is the point: the light's own area term says which kernel it is.
    Kernel::Disc.transfer(d, normal, -light.inverse_normal, light.area_term)
}
