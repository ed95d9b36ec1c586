//! Gathers what a picture of virtual surface lights shall be like.

use crate::{LayerKind, RenderError, distance_map_edge};
use photonstream_protocol::VslFrame;
use photonstream_scene::{RangeCulling, RenderSettings, SHADOW_MAP_EDGES, Visibility};
use photonstream_shading::Kernel;

/// What a picture of virtual surface lights shall be like.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// How the flux of a virtual surface light falls off.
    pub kernel: Kernel,
    /// Whether virtual surface lights are shadowed.
    pub visibility: Visibility,
    /// Edge of the shadow maps of virtual surface lights in texels, for [`Visibility::ShadowMaps`].
    pub shadow_map_px: u32,
    /// A virtual surface light ends at the range where it cannot add this radiance (W m⁻² sr⁻¹) any more; 0: it has none.
    pub epsilon: f32,
    /// Whether lights beyond their range are skipped or drawn by lot.
    pub culling: RangeCulling,
    /// Shadow rays per camera sample and area light.
    pub light_samples: u32,
    /// What is rendered, in this order; the first is what a viewer shows.
    pub layers: Vec<LayerKind>,
    /// Camera samples per pixel: 1 is the pixel's centre, more are stratified over it.
    pub samples_per_pixel: u32,
    /// Seed of pixel and area-light samples, and of the lots of stochastic culling.
    pub seed: u64,
    /// Threads; `None`: one per core. The picture does not depend on it.
    pub threads: Option<usize>,
}

impl RenderOptions {
    /// The settings that a scene asks for; the full picture, one sample per pixel.
    pub fn from_settings(settings: &RenderSettings) -> Self {
        Self {
            width: settings.width,
            height: settings.height,
            kernel: settings.kernel,
            visibility: settings.visibility,
            shadow_map_px: settings.shadow_map_px,
            epsilon: settings.epsilon,
            culling: settings.culling,
            light_samples: settings.light_samples,
            layers: vec![LayerKind::Full],
            samples_per_pixel: 1,
            seed: 1,
            threads: None,
        }
    }

    /// Whether every option is in its range.
    ///
    /// # Errors
    /// [`RenderError::Option`] names the first that is not.
    pub fn validate(&self) -> Result<(), RenderError> {
        let wrong = |option, found: String, expected| Err(RenderError::Option { option, found, expected });
        if !(self.epsilon >= 0.0 && self.epsilon.is_finite()) {
            return wrong("epsilon", self.epsilon.to_string(), "0 or more, finite");
        }
        if !SHADOW_MAP_EDGES.contains(&self.shadow_map_px) {
            return wrong("shadow_map_px", self.shadow_map_px.to_string(), "32, 64, 128 or 256");
        }
        if !(1..=MAX_SAMPLES).contains(&self.light_samples) {
            return wrong("light_samples", self.light_samples.to_string(), "1 to 65536");
        }
        if !(1..=MAX_SAMPLES).contains(&self.samples_per_pixel) {
            return wrong("samples per pixel", self.samples_per_pixel.to_string(), "1 to 65536");
        }
        let repeats = |(i, layer): (usize, &LayerKind)| self.layers[..i].contains(layer);
        if self.layers.is_empty() || self.layers.iter().enumerate().any(repeats) {
            let names: Vec<_> = self.layers.iter().map(|l| l.name()).collect();
            return wrong("layers", format!("[{}]", names.join(", ")), "one or more, each once");
        }
        Ok(())
    }

    /// Whether `frame` has what the visibility needs.
    ///
    /// # Errors
    /// [`RenderError::NoDistanceMaps`].
    pub fn check_distance_maps(&self, frame: &VslFrame) -> Result<(), RenderError> {
        let is_missing =
            !frame.vsls.is_empty() && distance_map_edge(frame.distances.len(), frame.vsls.len()).is_none();
        let is_needed = self.visibility == Visibility::Octahedral && self.needs(LayerKind::needs_indirect);
        if is_missing && is_needed { Err(RenderError::NoDistanceMaps) } else { Ok(()) }
    }

    /// Whether any layer asked for has the given need, such as [`LayerKind::needs_direct`].
    pub fn needs(&self, what: fn(LayerKind) -> bool) -> bool {
        self.layers.iter().any(|&layer| what(layer))
    }
}

const MAX_SAMPLES: u32 = 1 << 16;
