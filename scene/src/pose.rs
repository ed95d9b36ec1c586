//! Turns where an object stands into its vertices in the scene's space, at load and whenever it moves.

use crate::{
    bake::{EmitterFace, snapped_centre},
    placement::Placement,
};
use glam::{DAffine3, DMat3, DVec3, Mat3, Vec3};
use photonstream_shading::{LightShape, surface};
use std::ops::Range;

/// The mesh of an object in its own coordinates, as exactly as the config gives it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RestMesh {
    /// Vertices in the object's own coordinates, m.
    pub(crate) own: Vec<DVec3>,
    /// Where they are in [`crate::Geometry::vertices`].
    pub(crate) vertices: Range<u32>,
    /// The box around those of them that triangles use, lower and upper corner.
    pub(crate) used: (DVec3, DVec3),
    /// How the object stood at load.
    pub(crate) loaded: Pose,
}

/// How an object is scaled to its final size, then turned and moved into the scene's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Along the object's own axes; an odd number of negative factors turns it inside out, and its triangles back.
    pub(crate) scale: DVec3,
    pub(crate) rotation: DMat3,
    /// Position relative to the scene's origin, m.
    pub(crate) offset: DVec3,
}

impl Pose {
    /// Where an object stands in a scene around `origin`.
    pub(crate) fn new(placement: &Placement, origin: DVec3) -> Self {
        Self {
            scale: placement.scale,
            rotation: placement.rotation,
            offset: offset(placement.position, origin),
        }
    }

    /// Whether the scale turns a mesh inside out.
    pub(crate) fn is_mirrored(&self) -> bool {
        self.scale.x * self.scale.y * self.scale.z < 0.0
    }

    /// A vertex in the scene's space.
    ///
    /// It comes from the config's numbers directly, not by way of rest space: equal numbers give equal bits, so that
    /// neighbouring quads share their edges without a gap.
    pub(crate) fn apply(&self, own: DVec3) -> DVec3 {
        self.rotation * (self.scale * own) + self.offset
    }

    /// The map of normals to the scene's space; their lengths are lost.
    pub(crate) fn world_from_own_normal(&self) -> Mat3 {
        // Near 1, whatever the size.
        let shrinkage = self.scale.abs().max_element() / self.scale;
        (self.rotation * DMat3::from_diagonal(shrinkage)).as_mat3()
    }

    /// The normal of a triangle that has no area in the scene's space, from rest space.
    pub(crate) fn turned_normal(&self, rest: [Vec3; 3]) -> Option<Vec3> {
        surface::normal(rest).and_then(|n| (self.rotation * n.as_dvec3()).as_vec3().try_normalize())
    }

    /// The motion from the rest space around `centre`.
    pub(crate) fn world_from_rest(&self, centre: DVec3) -> DAffine3 {
        DAffine3 { matrix3: self.rotation, translation: self.offset + self.rotation * centre }
    }
}

impl RestMesh {
    /// The origin of rest space for a mesh of this size: a mesh given far from its own origin keeps its precision.
    pub(crate) fn centre(&self, scale: DVec3) -> DVec3 {
        // Rounding is monotone: the box of the scaled vertices is the scaled box.
        let (a, b) = (scale * self.used.0, scale * self.used.1);
        snapped_centre((a.min(b), a.max(b)))
    }

    /// The map from rest space as loaded to the scene's space: a rotation times what the size has grown by, then a shift.
    /// At the size it was loaded with this is [`Pose::world_from_rest`], bit for bit.
    pub(crate) fn world_from_loaded(&self, pose: &Pose) -> DAffine3 {
        let (rotation, growth) = (pose.rotation, pose.scale / self.loaded.scale);
        let matrix3 = DMat3::from_cols(
            rotation.x_axis * growth.x,
            rotation.y_axis * growth.y,
            rotation.z_axis * growth.z,
        );
        DAffine3 { matrix3, translation: pose.offset + matrix3 * self.centre(self.loaded.scale) }
    }

    /// A vertex in rest space.
    pub(crate) fn rest_vertex(own: DVec3, scale: DVec3, centre: DVec3) -> Vec3 {
        round(scale * own - centre)
    }

    /// The shape of the light that a face emits; `vertices` are those of the whole scene.
    pub(crate) fn light_shape(&self, face: EmitterFace, pose: &Pose, vertices: &[Vec3]) -> LightShape {
        let (EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners)) = face;
        let [corner, u, v] = corners.map(|i| vertices[(i + self.vertices.start) as usize]);
        let (edge_u, edge_v) =
            if pose.is_mirrored() { (v - corner, u - corner) } else { (u - corner, v - corner) };
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
