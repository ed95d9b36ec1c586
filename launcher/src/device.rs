//! Turns the GPU renderer into the device that an evaluation measures.

use photonstream_evaluation::device::{Device, Drawn, Way};
use photonstream_protocol::VslFrame;
use photonstream_renderer::{LayerKind, RenderError, RenderOptions, Watch};
use photonstream_renderer_wgpu::{Accumulation, AdapterChoice, Gpu, GpuError, Renderer, Show, View};
use photonstream_scene::{Scene, Visibility};
use std::time::Instant;

/// Frames that are timed at most, and at least.
const RUNS: (usize, usize) = (5, 3);
/// More than the least number is not timed beyond this, ms.
const LONG_MS: f64 = 500.0;

/// A renderer on an adapter.
#[derive(Debug)]
pub(crate) struct GpuDevice {
    renderer: Renderer,
    choice: AdapterChoice,
    /// Counts frames: one of another epoch is uploaded whole.
    epoch: u64,
}

impl GpuDevice {
    /// On the adapter that `choice` asks for.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] and those of [`Renderer::new`].
    pub(crate) fn new(choice: AdapterChoice) -> Result<Self, GpuError> {
        let gpu = Gpu::headless(&choice)?;
        Ok(Self { renderer: Renderer::new(gpu)?, choice, epoch: 0 })
    }

    fn upload(&mut self, frame: &mut VslFrame) -> Result<(), GpuError> {
        self.epoch += 1;
        frame.epoch = self.epoch;
        self.renderer.set_frame(frame).map(drop)
    }

    /// Times of frames, ms, at least `least`.
    fn timed(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        view: &View,
        least: usize,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, RenderError> {
        self.renderer.set_scene(scene)?;
        let mut frame = frame.clone();
        let mut frames_ms: Vec<f64> = Vec::new();
        // The first makes pipelines, targets and shadow maps, and does not count.
        for run in 0..=RUNS.0 {
            watch.check()?;
            if frames_ms.len() >= least && frames_ms.iter().sum::<f64>() > LONG_MS {
                break;
            }
            let begun = Instant::now();
            self.upload(&mut frame)?;
            // Another place within the pixels: nothing of the last picture is still right.
            let jitter = [0.5 + 1e-3 * (run + 1) as f32, 0.5];
            let drawn = self.renderer.draw_watched(&View { jitter, ..*view }, watch)?;
            if drawn.stopped {
                return Err(RenderError::Cancelled);
            }
            self.renderer.gpu().wait()?;
            if run > 0 {
                frames_ms.push(begun.elapsed().as_secs_f64() * 1e3);
            }
        }
        let without = self.renderer.unshadowed_vsls();
        if view.visibility == Visibility::ShadowMaps && without > 0 {
            return Err(RenderError::Option {
                option: "visibility",
                found: format!("shadow-maps, and {without} virtual surface lights too many"),
                expected: "octahedral or rays for so many",
            });
        }
        Ok(frames_ms)
    }
}

impl Device for GpuDevice {
    fn adapter(&self) -> String {
        self.renderer.gpu().name()
    }

    fn arguments(&self) -> String {
        let AdapterChoice { name, software } = &self.choice;
        let name = name.as_ref().map(|name| format!("--adapter '{}'", name.replace('\'', r"'\''")));
        let software = software.then(|| "--software".to_owned());
        name.into_iter().chain(software).collect::<Vec<_>>().join(" ")
    }

    fn ways(&self) -> Vec<Way> {
        let way = |accumulation: Accumulation, interleave| Way {
            accumulation: accumulation.name().into(),
            interleave,
        };
        let default = Accumulation::default();
        let others = Accumulation::ALL.iter().filter(|&&a| a != default).map(|&a| way(a, 1));
        // The pattern belongs to the tiles.
        [1, 2, 4].map(|edge| way(Accumulation::Tiled, edge)).into_iter().chain(others).collect()
    }

    fn draw(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        way: &Way,
        watch: Watch<'_>,
    ) -> Result<Drawn, RenderError> {
        let view = view(scene, options, way)?;
        let frames_ms = self.timed(scene, frame, &view, RUNS.1, watch)?;
        let layers: Vec<LayerKind> = options.layers.clone();
        let mut film = self.renderer.film(&View { show: Show::Layer(LayerKind::Full), ..view }, &layers)?;
        film.metadata.scene_hash = Some(scene.hash);
        Ok(Drawn { film, frames_ms })
    }

    fn time(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        way: &Way,
        watch: Watch<'_>,
    ) -> Result<Vec<f64>, RenderError> {
        let view = view(scene, options, way)?;
        self.timed(scene, frame, &view, 1, watch)
    }
}

/// What `options` and `way` ask for.
fn view(scene: &Scene, options: &RenderOptions, way: &Way) -> Result<View, RenderError> {
    let accumulation = Accumulation::ALL.iter().copied().find(|a| a.name() == way.accumulation);
    let accumulation = accumulation.ok_or_else(|| RenderError::Option {
        option: "accumulation",
        found: way.accumulation.clone(),
        expected: "tiled, splat or forward",
    })?;
    Ok(View {
        width: options.width,
        height: options.height,
        kernel: options.kernel,
        visibility: options.visibility,
        shadow_map_px: options.shadow_map_px,
        epsilon: options.epsilon,
        light_samples: options.light_samples,
        seed: options.seed,
        accumulation,
        interleave: way.interleave,
        ..View::from_settings(&scene.render, &scene.camera)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use photonstream_evaluation::{Observer, Options, evaluate, plan::Effort};
    use photonstream_renderer_wgpu::test_gpu;
    use std::{path::Path, sync::atomic::AtomicBool};

    fn evaluated(
        device: &mut GpuDevice,
        out: &Path,
        points: &[&str],
    ) -> Vec<photonstream_evaluation::results::Row> {
        let options = Options {
            configs: vec![Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml")],
            out: out.to_owned(),
            cache: out.join("cache"),
            effort: Effort::Quick,
            size: Some((32, 32)),
            reference_spp: Some(64),
            time_s: None,
            threads: Some(2),
            seed: None,
            points: points.iter().map(|&p| p.to_owned()).collect(),
        };
        let observer = Observer { progress: &|_, _| {}, cancelled: &AtomicBool::new(false) };
        evaluate(&options, Ok(device), observer).unwrap().rows
    }

    /// Every way but the interleaved ones, which mix neighbours, gives the same picture: the same light, all of it, so that
    /// errors differ by f32 sums alone, 10⁻³ of themselves. The light of the processor's picture is the same, too; but some
    /// pixels on edges show the other surface, because the device rasterises them: the means are within 1 %, ten pixels of
    /// the mean's own brightness.
    ///
    /// 200 lights, 4 096 paths, 32 × 32 pixels.
    #[test]
    fn ways_give_the_light_of_the_processor() {
        let Some(gpu) = test_gpu::gpu() else { return };
        let choice = AdapterChoice { name: None, software: true };
        let mut device = GpuDevice { renderer: Renderer::new(gpu).unwrap(), choice, epoch: 0 };
        let folder = tempfile::tempdir().unwrap();
        let settings = "vsls=200,pool=4096,kernel=disc,visibility=none,seed=1";
        let ways = device.ways();
        assert_eq!(ways.len(), 5);
        let mut points = vec![format!("photon-streaming:{settings}")];
        points.extend(ways.iter().map(|way| {
            let Way { accumulation, interleave } = way;
            format!("photon-streaming-gpu:{settings},accumulation={accumulation},interleave={interleave}")
        }));
        let points: Vec<&str> = points.iter().map(String::as_str).collect();
        let rows = evaluated(&mut device, folder.path(), &points);
        assert_eq!(rows.len(), 6, "{rows:?}");
        for row in &rows[1..] {
            assert_eq!(row.adapter.as_deref(), Some(device.adapter().as_str()));
            assert!(row.picture_ms > 0.0 && row.runs >= 3 && row.command.ends_with(" --software"), "{row:?}");
            if row.interleave == Some(1) {
                let ratio = row.rel_rmse_indirect / rows[1].rel_rmse_indirect;
                assert!((ratio - 1.0).abs() < 1e-3, "{:?}: {ratio}", row.accumulation);
                let bias = row.bias_indirect - rows[0].bias_indirect;
                assert!(bias.abs() < 0.01, "{:?}: {bias}", row.accumulation);
            } else {
                assert!(row.rel_rmse_indirect.is_finite() && row.rel_rmse_indirect > 0.0);
            }
        }
    }

    #[test]
    fn what_it_has_not_is_left_out() {
        let Some(gpu) = test_gpu::gpu() else { return };
        let choice = AdapterChoice { name: Some("it's".into()), software: false };
        let mut device = GpuDevice { renderer: Renderer::new(gpu).unwrap(), choice, epoch: 0 };
        assert_eq!(device.arguments(), r"--adapter 'it'\''s'");
        let folder = tempfile::tempdir().unwrap();
        let points = ["photon-streaming-gpu:vsls=20,pool=64,accumulation=scattered"];
        assert!(evaluated(&mut device, folder.path(), &points).is_empty());
        let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("found scattered, expected tiled, splat or forward"));
    }
}
