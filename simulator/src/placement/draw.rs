//! Turns a surface into points drawn uniformly on its shrunken triangles.

use crate::{
    streams::stream_of,
    vsl::{Surface, Vsl},
};
use photonstream_scene::Scene;
use photonstream_shading::{sampling, sobol::Sequence, surface};

/// `count` points, each on a triangle chosen by area and uniform on that triangle scaled by `triangle_scale` about its
/// centroid, which keeps them off the edges. Their areas are zero.
pub(super) fn points(scene: &Scene, on: Surface, count: u32, seed: u64, triangle_scale: f32) -> Vec<Vsl> {
    let triangles = scene.objects[on.object.0 as usize].triangles.clone();
    let mut cumulative = Vec::with_capacity(triangles.len());
    let mut sum = 0.0;
    for triangle in triangles.clone() {
        sum += surface::area(scene.geometry.rest_triangle(triangle));
        cumulative.push(sum);
    }
    // Named by the object's name, so that another object's coming or going leaves the points where they are.
    let name = &scene.objects[on.object.0 as usize].name;
    let sequence = Sequence::new(seed, stream_of(name, on.side as u32));
    (0..count)
        .map(|index| {
            let mut sample = sequence.sample(u64::from(index));
            let target = f64::from(sample.next_1d()) * sum;
            let chosen = cumulative.partition_point(|&c| c <= target).min(cumulative.len() - 1);
            let [u, v] = sampling::triangle(sample.next_2d());
            let inset = (1.0 - triangle_scale) / 3.0;
            Vsl {
                surface: on,
                triangle: triangles.start + chosen as u32,
                barycentric: [u * triangle_scale + inset, v * triangle_scale + inset],
                area: 0.0,
            }
        })
        .collect()
}
