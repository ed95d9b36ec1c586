//! Gathers what a reference picture shall be like.

use photonstream_renderer::{LayerKind, RenderError};
use photonstream_scene::RenderSettings;
use std::time::Duration;

/// How [`crate::reference()`] makes a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceOptions {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// When it is good enough.
    pub stop: Stop,
    /// What is rendered, of full, direct and indirect; the noise of the first one is what [`Stop::Error`] looks at.
    pub layers: Vec<LayerKind>,
    /// Seed of all samples.
    pub seed: u64,
    /// Where in a pixel its samples lie.
    pub pixel_filter: PixelFilter,
    /// Threads; `None`: one per core.
    pub threads: Option<usize>,
}

/// When a reference picture is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// After so many paths per pixel, rounded up to an even number.
    Samples(u64),
    /// When the estimated relative RMSE is at most `rel_rmse`, or after `max_samples` paths per pixel.
    Error {
        /// Relative RMSE to reach.
        rel_rmse: f64,
        /// Most paths per pixel.
        max_samples: u64,
    },
    /// After the pass in which this time is over.
    Time(Duration),
}

/// Where in a pixel its samples lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum PixelFilter {
    /// At its centre, as the other renderers do with one sample: no edge differs by anti-aliasing.
    #[default]
    Centre,
    /// Uniformly over the pixel.
    Box,
}

impl Stop {
    pub(crate) fn most_samples_per_half(self) -> u64 {
        match self {
            Self::Samples(samples) | Self::Error { max_samples: samples, .. } => samples.div_ceil(2),
            Self::Time(_) => u64::MAX,
        }
    }
}

impl ReferenceOptions {
    /// The size that a scene asks for; the full picture at its pixel centres.
    pub fn from_settings(settings: &RenderSettings, stop: Stop) -> Self {
        Self {
            width: settings.width,
            height: settings.height,
            stop,
            layers: vec![LayerKind::Full],
            seed: 1,
            pixel_filter: PixelFilter::Centre,
            threads: None,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        let wrong = |option, found: String, expected| Err(RenderError::Option { option, found, expected });
        if self.stop.most_samples_per_half() == 0 {
            return wrong("samples per pixel", "0".into(), "1 or more");
        }
        if let Stop::Error { rel_rmse, .. } = self.stop
            && !(rel_rmse > 0.0 && rel_rmse.is_finite())
        {
            return wrong("error", rel_rmse.to_string(), "a relative error above 0");
        }
        let traced = |l: &LayerKind| matches!(l, LayerKind::Full | LayerKind::Direct | LayerKind::Indirect);
        let repeats = |(i, layer): (usize, &LayerKind)| self.layers[..i].contains(layer);
        if self.layers.is_empty()
            || !self.layers.iter().all(traced)
            || self.layers.iter().enumerate().any(repeats)
        {
            let names: Vec<_> = self.layers.iter().map(|l| l.name()).collect();
            let expected = "one or more of full, direct, indirect, each once";
            return wrong("layers", format!("[{}]", names.join(", ")), expected);
        }
        Ok(())
    }
}
