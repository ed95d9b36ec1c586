//! Turns a few lines of TOML into scenes, their light and their pictures.

use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, Rendered, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{RangeCulling, Scene, SceneConfig, SceneError, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::{
    counters::Counters, flux::QUANTUM, ledger::Ledger, records, simulation::Simulation,
};
use std::{path::Path, sync::Arc};

pub(crate) const CAMERA: &str =
    "[camera]\nposition_m = [0, 1, 4]\ntarget_m = [0, 0.5, 0]\nvertical_fov_deg = 40\n";

/// The scene that `text` describes, or why it is refused.
pub(crate) fn build(text: &str) -> Result<Scene, SceneError> {
    SceneConfig::from_text(text, Path::new("test.toml"))?.build()
}

pub(crate) fn scene(text: &str) -> Arc<Scene> {
    Arc::new(build(text).unwrap_or_else(|e| panic!("{e}\n{text}")))
}

/// A closed box of 2 × 1 × 3 m seen from within, of albedo `rho`, around the middle of its coordinates.
pub(crate) fn closed_box(rho: f64, light: &str, streaming: &str) -> Arc<Scene> {
    scene(&format!(
        "[camera]\nposition_m = [0.9, 0.4, 1.4]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 60\n\
         [material.wall]\nalbedo = {rho}\n\
         [object.room]\nmaterial = \"wall\"\nsides = \"back\"\nbox = {{ size_m = [2, 1, 3] }}\n\
         [light.lamp]\n{light}\n[streaming]\n{streaming}\n"
    ))
}

/// A scene made ready, and its pool filled.
pub(crate) struct Lit {
    pub(crate) simulation: Simulation,
    pub(crate) ledger: Ledger,
}

impl Lit {
    pub(crate) fn new(scene: &Arc<Scene>) -> Self {
        let simulation = Simulation::new(Arc::clone(scene));
        let ledger = simulation.fill();
        Self { simulation, ledger }
    }

    pub(crate) fn counters(&self) -> Counters {
        self.ledger.counters()
    }

    /// The lights, as renderers get them.
    pub(crate) fn vsls(&self) -> VslSet {
        let scene = &self.simulation.scene;
        let mut records = records::vsl_records(scene, &self.simulation.placement);
        records::write_flux(&mut records, self.ledger.readings(scene), 0);
        VslSet::from_records(&records).unwrap()
    }

    /// Sum of all flux, W.
    pub(crate) fn total(&self) -> [f64; 3] {
        self.ledger.readings(&self.simulation.scene).fold([0.0; 3], |sum, reading| {
            let flux = reading.flux.to_array();
            [0, 1, 2].map(|i| sum[i] + f64::from(flux[i]))
        })
    }

    /// Standard error of the first channel of [`Lit::total`], W, from the variance between the paths of a single light.
    pub(crate) fn sigma(&self) -> f64 {
        let scene = &self.simulation.scene;
        let watts = f64::from(self.ledger.scales(scene)[0].watts.x);
        let pool = self.ledger.pool();
        let n = f64::from(pool.slots());
        let paths = (0..pool.slots()).map(|slot| pool.path(slot).unwrap_or_default());
        let sums = paths.map(|path| path.iter().map(|d| f64::from(d.rgb[0])).sum::<f64>() * QUANTUM);
        let sums: Vec<f64> = sums.collect();
        let mean = sums.iter().sum::<f64>() / n;
        let variance = sums.iter().map(|s| (s - mean) * (s - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        watts * (variance / n).sqrt()
    }

    /// The picture by shadow rays, kernel `disc`, no range, all three sums.
    pub(crate) fn picture(&self, size: u32) -> Rendered {
        self.picture_with(size, Kernel::Disc, Visibility::Rays, 0.0)
    }

    pub(crate) fn picture_with(
        &self,
        size: u32,
        kernel: Kernel,
        visibility: Visibility,
        epsilon: f32,
    ) -> Rendered {
        let scene = &self.simulation.scene;
        let culling = RangeCulling::Cut;
        let options = RenderOptions { kernel, visibility, epsilon, culling, ..options(scene, size) };
        let rendered = render(scene, &self.vsls(), &options, Watch::default()).unwrap();
        rendered.film.check_finite().unwrap();
        for layer in rendered.film.layers() {
            assert!(layer.pixels.iter().all(|p| p.min_element() >= 0.0), "{}: negative light", layer.name);
        }
        rendered
    }

    /// Flux and its standard error are finite and not negative, no path was lost to a bad number.
    pub(crate) fn assert_sane(&self) {
        for (vsl, reading) in self.ledger.readings(&self.simulation.scene).enumerate() {
            let flux = reading.flux;
            assert!(flux.is_finite() && flux.min_element() >= 0.0, "light {vsl}: flux {flux}");
            let error = reading.standard_error;
            assert!(error.is_finite() && error >= 0.0, "light {vsl}: standard error {error}");
        }
        assert_eq!(self.counters().rejected, 0);
    }
}

pub(crate) fn options(scene: &Scene, size: u32) -> RenderOptions {
    RenderOptions {
        width: size,
        height: size,
        epsilon: 0.0,
        layers: vec![LayerKind::Full, LayerKind::Direct, LayerKind::Indirect],
        light_samples: 4,
        ..RenderOptions::from_settings(&scene.render)
    }
}

pub(crate) fn pixels<'a>(rendered: &'a Rendered, layer: &str) -> &'a [Vec3] {
    &rendered.film.layer(layer).unwrap().pixels
}

/// The mean of the first channel.
pub(crate) fn mean(pixels: &[Vec3]) -> f64 {
    pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / pixels.len() as f64
}

/// Holds a figure to its limit, and tells it: the figures of `hard-cases.md` are what `--nocapture` shows.
#[track_caller]
#[allow(clippy::print_stdout)]
pub(crate) fn figure(case: &str, found: f64, limit: f64) {
    println!("figure: {case}: {found:.3e} of {limit:.1e}");
    assert!(found.abs() <= limit, "{case}: {found:e}, at most {limit:e}");
}
