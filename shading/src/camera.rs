//! Turns pixels into rays: a pinhole camera.

use glam::Vec3;

/// A pinhole camera; +x of the picture to the right, +y down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the eye is, in metres from the scene's origin.
    pub position: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Unit vector to the top of the picture.
    pub up: Vec3,
    /// tan of half the vertical field of view.
    pub tan_half_fov: f32,
}

impl Camera {
    /// A camera at `position` that looks at `target`, `up` towards the top of the picture; field of view in degrees.
    ///
    /// `None` where position and target coincide, `up` is parallel to the view, the field of view is not within
    /// (0, 180), or anything is not finite.
    pub fn look_at(position: Vec3, target: Vec3, up: Vec3, vertical_fov_deg: f32) -> Option<Self> {
        let forward = (target - position).try_normalize()?;
        let right = forward.cross(up.try_normalize()?);
        // Below this sine the roll of the picture would be rounding noise.
        let right = (right.length() > 1e-4).then(|| right.normalize())?;
        let tan_half_fov = (vertical_fov_deg.to_radians() * 0.5).tan();
        let valid = vertical_fov_deg > 0.0
            && vertical_fov_deg < 180.0
            && tan_half_fov.is_finite()
            && position.is_finite();
        valid.then(|| Self { position, forward, right, up: right.cross(forward), tan_half_fov })
    }

    /// The width of a pixel in the middle of a picture of `height` rows, at distance 1.
    #[inline]
    pub fn pixel_width(&self, height: u32) -> f32 {
        2.0 * self.tan_half_fov / height as f32
    }

    /// Unit direction through picture coordinates (`x`, `y`) in pixels of a `width` × `height` picture; pixel (i, j)
    /// spans [i, i+1) × [j, j+1).
    #[inline]
    pub fn direction(&self, x: f32, y: f32, width: u32, height: u32) -> Vec3 {
        let scale = 2.0 * self.tan_half_fov / height as f32;
        let right = (x - 0.5 * width as f32) * scale;
        let up = (0.5 * height as f32 - y) * scale;
        (self.forward + self.right * right + self.up * up).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centre_and_edges_of_the_picture_are_where_they_belong() {
        let camera =
            Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, -5.0), Vec3::Y, 90.0).unwrap();
        assert!((camera.direction(320.0, 240.0, 640, 480) - Vec3::NEG_Z).length() < 1e-6);
        let top = camera.direction(320.0, 0.0, 640, 480);
        assert!((top - Vec3::new(0.0, 1.0, -1.0).normalize()).length() < 1e-6);
        assert!(camera.direction(640.0, 240.0, 640, 480).x > 0.0);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        let look = |target, up, fov| Camera::look_at(Vec3::ZERO, target, up, fov);
        assert!(look(Vec3::ZERO, Vec3::Y, 40.0).is_none());
        assert!(look(Vec3::Y, Vec3::Y, 40.0).is_none());
        assert!(look(Vec3::Z, Vec3::Y, 0.0).is_none());
        assert!(look(Vec3::Z, Vec3::Y, 180.0).is_none());
        assert!(look(Vec3::Z, Vec3::Y, f32::NAN).is_none());
        assert!(look(Vec3::new(f32::NAN, 0.0, 1.0), Vec3::Y, 40.0).is_none());
    }
}
