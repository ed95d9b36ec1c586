//! Turns triangles that all emit the same radiance into one light: places on them by their areas.

use crate::{sampling, surface};
use glam::Vec3;

/// The triangles of an emitter, each of which shines from its front.
#[derive(Clone, Debug, PartialEq)]
pub struct EmissiveMesh {
    /// Corners in metres from the scene's origin, counter-clockwise seen from the front.
    triangles: Vec<[Vec3; 3]>,
    /// Running sums of the triangles' shares of the area, the last one 1.
    cumulative: Vec<f32>,
    area: f64,
}

/// A place on an emissive mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissivePlace {
    /// The triangle's number.
    pub triangle: usize,
    /// The point, moved just off the surface, so that the emitter itself does not shade it.
    pub point: Vec3,
    /// Unit normal of the side that shines.
    pub normal: Vec3,
}

impl EmissiveMesh {
    /// The light of those `triangles` that have an area; `None` if none has.
    pub fn new(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Option<Self> {
        let triangles: Vec<_> = triangles.into_iter().filter(|&t| surface::normal(t).is_some()).collect();
        let area: f64 = triangles.iter().map(|&t| surface::area(t)).sum();
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let mut sum = 0.0;
        let mut cumulative: Vec<f32> = triangles
            .iter()
            .map(|&t| {
                sum += surface::area(t);
                (sum / area) as f32
            })
            .collect();
        *cumulative.last_mut()? = 1.0;
        Some(Self { triangles, cumulative, area })
    }

    /// Its area in m².
    pub fn area(&self) -> f32 {
        self.area as f32
    }

    /// Corners of its triangles.
    pub fn triangles(&self) -> &[[Vec3; 3]] {
        &self.triangles
    }

    /// Running sums of the triangles' shares of the area, the last one 1.
    pub fn cumulative(&self) -> &[f32] {
        &self.cumulative
    }

    /// A place drawn uniformly over the area: `u[0]` chooses the triangle, and what is left of it and `u[1]` the point there.
    ///
    /// Twin: `mesh_choice` in rays_direct.wgsl.
    #[inline]
    pub fn place(&self, u: [f32; 2]) -> EmissivePlace {
        let triangle = self.cumulative.partition_point(|&sum| sum <= u[0]).min(self.cumulative.len() - 1);
        let before = if triangle == 0 { 0.0 } else { self.cumulative[triangle - 1] };
        let left = rest(u[0], before, self.cumulative[triangle]);
        let corners @ [a, b, c] = self.triangles[triangle];
        let (edge_u, edge_v) = (b - a, c - a);
        let [s, t] = sampling::triangle([left, u[1]]);
        let normal = edge_u.cross(edge_v).normalize_or_zero();
        let point = surface::offset(corners, a + edge_u * s + edge_v * t, normal);
        EmissivePlace { triangle, point, normal }
    }
}

/// Where `u` lies between `before` and `end`, in [0, 1).
#[inline]
fn rest(u: f32, before: f32, end: f32) -> f32 {
    let width = end - before;
    // A triangle so small that its share is lost in the sum is hardly ever chosen, and then anywhere on it.
    if width > 0.0 { ((u - before) / width).clamp(0.0, sampling::ONE_MINUS_EPSILON) } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sobol::Sequence;

    /// Triangles of 3, 1 and 4 m² (and one of none) are chosen by their areas, and points fill them evenly: N = 2¹⁶ of a Sobol
    /// sequence, seed 3; counts to 1e-3 and means to 2e-3, whose errors in stratified points fall below 1/√N = 4e-3.
    #[test]
    fn places_are_uniform_over_the_area() {
        let triangle =
            |x: f32, size: f32| [Vec3::X * x, Vec3::new(x + size, 0.0, 0.0), Vec3::new(x, 2.0, 0.0)];
        let mesh = EmissiveMesh::new([
            triangle(0.0, 3.0),
            triangle(5.0, 0.0),
            triangle(5.0, 1.0),
            triangle(9.0, 4.0),
        ]);
        let mesh = mesh.unwrap();
        assert_eq!((mesh.area(), mesh.triangles().len()), (8.0, 3));
        let n = 1 << 16;
        let (mut counts, mut sums) = ([0.0f64; 3], [Vec3::ZERO; 3]);
        for i in 0..n {
            let place = mesh.place(Sequence::new(3, 0).sample(i).next_2d());
            counts[place.triangle] += 1.0;
            sums[place.triangle] += place.point;
            assert_eq!(place.normal, Vec3::Z);
            assert!(place.point.z > 0.0 && place.point.z < 1e-3);
        }
        for (k, [x, size]) in [[0.0, 3.0f32], [5.0, 1.0], [9.0, 4.0]].into_iter().enumerate() {
            assert!((counts[k] / n as f64 - f64::from(size) / 8.0).abs() < 1e-3, "{counts:?}");
            let mean = sums[k] / counts[k] as f32;
            let middle = Vec3::new(x + size / 3.0, 2.0 / 3.0, 0.0);
            assert!((mean - middle).truncate().length() < 2e-3 * size.max(1.0), "{k}: {mean}");
        }
        assert!(EmissiveMesh::new([triangle(5.0, 0.0)]).is_none());
        for u in [0.0, 0.375, 0.5, 1.0 - f32::EPSILON / 2.0, 1.0] {
            assert!(mesh.place([u, u]).point.is_finite());
        }
    }
}
