//! Turns coordinates and texels beyond the edges of a texture into those that stand for them.

/// How a texture goes on beyond its edges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum Wrap {
    /// Again and again.
    #[default]
    Repeat = 0,
    /// Again and again, every other time mirrored.
    Mirror = 1,
    /// With its outermost texels.
    Clamp = 2,
}

/// A coordinate brought into [0, 1].
pub(crate) fn wrapped(u: f32, wrap: Wrap) -> f32 {
    match wrap {
        Wrap::Repeat => u - u.floor(),
        Wrap::Mirror => 1.0 - (u - (u * 0.5).floor() * 2.0 - 1.0).abs(),
        Wrap::Clamp => u.clamp(0.0, 1.0),
    }
}

/// The texel that stands for `index`, which is at most one beyond the `count` of a row or column.
pub(crate) fn neighbour(index: i32, count: i32, wrap: Wrap) -> i32 {
    if wrap == Wrap::Repeat {
        if index < 0 {
            return count - 1;
        }
        if index >= count {
            return 0;
        }
    }
    index.clamp(0, count - 1)
}
