//! Turns a scene and its virtual surface lights into a picture: the sum of METHODS §2, tile by tile.

use crate::{
    InstructionSet,
    cull::{Culling, Selection},
    direct, gather, mapped,
    owner::Owners,
    patched, shadowed,
    surface::{self, Surface},
    threads::on_threads,
    tile::{TILE_EDGE, Tile},
};
use core::f32::consts::FRAC_1_PI;
use glam::Vec3;
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{
    FrameRenderer, LayerKind, RenderError, RenderOptions, RenderStats, Rendered, VslSet, Watch, owner,
    shadow_rays::LIGHT_SEED,
};
use photonstream_scene::{RangeCulling, Scene, Visibility};
use photonstream_shading::{culling, sobol::Sequence};
use rayon::prelude::*;
use std::{sync::atomic::AtomicUsize, time::Instant};

/// Renders `scene` as lit by its lights and by `vsls`.
///
/// Lo = Le + ρ/π (E_direct + Σ Φ V cosθ cosθ_s K), METHODS §2. The picture depends on `options` alone, not on the
/// number of threads.
///
/// # Errors
/// [`RenderError`]: an option out of range, an impossible size, cancelled.
pub fn render(
    scene: &Scene,
    vsls: &VslSet,
    options: &RenderOptions,
    watch: Watch<'_>,
) -> Result<Rendered, RenderError> {
    render_with(scene, vsls, options, watch, InstructionSet::Detected)
}

/// [`render`] with a given instruction set; all of them give the same picture.
///
/// # Errors
/// As [`render`].
pub fn render_with(
    scene: &Scene,
    vsls: &VslSet,
    options: &RenderOptions,
    watch: Watch<'_>,
    instructions: InstructionSet,
) -> Result<Rendered, RenderError> {
    let start = Instant::now();
    options.validate()?;
    if options.visibility == Visibility::Ao {
        let expected = "none, rays, octahedral or shadow-maps here; ao needs the G-buffer of --renderer wgpu";
        return Err(RenderError::Option { option: "visibility", found: "ao".into(), expected });
    }
    let needs_maps = options.visibility == Visibility::Octahedral && options.needs(LayerKind::needs_indirect);
    if needs_maps && vsls.map_edge() == 0 && !vsls.is_empty() {
        return Err(RenderError::NoDistanceMaps);
    }
    let mut film = Film::new(options.width, options.height)?;
    let frame = Frame::new(scene, vsls, options, instructions);
    let tiles = on_threads(options.threads, || frame.tiles(watch))?;
    for (index, &kind) in options.layers.iter().enumerate() {
        let mut pixels = vec![Vec3::ZERO; film.pixel_count()];
        for tile in &tiles {
            for (row, values) in tile.layers[index].chunks_exact(tile.width).enumerate() {
                let at = (tile.y as usize + row) * options.width as usize + tile.x as usize;
                pixels[at..at + tile.width].copy_from_slice(values);
            }
        }
        film.push(kind.name(), pixels)?;
    }
    let mut stats = tiles.iter().fold(RenderStats::default(), |sum, tile| sum.merge(&tile.stats));
    // Summed in the order of the tiles: the same on any number of threads.
    let (skipped, indirect) =
        tiles.iter().fold((0.0, 0.0), |(s, i), tile| (s + tile.skipped, i + tile.indirect));
    let variance: f64 = tiles.iter().map(|tile| tile.variance).sum();
    stats.range_loss_share = if skipped > 0.0 { skipped / indirect } else { 0.0 };
    stats.range_error = RenderStats::range_error(variance, indirect, film.pixel_count());
    stats.vsls = vsls.len() as u64;
    stats.render_ms = start.elapsed().as_secs_f64() * 1e3;
    let mut rendered = Rendered { film, stats };
    rendered.describe(scene, None, options);
    Ok(rendered)
}

/// The CPU as a renderer of published frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuRenderer;

impl FrameRenderer for CpuRenderer {
    fn render(
        &mut self,
        scene: &Scene,
        frame: &VslFrame,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Rendered, RenderError> {
        options.check_distance_maps(frame)?;
        let mut rendered = render(scene, &VslSet::from_frame(frame)?, options, watch)?;
        rendered.describe(scene, Some(frame), options);
        Ok(rendered)
    }
}

/// All that the tiles of one picture share.
struct Frame<'a> {
    scene: &'a Scene,
    vsls: &'a VslSet,
    options: &'a RenderOptions,
    instructions: InstructionSet,
    culling: Culling,
    owners: Option<Owners<'a>>,
}

/// The pixels of one tile.
struct TileResult {
    x: u32,
    y: u32,
    width: usize,
    /// One list of pixels per layer asked for.
    layers: Vec<Vec<Vec3>>,
    stats: RenderStats,
    /// Sum of the upper bounds of what was skipped, in W m⁻² sr⁻¹.
    skipped: f64,
    /// Sum of the upper bounds of the variance that lots bring, in (W m⁻² sr⁻¹)².
    variance: f64,
    /// Sum of the indirect radiance, largest channel, in W m⁻² sr⁻¹.
    indirect: f64,
}

impl<'a> Frame<'a> {
    fn new(
        scene: &'a Scene,
        vsls: &'a VslSet,
        options: &'a RenderOptions,
        instructions: InstructionSet,
    ) -> Self {
        let (lo, hi) = scene.bvh.bounds();
        let magnitude = lo.abs().max(hi.abs()).max_element();
        let culling = Culling {
            kernel: options.kernel,
            epsilon: options.epsilon,
            stochastic: options.culling == RangeCulling::Stochastic,
            albedo_max: scene.albedo_max(),
            magnitude: if magnitude.is_finite() { magnitude } else { 0.0 },
        };
        let owners = options.needs(LayerKind::needs_owner).then(|| Owners::new(vsls, scene.objects.len()));
        Self { scene, vsls, options, instructions, culling, owners }
    }

    fn tiles(&self, watch: Watch<'_>) -> Result<Vec<TileResult>, RenderError> {
        let columns = self.options.width.div_ceil(TILE_EDGE);
        let total = columns as usize * self.options.height.div_ceil(TILE_EDGE) as usize;
        let done = AtomicUsize::new(0);
        (0..total)
            .into_par_iter()
            .map_init(
                || (Tile::new(), Selection::default()),
                |(tile, selection), index| {
                    watch.check()?;
                    let (x, y) = (index as u32 % columns * TILE_EDGE, index as u32 / columns * TILE_EDGE);
                    let result = self.tile(x, y, tile, selection);
                    watch.advance(&done, total);
                    Ok(result)
                },
            )
            .collect()
    }

    fn tile(&self, x: u32, y: u32, tile: &mut Tile, selection: &mut Selection) -> TileResult {
        let width = (self.options.width - x).min(TILE_EDGE) as usize;
        let height = (self.options.height - y).min(TILE_EDGE) as usize;
        let count = width * height;
        let layers = vec![vec![Vec3::ZERO; count]; self.options.layers.len()];
        let stats = RenderStats::default();
        let mut result =
            TileResult { x, y, width, layers, stats, skipped: 0.0, variance: 0.0, indirect: 0.0 };
        for sample_index in 0..self.options.samples_per_pixel {
            let pixel_of = |i: usize| (x + (i % width) as u32, y + (i / width) as u32);
            tile.fill(count, |i| self.see(pixel_of(i), sample_index));
            result.stats.camera_rays += count as u64;
            if self.options.needs(LayerKind::needs_indirect) {
                let first_lot = culling::first_lot(self.options.seed, sample_index);
                self.gather(tile, first_lot, selection, &mut result);
            }
            for i in 0..count {
                let (px, py) = pixel_of(i);
                if let Some(surface) = &tile.surfaces[i] {
                    let pixel = py * self.options.width + px;
                    self.shade(surface, tile.irradiance.get(i), pixel, sample_index, i, &mut result);
                } else if self.scene.sky.is_some() {
                    let background = self.scene.background(self.direction((px, py), sample_index));
                    self.add_background(background, i, &mut result);
                }
            }
        }
        if self.options.samples_per_pixel > 1 {
            let share = 1.0 / self.options.samples_per_pixel as f32;
            result.layers.iter_mut().flatten().for_each(|p| *p *= share);
        }
        result
    }

    /// What camera sample `sample_index` of a pixel sees.
    fn see(&self, pixel: (u32, u32), sample_index: u32) -> Option<Surface> {
        let camera = &self.scene.camera;
        let width = camera.pixel_width(self.options.height);
        surface::seen(self.scene, camera.position, self.direction(pixel, sample_index), width)
    }

    /// Where camera sample `sample_index` of a pixel looks.
    fn direction(&self, (px, py): (u32, u32), sample_index: u32) -> Vec3 {
        let options = self.options;
        let [u, v] = if options.samples_per_pixel == 1 {
            [0.5, 0.5]
        } else {
            let stream = py * options.width + px;
            Sequence::new(options.seed, stream).sample(sample_index.into()).next_2d()
        };
        self.scene.camera.direction(px as f32 + u, py as f32 + v, options.width, options.height)
    }

    /// Adds what lies behind all surfaces to the layers that show emitted light.
    fn add_background(&self, background: Vec3, i: usize, result: &mut TileResult) {
        for (layer, kind) in result.layers.iter_mut().zip(&self.options.layers) {
            if kind.needs_direct() {
                layer[i] += background;
            }
        }
    }

    fn gather(&self, tile: &mut Tile, first_lot: u32, selection: &mut Selection, result: &mut TileResult) {
        self.culling.select(self.vsls, tile, first_lot, selection);
        result.skipped += selection.skipped;
        result.variance += selection.variance;
        match self.options.visibility {
            Visibility::None | Visibility::Ao => {
                result.skipped += gather::accumulate(self.instructions, selection, tile);
                result.skipped += patched::accumulate(selection, tile);
            }
            Visibility::Octahedral => {
                result.skipped += mapped::accumulate(self.instructions, self.vsls, selection, tile)
            }
            // What shadow maps stand for.
            Visibility::Rays | Visibility::ShadowMaps => {
                let shadowed = shadowed::accumulate(self.scene, &self.culling, selection, tile);
                result.skipped += shadowed.skipped;
                result.stats.vsl_rays += shadowed.rays;
            }
        }
    }

    /// Adds what one camera sample shows to every layer.
    fn shade(
        &self,
        surface: &Surface,
        irradiance: Vec3,
        pixel: u32,
        sample_index: u32,
        i: usize,
        result: &mut TileResult,
    ) {
        let brdf = surface.albedo * FRAC_1_PI;
        let indirect = brdf * irradiance;
        result.indirect += f64::from(indirect.max_element());
        let mut direct = surface.emitted;
        if self.options.needs(LayerKind::needs_direct) && surface.albedo != Vec3::ZERO {
            let samples = self.options.light_samples;
            let sequence = Sequence::new(self.options.seed ^ LIGHT_SEED, pixel);
            let sample_of =
                |k: u32| sequence.sample(u64::from(sample_index) * u64::from(samples) + u64::from(k));
            let rays = &mut result.stats.light_rays;
            direct += brdf * direct::irradiance_of_all(self.scene, surface, samples, sample_of, rays);
        }
        let owner = self.owners.as_ref().and_then(|o| o.find(surface));
        for (layer, kind) in result.layers.iter_mut().zip(&self.options.layers) {
            layer[i] += match kind {
                LayerKind::Full => direct + indirect,
                LayerKind::Direct => direct,
                LayerKind::Indirect => indirect,
                LayerKind::Albedo => surface.albedo,
                LayerKind::Normal => (surface.normal + Vec3::ONE) * 0.5,
                LayerKind::Vsl => owner.map_or(Vec3::ZERO, owner::colour),
                LayerKind::Flux => owner.map_or(Vec3::ZERO, |o| self.vsls.radiosity(o)),
                LayerKind::Depth => Vec3::splat(surface.distance),
            };
        }
    }
}
