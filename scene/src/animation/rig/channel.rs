//! Turns the keyframes of one property of a node into its value at any time, as glTF says.

use glam::{DQuat, DVec3, DVec4};

/// How values between two keyframes come about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// At constant speed; rotations along the shortest arc.
    Linear,
    /// The value of the keyframe before.
    Step,
    /// A cubic through both values with their tangents.
    Cubic,
}

/// One property of a node: its keyframes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    /// s; never falling, at least one, all finite.
    pub(crate) times: Vec<f64>,
    /// One for each time; of a cubic three: tangent before, value, tangent after, these in units of the value per s.
    pub(crate) values: Vec<DVec4>,
    pub(crate) between: Between,
}

impl Channel {
    /// The time of the last keyframe, s.
    pub(crate) fn end(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// A translation or a scale.
    pub(crate) fn vector(&self, time_s: f64) -> DVec3 {
        self.value(time_s, DVec4::lerp).truncate()
    }

    /// A rotation of unit length; none at all where the file's has no length.
    pub(crate) fn rotation(&self, time_s: f64) -> DQuat {
        let unit = |v: DVec4| DQuat::from_vec4(v.try_normalize().unwrap_or(DVec4::W));
        unit(self.value(time_s, |a, b, share| unit(a).slerp(unit(b), share).into()))
    }

    /// Source: Khronos Group, *glTF 2.0 Specification*, appendix C.
    fn value(&self, time: f64, linear: impl Fn(DVec4, DVec4, f64) -> DVec4) -> DVec4 {
        let of = |i: usize| match self.between {
            Between::Cubic => self.values[3 * i + 1],
            _ => self.values[i],
        };
        let next = self.times.partition_point(|&t| t <= time);
        if next == 0 || next == self.times.len() {
            return of(next.saturating_sub(1));
        }
        let (before, span) = (next - 1, self.times[next] - self.times[next - 1]);
        let s = (time - self.times[before]) / span;
        let (a, b) = (of(before), of(next));
        // At a keyframe its value, bit for bit.
        match self.between {
            _ if s == 0.0 => a,
            Between::Step => a,
            Between::Linear => linear(a, b, s),
            Between::Cubic => {
                let (leaving, arriving) = (self.values[3 * before + 2], self.values[3 * next]);
                let (s2, s3) = (s * s, s * s * s);
                a * (2.0 * s3 - 3.0 * s2 + 1.0)
                    + leaving * (span * (s3 - 2.0 * s2 + s))
                    + b * (3.0 * s2 - 2.0 * s3)
                    + arriving * (span * (s3 - s2))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(between: Between, values: &[f64]) -> Channel {
        let values = values.iter().map(|&x| DVec4::new(x, 0.0, 0.0, 0.0)).collect();
        Channel { times: vec![1.0, 3.0], values, between }
    }

    /// Exact in f64: no tolerance.
    #[test]
    fn values_hold_outside_and_follow_their_kind_between() {
        let at = |channel: &Channel, t| channel.vector(t).x;
        for (between, values, middle) in [
            (Between::Linear, &[2.0, 6.0][..], 3.0),
            (Between::Step, &[2.0, 6.0], 2.0),
            // h(1/4) with tangents 4 and 8 per s over 2 s: 2·27/32 + 6·5/32 + 2·4·9/64 − 2·8·3/64.
            (Between::Cubic, &[9.0, 2.0, 4.0, 8.0, 6.0, 9.0], 3.0),
        ] {
            let channel = channel(between, values);
            assert_eq!([0.0, 1.0, 3.0, 4.0].map(|t| at(&channel, t)), [2.0, 2.0, 6.0, 6.0], "{between:?}");
            assert_eq!(at(&channel, 1.5), middle, "{between:?}");
        }
    }

    /// A turn of 270° is passed the short way, over −45° of 90°. 1e-15: a few roundings.
    #[test]
    fn rotations_take_the_shortest_arc() {
        let about_z = |degrees: f64| DVec4::from(DQuat::from_rotation_z(degrees.to_radians()));
        let values = vec![about_z(0.0), about_z(270.0)];
        let channel = Channel { times: vec![0.0, 1.0], values, between: Between::Linear };
        let x = channel.rotation(0.5) * DVec3::X;
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!((x - DVec3::new(half, -half, 0.0)).length() < 1e-15, "{x}");
        // Without a length it turns nothing.
        let none = Channel { times: vec![0.0], values: vec![DVec4::ZERO], between: Between::Step };
        assert_eq!(none.rotation(0.0), DQuat::IDENTITY);
    }
}
