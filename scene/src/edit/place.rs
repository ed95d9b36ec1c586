//! Turns a map from an object's rest space as loaded into the pose that gives it: its axes into scale and rotation.

use crate::{
    config::{Field, MAX_LENGTH_M},
    error::SceneError,
    pose::{Pose, RestMesh},
};
use glam::{DAffine3, DMat3, DVec3};

/// Relative deviation up to which axes are orthogonal, and two sizes the same: the rotation keeps what the size leaves out,
/// so that vertices follow the map to the rounding of f64.
const SAME_TO: f64 = 1e-9;
/// Smallest magnitude of a scale, as in a config.
const MIN_SCALE: f64 = 1e-9;

/// The pose in which `mesh` is where `map` puts it. Of the scales that are possible it is the one nearest to that of
/// `current`, so that an object that keeps its size keeps its vertices at rest.
///
/// # Errors
/// If the axes are not orthogonal, or a scale is not one that a config may say.
pub(super) fn pose(
    mesh: &RestMesh,
    current: &Pose,
    map: &DAffine3,
    field: &Field<'_>,
) -> Result<Pose, SceneError> {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = map.matrix3;
    let lengths = DVec3::new(x.length(), y.length(), z.length());
    let loaded = mesh.loaded.scale;
    let size = (lengths * loaded).abs();
    let is_possible =
        size.to_array().iter().all(|s| (MIN_SCALE * (1.0 - SAME_TO)..=MAX_LENGTH_M).contains(s));
    let is_orthogonal =
        [(x, y), (y, z), (z, x)].iter().all(|(a, b)| a.dot(*b).abs() <= SAME_TO * a.length() * b.length());
    if !(is_possible && is_orthogonal) {
        return Err(field.invalid(
            map.matrix3,
            "orthogonal axes that make scales of magnitude 1e-9 to 1e9",
            "place objects by rotations and scales along their own axes",
        ));
    }
    let scale = scale(size, current.scale, loaded, map.matrix3.determinant() < 0.0);
    let growth = scale / loaded;
    Ok(Pose {
        scale,
        rotation: DMat3::from_cols(x / growth.x, y / growth.y, z / growth.z),
        offset: map.translation - map.matrix3 * mesh.centre(loaded),
    })
}

/// A scale of magnitude `size` that turns the mesh inside out as compared with `loaded`, or does not. Two mirrored axes are
/// a rotation: a map does not tell which of its axes are mirrored, and any choice gives the same vertices.
fn scale(size: DVec3, current: DVec3, loaded: DVec3, mirrored: bool) -> DVec3 {
    let signs = current.signum() * loaded.signum();
    let signs = match signs.element_product() < 0.0 {
        now if now == mirrored => signs,
        _ if mirrored => DVec3::NEG_ONE,
        _ => DVec3::ONE,
    };
    let wanted = size * loaded.signum() * signs;
    let near = |known: DVec3| (wanted - known).abs().cmple(size * SAME_TO).all();
    [current, loaded].into_iter().find(|&known| near(known)).unwrap_or(wanted)
}
