//! Gathers what is shown and edited of the methods of few lights: VPLs, blockers and proxies.

mod edits;
mod hands;
mod outline;
mod places;
mod roles;
mod shapes;
mod surface;
#[cfg(test)]
mod tests;

pub(crate) use edits::Edits;
pub(crate) use hands::albedo;
pub(crate) use places::Places;
pub(crate) use roles::{Mark, Roles};
pub(crate) use shapes::{Shape, Sight, disc, nearest, rhombus, shapes, triangle};

/// What can be edited: its number in its list of the config.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gizmo {
    /// A predefined virtual point light.
    Vpl(usize),
    /// A sphere that keeps light from them.
    Blocker(usize),
    /// A body in the place of the scene, for the axes of spots.
    Proxy(usize),
}

/// What can be added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A [`Gizmo::Vpl`].
    Vpl,
    /// A [`Gizmo::Blocker`].
    Blocker,
    /// A [`Gizmo::Proxy`].
    Proxy,
}

impl Kind {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Vpl, Self::Blocker, Self::Proxy];

    /// As people say it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Vpl => "VPL",
            Self::Blocker => "blocker",
            Self::Proxy => "proxy",
        }
    }
}

impl Gizmo {
    /// What it is.
    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Vpl(_) => Kind::Vpl,
            Self::Blocker(_) => Kind::Blocker,
            Self::Proxy(_) => Kind::Proxy,
        }
    }

    /// Its number in its list.
    pub(crate) fn index(self) -> usize {
        let (Self::Vpl(index) | Self::Blocker(index) | Self::Proxy(index)) = self;
        index
    }
}

impl std::fmt::Display for Gizmo {
    /// Its kind and its number, counted from 1 as people do.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.kind().name(), self.index() + 1)
    }
}
