//! Turns where a node is into a placement, and what a placement cannot do into the mesh.

use super::Skeleton;
use crate::placement::Placement;
use glam::{DAffine3, DMat3, DVec3};

/// Relative difference up to which two scales are the same: a rotation's rounding makes no other size.
const SAME_TO: f64 = 1e-9;
/// Cosine up to which axes are at right angles: files hold rotations in f32.
const SQUARE_TO: f64 = 1e-6;
/// Smallest magnitude of a scale, as in a config.
const MIN_SCALE: f64 = 1e-9;
/// Most moments at which a node's axes are looked at.
const MOST_MOMENTS: usize = 512;
/// Most moments times nodes.
const MOST_WORLDS: usize = 1 << 20;

/// How a node's mesh is given, so that scaling, turning and moving puts it where the node is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shape {
    /// From the node's space to that in which its mesh is given.
    pub(crate) own_from_node: DMat3,
    node_from_own: DMat3,
    /// At time 0.
    scale: DVec3,
}

impl Shape {
    /// Shapes of all joints, and how far, in degrees, axes that should be at right angles are ever off.
    ///
    /// A mesh is given as it stands at time 0, but for its place, so that what the file shears stays sheared; where that
    /// does not do, as where a turned node grows along one of its axes, as it is in its node's space.
    pub(crate) fn of(skeleton: &Skeleton, import: &Placement) -> Vec<(Self, f64)> {
        let start = skeleton.worlds(0.0);
        let most = (MOST_WORLDS / start.len().max(1)).clamp(1, MOST_MOMENTS);
        let candidates: Vec<[Self; 2]> = start
            .iter()
            .map(|world| {
                let as_it_stands = Some(world.matrix3).filter(|m| m.inverse().is_finite());
                [as_it_stands.unwrap_or(DMat3::IDENTITY), DMat3::IDENTITY].map(|own_from_node| {
                    let node_from_own = own_from_node.inverse();
                    let (_, scale, _) = parts(world.matrix3 * node_from_own);
                    Self { own_from_node, node_from_own, scale }
                })
            })
            .collect();
        let mut worst = vec![[0.0f64; 2]; start.len()];
        for time in skeleton.hierarchy.moments(most) {
            let worlds = skeleton.worlds(time);
            for ((world, shapes), worst) in worlds.iter().zip(&candidates).zip(&mut worst) {
                for (shape, worst) in shapes.iter().zip(worst) {
                    *worst = worst.max(shape.split(world, import).1);
                }
            }
        }
        let chosen = candidates.into_iter().zip(worst).map(|([first, second], [a, b])| {
            let (shape, cosine) = if a <= SQUARE_TO || a <= b { (first, a) } else { (second, b) };
            (shape, if cosine <= SQUARE_TO { 0.0 } else { cosine.min(1.0).asin().to_degrees() })
        });
        chosen.collect()
    }

    /// The placement that puts the mesh where its node is, with the import at `import`.
    pub(crate) fn at(&self, world: &DAffine3, import: &Placement) -> Placement {
        self.split(world, import).0
    }

    /// That placement, and the largest cosine between axes that it takes as square.
    fn split(&self, world: &DAffine3, import: &Placement) -> (Placement, f64) {
        let (mut rotation, mut scale, mut cosine) = parts(world.matrix3 * self.node_from_own);
        if (scale / self.scale - 1.0).abs().max_element() <= SAME_TO {
            scale = self.scale;
        }
        let [x, y, z] = import.scale.to_array();
        if x == y && y == z {
            (rotation, scale) = (import.rotation * rotation, scale * x);
        } else {
            let stretched = DMat3::from_diagonal(import.scale) * rotation * DMat3::from_diagonal(scale);
            let (turned, stretched, off) = parts(stretched);
            (rotation, scale, cosine) = (import.rotation * turned, stretched, cosine.max(off));
        }
        (Placement { scale, rotation, position: import.apply(world.translation) }, cosine)
    }
}

/// Rotation and scale of `matrix`, and the largest cosine between its axes, which would be 0 if these were all of it.
fn parts(matrix: DMat3) -> (DMat3, DVec3, f64) {
    let mirrored = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    let (x, y, z) = (matrix.x_axis * mirrored, matrix.y_axis, matrix.z_axis);
    let unit = |v: DVec3| v.try_normalize();
    let first = unit(x).or_else(|| unit(y.cross(z))).unwrap_or(DVec3::X);
    let second = unit(y - first * first.dot(y)).or_else(|| unit(z.cross(first)));
    let second = second.unwrap_or_else(|| first.any_orthonormal_vector());
    let rotation = DMat3::from_cols(first, second, first.cross(second));
    let cosine = |a: DVec3, b: DVec3| unit(a).zip(unit(b)).map_or(0.0, |(a, b)| a.dot(b).abs());
    let cosine = cosine(x, y).max(cosine(y, z)).max(cosine(z, x));
    let scale = DVec3::new(x.length(), y.length(), z.length()).max(DVec3::splat(MIN_SCALE));
    (rotation, scale * DVec3::new(mirrored, 1.0, 1.0), cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rotation times scale comes back, mirrored too, to a few roundings; a flat matrix gives a rotation all the same.
    #[test]
    fn matrices_come_apart() {
        let turn = DMat3::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 1.1);
        for scale in [DVec3::new(2.0, 3.0, 0.5), DVec3::new(-2.0, 1.0, 1.0), DVec3::new(2.0, -1.0, 3.0)] {
            let matrix = turn * DMat3::from_diagonal(scale);
            let (rotation, found, cosine) = parts(matrix);
            let back = rotation * DMat3::from_diagonal(found);
            assert!((back - matrix).to_cols_array().iter().all(|d| d.abs() < 1e-14), "{back}");
            assert!((rotation.determinant() - 1.0).abs() < 1e-14 && cosine < 1e-14);
        }
        for flat in [DMat3::ZERO, DMat3::from_diagonal(DVec3::X), DMat3::from_diagonal(DVec3::Y)] {
            assert!((parts(flat).0.determinant() - 1.0).abs() < 1e-14);
        }
        // 60° between x and y.
        let sheared = DMat3::from_cols(DVec3::X, DVec3::new(0.5, 0.75f64.sqrt(), 0.0), DVec3::Z);
        assert!((parts(sheared).2 - 0.5).abs() < 1e-15);
    }
}
