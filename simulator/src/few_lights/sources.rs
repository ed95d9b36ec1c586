//! Turns a scene's lights into those of `running-light`.

use core::f32::consts::FRAC_1_PI;
use glam::Vec3;
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

/// Whether a light lights VPLs: all but a sky do.
pub(crate) fn lights_vpls(light: &SceneLight) -> bool {
    !matches!(light.light.shape, LightShape::Sky { .. })
}

/// The lights of a scene, in their order. A sky has no samples.
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
            let whole = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ZERO };
            Source { spot: None, samples: Vec::new(), whole }
        }
        ref shape @ (LightShape::Mesh { .. }
        | LightShape::Parallelogram { .. }
        | LightShape::Triangle { .. }) => {
            let sequence = Sequence::new(0, STREAM);
            let place = |index: u32| {
                let u = sequence.sample(index.into()).next_2d();
                match shape {
                    LightShape::Mesh { mesh } => {
                        let place = mesh.place(u);
                        (place.point, place.normal)
                    }
                    _ => (shape.emit_with(bounds, [0.5; 2], u).origin, shape.emitter_normal()),
                }
            };
            let places: Vec<(Vec3, Vec3)> = (0..POINTS).map(place).collect();
            let piece = power / POINTS as f32;
            let samples: Vec<Light> =
                places.iter().map(|&(point, normal)| Light::emitter(point, normal, piece)).collect();
            let whole = match shape {
                // Its faces look everywhere: it sends light as a point in its middle does.
                LightShape::Mesh { .. } => {
                    let sum: Vec3 = places.iter().map(|&(point, _)| point).sum();
                    Light::point(sum / POINTS as f32, power)
                }
                _ => samples[0],
            };
            Source { spot: None, samples, whole }
        }
    }
}
