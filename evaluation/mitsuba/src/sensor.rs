//! Turns the camera and the size of the picture into a Mitsuba sensor.

use super::document::Document;
use photonstream_scene::Scene;

/// The nearest that Mitsuba sees, as a share of the radius of the scene.
const NEAR_SHARE: f32 = 1e-4;

/// A perspective camera whose film averages each pixel's whole area (filter `box`), as `reference --filter box` does.
pub(crate) fn write(scene: &Scene, document: &mut Document) {
    let camera = &scene.camera;
    let fov_deg = 2.0 * f64::from(camera.tan_half_fov).atan().to_degrees();
    let (centre, radius) = (scene.bounds.centre, scene.bounds.radius);
    document.begin("sensor", &[("type", &"perspective")]);
    document.property("string", "fov_axis", "y");
    document.property("float", "fov", fov_deg);
    document.property("float", "near_clip", radius * NEAR_SHARE);
    document.property("float", "far_clip", 2.0 * (camera.position.distance(centre) + radius));
    document.look_along(camera.position, camera.forward, camera.up);
    document.begin("film", &[("type", &"hdrfilm")]);
    document.property("integer", "width", "$width");
    document.property("integer", "height", "$height");
    document.property("string", "pixel_format", "rgb");
    document.property("string", "component_format", "float32");
    document.leaf("rfilter", &[("type", &"box")]);
    document.end();
    document.begin("sampler", &[("type", &"independent")]);
    document.property("integer", "sample_count", "$spp");
    document.end();
    document.end();
}
