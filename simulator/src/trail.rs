//! Turns a path into the points it passed.

use glam::{Vec3, Vec3A, Vec4};
use photonstream_scene::Side;

/// A point of a path: where it was emitted, hit something, or left the scene.
///
/// Position and mark lie side by side so that one load fetches both: whole pools are looked through after a change.
#[derive(Clone, Copy, Debug)]
pub struct Vertex(
    /// Position in the scene's space, m (for a path that left the scene the direction in which it did), and in the bits of
    /// the last component the triangle of a hit and what happened there.
    Vec4,
);

impl Default for Vertex {
    /// A beginning at the origin: no segment ends there.
    fn default() -> Self {
        Self::emitted(Vec3::ZERO)
    }
}

impl PartialEq for Vertex {
    fn eq(&self, other: &Self) -> bool {
        self.0.truncate() == other.0.truncate() && self.mark() == other.mark()
    }
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
/// The number of what is no triangle.
pub(crate) const EMITTED: u32 = DEPOSITED - 1;
pub(crate) const ESCAPED: u32 = DEPOSITED - 2;

/// Most triangles of a scene whose paths can be told apart.
pub const MAX_TRIANGLES: u32 = ESCAPED;

impl Vertex {
    fn new(position: Vec3, mark: u32) -> Self {
        Self(position.extend(f32::from_bits(mark)))
    }

    pub(crate) fn emitted(position: Vec3) -> Self {
        Self::new(position, EMITTED)
    }

    pub(crate) fn hit(position: Vec3, triangle: u32, side: Side, deposited: bool) -> Self {
        let side = if side == Side::Back { BACK } else { 0 };
        Self::new(position, triangle | side | if deposited { DEPOSITED } else { 0 })
    }

    pub(crate) fn escaped(direction: Vec3) -> Self {
        Self::new(direction, ESCAPED)
    }

    #[inline]
    fn mark(&self) -> u32 {
        self.0.w.to_bits()
    }

    /// The triangle that was hit, or [`EMITTED`] or [`ESCAPED`].
    #[inline]
    pub(crate) fn number(&self) -> u32 {
        self.mark() & !(BACK | DEPOSITED)
    }

    /// The position's components and the number.
    #[inline]
    pub(crate) fn parts(&self) -> ([f32; 3], u32) {
        let [x, y, z, _] = self.0.to_array();
        ([x, y, z], self.number())
    }

    #[inline]
    pub(crate) fn place(&self) -> Vec3A {
        Vec3A::from_vec4(self.0)
    }

    /// Position in the scene's space, m; for a path that left the scene the direction in which it did.
    pub fn position(&self) -> Vec3 {
        self.0.truncate()
    }

    /// What happened.
    pub fn event(&self) -> Event {
        match self.number() {
            EMITTED => Event::Emitted,
            ESCAPED => Event::Escaped,
            triangle => Event::Hit {
                triangle,
                side: if self.mark() & BACK == 0 { Side::Front } else { Side::Back },
                deposited: self.mark() & DEPOSITED != 0,
            },
        }
    }

    /// The same hit in a scene in which its triangle has another number.
    pub(crate) fn renumbered(self, triangle: u32) -> Self {
        Self::new(self.position(), triangle | (self.mark() & (BACK | DEPOSITED)))
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
            let vertex = Vertex::hit(Vec3::X, 7, side, deposited);
            assert_eq!(vertex.event(), Event::Hit { triangle: 7, side, deposited });
            let event = vertex.renumbered(MAX_TRIANGLES - 1).event();
            assert_eq!(event, Event::Hit { triangle: MAX_TRIANGLES - 1, side, deposited });
        }
    }
}
