//! Turns position, rotation and scale of an object into the maps between its own, its rest and the config's space.

use crate::{
    config::{Field, OneOrThree, Vector},
    error::SceneError,
    primitives::sin_cos_turn,
};
use glam::{DMat3, DVec3};

/// Where an object stands: scaled along its own axes, turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    pub(crate) scale: DVec3,
    pub(crate) rotation: DMat3,
    pub(crate) position: DVec3,
}

impl Placement {
    /// Reads the placement that a table gives by `position_m`, `rotation_deg` and `scale`, and writes their defaults.
    pub(crate) fn resolve(
        position: &mut Option<Vector>,
        angles: &mut Option<Vector>,
        scale: &mut Option<OneOrThree>,
        field: &Field<'_>,
    ) -> Result<Self, SceneError> {
        let position = *position.get_or_insert(Vector::default());
        let angles = *angles.get_or_insert(Vector::default());
        let scale = *scale.get_or_insert(OneOrThree([1.0; 3]));
        Ok(Self {
            position: field.key("position_m").metres(position)?,
            rotation: rotation(field.key("rotation_deg").degrees(angles)?),
            scale: field.key("scale").scale(scale)?,
        })
    }

    /// A point of the object's own coordinates in those of the config.
    pub(crate) fn apply(&self, point: DVec3) -> DVec3 {
        self.rotation * (self.scale * point) + self.position
    }

    /// The unit vector of a direction of the object's own coordinates in those of the config; 0 where that leads nowhere.
    pub(crate) fn turn(&self, direction: DVec3) -> DVec3 {
        (self.rotation * (self.scale * direction)).normalize_or_zero()
    }
}

/// Intrinsic XYZ: about x, then about the turned y, then about the twice turned z; R = Rx Ry Rz.
pub(crate) fn rotation(degrees: DVec3) -> DMat3 {
    let [(sx, cx), (sy, cy), (sz, cz)] = degrees.to_array().map(|d| sin_cos_turn(d / 360.0));
    let x = DMat3::from_cols(DVec3::X, DVec3::new(0.0, cx, sx), DVec3::new(0.0, -sx, cx));
    let y = DMat3::from_cols(DVec3::new(cy, 0.0, -sy), DVec3::Y, DVec3::new(sy, 0.0, cy));
    let z = DMat3::from_cols(DVec3::new(cz, sz, 0.0), DVec3::new(-sz, cz, 0.0), DVec3::Z);
    x * y * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::EulerRot;

    #[test]
    fn rotation_is_intrinsic_xyz_and_exact_at_right_angles() {
        let angles = DVec3::new(20.0, -50.0, 130.0);
        let r = angles * (std::f64::consts::PI / 180.0);
        let expected = DMat3::from_euler(EulerRot::XYZ, r.x, r.y, r.z);
        // Three products of three rounded factors: a few ulps of 1.
        assert!((rotation(angles) - expected).to_cols_array().iter().all(|d| d.abs() < 1e-15));
        assert_eq!(rotation(DVec3::new(0.0, 90.0, 0.0)) * DVec3::X, DVec3::NEG_Z);
        assert_eq!(rotation(DVec3::new(0.0, 0.0, 90.0)) * DVec3::X, DVec3::Y);
        assert_eq!(rotation(DVec3::new(90.0, 0.0, 0.0)) * DVec3::Y, DVec3::Z);
    }
}
