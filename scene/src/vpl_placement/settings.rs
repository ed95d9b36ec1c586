//! Gathers what placement of virtual point lights can be told.

use super::VplPlacementError;
use crate::config::MAX_LENGTH_M;
use glam::DVec3;

/// How the area is found that a VPL stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum PlacedWeights {
    /// The reached surface nearest to it, measured.
    #[default]
    Surface,
    /// Left to automatic weights: a disc half way to the closest other VPL.
    Automatic,
}

/// What [`super::place_vpls`] does.
#[derive(Clone, Debug, PartialEq)]
pub struct VplPlacementSettings {
    /// Paths traced, 1 to 2²². More find more, and average better.
    pub population: u32,
    /// Distance within which reflections are put together, m; `None`: the finest that needs no more than `most` VPLs.
    pub spacing_m: Option<f64>,
    /// Reflections of each path, 1 to 64.
    pub depth: u32,
    /// Points explored from each start, 0 to 65 536.
    pub explore: u32,
    /// How far VPLs are drawn back into their surface, m; negative: how far they are lifted off it.
    pub normal_bias_m: f64,
    /// Seed of exploration and paths.
    pub seed: u64,
    /// Where exploration starts, in the coordinates of the config, m; none: at the camera's eye.
    pub starts: Vec<DVec3>,
    /// Most VPLs, 1 to 2¹⁶; the most populous are kept.
    pub most: u32,
    /// What becomes of their weights.
    pub weights: PlacedWeights,
}

impl Default for VplPlacementSettings {
    fn default() -> Self {
        Self {
            population: 8192,
            spacing_m: None,
            depth: 3,
            explore: 30,
            normal_bias_m: 0.0,
            seed: 1,
            starts: Vec::new(),
            most: 200,
            weights: PlacedWeights::default(),
        }
    }
}

impl VplPlacementSettings {
    pub(super) fn check(&self) -> Result<(), VplPlacementError> {
        let whole = |name, value: u32, range: std::ops::RangeInclusive<u32>| {
            if range.contains(&value) {
                return Ok(());
            }
            let expected = format!("a whole number from {} to {}", range.start(), range.end());
            Err(VplPlacementError::Setting { name, found: value.to_string(), expected })
        };
        whole("population", self.population, 1..=1 << 22)?;
        whole("depth", self.depth, 1..=64)?;
        whole("explore", self.explore, 0..=1 << 16)?;
        whole("max", self.most, 1..=1 << 16)?;
        let length = |name, value: f64, expected: &str, valid: bool| {
            if valid {
                return Ok(());
            }
            Err(VplPlacementError::Setting { name, found: value.to_string(), expected: expected.into() })
        };
        if let Some(spacing) = self.spacing_m {
            let valid = (1e-6..=MAX_LENGTH_M).contains(&spacing);
            length("spacing_m", spacing, "a length from 1e-6 to 1e9 m", valid)?;
        }
        let valid = self.normal_bias_m.abs() <= MAX_LENGTH_M;
        length("normal_bias_m", self.normal_bias_m, "a length within ±1e9 m", valid)?;
        self.starts.iter().try_for_each(|start| {
            let farthest = start.abs().max_element();
            let valid = start.is_finite() && farthest <= MAX_LENGTH_M;
            length("from", farthest, "a position within ±1e9 m", valid)
        })
    }
}
