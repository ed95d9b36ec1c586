//! Turns what a picture depends on into keys: a stage is done again only when its key differs from the last one.

use crate::{Accumulation, Shadows, Show, View};
use photonstream_renderer::LayerKind;
use photonstream_scene::{RangeCulling, Visibility};
use photonstream_shading::{Camera, Kernel};

/// Counts of changes to what is on the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Versions {
    pub(crate) shape: u64,
    pub(crate) materials: u64,
    pub(crate) lights: u64,
    pub(crate) vsls: u64,
}

/// A stage of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Shadow maps, whatever the view.
    Maps,
    GBuffer,
    Direct,
    Unpack,
    Indirect,
    Openness,
    Owners,
    Output,
}

impl Stage {
    const COUNT: usize = 8;
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    view: View,
    versions: Versions,
}

/// What each stage was last done for.
#[derive(Debug, Default)]
pub(crate) struct Done([Option<Key>; Stage::COUNT]);

impl Done {
    /// Whether `stage` has to be done for this picture.
    pub(crate) fn is_stale(&self, stage: Stage, view: &View, versions: Versions) -> bool {
        self.0[stage as usize] != Some(key(stage, view, versions))
    }

    pub(crate) fn set(&mut self, stage: Stage, view: &View, versions: Versions) {
        self.0[stage as usize] = Some(key(stage, view, versions));
    }

    /// Forgets everything: the textures are new, or a picture was given up half way.
    pub(crate) fn forget(&mut self) {
        self.0 = Default::default();
    }
}

/// The view and versions with all that does not matter to `stage` set to the same values.
fn key(stage: Stage, view: &View, versions: Versions) -> Key {
    let base = View {
        width: view.width,
        height: view.height,
        camera: Camera {
            position: glam::Vec3::ZERO,
            forward: glam::Vec3::ZERO,
            right: glam::Vec3::ZERO,
            up: glam::Vec3::ZERO,
            tan_half_fov: 1.0,
        },
        kernel: Kernel::Paper,
        visibility: Visibility::None,
        shadow_map_px: 0,
        epsilon: 0.0,
        culling: RangeCulling::Cut,
        accumulation: Accumulation::Tiled,
        interleave: 1,
        shadows: Shadows::None,
        rays_per_pixel: 0,
        light_samples: 1,
        show: Show::Layer(LayerKind::Full),
        only_light: None,
        jitter: [0.0; 2],
        sample: 0,
        seed: 0,
    };
    let seen = View { camera: view.camera, jitter: view.jitter, ..base };
    let shape = Versions { shape: versions.shape, ..Versions::default() };
    let View { kernel, epsilon, seed, .. } = *view;
    // Lots are drawn anew for each sample and seed; what has no range does not care for the culling.
    let lots = view.draws_lots();
    let culling = if lots { view.culling } else { RangeCulling::Cut };
    let (lot_sample, lot_seed) = if lots { (view.sample, seed) } else { (0, 0) };
    match stage {
        // New views of lights are told apart by the lights' table.
        Stage::Maps => Key { view: View { width: 0, height: 0, ..base }, versions: shape },
        Stage::GBuffer => Key { view: seen, versions: shape },
        Stage::Direct => {
            let View { shadows, light_samples, only_light, sample, .. } = *view;
            let view = View { shadows, light_samples, only_light, sample, seed, ..seen };
            Key { view, versions: Versions { lights: versions.lights, ..shape } }
        }
        // The range depends on the largest albedo.
        Stage::Unpack => {
            let versions =
                Versions { vsls: versions.vsls, materials: versions.materials, ..Versions::default() };
            let base = View { culling, sample: lot_sample, seed: lot_seed, ..base };
            Key { view: View { width: 0, height: 0, kernel, epsilon, ..base }, versions }
        }
        Stage::Indirect => {
            let rays = view.by_rays();
            let view = View {
                kernel,
                epsilon,
                accumulation: view.accumulation,
                interleave: view.interleave,
                visibility: match view.visibility {
                    Visibility::Octahedral => Visibility::Octahedral,
                    Visibility::ShadowMaps if view.draws_maps() => Visibility::ShadowMaps,
                    _ if rays => Visibility::Rays,
                    _ => Visibility::None,
                },
                shadow_map_px: if view.draws_maps() { view.shadow_map_px } else { 0 },
                // Lists that the sum itself does not need are made for it alone.
                show: if view.show == Show::Tiles { Show::Tiles } else { base.show },
                rays_per_pixel: if rays { view.rays_per_pixel } else { 0 },
                culling,
                sample: if rays { view.sample } else { lot_sample },
                seed: if rays { seed } else { lot_seed },
                ..seen
            };
            Key { view, versions: Versions { vsls: versions.vsls, materials: versions.materials, ..shape } }
        }
        Stage::Openness => Key { view: View { seed, ..seen }, versions: shape },
        Stage::Owners => {
            let view = View { show: view.show, ..seen };
            Key { view, versions: Versions { vsls: versions.vsls, ..shape } }
        }
        Stage::Output => Key { view: *view, versions },
    }
}

#[cfg(test)]
mod tests {
    use super::{Stage::*, *};
    use photonstream_scene::RenderSettings;

    fn view() -> View {
        let camera = Camera::look_at(glam::Vec3::ZERO, glam::Vec3::Z, glam::Vec3::Y, 40.0).unwrap();
        View::from_settings(&RenderSettings::default(), &camera)
    }

    #[test]
    fn a_stage_is_done_again_only_for_what_it_depends_on() {
        let (view, versions) = (view(), Versions::default());
        let stages = [Maps, GBuffer, Direct, Unpack, Indirect, Openness, Owners, Output];
        let mut done = Done::default();
        for stage in stages {
            assert!(done.is_stale(stage, &view, versions));
            done.set(stage, &view, versions);
        }
        let stale = |view: View, versions| {
            stages.into_iter().filter(|&s| done.is_stale(s, &view, versions)).collect::<Vec<_>>()
        };

        assert_eq!(stale(view, versions), []);
        let mut camera = view.camera;
        camera.position.x = 1.0;
        assert_eq!(
            stale(View { camera, ..view }, versions),
            [GBuffer, Direct, Indirect, Openness, Owners, Output]
        );
        assert_eq!(stale(View { shadows: Shadows::Rays, ..view }, versions), [Direct, Output]);
        assert_eq!(stale(View { kernel: Kernel::Paper, ..view }, versions), [Unpack, Indirect, Output]);
        let culling = RangeCulling::Cut;
        assert_eq!(stale(View { culling, ..view }, versions), [Unpack, Indirect, Output]);
        assert_eq!(stale(View { interleave: 2, ..view }, versions), [Indirect, Output]);
        assert_eq!(stale(View { shadow_map_px: 32, ..view }, versions), [Output]);
        let visibility = Visibility::ShadowMaps;
        assert_eq!(stale(View { visibility, ..view }, versions), [Indirect, Output]);
        assert_eq!(stale(View { show: Show::Tiles, ..view }, versions), [Indirect, Owners, Output]);
        assert_eq!(stale(view, Versions { vsls: 1, ..versions }), [Unpack, Indirect, Owners, Output]);
        assert_eq!(stale(view, Versions { lights: 1, ..versions }), [Direct, Output]);
        assert_eq!(stale(view, Versions { materials: 1, ..versions }), [Unpack, Indirect, Output]);
        assert_eq!(
            stale(view, Versions { shape: 1, ..versions }),
            [Maps, GBuffer, Direct, Indirect, Openness, Owners, Output]
        );
    }
}
