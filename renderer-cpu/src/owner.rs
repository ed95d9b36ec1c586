//! Turns a point on a surface into the virtual surface light that owns it, for pictures of who owns what.

use crate::surface::Surface;
use photonstream_renderer::{VslSet, owner::COMPATIBLE_COS};

/// The virtual surface lights of each object.
pub(crate) struct Owners<'a> {
    vsls: &'a VslSet,
    /// Indices of lights, grouped by object.
    of_object: Vec<Vec<u32>>,
}

impl<'a> Owners<'a> {
    pub(crate) fn new(vsls: &'a VslSet, objects: usize) -> Self {
        let mut of_object = vec![Vec::new(); objects];
        for (index, &object) in vsls.object().iter().enumerate() {
            if let Some(list) = of_object.get_mut(object as usize) {
                list.push(index as u32);
            }
        }
        Self { vsls, of_object }
    }

    /// The nearest light of the same object whose normal is within 60° of the surface's, else the nearest one on the
    /// same side.
    pub(crate) fn find(&self, surface: &Surface) -> Option<usize> {
        let mut best = (f32::INFINITY, None);
        let mut best_of_side = (f32::INFINITY, None);
        for &index in &self.of_object[surface.object as usize] {
            let index = index as usize;
            let cos = self.vsls.normal()[index].dot(surface.normal);
            if cos <= 0.0 {
                continue;
            }
            let distance_sq = self.vsls.position()[index].distance_squared(surface.position);
            if distance_sq < best_of_side.0 {
                best_of_side = (distance_sq, Some(index));
            }
            if cos >= COMPATIBLE_COS && distance_sq < best.0 {
                best = (distance_sq, Some(index));
            }
        }
        best.1.or(best_of_side.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use photonstream_renderer::Vsl;

    fn surface(position: Vec3, normal: Vec3, object: u32) -> Surface {
        Surface {
            position,
            ray_origin: position,
            normal,
            flat: normal,
            albedo: Vec3::ONE,
            emitted: Vec3::ZERO,
            object,
            distance: 1.0,
        }
    }

    #[test]
    fn owners_are_of_the_same_object_and_side_and_compatible_if_possible() {
        let vsl = |x: f32, normal: Vec3, object| Vsl {
            position: Vec3::X * x,
            normal: normal.normalize(),
            flux: Vec3::ONE,
            area: 1.0,
            object,
        };
        let vsls = VslSet::new([
            vsl(0.1, Vec3::Y, 1),
            vsl(0.2, Vec3::NEG_Y, 0),
            vsl(0.3, Vec3::new(1.0, 0.3, 0.0), 0),
            vsl(0.9, Vec3::new(0.2, 1.0, 0.0), 0),
        ])
        .unwrap();
        let owners = Owners::new(&vsls, 3);
        assert_eq!(owners.find(&surface(Vec3::ZERO, Vec3::Y, 0)), Some(3));
        assert_eq!(owners.find(&surface(Vec3::ZERO, Vec3::Y, 1)), Some(0));
        assert_eq!(owners.find(&surface(Vec3::ZERO, Vec3::NEG_Y, 1)), None);
        assert_eq!(owners.find(&surface(Vec3::ZERO, Vec3::NEG_Y, 2)), None);
        // No compatible normal (cosines 0.4, 0.17 and below 0): the nearest of the side.
        assert_eq!(owners.find(&surface(Vec3::ZERO, Vec3::new(0.3, -0.4, 0.75f32.sqrt()), 0)), Some(1));
    }
}
