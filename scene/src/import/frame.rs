//! Turns points of a file, in its units and with its axis up, into metres with +Y up.

use crate::{
    config::{Field, UpAxis},
    error::SceneError,
};
use glam::{DMat3, DVec3};

/// The units and axes of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    up: UpAxis,
    unit_m: f64,
}

impl Frame {
    /// Reads `up_axis` and `unit_m` of the table `field`, and writes their defaults.
    ///
    /// # Errors
    /// If the unit is no length.
    pub(crate) fn resolve(
        up_axis: &mut Option<UpAxis>,
        unit_m: &mut Option<f64>,
        field: &Field<'_>,
    ) -> Result<Self, SceneError> {
        let up = *up_axis.get_or_insert_default();
        let unit_m = field.key("unit_m").length(*unit_m.get_or_insert(1.0))?;
        Ok(Self { up, unit_m })
    }

    /// With `up` pointing up, and so many metres in a unit.
    pub(crate) fn new(up: UpAxis, unit_m: f64) -> Self {
        Self { up, unit_m }
    }

    /// A point of the file, m.
    pub(crate) fn apply(&self, point: DVec3) -> DVec3 {
        self.turn(point) * self.unit_m
    }

    /// The map of directions and lengths of the file to those of the scene, m.
    pub(crate) fn matrix(&self) -> DMat3 {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| self.apply(axis));
        DMat3::from_cols(x, y, z)
    }

    /// A direction of the file.
    pub(crate) fn turn(&self, v: DVec3) -> DVec3 {
        match self.up {
            UpAxis::Y => v,
            UpAxis::Z => DVec3::new(v.x, v.z, -v.y),
        }
    }
}
