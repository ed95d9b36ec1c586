//! Turns a time into the value of one animated property: keyframes or an orbit, repeated or not.

use crate::{
    config::{Interpolation, Repeat},
    primitives::sin_cos_turn,
};
use glam::DVec3;

/// A property as a function of time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    pub(super) path: Path,
    pub(super) repeat: Repeat,
}

/// A property from time 0 to the end of its path.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Path {
    /// Times in s, strictly increasing from at least 0, as many as values, at least one.
    Keyframes { times: Vec<f64>, values: Vec<DVec3>, interpolation: Interpolation },
    /// A circle in the plane of two perpendicular radii (m), in turns and s.
    Orbit { centre: DVec3, radius_u: DVec3, radius_v: DVec3, phase: f64, period: f64 },
}

impl Track {
    /// The value at a finite time in s: a pure function, so that any time can be asked for in any order.
    pub(super) fn at(&self, time_s: f64) -> DVec3 {
        let end = self.path.duration();
        let time = match self.repeat {
            _ if end == 0.0 => 0.0,
            Repeat::Loop => time_s.rem_euclid(end),
            Repeat::Once => time_s.clamp(0.0, end),
            Repeat::Bounce => {
                let there_and_back = time_s.rem_euclid(2.0 * end);
                if there_and_back > end { 2.0 * end - there_and_back } else { there_and_back }
            }
        };
        self.path.at(time)
    }

    /// After what time it begins again, s: 0 where it never changes, `None` where it ends.
    pub(super) fn period(&self) -> Option<f64> {
        let end = self.path.duration();
        match self.repeat {
            _ if end == 0.0 => Some(0.0),
            Repeat::Loop => Some(end),
            Repeat::Bounce => Some(2.0 * end),
            Repeat::Once => None,
        }
    }

    /// From what time on it changes no more, s; `None` where it is repeated.
    pub(super) fn end(&self) -> Option<f64> {
        let end = self.path.duration();
        (self.repeat == Repeat::Once || end == 0.0).then_some(end)
    }
}

impl Path {
    /// The circle around `axis` (a unit vector) that starts at `phase` turns.
    pub(super) fn orbit(centre: DVec3, axis: DVec3, radius: f64, period: f64, phase: f64) -> Self {
        // From the direction of X, unless that is within 26 degrees of the axis.
        let start = if axis.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        let u = (start - axis * axis.dot(start)).normalize();
        let (radius_u, radius_v) = (u * radius, axis.cross(u) * radius);
        Self::Orbit { centre, radius_u, radius_v, phase, period }
    }

    fn duration(&self) -> f64 {
        match self {
            Self::Keyframes { times, .. } => times.last().copied().unwrap_or(0.0),
            Self::Orbit { period, .. } => *period,
        }
    }

    fn at(&self, time: f64) -> DVec3 {
        match self {
            Self::Keyframes { times, values, interpolation } => {
                let next = times.partition_point(|&t| t <= time);
                let (Some(before), Some(after)) = (next.checked_sub(1), values.get(next)) else {
                    return values[next.min(values.len() - 1)];
                };
                let share = (time - times[before]) / (times[next] - times[before]);
                interpolate(*interpolation, values[before], *after, share)
            }
            Self::Orbit { centre, radius_u, radius_v, phase, period } => {
                let (sin, cos) = sin_cos_turn((time / period + phase).fract());
                *centre + *radius_u * cos + *radius_v * sin
            }
        }
    }
}

/// Never beyond `a` and `b`: what is valid for both is valid between.
fn interpolate(interpolation: Interpolation, a: DVec3, b: DVec3, share: f64) -> DVec3 {
    let share = match interpolation {
        Interpolation::Step => return a,
        Interpolation::Linear => share,
        Interpolation::Smooth => share * share * (3.0 - 2.0 * share),
    };
    (a + (b - a) * share).clamp(a.min(b), a.max(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keyframes(interpolation: Interpolation, repeat: Repeat) -> Track {
        let values = [1.0, 3.0, -1.0].map(DVec3::splat).to_vec();
        Track { path: Path::Keyframes { times: vec![1.0, 2.0, 4.0], values, interpolation }, repeat }
    }

    /// All numbers are exact in f64: no tolerance.
    #[test]
    fn keyframes_are_met_and_joined() {
        for (interpolation, between) in [
            (Interpolation::Linear, [1.5, 2.0, 2.0, 1.0]),
            (Interpolation::Smooth, [1.3125, 2.0, 2.375, 1.0]),
            (Interpolation::Step, [1.0, 1.0, 3.0, 3.0]),
        ] {
            let track = keyframes(interpolation, Repeat::Once);
            for (time, value) in [(-1.0, 1.0), (0.0, 1.0), (1.0, 1.0), (2.0, 3.0), (4.0, -1.0), (9.0, -1.0)] {
                assert_eq!(track.at(time), DVec3::splat(value), "{interpolation:?} {time}");
            }
            for (time, value) in [1.25, 1.5, 2.5, 3.0].into_iter().zip(between) {
                assert_eq!(track.at(time), DVec3::splat(value), "{interpolation:?} {time}");
            }
        }
    }

    #[test]
    fn repeats_begin_again_turn_back_or_stay() {
        let at = |repeat, time| keyframes(Interpolation::Linear, repeat).at(time).x;
        assert_eq!([4.0, 5.5, 8.0, 801.5].map(|t| at(Repeat::Loop, t)), [1.0, 2.0, 1.0, 2.0]);
        assert_eq!([4.0, 5.0, 6.0, 7.5, 801.5].map(|t| at(Repeat::Bounce, t)), [-1.0, 1.0, 3.0, 1.0, 2.0]);
        assert_eq!([4.0, 5.0, 1e300].map(|t| at(Repeat::Once, t)), [-1.0, -1.0, -1.0]);
        let period = |repeat| keyframes(Interpolation::Linear, repeat).period();
        assert_eq!([Repeat::Loop, Repeat::Bounce, Repeat::Once].map(period), [Some(4.0), Some(8.0), None]);
        let end = |repeat| keyframes(Interpolation::Linear, repeat).end();
        assert_eq!([Repeat::Loop, Repeat::Bounce, Repeat::Once].map(end), [None, None, Some(4.0)]);
        let path = Path::Keyframes {
            times: vec![0.0],
            values: vec![DVec3::X],
            interpolation: Interpolation::Linear,
        };
        assert_eq!(Track { path: path.clone(), repeat: Repeat::Loop }.at(7.0), DVec3::X);
        assert_eq!(Track { path: path.clone(), repeat: Repeat::Loop }.end(), Some(0.0));
        assert_eq!(Track { path, repeat: Repeat::Once }.period(), Some(0.0));
    }

    /// 1 000 times over all domains; between two values by construction, so no tolerance.
    #[test]
    fn values_stay_between_their_keyframes() {
        let (a, b) = (DVec3::new(1.0, 0.0, 1e-9), DVec3::new(1e-9, 1e15, 1e9));
        for i in 0..1000 {
            for interpolation in [Interpolation::Linear, Interpolation::Smooth] {
                let value = interpolate(interpolation, a, b, f64::from(i) / 999.0);
                assert!(value.cmpge(a.min(b)).all() && value.cmple(a.max(b)).all(), "{value}");
            }
        }
    }

    #[test]
    fn orbits_are_circles_about_their_axis() {
        let centre = DVec3::new(1.0, 2.0, 3.0);
        let orbit = |axis: DVec3, phase| Track {
            path: Path::orbit(centre, axis, 0.5, 4.0, phase),
            repeat: Repeat::Loop,
        };
        // Right angles are exact.
        for (axis, start, next) in [
            (DVec3::Y, DVec3::X, DVec3::NEG_Z),
            (DVec3::Z, DVec3::X, DVec3::Y),
            (DVec3::X, DVec3::Y, DVec3::Z),
        ] {
            let track = orbit(axis, 0.0);
            for (time, direction) in [(0.0, start), (1.0, next), (2.0, -start), (3.0, -next), (5.0, next)] {
                assert_eq!(track.at(time), centre + direction * 0.5);
            }
            assert_eq!(orbit(axis, 0.25).at(0.0), track.at(1.0));
        }
        let axis = DVec3::new(0.6, -0.48, 0.64);
        for i in 0..100 {
            let arm = orbit(axis, 0.1).at(f64::from(i) * 0.173) - centre;
            // A few roundings of numbers up to 3.5.
            assert!((arm.length() - 0.5).abs() < 1e-14 && arm.dot(axis).abs() < 1e-14);
        }
    }
}
