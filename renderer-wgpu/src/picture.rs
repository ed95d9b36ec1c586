//! Turns what a renderer draws into pictures in memory, and published frames into rendered films.

use crate::{Accumulation, Gpu, GpuError, PassTime, Renderer, Shadows, Show, View, readback};
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{
    FrameRenderer, LayerKind, RenderError, RenderOptions, RenderStats, Rendered, Watch,
};
use photonstream_scene::{RangeCulling, Scene, Visibility};
use photonstream_shading::sobol::Sequence;
use std::time::Instant;

impl Renderer {
    /// The pixels of the last drawn picture; waits for the device.
    ///
    /// # Errors
    /// A failed device.
    pub fn pixels(&self) -> Result<Vec<glam::Vec3>, GpuError> {
        self.targets
            .as_ref()
            .map_or(Ok(Vec::new()), |targets| readback::colours(self.gpu(), &targets.output.texture))
    }

    /// Draws `layers` of `view` into a film, with one sample per pixel.
    ///
    /// # Errors
    /// [`RenderError`]: an impossible option, size or device.
    pub fn film(&mut self, view: &View, layers: &[LayerKind]) -> Result<Film, RenderError> {
        let mut film = Film::new(view.width, view.height)?;
        for &layer in layers {
            self.draw(&View { show: Show::Layer(layer), ..*view })?;
            film.push(layer.name(), self.pixels()?)?;
        }
        Ok(film)
    }
}

/// The GPU as a renderer of published frames.
#[derive(Debug)]
pub struct WgpuRenderer {
    renderer: Renderer,
    choices: Choices,
    /// Time of each pass of the last picture.
    passes: Vec<PassTime>,
    warned: Warned,
}

/// What the GPU renderer can be asked for beyond the options that all renderers have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choices {
    /// How virtual surface lights are summed.
    pub accumulation: Accumulation,
    /// Edge of the pattern of interleaved sampling: 1, 2 or 4.
    pub interleave: u32,
    /// How lights are shadowed.
    pub shadows: Shadows,
    /// Shadow rays to virtual surface lights per pixel; 0: one to each.
    pub rays_per_pixel: u32,
    /// Whether the time of each pass is told.
    pub timed: bool,
}

impl Default for Choices {
    fn default() -> Self {
        Self {
            accumulation: Accumulation::Tiled,
            interleave: 1,
            shadows: Shadows::Maps,
            rays_per_pixel: 32,
            timed: false,
        }
    }
}

#[derive(Debug, Default)]
struct Warned {
    unshadowed: bool,
    unshadowed_vsls: bool,
    refused: bool,
}

impl WgpuRenderer {
    /// A renderer of published frames on `gpu`.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn new(gpu: Gpu, choices: Choices) -> Result<Self, GpuError> {
        let mut renderer = Renderer::new(gpu)?;
        renderer.set_timed(choices.timed);
        Ok(Self { renderer, choices, passes: Vec::new(), warned: Warned::default() })
    }

    /// The renderer itself.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Time of each pass of the last picture, if asked for.
    pub fn passes(&self) -> &[PassTime] {
        &self.passes
    }

    /// The view that `options` and the choices ask for.
    fn view(&self, scene: &Scene, options: &RenderOptions) -> View {
        View {
            width: options.width,
            height: options.height,
            kernel: options.kernel,
            visibility: options.visibility,
            shadow_map_px: options.shadow_map_px,
            epsilon: options.epsilon,
            culling: options.culling,
            light_samples: options.light_samples,
            seed: options.seed,
            accumulation: self.choices.accumulation,
            interleave: self.choices.interleave,
            shadows: self.choices.shadows,
            rays_per_pixel: self.choices.rays_per_pixel,
            ..View::from_settings(&scene.render, &scene.camera)
        }
    }

    fn warn(&mut self, options: &RenderOptions) -> Result<(), GpuError> {
        let unshadowed = self.renderer.unshadowed_lights();
        if unshadowed > 0 && !std::mem::replace(&mut self.warned.unshadowed, true) {
            tracing::warn!(
                "{unshadowed} lights have no shadows: there are only 256 shadow maps; use --shadows rays"
            );
        }
        let unshadowed =
            if options.visibility == Visibility::ShadowMaps { self.renderer.unshadowed_vsls() } else { 0 };
        if unshadowed > 0 && !std::mem::replace(&mut self.warned.unshadowed_vsls, true) {
            tracing::warn!(
                "{unshadowed} virtual surface lights, the darkest, have no shadows: there are too many for shadow maps; use \
                 --visibility octahedral or rays"
            );
        }
        let refused = self.renderer.refused_records()?;
        if refused > 0 && !std::mem::replace(&mut self.warned.refused, true) {
            tracing::warn!("{refused} published lights have impossible values and are not shown");
        }
        Ok(())
    }
}

impl FrameRenderer for WgpuRenderer {
    fn render(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Rendered, RenderError> {
        let start = Instant::now();
        options.validate()?;
        let mut film = Film::new(options.width, options.height)?;
        self.renderer.set_scene(scene)?;
        self.renderer.set_frame(frame)?;
        options.check_distance_maps(frame)?;
        let view = self.view(scene, options);
        let samples = options.samples_per_pixel;
        let mut layers: Vec<Vec<glam::Vec3>> = Vec::new();
        let mut stats = RenderStats { vsls: frame.vsls.len() as u64, ..RenderStats::default() };
        self.passes.clear();
        let (mut indirect_sum, mut range_sum) = (0.0, 0.0);
        for sample in 0..samples {
            watch.check()?;
            // All pixels share the places of their samples.
            let jitter = if samples == 1 {
                [0.5; 2]
            } else {
                Sequence::new(options.seed, 0).sample(sample.into()).next_2d()
            };
            for (index, &layer) in options.layers.iter().enumerate() {
                let shown = View { show: Show::Layer(layer), jitter, sample, ..view };
                let drawn = self.renderer.draw_watched(&shown, watch)?;
                if drawn.stopped {
                    return Err(RenderError::Cancelled);
                }
                stats.light_rays += drawn.light_rays;
                stats.vsl_rays += drawn.vsl_rays;
                self.passes.extend(drawn.passes);
                let pixels = self.renderer.pixels()?;
                match layers.get_mut(index) {
                    None => layers.push(pixels),
                    Some(sum) => sum.iter_mut().zip(pixels).for_each(|(s, p)| *s += p),
                }
            }
            stats.camera_rays += film.pixel_count() as u64;
            if options.needs(LayerKind::needs_indirect) && options.epsilon > 0.0 {
                let skipped = self.renderer.skipped()?;
                if skipped > 0.0 {
                    self.renderer.draw(&View {
                        show: Show::Layer(LayerKind::Indirect),
                        jitter,
                        sample,
                        ..view
                    })?;
                    indirect_sum +=
                        self.renderer.pixels()?.iter().map(|p| f64::from(p.max_element())).sum::<f64>();
                    range_sum += skipped;
                }
            }
            watch.report(f64::from(sample + 1) / f64::from(samples));
        }
        for (layer, mut pixels) in options.layers.iter().zip(layers) {
            let share = 1.0 / samples as f32;
            if samples > 1 {
                pixels.iter_mut().for_each(|p| *p *= share);
            }
            film.push(layer.name(), pixels)?;
        }
        match options.culling {
            RangeCulling::Stochastic => {
                let variance = range_sum * f64::from(options.epsilon).powi(2);
                stats.range_error = RenderStats::range_error(variance, indirect_sum, film.pixel_count());
            }
            RangeCulling::Cut if range_sum > 0.0 => stats.range_loss_share = range_sum / indirect_sum,
            RangeCulling::Cut => {}
        }
        self.warn(options)?;
        let by_rays = options.needs(LayerKind::needs_indirect) && options.visibility == Visibility::Rays;
        stats.noise = if by_rays { self.renderer.noise()? } else { None };
        if let Some(noise) = stats.noise.filter(|&noise| noise > 0.0) {
            tracing::info!(
                "{} shadow rays per pixel leave a standard error of {:.2} % of the indirect light; --rays sets the number",
                self.choices.rays_per_pixel,
                noise * 100.0
            );
        }
        if self.choices.timed {
            tracing::info!("{}", times(&self.passes));
        }
        stats.render_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut rendered = Rendered { film, stats };
        rendered.describe(scene, Some(frame), options);
        Ok(rendered)
    }
}

/// The passes with their times, those of one name together, and the sum.
fn times(passes: &[PassTime]) -> String {
    if passes.is_empty() {
        return "the device tells no times".into();
    }
    let mut named: Vec<PassTime> = Vec::new();
    for pass in passes {
        match named.iter_mut().find(|p| p.name == pass.name) {
            Some(known) => known.ms += pass.ms,
            None => named.push(*pass),
        }
    }
    let sum: f64 = named.iter().map(|p| p.ms).sum();
    let list: Vec<_> = named.iter().map(|p| format!("{} {:.2} ms", p.name, p.ms)).collect();
    format!("{}; together {sum:.2} ms", list.join(", "))
}
