//! Gathers what a user writes in an `[[animation]]` table, before it is validated.

use super::{Vector, values};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// `[[animation]]`: moves or dims one light or object. Exactly one of `light` and `object`, and either keyframes
/// (`times_s` with `values`) or an `orbit`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimationConfig {
    /// Name of the light it changes.
    pub light: Option<String>,
    /// Name of the object it moves; the name of an import moves all its objects.
    pub object: Option<String>,
    /// What of it changes.
    #[serde(default, with = "values::by_name")]
    pub property: Option<AnimatedProperty>,
    /// Times of the keyframes, s; strictly increasing, the first not below 0.
    pub times_s: Option<Vec<f64>>,
    /// What the property is at each of these times, in the unit of its key.
    pub values: Option<Vec<AnimatedValue>>,
    /// How values between two keyframes come about; default linear.
    #[serde(default, with = "values::by_name")]
    pub interpolation: Option<Interpolation>,
    /// A circle, for positions.
    pub orbit: Option<OrbitConfig>,
    /// What follows the last keyframe, or a full turn of the orbit; default loop.
    #[serde(default, with = "values::by_name")]
    pub repeat: Option<Repeat>,
}

/// `orbit`: a circle, passed at constant speed, right-handed about `axis`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OrbitConfig {
    /// Its centre, m.
    pub centre_m: Vector,
    /// Perpendicular to its plane; of any length.
    pub axis: Vector,
    /// Its radius, m.
    pub radius_m: f64,
    /// Time of a full turn, s.
    pub period_s: f64,
    /// Where it starts, from the direction of +X made perpendicular to the axis (+Y where the axis is near X).
    pub phase_deg: Option<f64>,
}

/// A key of a light or object that can change with time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AnimatedProperty {
    /// Where it stands, m.
    Position,
    /// Its three angles, each interpolated as written.
    Rotation,
    /// Its size.
    Scale,
    /// Emitted power, W.
    Power,
    /// Irradiance of directional light, W m⁻².
    Irradiance,
    /// The way the light travels.
    Direction,
    /// A point on the axis of a spot, m.
    Target,
}

/// How values between two keyframes come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Interpolation {
    /// At constant speed.
    #[default]
    Linear,
    /// By 3 s² − 2 s³: starts and stops gently at every keyframe, and never goes beyond the two values.
    Smooth,
    /// The value of the keyframe before.
    Step,
}

/// What follows the last keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Repeat {
    /// The beginning.
    #[default]
    Loop,
    /// The way back, then the beginning.
    Bounce,
    /// Nothing: the last value stays.
    Once,
}

/// A number, or three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnimatedValue {
    /// One number.
    One(f64),
    /// Three numbers.
    Three([f64; 3]),
}

impl Serialize for AnimatedValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::One(value) => value.serialize(serializer),
            Self::Three(values) => values.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for AnimatedValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        values::one_or_three(deserializer, Self::One, Self::Three)
    }
}
