//! Turns a placement into how dense its lights lie by the names of objects, for another scene.

use super::area;
use crate::placement::Placement;
use photonstream_scene::{Scene, Side};
use std::collections::HashMap;

/// Lights per m² on each side of each object, relative to the mean; 1 where nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Densities(HashMap<(String, Side), f64>);

impl Densities {
    /// Those of a placement.
    pub(crate) fn of(scene: &Scene, placement: &Placement) -> Self {
        let areas: Vec<f64> = placement.surfaces.iter().map(|(on, _)| area(scene, *on)).collect();
        let mean = placement.owning() as f64 / areas.iter().sum::<f64>();
        let densities = placement.surfaces.iter().zip(areas).map(|((on, lights), area)| {
            let name = scene.objects[on.object.0 as usize].name.clone();
            ((name, on.side), lights.len() as f64 / area / mean)
        });
        Self(densities.collect())
    }

    /// That of one side of an object.
    pub(crate) fn get(&self, object: &str, side: Side) -> f64 {
        if self.0.is_empty() {
            return 1.0;
        }
        self.0.get(&(object.to_owned(), side)).copied().unwrap_or(1.0)
    }
}
