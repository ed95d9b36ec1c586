//! Turns a placement into how dense its lights lie by the names of objects, for another scene.

use super::{MOST_TIMES, area};
use crate::placement::Placement;
use photonstream_scene::{Scene, Side};
use std::collections::HashMap;

/// Lights per m² on each side of each object, relative to the mean; 1 where nothing is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Densities(HashMap<(String, Side), f64>);

impl Densities {
    /// Those of a placement.
    pub(crate) fn of(scene: &Scene, placement: &Placement) -> Self {
        let areas: Vec<f64> = placement.surfaces.iter().map(|(on, _)| area(scene, on.object)).collect();
        let mean = placement.owning() as f64 / areas.iter().sum::<f64>();
        let densities = placement.surfaces.iter().zip(areas).map(|((on, lights), area)| {
            let name = scene.objects[on.object.0 as usize].name.clone();
            let density = lights.len() as f64 / area / mean;
            // Of what is tiny a single light is dense, and says nothing of what it would be at another size.
            let density = if density.is_finite() { density.clamp(1.0 / MOST_TIMES, MOST_TIMES) } else { 1.0 };
            ((name, on.side), density)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::Simulation;
    use photonstream_scene::SceneConfig;
    use std::{path::Path, sync::Arc};

    /// A crumb that has its one light is not as dense as that when it is scaled up, and what is unknown is as dense as all.
    #[test]
    fn tiny_surfaces_say_little() {
        let text = "[camera]\nposition_m = [0, 3, 9]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 40\n[material.m]\nalbedo = 0.5\n\
                    [object.floor]\nmaterial = \"m\"\nquad = { corner_m = [-2, 0, 2], edge_u_m = [4, 0, 0], edge_v_m = [0, 0, -4] }\n\
                    [object.crumb]\nmaterial = \"m\"\nposition_m = [0, 1, 0]\nbox = { size_m = [1e-4, 1e-4, 1e-4] }\n\
                    [light.l]\npower_w = 1\npoint = { position_m = [0, 5, 0] }\n[streaming]\nvsls = 500\n";
        let scene = SceneConfig::from_text(text, Path::new("test.toml")).unwrap().build().unwrap();
        let simulation = Simulation::new(Arc::new(scene));
        let densities = Densities::of(&simulation.scene, &simulation.placement);
        assert_eq!(densities.get("crumb", Side::Front), MOST_TIMES);
        assert!((densities.get("floor", Side::Front) - 1.0).abs() < 0.01);
        assert_eq!(densities.get("floor", Side::Back), 1.0);
    }
}
