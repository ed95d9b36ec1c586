//! Turns a sky into a Mitsuba emitter, and its radiances into a picture for one that is not constant.

use super::document::Document;
use exr::prelude::{self as exr_rs, WritableImage};
use glam::Vec3;
use photonstream_scene::Scene;
use photonstream_shading::{Sky, sky::Spread};
use std::{f32::consts::PI, io::Cursor};

/// The picture, seen from the folder of `scene.xml`.
pub(crate) const FILE: &str = "sky.exr";

/// Rows of the picture of a gradient, whose radiances Mitsuba interpolates.
const GRADIENT_ROWS: usize = 1024;

/// The emitter of a sky of the given mean radiance.
pub(crate) fn write(sky: &Sky, power: Vec3, document: &mut Document) {
    if sky.is_constant() {
        document.begin("emitter", &[("type", &"constant")]);
        document.rgb("radiance", power * sky.relative(Vec3::Y));
    } else {
        document.begin("emitter", &[("type", &"envmap")]);
        document.property("string", "filename", FILE);
    }
    document.end();
}

/// The radiances of a sky that shines and is not constant, as OpenEXR.
pub(crate) fn map(scene: &Scene) -> Option<Vec<u8>> {
    let light = &scene.lights[scene.sky?.0 as usize].light;
    let sky = light.shape.sky().filter(|sky| !sky.is_constant() && light.power != Vec3::ZERO)?;
    let (width, height) = match sky.spread() {
        Spread::Gradient(_) => (4, GRADIENT_ROWS),
        Spread::Map(map, _) => (map.width() as usize, map.height() as usize),
    };
    let channels = exr_rs::SpecificChannels::rgb(|at: exr_rs::Vec2<usize>| {
        let [r, g, b] = (light.power * sky.relative(direction(at, width, height))).to_array();
        (r, g, b)
    });
    let mut bytes = Cursor::new(Vec::new());
    let image = exr_rs::Image::from_channels((width, height), channels);
    image.write().to_buffered(&mut bytes).expect("invariant: a picture of floats is written to memory");
    Some(bytes.into_inner())
}

/// Where the middle of a texel lies: of Mitsuba's pictures the left edge is at −Z and the middle at +Z, +X a quarter from the
/// left.
fn direction(at: exr_rs::Vec2<usize>, width: usize, height: usize) -> Vec3 {
    let (sin, cos) = ((at.0 as f32 + 0.5) / width as f32 * 2.0 * PI).sin_cos();
    let (radius, y) = ((at.1 as f32 + 0.5) / height as f32 * PI).sin_cos();
    Vec3::new(radius * sin, y, -radius * cos)
}
