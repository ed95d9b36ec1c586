//! Turns spheres into the share of light that passes them.

use glam::Vec3;

/// A sphere that dims the light of segments which pass through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blocker {
    centre: Vec3,
    per_radius_sq: f32,
}

impl Blocker {
    /// A blocker around `centre` (world space, m; the caller moves what is attached to an object) with a radius in m.
    /// One without a radius (0, negative, NaN) blocks nothing.
    #[inline]
    pub fn new(centre: Vec3, radius: f32) -> Self {
        let radius = if radius > 0.0 { radius } else { 0.0 };
        Self { centre, per_radius_sq: 1.0 / (radius * radius) }
    }
}

/// A way of light from a receiver to its source, as a line with a beginning and an end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    from: Vec3,
    /// Unit vector.
    direction: Vec3,
    /// In m; infinite for light from infinitely far away.
    length: f32,
}

impl Segment {
    #[inline]
    pub(crate) fn new(from: Vec3, direction: Vec3, length: f32) -> Self {
        Self { from, direction, length }
    }

    /// Square of the distance of `point` to the segment in m²: to its line between the ends, to an end beyond it.
    #[inline]
    fn distance_sq(&self, point: Vec3) -> f32 {
        let to_point = point - self.from;
        let along = to_point.dot(self.direction);
        let along = if along > 0.0 { along } else { 0.0 };
        let along = if along < self.length { along } else { self.length };
        (to_point - self.direction * along).length_squared()
    }

    /// V = Π min(1, (d_seg/r)²), 0 to 1: the share of light that passes all blockers.
    ///
    /// Source: paper B §4.2, eq. 5.
    #[inline]
    pub(crate) fn passing(&self, blockers: &[Blocker]) -> f32 {
        let (fours, rest) = blockers.as_chunks::<4>();
        let fours = fours.iter().fold([1.0; 4], |passing, four| self.times_shares(passing, four));
        let passing = (fours[0] * fours[1]) * (fours[2] * fours[3]);
        rest.iter().fold(passing, |passing, &blocker| self.times_shares([passing], &[blocker])[0])
    }

    /// Each lane of `passing` times the share that its blocker lets pass. Written by lanes and without branches, so that
    /// the compiler takes vector instructions.
    #[inline(always)]
    fn times_shares<const N: usize>(&self, passing: [f32; N], blockers: &[Blocker; N]) -> [f32; N] {
        core::array::from_fn(|i| {
            let blocker = &blockers[i];
            let share = self.distance_sq(blocker.centre) * blocker.per_radius_sq;
            // A share that is not a number (a blocker without a radius, a distance beyond f32) blocks nothing.
            passing[i] * if share < 1.0 { share } else { 1.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(from: Vec3, to: Vec3) -> Segment {
        Segment::new(from, (to - from).normalize(), (to - from).length())
    }

    /// By hand, segment from (0,0,0) to (4,0,0): beside its middle, before its beginning (3-4-5), beyond its end, on it.
    #[test]
    fn distance_to_a_segment_ends_with_it() {
        let s = segment(Vec3::ZERO, Vec3::X * 4.0);
        assert_eq!(s.distance_sq(Vec3::new(2.0, 3.0, 0.0)), 9.0);
        assert_eq!(s.distance_sq(Vec3::new(-3.0, 0.0, 4.0)), 25.0);
        assert_eq!(s.distance_sq(Vec3::new(7.0, 4.0, 0.0)), 25.0);
        assert_eq!(s.distance_sq(Vec3::new(4.5, 0.0, 0.0)), 0.25);
        assert_eq!(s.distance_sq(Vec3::X), 0.0);
        let ray = Segment::new(Vec3::ZERO, Vec3::X, f32::INFINITY);
        assert_eq!(ray.distance_sq(Vec3::new(1e6, 2.0, 0.0)), 4.0);
        assert_eq!(ray.distance_sq(Vec3::new(-1.0, 0.0, 0.0)), 1.0);
    }

    /// By hand: at half the radius a quarter passes, through the centre nothing, from the radius on all; two quarters
    /// make a sixteenth.
    #[test]
    fn blockers_multiply() {
        let s = segment(Vec3::ZERO, Vec3::X * 4.0);
        let at = |y| Blocker::new(Vec3::new(2.0, y, 0.0), 2.0);
        assert_eq!(s.passing(&[]), 1.0);
        assert_eq!(s.passing(&[at(1.0)]), 0.25);
        assert_eq!(s.passing(&[at(1.0), at(-1.0)]), 0.0625);
        assert_eq!(s.passing(&[at(0.0), at(1.0)]), 0.0);
        assert_eq!(s.passing(&[at(2.0), at(5.0)]), 1.0);
    }

    /// A sphere of radius 1 whose surface is just behind the light, or behind the VPL, blocks nothing; one that reaches
    /// half a metre past an end (0.5²) lets a quarter pass.
    #[test]
    fn blockers_behind_the_ends_do_not_block() {
        let s = segment(Vec3::ZERO, Vec3::X * 4.0);
        for x in [-1.0, 5.0, -3.0, 9.0] {
            assert_eq!(s.passing(&[Blocker::new(Vec3::X * x, 1.0)]), 1.0, "at {x}");
        }
        for x in [-0.5, 4.5] {
            assert_eq!(s.passing(&[Blocker::new(Vec3::X * x, 1.0)]), 0.25, "at {x}");
        }
    }

    #[test]
    fn blockers_without_a_radius_block_nothing() {
        let s = segment(Vec3::ZERO, Vec3::X * 4.0);
        for radius in [0.0, -2.0, f32::NAN, 1e-30] {
            assert_eq!(s.passing(&[Blocker::new(Vec3::X, radius)]), 1.0, "radius {radius}");
        }
    }
}
