//! Gathers what paper A's tables say, and turns the names of its scenes into scenes of ours.

use crate::EvaluateError;
use photonstream_scene::{
    Scene, SceneConfig,
    config::{LightConfig, OneOrThree, SpotConfig, Vector},
};
use std::path::Path;

/// Numbers of virtual surface lights in the columns of tables 2 and 3.
pub const VSLS: [u32; 4] = [10, 50, 100, 200];
/// Sizes of the pictures of tables 2 and 3, pixels.
pub const SIZES: [(u32, u32); 2] = [(800, 600), (1280, 1024)];

/// A row of the paper's tables, and the scene here that stands for it.
#[derive(Clone, Copy, Debug)]
pub struct PaperScene {
    /// The paper's name.
    pub name: &'static str,
    /// Table 1: polygons and vertices.
    pub polygons: (u32, u32),
    /// Tables 2 and 3: pictures a second with deferred shading, and with the whole geometry drawn for each light.
    pub per_s: [[(u32, u32); 4]; 2],
    /// How the scene here differs from the paper's.
    pub differs: &'static str,
    config: (&'static str, &'static str),
    spot: Option<Spot>,
}

/// A spot that takes the place of a config's lights: the paper's scenes have one.
#[derive(Clone, Copy, Debug)]
struct Spot {
    position_m: [f64; 3],
    target_m: [f64; 3],
    power_w: f64,
    outer_half_angle_deg: f64,
}

/// The paper's four scenes. Source: paper A, tables 1 to 3.
pub const SCENES: [PaperScene; 4] = [
    PaperScene {
        name: "Cornell Box",
        polygons: (2_006, 1_042),
        per_s: [[(140, 195), (48, 40), (36, 19), (21, 10)], [(55, 75), (19, 16), (15, 7), (8, 4)]],
        differs: "a box of our own, as the paper describes its",
        config: ("cornell-box.toml", include_str!("../../../configs/cornell-box.toml")),
        spot: None,
    },
    PaperScene {
        name: "Dragon",
        polygons: (100_010, 50_022),
        per_s: [[(90, 50), (43, 9), (35, 5), (21, 2)], [(45, 86), (19, 7), (15, 4), (8, 1)]],
        differs: "a scan of twice as many triangles",
        config: ("dragon.toml", include_str!("../../../configs/dragon.toml")),
        spot: Some(Spot {
            position_m: [0.0, 1.95, 0.2],
            target_m: [0.0, 0.0, -0.1],
            power_w: 14.0,
            outer_half_angle_deg: 55.0,
        }),
    },
    PaperScene {
        name: "Sponza",
        polygons: (66_453, 60_898),
        per_s: [[(115, 115), (39, 20), (32, 15), (19, 6)], [(45, 55), (16, 11), (15, 4), (7, 2)]],
        differs: "the same model",
        config: ("sponza.toml", include_str!("../../../configs/sponza.toml")),
        spot: Some(Spot {
            position_m: [-4.0, 14.0, 0.0],
            target_m: [3.0, 0.0, -0.5],
            power_w: 2000.0,
            outer_half_angle_deg: 35.0,
        }),
    },
    PaperScene {
        name: "Sibenik",
        polygons: (80_359, 75_596),
        per_s: [[(140, 90), (83, 24), (58, 11), (36, 6)], [(62, 45), (35, 11), (25, 5), (15, 3)]],
        differs: "another export, without the houses around it",
        config: ("sibenik.toml", include_str!("../../../configs/sibenik.toml")),
        spot: Some(Spot {
            position_m: [18.0, 12.0, 0.0],
            target_m: [6.0, 0.0, 0.0],
            power_w: 2000.0,
            outer_half_angle_deg: 50.0,
        }),
    },
];

impl PaperScene {
    /// The scene, lit by one spot, with virtual surface lights by area, as the paper has them.
    ///
    /// # Errors
    /// If its model is not there, which says where to get it.
    pub fn load(&self) -> Result<Scene, EvaluateError> {
        let (file, text) = self.config;
        let mut config = SceneConfig::from_text(text, Path::new(file))?;
        if let Some(spot) = self.spot {
            let Spot { position_m, target_m, power_w, outer_half_angle_deg } = spot;
            let light = LightConfig {
                power_w: Some(OneOrThree([power_w; 3])),
                spot: Some(SpotConfig {
                    position_m: Vector(position_m),
                    target_m: Some(Vector(target_m)),
                    direction: None,
                    outer_half_angle_deg,
                    inner_half_angle_deg: None,
                }),
                ..LightConfig::default()
            };
            config.light = [("spot".to_owned(), light)].into();
        }
        config.streaming.adaptive = Some(false);
        Ok(config.build()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_scene::SceneError;

    /// Of the paper's tables, copied by hand: twice as many lights are never drawn faster, deferred or not.
    #[test]
    fn more_lights_are_slower_in_the_paper() {
        for scene in SCENES {
            for row in scene.per_s {
                assert!(row.is_sorted_by(|a, b| a.0 > b.0 && a.1 > b.1), "{}: {row:?}", scene.name);
            }
        }
    }

    /// One spot lights each scene; models that are not there are skipped, loudly.
    #[test]
    fn scenes_have_one_spot() {
        for paper in SCENES {
            match paper.load() {
                Ok(scene) => {
                    assert_eq!(scene.lights.len(), 1, "{}", paper.name);
                    assert!(scene.lights[0].light.power.min_element() > 0.0);
                }
                Err(EvaluateError::Scene(error @ SceneError::AssetMissing { .. })) => {
                    println!("SKIP {}: {error}", paper.name);
                }
                Err(error) => panic!("{}: {error}", paper.name),
            }
        }
    }
}
