//! Turns `[camera]` into a pinhole camera in the scene's space.

use crate::{
    config::{CameraConfig, Field, Vector},
    error::SceneError,
};
use glam::DVec3;
use photonstream_shading::Camera;

pub(super) fn camera(
    config: &mut CameraConfig,
    field: &Field<'_>,
    origin: DVec3,
) -> Result<Camera, SceneError> {
    let missing = |key: &str| field.missing(key);
    let position = config.position_m.ok_or_else(|| missing("position_m"))?;
    let position = field.key("position_m").metres(position)?;
    let target = field.key("target_m").metres(config.target_m.ok_or_else(|| missing("target_m"))?)?;
    let up_config = *config.up.get_or_insert(Vector([0.0, 1.0, 0.0]));
    let up = field.key("up").direction(up_config)?;
    let fov = field.key("vertical_fov_deg").number(
        config.vertical_fov_deg.ok_or_else(|| missing("vertical_fov_deg"))?,
        "an angle of at least 0.001 and below 180 degrees",
        |x| (0.001..180.0).contains(&x),
    )?;
    let Some(forward) = (target - position).try_normalize() else {
        return Err(field.key("target_m").invalid(
            "the camera's own position",
            "a point apart from position_m",
            "move target_m to what the camera looks at",
        ));
    };
    if forward.cross(up).length() < 1e-3 {
        return Err(field.key("up").invalid(
            "a direction along the view",
            "a direction that makes an angle with it",
            "choose another up, for example [0, 0, 1]",
        ));
    }
    // The target only gives a direction: taken at unit distance it keeps its precision however far the real one is.
    let eye = (position - origin).as_vec3();
    let mut camera = Camera::look_at(glam::Vec3::ZERO, forward.as_vec3(), up.as_vec3(), fov as f32)
        .ok_or_else(|| {
            field.invalid("a degenerate camera", "a view with a direction and an angle", "change it")
        })?;
    camera.position = eye;
    Ok(camera)
}
