//! Turns numbers of a config into validated ones: finite, within their domain, representable.

use super::{Field, OneOrThree, Vector};
use crate::error::SceneError;
use glam::DVec3;

/// Largest coordinate or length, m: beyond it f32 cannot tell points 60 m apart, and squares come near its limit.
pub const MAX_LENGTH_M: f64 = 1e9;

/// Largest power in W or irradiance in W m⁻².
pub const MAX_POWER: f64 = 1e15;

impl Field<'_> {
    /// A position or edge in m.
    pub(crate) fn metres(&self, value: Vector) -> Result<DVec3, SceneError> {
        self.each(value.0, "numbers within ±1e9 m", "write a position in metres", |x| {
            x.abs() <= MAX_LENGTH_M
        })
    }

    /// A length in m, above 0.
    pub(crate) fn length(&self, value: f64) -> Result<f64, SceneError> {
        self.number(value, "a length in (0, 1e9] m", |x| x > 0.0 && x <= MAX_LENGTH_M)
    }

    /// Three lengths in m, above 0.
    pub(crate) fn lengths(&self, value: Vector) -> Result<DVec3, SceneError> {
        self.each(value.0, "lengths in (0, 1e9] m", "write lengths above 0", |x| x > 0.0 && x <= MAX_LENGTH_M)
    }

    /// Scale factors, of either sign.
    pub(crate) fn scale(&self, value: OneOrThree) -> Result<DVec3, SceneError> {
        let valid = |x: f64| x.abs() >= 1e-9 && x.abs() <= MAX_LENGTH_M;
        self.each(
            value.0,
            "factors other than 0, of magnitude 1e-9 to 1e9",
            "use 1 to keep a size, a negative factor to mirror",
            valid,
        )
    }

    /// Angles in degrees.
    pub(crate) fn degrees(&self, value: Vector) -> Result<DVec3, SceneError> {
        self.each(value.0, "angles within ±36000 degrees", "write angles in degrees", |x| {
            x.abs() <= 36_000.0
        })
    }

    /// A direction, normalised.
    pub(crate) fn direction(&self, value: Vector) -> Result<DVec3, SceneError> {
        let finite =
            self.each(value.0, "numbers within ±1e9", "write a direction [x, y, z]", |x| x.abs() <= 1e9)?;
        finite.try_normalize().ok_or_else(|| {
            self.invalid(show(value.0), "a direction of non-zero length", "write for example [0, -1, 0]")
        })
    }

    /// An albedo.
    pub(crate) fn albedo(&self, value: OneOrThree) -> Result<DVec3, SceneError> {
        self.each(
            value.0,
            "albedos within [0, 1]",
            "a surface cannot reflect less than nothing or more than all light",
            |x| (0.0..=1.0).contains(&x),
        )
    }

    /// Power in W or irradiance in W m⁻².
    pub(crate) fn power(&self, value: OneOrThree) -> Result<DVec3, SceneError> {
        let valid = |x: f64| (0.0..=MAX_POWER).contains(&x);
        self.each(
            value.0,
            "values within [0, 1e15]",
            "a light cannot take light away; use 0 to switch it off",
            valid,
        )
    }

    /// A number in the domain that `expected` describes.
    pub(crate) fn number(
        &self,
        value: f64,
        expected: &str,
        valid: impl Fn(f64) -> bool,
    ) -> Result<f64, SceneError> {
        if value.is_finite() && valid(value) {
            Ok(value)
        } else {
            Err(self.invalid(value, expected, "change the value"))
        }
    }

    /// A whole number within `range`.
    pub(crate) fn count(&self, value: u32, range: std::ops::RangeInclusive<u32>) -> Result<u32, SceneError> {
        if range.contains(&value) {
            Ok(value)
        } else {
            let expected = format!("a whole number from {} to {}", range.start(), range.end());
            Err(self.invalid(value, expected, "change the value"))
        }
    }

    fn each(
        &self,
        value: [f64; 3],
        expected: &str,
        remedy: &str,
        valid: impl Fn(f64) -> bool,
    ) -> Result<DVec3, SceneError> {
        if value.iter().all(|x| x.is_finite() && valid(*x)) {
            Ok(DVec3::from_array(value))
        } else {
            Err(self.invalid(show(value), expected, remedy))
        }
    }
}

fn show([x, y, z]: [f64; 3]) -> String {
    format!("[{x}, {y}, {z}]")
}
