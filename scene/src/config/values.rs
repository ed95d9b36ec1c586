//! Turns TOML values into vectors, colours and named choices, and back.

use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;

/// Three numbers `[x, y, z]`.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Vector(pub [f64; 3]);

/// One number for all three components, or three numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OneOrThree(pub [f64; 3]);

impl Vector {
    /// As a vector to compute with.
    pub fn to_dvec3(self) -> DVec3 {
        DVec3::from_array(self.0)
    }
}

impl OneOrThree {
    /// As a vector to compute with.
    pub fn to_dvec3(self) -> DVec3 {
        DVec3::from_array(self.0)
    }
}

impl From<DVec3> for Vector {
    fn from(v: DVec3) -> Self {
        Self(v.to_array())
    }
}

impl Serialize for Vector {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl Serialize for OneOrThree {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Vector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Components { one: None, three: Self })
    }
}

impl<'de> Deserialize<'de> for OneOrThree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        one_or_three(deserializer, |value| Self([value; 3]), Self)
    }
}

/// Reads one number or three, into what `one` and `three` make of them.
pub(super) fn one_or_three<'de, T, D: Deserializer<'de>>(
    deserializer: D,
    one: fn(f64) -> T,
    three: fn([f64; 3]) -> T,
) -> Result<T, D::Error> {
    deserializer.deserialize_any(Components { one: Some(one), three })
}

/// Three numbers, or one where that has a meaning.
struct Components<T> {
    one: Option<fn(f64) -> T>,
    three: fn([f64; 3]) -> T,
}

impl<'de, T> de::Visitor<'de> for Components<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.one.is_some() {
            "a number or three numbers [a, b, c]"
        } else {
            "three numbers [x, y, z]"
        })
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<T, E> {
        self.one.map(|one| one(value)).ok_or_else(|| E::invalid_type(de::Unexpected::Float(value), &self))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<T, E> {
        self.one
            .map(|one| one(value as f64))
            .ok_or_else(|| E::invalid_type(de::Unexpected::Signed(value), &self))
    }

    // TOML has signed integers only, JSON both.
    fn visit_u64<E: de::Error>(self, value: u64) -> Result<T, E> {
        self.one
            .map(|one| one(value as f64))
            .ok_or_else(|| E::invalid_type(de::Unexpected::Unsigned(value), &self))
    }

    fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<T, A::Error> {
        let mut values = Vec::with_capacity(3);
        while let Some(value) = seq.next_element::<f64>()? {
            values.push(value);
        }
        let count = values.len();
        match values.try_into() {
            Ok(values) => Ok((self.three)(values)),
            Err(_) => Err(de::Error::invalid_length(count, &self)),
        }
    }
}

/// A choice that has a name in configs.
pub(crate) trait Named: Copy {
    fn config_name(self) -> &'static str;
}

macro_rules! impl_named {
    ($($type:ty),+) => { $(impl Named for $type { fn config_name(self) -> &'static str { self.name() } })+ };
}

impl_named!(
    super::AnimatedProperty,
    super::Interpolation,
    super::Repeat,
    super::UpAxis,
    crate::scene::Sides,
    crate::settings::Method,
    crate::settings::PhantomSurfaces,
    crate::settings::RangeCulling,
    crate::settings::Sampling,
    crate::settings::Visibility,
    crate::settings::VplVisibility,
    crate::settings::Weights,
    photonstream_shading::Kernel,
    photonstream_shading::tone::ToneMap
);

/// (De)serialises an optional choice by its name.
pub(super) mod by_name {
    use super::Named;
    use serde::{Deserialize, Deserializer, Serializer, de};
    use std::str::FromStr;

    pub(in crate::config) fn serialize<T: Named, S: Serializer>(
        value: &Option<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        match value {
            Some(value) => serializer.serialize_some(value.config_name()),
            None => serializer.serialize_none(),
        }
    }

    pub(in crate::config) fn deserialize<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
    where
        T: FromStr<Err = String>,
        D: Deserializer<'de>,
    {
        String::deserialize(deserializer)?.parse().map(Some).map_err(de::Error::custom)
    }
}
