//! Turns virtual surface lights into irradiance: forward, splatted or tiled, all to the same picture.

mod variant;

pub(crate) use self::variant::Maps;
use self::variant::{Variant, pipeline};
use crate::{
    Accumulation, Gpu, GpuError,
    geometry::{self, Geometry},
    layout::{BATCH_WORDS, TILE_EDGE, TileBounds},
    pipelines::{self, groups_of_64, part, texture, whole},
    readback,
    scope::{Edge, Scope},
    shader,
    targets::{HDR, Target, Targets},
    vsl_buffer::VslBuffer,
};
use glam::Vec3;
use std::collections::HashMap;
use wgpu::{BufferUsages, LoadOp, TextureUsages};

/// How the lights of a picture are gathered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gathering {
    pub(crate) accumulation: Accumulation,
    /// Whether lights have a range.
    pub(crate) ranged: bool,
    /// Edge of the pattern of interleaved sampling.
    pub(crate) interleave: u32,
    /// Whether lists are made even if they are not needed for the sum.
    pub(crate) listed: bool,
    /// Whether near lights are polygons.
    pub(crate) patches: bool,
    /// What lights are shadowed by.
    pub(crate) maps: Maps,
}

/// The passes that sum virtual surface lights.
#[derive(Debug)]
pub(crate) struct Gather {
    pipelines: HashMap<Variant, wgpu::RenderPipeline>,
    bound: wgpu::ComputePipeline,
    select: wgpu::ComputePipeline,
    join: Option<wgpu::RenderPipeline>,
    bounds: wgpu::Buffer,
    masks: wgpu::Buffer,
    /// What tiles have skipped and kept.
    pub(crate) tallies: wgpu::Buffer,
    black: Target,
}

/// Number of tiles of a picture, in columns and rows.
pub(crate) fn tiles(size: [u32; 2]) -> [u32; 2] {
    size.map(|edge| edge.div_ceil(TILE_EDGE))
}

impl Gather {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            pipelines: HashMap::new(),
            bound: pipelines::computing(gpu, &shader::CULL, "bound"),
            select: pipelines::computing(gpu, &shader::CULL, "select_lights"),
            join: None,
            bounds: geometry::buffer(
                gpu,
                "tile bounds",
                size_of::<TileBounds>() as u64,
                BufferUsages::STORAGE,
            ),
            masks: geometry::buffer(gpu, "tile lists", 8 * u64::from(BATCH_WORDS), BufferUsages::STORAGE),
            tallies: geometry::buffer(gpu, "tile tallies", 8 * u64::from(BATCH_WORDS), TALLIES),
            black: Target::new(gpu, "black", [1, 1], HDR, TextureUsages::TEXTURE_BINDING),
        }
    }

    /// Makes room for the tiles of a picture.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] where the device cannot bind as much.
    pub(crate) fn resize(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<(), GpuError> {
        let [columns, rows] = tiles(size);
        let count = u64::from(columns) * u64::from(rows);
        let words = count * u64::from(BATCH_WORDS);
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        if words * 8 > limit {
            let remedy = "choose a smaller --size";
            let what = "tile lists in bytes";
            return Err(GpuError::TooLarge { what, found: words * 8, limit, adapter: gpu.name(), remedy });
        }
        let bytes = count * size_of::<TileBounds>() as u64;
        if self.bounds.size() != bytes {
            self.bounds = geometry::buffer(gpu, "tile bounds", bytes, BufferUsages::STORAGE);
            // Of near lights, too, for interleaved sampling.
            self.masks = geometry::buffer(gpu, "tile lists", words * 8, BufferUsages::STORAGE);
            self.tallies = geometry::buffer(gpu, "tile tallies", words * 8, TALLIES);
        }
        Ok(())
    }

    /// Sums all lights into `targets.indirect`.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] where the device cannot add to f32 targets and the accumulation needs it.
    pub(crate) fn encode(
        &mut self,
        scope: &mut Scope<'_>,
        targets: &mut Targets,
        geometry: &Geometry,
        lights: &VslBuffer,
        gathering: Gathering,
        sees: impl Fn(Vec3, f32) -> bool,
    ) -> Result<(), GpuError> {
        self.prepare(scope.gpu, gathering)?;
        self.encode_bounds(scope, targets, geometry);
        match gathering.accumulation {
            Accumulation::Tiled => self.encode_tiled(scope, targets, lights, gathering),
            Accumulation::Splat | Accumulation::Forward => {
                // The lists are not used for the picture, but say what the range loses.
                if gathering.listed {
                    self.encode_selections(scope, targets, lights);
                }
                self.encode_additive(scope, targets, geometry, lights, gathering, sees);
            }
        }
        Ok(())
    }

    /// Upper bound of the radiance (W m⁻² sr⁻¹, summed over pixels) that skipped lights would have added, or with stochastic
    /// culling of the variance of the radiance in units of ε²; waits for the device.
    pub(crate) fn skipped(&self, gpu: &Gpu) -> Result<f64, GpuError> {
        let tallies: Vec<[f32; 2]> = readback::buffer(gpu, &self.tallies)?;
        Ok(tallies.iter().map(|t| f64::from(t[0])).sum())
    }

    /// Finds what the range of the lights loses, for a picture whose light is summed elsewhere.
    pub(crate) fn encode_loss(
        &self,
        scope: &mut Scope<'_>,
        targets: &Targets,
        geometry: &Geometry,
        lights: &VslBuffer,
    ) {
        self.encode_bounds(scope, targets, geometry);
        self.encode_selections(scope, targets, lights);
    }

    fn encode_selections(&self, scope: &mut Scope<'_>, targets: &Targets, lights: &VslBuffer) {
        let span = scope.timer.span("light lists");
        let batches = lights.batches();
        for batch in 0..batches {
            let edge = Edge { span, first: batch == 0, last: batch + 1 == batches };
            self.encode_selection(scope, targets, lights, batch, edge);
        }
    }

    fn prepare(&mut self, gpu: &Gpu, gathering: Gathering) -> Result<(), GpuError> {
        let Gathering { accumulation, ranged, interleave, patches, maps, .. } = gathering;
        if accumulation != Accumulation::Tiled
            && !gpu.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE)
        {
            return Err(GpuError::Unsupported {
                option: format!("accumulation {accumulation}"),
                adapter: gpu.name(),
                lacks: "blending of f32 targets".into(),
                remedy: "choose --accumulation tiled",
            });
        }
        for continues in [false, true] {
            let variant =
                Variant { accumulation, ranged, continues, interleaved: interleave > 1, patches, maps };
            self.pipelines.entry(variant).or_insert_with(|| pipeline(gpu, variant));
        }
        if interleave > 1 && self.join.is_none() {
            self.join = Some(pipelines::covering(gpu, &shader::INTERLEAVE, "join", HDR, &[]));
        }
        Ok(())
    }

    fn encode_bounds(&self, scope: &mut Scope<'_>, targets: &Targets, geometry: &Geometry) {
        scope.encoder.clear_buffer(&self.tallies, 0, None);
        let resources = [
            whole(scope.frame),
            texture(&targets.gbuffer.view),
            whole(&geometry.objects),
            whole(&self.bounds),
        ];
        let group = pipelines::bind(scope.gpu, &self.bound.get_bind_group_layout(0), &resources);
        let [columns, rows] = tiles(targets.size);
        let edge = scope.alone("tile bounds");
        scope.compute(edge, &self.bound, &[&group], groups_of_64(columns * rows));
    }

    fn encode_selection(
        &self,
        scope: &mut Scope<'_>,
        targets: &Targets,
        lights: &VslBuffer,
        batch: u32,
        edge: Edge,
    ) {
        let (offset, bytes) = lights.batch(batch);
        let frame = pipelines::bind(scope.gpu, &self.select.get_bind_group_layout(0), &[whole(scope.frame)]);
        let resources = [
            whole(&self.bounds),
            part(&lights.lights, offset, bytes),
            whole(&self.masks),
            whole(&self.tallies),
            lights.numbers(batch),
        ];
        let lists = pipelines::bind(scope.gpu, &self.select.get_bind_group_layout(1), &resources);
        let [columns, rows] = tiles(targets.size);
        scope.compute(
            edge,
            &self.select,
            &[&frame, &lists],
            groups_of_64(columns * rows * lights.batch_numbers(batch).words),
        );
    }

    fn encode_tiled(
        &self,
        scope: &mut Scope<'_>,
        targets: &mut Targets,
        lights: &VslBuffer,
        gathering: Gathering,
    ) {
        let batches = lights.batches();
        let interleaved = gathering.interleave > 1;
        // Two textures are read and written in turn; the last write, after any joining, is that to `indirect`.
        let writes = batches + u32::from(interleaved);
        if writes > 1 {
            targets.spare(scope.gpu);
        }
        if interleaved {
            targets.near(scope.gpu);
        }
        let lists = scope.timer.span("light lists");
        let shading = scope.timer.span("indirect light");
        for batch in 0..batches {
            let (first, last) = (batch == 0, batch + 1 == batches);
            self.encode_selection(scope, targets, lights, batch, Edge { span: lists, first, last });
            let variant = Variant {
                accumulation: Accumulation::Tiled,
                ranged: gathering.ranged,
                continues: !first,
                interleaved,
                patches: gathering.patches,
                maps: gathering.maps,
            };
            let pipeline = &self.pipelines[&variant];
            let (to, from) = turn(targets, writes - 1 - batch);
            let (offset, bytes) = lights.batch(batch);
            let near = targets.near.as_ref().map(|near| {
                let at = ((batches - 1 - batch) % 2) as usize;
                [&near[at].view, &near[1 - at].view]
            });
            let black = &self.black.view;
            let mut resources = vec![
                whole(scope.frame),
                texture(&targets.gbuffer.view),
                part(&lights.lights, offset, bytes),
                whole(&self.masks),
                texture(if first { black } else { from }),
                // Of the near lights; there is none without interleaving.
                None,
                lights.numbers(batch),
                whole(&lights.patches),
            ];
            resources.extend(map_resources(lights, gathering.maps, resources.len()));
            let edge = Edge { span: shading, first, last };
            match near.filter(|_| interleaved) {
                Some([near_to, near_from]) => {
                    resources[5] = texture(if first { black } else { near_from });
                    let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
                    scope.cover_both(edge, pipeline, &group, [to, near_to]);
                }
                None => {
                    let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
                    scope.cover(edge, pipeline, &group, to);
                }
            }
        }
        if let (true, Some(pipeline), Some(near)) = (interleaved, &self.join, &targets.near) {
            let (to, from) = turn(targets, 0);
            let near = texture(&near[0].view);
            let resources = [whole(scope.frame), texture(&targets.gbuffer.view), texture(from), near];
            let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
            let edge = scope.alone("interleaving");
            scope.cover(edge, pipeline, &group, to);
        }
    }

    fn encode_additive(
        &self,
        scope: &mut Scope<'_>,
        targets: &Targets,
        geometry: &Geometry,
        lights: &VslBuffer,
        gathering: Gathering,
        sees: impl Fn(Vec3, f32) -> bool,
    ) {
        let Gathering { accumulation, ranged, patches, maps, .. } = gathering;
        let pipeline = &self.pipelines
            [&Variant { accumulation, ranged, continues: false, interleaved: false, patches, maps }];
        let forward = accumulation == Accumulation::Forward;
        let batches = lights.batches();
        let span = scope.timer.span("indirect light");
        for batch in 0..batches {
            let (offset, bytes) = lights.batch(batch);
            let block = part(&lights.lights, offset, bytes);
            let mut resources = vec![whole(scope.frame)];
            if !forward {
                resources.push(texture(&targets.gbuffer.view));
            }
            resources.extend([block, lights.numbers(batch), whole(&lights.patches)]);
            resources.extend(map_resources(lights, maps, resources.len()));
            let group = pipelines::bind(scope.gpu, &pipeline.get_bind_group_layout(0), &resources);
            let load = if batch == 0 { LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { LoadOp::Load };
            let depth = forward.then_some((&targets.depth.view, LoadOp::Load));
            let edge = Edge { span, first: batch == 0, last: batch + 1 == batches };
            let mut pass = scope.render_pass(edge, Some((&targets.indirect.view, load)), depth);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            let instances = 0..lights.batch_numbers(batch).lights;
            if forward {
                geometry.draw(&mut pass, instances, &sees);
            } else {
                // The 8 faces of an octahedron.
                pass.draw(0..24, instances);
            }
        }
    }
}

/// What a pipeline looks lights' shadows up in, from binding `next` on: published distance maps, or, at bindings of their own
/// in every module, the maps that are drawn.
fn map_resources(lights: &VslBuffer, maps: Maps, next: usize) -> Vec<Option<wgpu::BindingResource<'_>>> {
    if maps != Maps::Drawn {
        return vec![whole(&lights.maps.texels)];
    }
    let mut resources = vec![None; DRAWN_MAPS_BINDING - next];
    let drawn = &lights.shadow_maps;
    let sampler = Some(wgpu::BindingResource::Sampler(&drawn.nearest));
    resources.extend([texture(&drawn.maps), whole(&drawn.layers), sampler]);
    resources
}

/// The first binding of vsl_map_drawn.wgsl.
const DRAWN_MAPS_BINDING: usize = 9;

const TALLIES: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC);

/// Target and source of a write after which `more` follow: the last is to `indirect`.
fn turn(targets: &Targets, more: u32) -> (&wgpu::TextureView, &wgpu::TextureView) {
    let indirect = &targets.indirect.view;
    let spare = targets.spare.as_ref().map_or(indirect, |s| &s.view);
    if more.is_multiple_of(2) { (indirect, spare) } else { (spare, indirect) }
}
