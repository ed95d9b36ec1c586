//! Turns a scene's lights into those of `running-light`.

use core::f32::consts::FRAC_1_PI;
use photonstream_running_light::{Light, Spot};
use photonstream_scene::{Scene, SceneLight};
use photonstream_shading::{LightShape, light::Bounds, sobol::Sequence};

/// Points that stand for a light with a surface.
pub(crate) const POINTS: u32 = 16;

/// The stream of these points.
const STREAM: u32 = 0x5e1f;

/// One light of a scene.
#[derive(Debug)]
pub(super) struct Source {
    /// Set for spots.
    pub(super) spot: Option<Spot>,
    /// What lights VPLs.
    pub(super) samples: Vec<Light>,
    /// One light that stands for all of them: for its direction.
    pub(super) whole: Light,
}

/// Whether a light is a spot.
pub(crate) fn is_spot(light: &SceneLight) -> bool {
    matches!(light.light.shape, LightShape::Spot { .. })
}

/// The lights of a scene, in their order. A sky lights no VPL.
pub(super) fn of(scene: &Scene) -> Vec<Source> {
    scene.lights.iter().map(|light| source(light, scene.bounds)).collect()
}

fn source(light: &SceneLight, bounds: Bounds) -> Source {
    let power = light.light.power;
    let single = |light: Light| Source { spot: None, samples: vec![light], whole: light };
    match light.light.shape {
        LightShape::Point { position } => single(Light::point(position, power)),
        LightShape::Directional { direction } => single(Light::Directional { direction, irradiance: power }),
        LightShape::Spot { position, direction, versine_inner, versine_outer } => {
            let intensity = power * (FRAC_1_PI / (versine_inner + versine_outer));
            let spot = Spot { position, direction, versine_inner, versine_outer, intensity };
            Source { spot: Some(spot), ..single(Light::Spot(spot)) }
        }
        LightShape::Sky { .. } => {
            let whole = Light::Directional { direction: glam::Vec3::NEG_Y, irradiance: glam::Vec3::ZERO };
            Source { spot: None, samples: Vec::new(), whole }
        }
        ref shape @ (LightShape::Mesh { .. }
        | LightShape::Parallelogram { .. }
        | LightShape::Triangle { .. }) => {
            let sequence = Sequence::new(0, STREAM);
            let piece = power / POINTS as f32;
            let samples: Vec<Light> = (0..POINTS)
                .map(|index| {
                    let u = sequence.sample(index.into()).next_2d();
                    match shape {
                        LightShape::Mesh { mesh } => {
                            let place = mesh.place(u);
                            Light::emitter(place.point, place.normal, piece)
                        }
                        _ => {
                            let origin = shape.emit_with(bounds, [0.5; 2], u).origin;
                            Light::emitter(origin, shape.emitter_normal(), piece)
                        }
                    }
                })
                .collect();
            let whole = samples[0];
            Source { spot: None, samples, whole }
        }
    }
}
