//! Turns a number of virtual surface lights into the share of each surface.

use crate::{
    apportion::apportion,
    budgets::{self, Densities},
    vsl::Surface,
};
use photonstream_scene::{ObjectId, Scene};

/// How many lights a surface gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    pub(super) surface: Surface,
    pub(super) vsls: u32,
}

/// At least one light for each reflecting side of each object with triangles, the rest by area times density (largest
/// remainder), so that the sum is `vsls`, or the number of surfaces where that is more. Ordered by surface.
pub(super) fn by_area(scene: &Scene, vsls: u32, densities: &Densities) -> Vec<Share> {
    let mut surfaces = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        if object.triangles.is_empty() {
            continue;
        }
        let object_id = ObjectId(index as u32);
        let area = budgets::area(scene, object_id);
        surfaces.extend(object.sides.iter().map(|side| {
            let weight = area * densities.get(&object.name, side);
            (Surface { object: object_id, side }, weight)
        }));
    }
    let weights: Vec<f64> = surfaces.iter().map(|&(_, weight)| weight).collect();
    let counts = apportion(&weights, vsls);
    surfaces.into_iter().zip(counts).map(|((surface, _), vsls)| Share { surface, vsls }).collect()
}
