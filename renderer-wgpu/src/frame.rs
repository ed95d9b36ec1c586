//! Turns a view into the numbers that all passes of its picture share, and says what the view can see.

use crate::{
    Show, View, gather,
    layout::{ALL_LIGHTS, CameraUniform, FrameUniform, Shown},
    openness,
    renderer::OnDevice,
    vsl_shadow_maps,
};
use glam::Vec3;
use photonstream_renderer::LayerKind;
use photonstream_shading::{Camera, Kernel, culling};

/// The numbers of `view`.
pub(crate) fn frame_uniform(view: &View, scene: &OnDevice, vsls: u32, published_edge: u32) -> FrameUniform {
    let Camera { position, forward, right, up, tan_half_fov } = view.camera;
    let show = match view.show {
        Show::Layer(LayerKind::Full) | Show::Discs => Shown::Full,
        Show::Layer(LayerKind::Direct) => Shown::Direct,
        Show::Layer(LayerKind::Indirect) => Shown::Indirect,
        Show::Layer(LayerKind::Albedo) => Shown::Albedo,
        Show::Layer(LayerKind::Normal) => Shown::Normal,
        Show::Layer(LayerKind::Depth) => Shown::Depth,
        Show::Layer(LayerKind::Vsl | LayerKind::Flux) | Show::Age => Shown::Owner,
        Show::Tiles => Shown::Tiles,
    };
    // Behind discs there is direct light alone, and so there is of one light.
    let show = match show {
        Shown::Full if view.show == Show::Discs || view.only_light.is_some() => Shown::Direct,
        show => show,
    };
    let by_lot = view.draws_lots();
    FrameUniform {
        camera: CameraUniform {
            position: position.to_array(),
            tan_half_fov,
            forward: forward.to_array(),
            near: (scene.bounds.radius * 1e-5).max(f32::MIN_POSITIVE),
            right: right.to_array(),
            up: up.to_array(),
            ..CameraUniform::default()
        },
        size: [view.width, view.height],
        tiles: gather::tiles([view.width, view.height]),
        jitter: view.jitter,
        epsilon: view.epsilon,
        albedo_max: scene.albedo_max,
        magnitude: scene.magnitude,
        area_factor: if view.kernel == Kernel::Patch { -1.0 } else { view.kernel.area_term(1.0) },
        interleave: view.interleave,
        vsls,
        lights: scene.lights.len() as u32,
        light_samples: view.light_samples,
        seed_low: view.seed as u32,
        seed_high: (view.seed >> 32) as u32,
        only_light: view.only_light.unwrap_or(ALL_LIGHTS),
        show: show as u32,
        ao_radius: scene.bounds.radius * openness::REACH_SHARE,
        ao_samples: openness::SAMPLES,
        flux_of_range: if by_lot { culling::flux_of_range(scene.albedo_max, view.epsilon) } else { 0.0 },
        first_lot: if by_lot { culling::first_lot(view.seed, view.sample) } else { 0 },
        map_edge: if view.draws_maps() { view.shadow_map_px } else { published_edge },
        map_depth_scale: 1.0 / vsl_shadow_maps::near(scene.bounds),
        ..FrameUniform::default()
    }
}

/// Whether any point of a sphere may be in the picture.
pub(crate) fn can_see(camera: &Camera, aspect: f32, centre: Vec3, radius: f32) -> bool {
    let d = centre - camera.position;
    let depth = d.dot(camera.forward);
    let beside = |across: f32, tan: f32| across.abs() - depth * tan <= radius * (1.0 + tan * tan).sqrt();
    depth > -radius
        && beside(d.dot(camera.right), camera.tan_half_fov * aspect)
        && beside(d.dot(camera.up), camera.tan_half_fov)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spheres_beside_and_behind_are_not_seen_and_those_that_reach_in_are() {
        let camera = Camera::look_at(Vec3::ZERO, Vec3::Z, Vec3::Y, 90.0).unwrap();
        let sees = |x, y, z, r| can_see(&camera, 1.0, Vec3::new(x, y, z), r);
        assert!(sees(0.0, 0.0, 5.0, 1.0) && sees(0.0, 0.0, 0.0, 0.1));
        assert!(!sees(0.0, 0.0, -2.0, 1.0) && sees(0.0, 0.0, -0.5, 1.0));
        // The edge of the picture runs along x = z: the sphere's distance to it is 1/√2 per unit.
        assert!(!sees(6.5, 0.0, 5.0, 1.0) && sees(6.3, 0.0, 5.0, 1.0));
        assert!(!sees(0.0, -6.5, 5.0, 1.0) && sees(0.0, -6.3, 5.0, 1.0));
    }
}
