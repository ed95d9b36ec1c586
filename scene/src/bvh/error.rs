//! Turns broken invariants of the ray-tracing structure into messages.

use thiserror::Error;

/// An invariant of a structure that does not hold: a bug in this crate; build it again and report the scene.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum BvhError {
    /// A reference is out of range or reached twice.
    #[error(
        "{tree}: reference {reference:#x}: expected a node or leaf in range that nothing else refers to; rebuild"
    )]
    Reference {
        /// Part or top level.
        tree: String,
        /// The reference; bit 31 marks leaves.
        reference: u32,
    },
    /// A box does not enclose what lies under it.
    #[error(
        "{tree}: box of reference {reference:#x}: expected to enclose its content within its parent; rebuild"
    )]
    NotEnclosed {
        /// Part or top level.
        tree: String,
        /// The reference; bit 31 marks leaves.
        reference: u32,
    },
    /// The tree is deeper than the traversal stack allows.
    #[error("{tree}: depth: found {found}, expected at most {limit}; rebuild")]
    Depth {
        /// Part or top level.
        tree: String,
        /// Levels found.
        found: usize,
        /// Levels allowed.
        limit: usize,
    },
    /// A node or packet that no reference reaches.
    #[error("{tree}: {what} {index}: expected to be reached from the root; rebuild")]
    Unreached {
        /// Part or top level.
        tree: String,
        /// `node` or `packet`.
        what: &'static str,
        /// Its number.
        index: usize,
    },
    /// A triangle that is doubled, of another part, or impossible to hit.
    #[error("{tree}: triangle {triangle}: expected once, from this part, finite and with an area; rebuild")]
    Triangle {
        /// The part.
        tree: String,
        /// Its number.
        triangle: u32,
    },
    /// Triangles are missing.
    #[error("{tree}: triangles: found {found}, expected {expected}; rebuild")]
    TriangleCount {
        /// The part.
        tree: String,
        /// Triangles that can be hit.
        expected: usize,
        /// Triangles in leaves.
        found: usize,
    },
    /// A lane beyond the triangles of its leaf that could be hit.
    #[error(
        "{tree}: packet {packet}, lane {lane}: found coordinates, expected NaN in an unused lane; rebuild"
    )]
    LaneNotEmpty {
        /// The part.
        tree: String,
        /// The packet.
        packet: usize,
        /// The lane.
        lane: usize,
    },
    /// A part with triangles that the top level does not reach, or an empty one that it does.
    #[error("top level: part {part}: expected to be reached exactly if it has triangles; rebuild")]
    PartMissing {
        /// Its number.
        part: usize,
    },
}
