//! Turns a path into the points it passed, and says what of a changed scene it met.
//!
//! Only a path that met what has changed can differ in the new version of the scene: it was reflected or absorbed by an
//! object that moved, or one of its segments crosses the box in which a moved object is now. That an object has left
//! the way of a ray that did not hit it changes nothing.

use glam::{Vec3, Vec3A};
use photonstream_scene::Side;
use std::ops::Range;

/// A point of a path: where it was emitted, hit something, or left the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Vertex {
    /// Position in the scene's space, m; for a path that left the scene the direction in which it did.
    pub position: Vec3,
    /// Barycentric coordinates of a hit.
    pub uv: [f32; 2],
    /// The triangle of a hit and what happened there.
    mark: u32,
}

/// What happened at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The path began.
    Emitted,
    /// A side of a triangle was hit; with or without a deposit.
    Hit {
        /// The triangle.
        triangle: u32,
        /// Its side.
        side: Side,
        /// Whether the path left a deposit there.
        deposited: bool,
    },
    /// The path left the scene.
    Escaped,
}

const BACK: u32 = 1 << 31;
const DEPOSITED: u32 = 1 << 30;
const EMITTED: u32 = DEPOSITED - 1;
const ESCAPED: u32 = DEPOSITED - 2;

/// Most triangles of a scene whose paths can be told apart.
pub const MAX_TRIANGLES: u32 = ESCAPED;

impl Vertex {
    pub(crate) fn emitted(position: Vec3) -> Self {
        Self { position, uv: [0.0; 2], mark: EMITTED }
    }

    pub(crate) fn hit(position: Vec3, uv: [f32; 2], triangle: u32, side: Side, deposited: bool) -> Self {
        let side = if side == Side::Back { BACK } else { 0 };
        Self { position, uv, mark: triangle | side | if deposited { DEPOSITED } else { 0 } }
    }

    pub(crate) fn escaped(direction: Vec3) -> Self {
        Self { position: direction, uv: [0.0; 2], mark: ESCAPED }
    }

    /// What happened.
    pub fn event(&self) -> Event {
        match self.mark & !(BACK | DEPOSITED) {
            EMITTED => Event::Emitted,
            ESCAPED => Event::Escaped,
            triangle => Event::Hit {
                triangle,
                side: if self.mark & BACK == 0 { Side::Front } else { Side::Back },
                deposited: self.mark & DEPOSITED != 0,
            },
        }
    }

    /// The same hit in a scene in which its triangle has another number.
    pub(crate) fn renumbered(self, triangle: u32) -> Self {
        Self { mark: triangle | (self.mark & (BACK | DEPOSITED)), ..self }
    }
}

/// A box around something that has moved, with a margin for rounding, in the scene's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstacle {
    centre: Vec3A,
    half: Vec3A,
}

/// Margin of an obstacle relative to the largest coordinate that a path has in the scene. A ray begins up to 2⁻¹⁸ of a
/// triangle's coordinates beside the point that is kept of it, and the test below rounds by some 2⁻²².
const MARGIN: f32 = 1.0 / (1 << 15) as f32;

impl Obstacle {
    /// The box from `low` to `high`; no coordinate of a path or of the box exceeds `reach`.
    pub(crate) fn new(low: Vec3, high: Vec3, reach: f32) -> Self {
        let (low, high) = (Vec3A::from(low), Vec3A::from(high));
        Self { centre: 0.5 * (low + high), half: 0.5 * (high - low) + reach * MARGIN }
    }

    /// The box around both.
    pub(crate) fn union(self, other: Self) -> Self {
        let low = (self.centre - self.half).min(other.centre - other.half);
        let high = (self.centre + self.half).max(other.centre + other.half);
        Self { centre: 0.5 * (low + high), half: 0.5 * (high - low) }
    }

    /// Whether the segment from `a` to `b` may cross it: by the axes of the box and those across it and the segment.
    #[inline]
    fn is_crossed(&self, a: Vec3A, b: Vec3A) -> bool {
        let (h, c) = (0.5 * (b - a), 0.5 * (a + b) - self.centre);
        let size = h.abs();
        if c.abs().cmpgt(self.half + size).any() {
            return false;
        }
        // Component i: |c × h| beyond the box's extent along that axis.
        let across = c.cross(h).abs();
        let (e, e1, e2) = (
            size,
            Vec3A::new(self.half.y, self.half.z, self.half.x),
            Vec3A::new(self.half.z, self.half.x, self.half.y),
        );
        let extent = e1 * Vec3A::new(e.z, e.x, e.y) + e2 * Vec3A::new(e.y, e.z, e.x);
        !across.cmpgt(extent).any()
    }

    /// Whether the ray from `a` along the unit vector `direction` may cross it.
    #[inline]
    fn is_crossed_by_ray(&self, a: Vec3A, direction: Vec3A) -> bool {
        let beyond = (self.centre - a).length() + self.half.length();
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

    /// Whether it concerns no path.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty() && self.obstacles.is_empty()
    }

    /// Whether the path through `vertices` may differ in the new version.
    #[inline]
    pub(crate) fn concerns(&self, vertices: &[Vertex]) -> bool {
        let Some((first, rest)) = vertices.split_first() else { return false };
        let mut from = Vec3A::from(first.position);
        for vertex in rest {
            let number = vertex.mark & !(BACK | DEPOSITED);
            let to = Vec3A::from(vertex.position);
            if number == ESCAPED {
                return self.obstacles.iter().any(|obstacle| obstacle.is_crossed_by_ray(from, to));
            }
            if self.has_changed(number) || self.obstacles.iter().any(|obstacle| obstacle.is_crossed(from, to))
            {
                return true;
            }
            from = to;
        }
        false
    }

    #[inline]
    fn has_changed(&self, triangle: u32) -> bool {
        if let [range] = self.triangles.as_slice() {
            return range.contains(&triangle);
        }
        let next = self.triangles.partition_point(|range| range.end <= triangle);
        self.triangles.get(next).is_some_and(|range| range.start <= triangle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_tells_what_happened() {
        assert_eq!(Vertex::emitted(Vec3::X).event(), Event::Emitted);
        assert_eq!(Vertex::escaped(Vec3::X).event(), Event::Escaped);
        for (side, deposited) in [(Side::Front, true), (Side::Back, true), (Side::Back, false)] {
            let vertex = Vertex::hit(Vec3::X, [0.1, 0.2], 7, side, deposited);
            assert_eq!(vertex.event(), Event::Hit { triangle: 7, side, deposited });
            let event = vertex.renumbered(MAX_TRIANGLES - 1).event();
            assert_eq!(event, Event::Hit { triangle: MAX_TRIANGLES - 1, side, deposited });
        }
    }

    /// Against points of the segment itself: N = 20 000 segments and boxes, seed 1; none that has a point inside is
    /// missed, and of those that are taken at most 2 % have no point within twice the spacing of the points.
    #[test]
    fn no_crossing_is_missed_and_few_are_invented() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32 * 2.0 - 1.0
        };
        let mut point = || Vec3::new(next(), next(), next());
        let (mut taken, mut invented) = (0, 0);
        for _ in 0..20_000 {
            let (a, b, centre, half) = (point(), point(), point(), point().abs() * 0.4);
            let obstacle = Obstacle::new(centre - half, centre + half, 1.0);
            let crossed = obstacle.is_crossed(a.into(), b.into());
            let nearest = (0..=400)
                .map(|i| ((a.lerp(b, i as f32 / 400.0) - centre).abs() - half).max_element())
                .fold(f32::INFINITY, f32::min);
            assert!(crossed || nearest > 0.0, "{a} {b} {centre} {half}");
            taken += u32::from(crossed);
            invented += u32::from(crossed && nearest > 2.0 * a.distance(b) / 400.0);
            let ray = obstacle.is_crossed_by_ray(a.into(), (b - a).normalize().into());
            assert!(ray || !crossed, "a ray goes farther than its segment");
        }
        assert!(taken > 500 && invented * 50 < taken, "{invented} of {taken}");
    }

    #[test]
    fn paths_that_met_nothing_new_are_left_alone() {
        let at =
            |x: f32, triangle| Vertex::hit(Vec3::new(x, 0.0, 0.0), [0.0; 2], triangle, Side::Front, true);
        let path = [Vertex::emitted(Vec3::ZERO), at(1.0, 5), at(2.0, 9), Vertex::escaped(Vec3::Y)];
        let touched = |ranges: &[Range<u32>]| Disturbance::new(ranges.to_vec(), vec![]).concerns(&path);
        assert!(touched(&[5..6]) && touched(&[0..1, 9..12]) && touched(&[0..2, 4..8, 20..30]));
        assert!(!touched(&[6..9]) && !touched(&[0..5, 6..9, 10..99]) && !touched(&[]));
        let boxed = |low, high| Disturbance::new([], vec![Obstacle::new(low, high, 100.0)]).concerns(&path);
        assert!(boxed(Vec3::new(1.4, -0.1, -0.1), Vec3::new(1.6, 0.1, 0.1)));
        assert!(boxed(Vec3::new(1.9, 50.0, -0.1), Vec3::new(2.1, 60.0, 0.1)), "beyond where it left");
        assert!(!boxed(Vec3::new(1.4, 0.1, -0.1), Vec3::new(1.6, 0.3, 0.1)));
        assert!(!boxed(Vec3::new(1.9, -60.0, -0.1), Vec3::new(2.1, -50.0, 0.1)));
        let many =
            (0..40).map(|i| Obstacle::new(Vec3::splat(9.0 + i as f32), Vec3::splat(9.5 + i as f32), 1.0));
        assert!(Disturbance::new([], many.collect()).obstacles.len() <= MOST_OBSTACLES);
    }
}
