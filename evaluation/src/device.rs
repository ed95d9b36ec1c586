//! Names what an evaluation asks of a graphics device, so that no graphics library is needed here.

use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{RenderError, RenderOptions, Watch};
use photonstream_scene::Scene;

/// How a device sums virtual surface lights over a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Way {
    /// The accumulation's name, as `photonstream render --accumulation` takes it.
    pub accumulation: String,
    /// Edge of the pattern of interleaved sampling; 1: every pixel sums all lights.
    pub interleave: u32,
}

/// What a device drew.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// The layers asked for.
    pub film: Film,
    /// What each timed frame took, ms; at least one.
    pub frames_ms: Vec<f64>,
}

/// A graphics device that draws published frames.
pub trait Device {
    /// Name of the adapter with its driver.
    fn adapter(&self) -> String;

    /// Options of `photonstream evaluate` that choose it again; empty for the default.
    fn arguments(&self) -> String;

    /// All ways that it has, the default first.
    fn ways(&self) -> Vec<Way>;

    /// Draws `frame` into the layers of `options`; and before that, timed, some frames whose light and picture are new each
    /// time, so that nothing is left from the last one. `frame` is the frame of `scene`.
    ///
    /// # Errors
    /// [`RenderError::Option`] for a way, kernel or visibility that it does not have, [`RenderError::Device`] for what the
    /// adapter cannot do, [`RenderError::Cancelled`].
    fn draw(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        way: &Way,
        watch: Watch<'_>,
    ) -> Result<Drawn, RenderError>;

    /// The times of some such frames alone, ms; of one where it takes long.
    ///
    /// # Errors
    /// As [`Device::draw`].
    fn time(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        way: &Way,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, RenderError>;
}

/// A device, or the reason why there is none.
pub type Offered<'a> = Result<&'a mut dyn Device, String>;

/// What is left out without a device, as the report names it.
pub const WITHOUT: &str = "the GPU renderer and its accumulations";
