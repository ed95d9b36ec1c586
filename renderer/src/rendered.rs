//! Gathers what a renderer makes of a published frame: a picture, and what it took.

use crate::{RenderError, RenderOptions, Watch};
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_scene::Scene;
use serde::Serialize;

/// A picture and what it took.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The layers asked for, and where they come from.
    pub film: Film,
    /// What it took.
    pub stats: RenderStats,
}

/// What a picture took. The keys of the serialised form are the fields' names.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize)]
pub struct RenderStats {
    /// Time from call to picture.
    pub render_ms: f64,
    /// Rays from the camera.
    pub camera_rays: u64,
    /// Shadow rays to lights.
    pub light_rays: u64,
    /// Shadow rays to virtual surface lights.
    pub vsl_rays: u64,
    /// Number of virtual surface lights.
    pub vsls: u64,
    /// What the range of the lights may have lost at most, as a share of the indirect light of the picture: the sum
    /// of the upper bounds of all that was skipped over the sum of what was found. 0 where nothing was skipped, infinite
    /// (`null` in JSON) where nothing was found, 0 with stochastic culling: nothing is lost on average.
    pub range_loss_share: f64,
    /// Upper bound of the standard error that lots of stochastic culling add to the indirect light, as rel. RMSE: that of
    /// independent lots, without cosines. 0 without lots, infinite (`null` in JSON) where nothing was found.
    pub range_error: f64,
    /// Standard error of the indirect light as rel. RMSE, where shadow rays went to some of the virtual surface lights
    /// only; `None` where nothing was drawn by lot.
    pub noise: Option<f64>,
}

impl RenderStats {
    /// [`RenderStats::range_error`] of a picture of `pixels`: `variance` is the sum over camera samples of the greatest variance
    /// of their radiance in (W m⁻² sr⁻¹)², `indirect` that of the indirect radiance, in the largest channel.
    pub fn range_error(variance: f64, indirect: f64, pixels: usize) -> f64 {
        if variance > 0.0 { (variance * pixels as f64).sqrt() / indirect } else { 0.0 }
    }

    /// The rays of both; the rest is that of `self`.
    #[must_use]
    pub fn merge(mut self, other: &Self) -> Self {
        self.camera_rays += other.camera_rays;
        self.light_rays += other.light_rays;
        self.vsl_rays += other.vsl_rays;
        self
    }
}

/// Turns published frames into pictures.
pub trait FrameRenderer {
    /// The picture of `frame`; `scene` is the frame's own, as [`crate::published::PublishedScene`] gives it.
    ///
    /// # Errors
    /// [`RenderError`]: an option out of range, an impossible size, unusable records, cancelled, a lost device.
    fn render(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Rendered, RenderError>;
}

impl Rendered {
    /// Notes in the picture what it shows and how it was made; number and hash of the frame come from `frame`.
    pub fn describe(&mut self, scene: &Scene, frame: Option<&VslFrame>, options: &RenderOptions) {
        let metadata = &mut self.film.metadata;
        metadata.scene_name = Some(scene.name.clone());
        metadata.scene_hash = Some(frame.map_or(scene.hash, |f| f.scene_hash));
        metadata.frame = frame.map(|f| f.frame);
        metadata.photon_paths = frame.map(|f| f.statistics.pool_valid);
        metadata.method = Some("photon-streaming".into());
        metadata.kernel = Some(options.kernel.name().into());
        metadata.visibility = Some(options.visibility.name().into());
        metadata.samples_per_pixel = Some(options.samples_per_pixel.into());
        metadata.vsls = Some(self.stats.vsls);
        metadata.software = Some(SOFTWARE.into());
    }
}

/// Name and version of this software, as pictures tell it.
pub const SOFTWARE: &str = concat!("photonstream ", env!("CARGO_PKG_VERSION"));
