//! Turns where an object stands into its vertices in the scene's space, at load and whenever it moves.

use crate::bake::EmitterFace;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use photonstream_shading::LightShape;
use std::ops::Range;

/// The mesh of an object at its final size, as exactly as the config gives it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RestMesh {
    /// Vertices along the object's own axes, m.
    pub(crate) scaled: Vec<DVec3>,
    /// Where they are in [`crate::Geometry::vertices`].
    pub(crate) vertices: Range<u32>,
    /// The origin of rest space.
    pub(crate) centre: DVec3,
    /// Whether the scale turned the mesh inside out, and its triangles back.
    pub(crate) mirrored: bool,
    /// How the object stood at load.
    pub(crate) loaded: Pose,
}

/// How an object at its final size is turned and moved into the scene's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    pub(crate) rotation: DMat3,
    /// Position relative to the scene's origin, m.
    pub(crate) offset: DVec3,
}

impl Pose {
    /// A vertex in the scene's space.
    ///
    /// It comes from the config's numbers directly, not by way of rest space: equal numbers give equal bits, so that
    /// neighbouring quads share their edges without a gap.
    pub(crate) fn apply(&self, scaled: DVec3) -> DVec3 {
        self.rotation * scaled + self.offset
    }

    /// The motion from the rest space around `centre`.
    pub(crate) fn world_from_rest(&self, centre: DVec3) -> DAffine3 {
        DAffine3 { matrix3: self.rotation, translation: self.offset + self.rotation * centre }
    }

    /// The pose that gives `motion` from the rest space around `centre`, to the rounding of f64.
    pub(crate) fn from_motion(motion: &DAffine3, centre: DVec3) -> Self {
        Self { rotation: motion.matrix3, offset: motion.translation - motion.matrix3 * centre }
    }
}

impl RestMesh {
    /// The shape of the light that a face emits; `vertices` are those of the whole scene.
    pub(crate) fn light_shape(&self, face: EmitterFace, vertices: &[Vec3]) -> LightShape {
        let (EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners)) = face;
        let [corner, u, v] = corners.map(|i| vertices[(i + self.vertices.start) as usize]);
        let (edge_u, edge_v) =
            if self.mirrored { (v - corner, u - corner) } else { (u - corner, v - corner) };
        match face {
            EmitterFace::Parallelogram(_) => LightShape::Parallelogram { corner, edge_u, edge_v },
            EmitterFace::Triangle(_) => LightShape::Triangle { corner, edge_u, edge_v },
        }
    }
}

/// A position in the config's coordinates, relative to `origin`.
pub(crate) fn offset(position: DVec3, origin: DVec3) -> DVec3 {
    position - origin
}

/// To f32, without negative zeros: points that are equal have equal bits.
pub(crate) fn round(point: DVec3) -> Vec3 {
    point.as_vec3() + Vec3::ZERO
}
