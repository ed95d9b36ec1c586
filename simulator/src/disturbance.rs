//! Turns what has moved or changed between two versions of a scene into the paths that may differ.
//!
//! Only a path that met what has changed can differ in the new version of the scene: it was reflected or absorbed by an
//! object that moved, or one of its segments crosses the box in which a moved object is now. That an object has left
//! the way of a ray that did not hit it changes nothing.

use crate::trail::{EMITTED, ESCAPED, Vertex};
use glam::{Mat3A, Vec3, Vec3A};
use std::ops::Range;

/// What encloses something that has moved, with a margin for rounding: a box along the scene's axes, a box along its own,
/// and a sphere, each of which it lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstacle {
    low: Vec3A,
    high: Vec3A,
    /// Centre of sphere and own box.
    centre: Vec3A,
    radius: f32,
    /// Half the own box, along its own axes.
    half: Vec3A,
    /// From the scene's axes to its own.
    own_from_scene: Mat3A,
    /// More than any other order of the same operations rounds: a part of the margin.
    slack: f32,
}

/// Margin of an obstacle relative to the largest coordinate that a path has in the scene. A ray begins up to 2⁻¹⁸ of a
/// triangle's coordinates beside the point that is kept of it, and the tests below round by some 2⁻²¹.
const MARGIN: f32 = 1.0 / (1 << 15) as f32;

impl Obstacle {
    /// What encloses `points`, a body's corners in the scene's space; its own axes are the rows of `own_from_scene`, a
    /// rotation. No coordinate of a path or of the body exceeds `reach`. `None` without points.
    pub(crate) fn around(
        points: impl Iterator<Item = Vec3> + Clone,
        own_from_scene: Mat3A,
        reach: f32,
    ) -> Option<Self> {
        let bounds = |map: &dyn Fn(Vec3) -> Vec3A| {
            points.clone().map(map).map(|p| (p, p)).reduce(|(l, h), (a, b)| (l.min(a), h.max(b)))
        };
        let (low, high) = bounds(&Vec3A::from)?;
        let (own_low, own_high) = bounds(&|p| own_from_scene * Vec3A::from(p))?;
        let margin = reach * MARGIN;
        let centre = own_from_scene.transpose() * (0.5 * (own_low + own_high));
        let radius = points.map(|p| Vec3A::from(p).distance(centre)).fold(0.0, f32::max);
        Some(Self {
            low: low - margin,
            high: high + margin,
            centre,
            radius: radius + margin,
            half: 0.5 * (own_high - own_low) + margin,
            own_from_scene,
            slack: 0.25 * margin,
        })
    }

    /// Something around both.
    pub(crate) fn union(self, other: Self) -> Self {
        let (low, high) = (self.low.min(other.low), self.high.max(other.high));
        let half = 0.5 * (high - low);
        Self {
            low,
            high,
            centre: low + half,
            radius: 1.01 * half.length(),
            half,
            own_from_scene: Mat3A::IDENTITY,
            slack: self.slack.max(other.slack),
        }
    }

    /// The box along the scene's axes that it lies in.
    pub(crate) fn bounds(&self) -> [[f32; 3]; 2] {
        [self.low.to_array(), self.high.to_array()]
    }

    /// Whether its sphere is smaller than its box.
    pub(crate) fn is_round(&self) -> bool {
        let size = self.high - self.low;
        size.x * size.y * size.z > 4.2 * self.radius * self.radius * self.radius
    }

    /// Centre and radius of a sphere that it lies in, however a distance to it is rounded.
    pub(crate) fn sphere(&self) -> ([f32; 3], f32) {
        (self.centre.to_array(), self.radius + self.slack)
    }

    /// Whether the segment from `a` to `b` may cross it.
    #[inline]
    fn is_crossed(&self, a: Vec3A, b: Vec3A) -> bool {
        let beside = a.min(b).cmpgt(self.high) | a.max(b).cmplt(self.low);
        !beside.any() && self.is_crossed_within(a, b)
    }

    /// The same, where the boxes around both meet. Without branches, as nobody could predict them.
    #[inline]
    fn is_crossed_within(&self, a: Vec3A, b: Vec3A) -> bool {
        let (along, from) = (b - a, self.centre - a);
        let share = (from.dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        let distance_sq = (from - share * along).length_squared();
        // By the axes of its own box, and those across them and the segment.
        let h = self.own_from_scene * (0.5 * along);
        let c = self.own_from_scene * (0.5 * along - from);
        let size = h.abs();
        let beside = c.abs().cmpgt(self.half + size);
        let across = c.cross(h).abs();
        let rotated = |v: Vec3A| (Vec3A::new(v.y, v.z, v.x), Vec3A::new(v.z, v.x, v.y));
        let ((half1, half2), (size1, size2)) = (rotated(self.half), rotated(size));
        let beside = beside | across.cmpgt(half1 * size2 + half2 * size1);
        (distance_sq <= self.radius * self.radius) & !beside.any()
    }

    /// Whether the ray from `a` along the unit vector `direction` may cross it.
    #[inline]
    pub(crate) fn is_crossed_by_ray(&self, a: Vec3A, direction: Vec3A) -> bool {
        let beyond = self.centre.distance(a) + self.radius;
        self.is_crossed(a, a + direction * (1.001 * beyond))
    }
}

/// What has changed between two versions of a scene for a path that met it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Disturbance {
    /// Triangles whose hits are no longer what they were; sorted, none adjacent.
    triangles: Vec<Range<u32>>,
    /// Where something is now that was not there before.
    obstacles: Vec<Obstacle>,
}

/// More boxes than this are joined: each costs a test for every segment.
const MOST_OBSTACLES: usize = 6;

impl Disturbance {
    /// From ranges of triangles in ascending order, and boxes.
    pub(crate) fn new(triangles: impl IntoIterator<Item = Range<u32>>, mut obstacles: Vec<Obstacle>) -> Self {
        let mut joined: Vec<Range<u32>> = Vec::new();
        for range in triangles.into_iter().filter(|range| !range.is_empty()) {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
        }
        while obstacles.len() > MOST_OBSTACLES {
            obstacles = obstacles
                .chunks(2)
                .map(|pair| {
                    pair.iter().copied().reduce(Obstacle::union).expect("invariant: chunks are not empty")
                })
                .collect();
        }
        Self { triangles: joined, obstacles }
    }

    /// Triangles whose hits are no longer what they were; sorted, none adjacent.
    pub(crate) fn triangles(&self) -> &[Range<u32>] {
        &self.triangles
    }

    /// Where something is now that was not there before.
    pub(crate) fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles
    }

    /// Whether it concerns no path.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.obstacles.is_empty()
    }

    /// How many of the first points of the path through `vertices` are the same in the new version, whatever becomes of the
    /// others; `None` where the whole path is.
    #[inline]
    pub(crate) fn first_met(&self, vertices: &[Vertex]) -> Option<usize> {
        vertices.windows(2).position(|ends| self.is_met(&ends[0], &ends[1])).map(|segment| segment + 1)
    }

    /// Whether the segment of a path between two points met it, or ended on it.
    #[inline(always)]
    pub(crate) fn is_met(&self, from: &Vertex, to: &Vertex) -> bool {
        match to.number() {
            EMITTED => false,
            ESCAPED => self.obstacles.iter().any(|o| o.is_crossed_by_ray(from.place(), to.place())),
            number => {
                self.has_changed(number)
                    || self.obstacles.iter().any(|o| o.is_crossed(from.place(), to.place()))
            }
        }
    }

    #[inline]
    pub(crate) fn has_changed(&self, triangle: u32) -> bool {
        if let [range] = self.triangles.as_slice() {
            return range.contains(&triangle);
        }
        let next = self.triangles.partition_point(|range| range.end <= triangle);
        self.triangles.get(next).is_some_and(|range| range.start <= triangle)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use photonstream_scene::Side;

    pub(crate) fn boxed(centre: Vec3, half: Vec3, turn: Mat3A, reach: f32) -> Obstacle {
        let corners = (0..8).map(move |i| {
            let side = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
            centre + Vec3::from(turn.transpose() * Vec3A::from(half * Vec3::new(side(0), side(1), side(2))))
        });
        Obstacle::around(corners, turn, reach).unwrap()
    }

    pub(crate) struct Numbers(pub(crate) u64);

    impl Numbers {
        pub(crate) fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1u64 << 24) as f32 * 2.0 - 1.0
        }

        pub(crate) fn point(&mut self) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next())
        }
    }

    /// Against points of the segment itself: N = 20 000 segments and turned boxes, seed 1; none that has a point inside is
    /// missed, and of those that are taken at most 2 % have no point within twice the spacing of the points.
    #[test]
    fn no_crossing_is_missed_and_few_are_invented() {
        let mut numbers = Numbers(1);
        let (mut taken, mut invented) = (0, 0);
        for _ in 0..20_000 {
            let (a, b, centre, half) =
                (numbers.point(), numbers.point(), numbers.point(), numbers.point().abs() * 0.4);
            let turn =
                Mat3A::from_euler(glam::EulerRot::XYZ, 3.0 * numbers.next(), numbers.next(), numbers.next());
            let obstacle = boxed(centre, half, turn, 1.0);
            let crossed = obstacle.is_crossed(a.into(), b.into());
            let inside = |p: Vec3| (Vec3::from(turn * Vec3A::from(p - centre)).abs() - half).max_element();
            let nearest =
                (0..=400).map(|i| inside(a.lerp(b, i as f32 / 400.0))).fold(f32::INFINITY, f32::min);
            assert!(crossed || nearest > 0.0, "{a} {b} {centre} {half}");
            taken += u32::from(crossed);
            invented += u32::from(crossed && nearest > 2.0 * a.distance(b) / 400.0);
            let ray = obstacle.is_crossed_by_ray(a.into(), (b - a).normalize().into());
            assert!(ray || !crossed, "a ray goes farther than its segment");
        }
        assert!(taken > 500 && invented * 50 < taken, "{invented} of {taken}");
    }

    /// A ball is a ball: of N = 20 000 segments near it those that pass its box's corners are not taken.
    #[test]
    fn round_bodies_are_enclosed_by_spheres() {
        let mut numbers = Numbers(2);
        let ball = (0..2000).map(|i| {
            let z = (i as f32 + 0.5) / 1000.0 - 1.0;
            let turn = i as f32 * 2.399_963;
            Vec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z)
        });
        let obstacle = Obstacle::around(ball, Mat3A::IDENTITY, 4.0).unwrap();
        for _ in 0..20_000 {
            let (a, b) = (3.0 * numbers.point(), 3.0 * numbers.point());
            let along = b - a;
            let share = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            let distance = (a + share * along).length();
            let crossed = obstacle.is_crossed(a.into(), b.into());
            assert!(crossed || distance > 1.0);
            assert!(!crossed || distance < 1.01, "{distance}");
        }
    }

    #[test]
    #[allow(clippy::single_range_in_vec_init)] // A list of one range is meant.
    fn paths_that_met_nothing_new_are_left_alone() {
        let at = |x: f32, triangle| Vertex::hit(Vec3::new(x, 0.0, 0.0), triangle, Side::Front, true);
        let path = [Vertex::emitted(Vec3::ZERO), at(1.0, 5), at(2.0, 9), Vertex::escaped(Vec3::Y)];
        let touched =
            |ranges: &[Range<u32>]| Disturbance::new(ranges.to_vec(), vec![]).first_met(&path).is_some();
        assert!(touched(&[5..6]) && touched(&[0..1, 9..12]) && touched(&[0..2, 4..8, 20..30]));
        assert!(!touched(&[6..9]) && !touched(&[0..5, 6..9, 10..99]) && !touched(&[]));
        let obstacle =
            |low: Vec3, high: Vec3| boxed(0.5 * (low + high), 0.5 * (high - low), Mat3A::IDENTITY, 100.0);
        let boxed = |low, high| Disturbance::new([], vec![obstacle(low, high)]).first_met(&path).is_some();
        assert!(boxed(Vec3::new(1.4, -0.1, -0.1), Vec3::new(1.6, 0.1, 0.1)));
        assert!(boxed(Vec3::new(1.9, 50.0, -0.1), Vec3::new(2.1, 60.0, 0.1)), "beyond where it left");
        assert!(!boxed(Vec3::new(1.4, 0.1, -0.1), Vec3::new(1.6, 0.3, 0.1)));
        assert!(!boxed(Vec3::new(1.9, -60.0, -0.1), Vec3::new(2.1, -50.0, 0.1)));
        assert_eq!(Disturbance::new([9..10], vec![]).first_met(&path), Some(2));
        let many = (0..40).map(|i| obstacle(Vec3::splat(9.0 + i as f32), Vec3::splat(9.5 + i as f32)));
        assert!(Disturbance::new([], many.collect()).obstacles.len() <= MOST_OBSTACLES);
    }
}
