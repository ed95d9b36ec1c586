//! Turns a pass over millions of rays into dispatches, none of which takes many turns of loops in one invocation.

use super::{RAY_STACK, RAY_TURNS, Rays, Traced};
use crate::{
    Gpu, GpuError,
    layout::{PixelRays, RaysDispatch},
};
use photonstream_renderer::Watch;
use std::ops::Range;
use std::time::Instant;

/// Lights, or samples of lights, of one dispatch: neighbouring pixels stay at the same lights.
const ITEMS: u32 = 64;
/// Lights that one dispatch weighs: no rays, so the turns of its loop are known.
const WEIGHED: u32 = 2_048;
/// Most dispatches of one submission.
const DISPATCHES: u64 = 32;
/// Items of all pixels of one submission: what software rasterisers trace in a few seconds at most.
const SUBMITTED: u64 = 8 << 20;
/// Bytes of a dispatch's uniforms from one to the next: the largest alignment that devices ask for.
const STRIDE: u64 = 256;
/// Bytes of the stacks of suspended rays: with more pixels the picture is divided into bands of rows.
const STACK_BYTES: u64 = 64 << 20;
const STACK_OF_PIXEL: u64 = RAY_STACK as u64 * 8;

/// What dispatches of every kind share: where pixels keep their rays, and the uniforms of the dispatches.
#[derive(Debug)]
pub(super) struct Workspace {
    size: [u32; 2],
    band_rows: u32,
    pub(super) pixels: wgpu::Buffer,
    uniforms: wgpu::Buffer,
    pub(super) counts: wgpu::Buffer,
    counts_read: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// What one dispatch does.
pub(super) struct Step<'a> {
    pub(super) pipeline: &'a wgpu::ComputePipeline,
    pub(super) uniform: RaysDispatch,
    pub(super) groups: [u32; 2],
}

/// A pass over the items of all pixels.
pub(super) struct Pass<'a> {
    pub(super) trace: &'a wgpu::ComputePipeline,
    /// Sums the weights of all items first.
    pub(super) weigh: Option<&'a wgpu::ComputePipeline>,
    /// Sums errors by rows afterwards.
    pub(super) sum_rows: Option<(&'a wgpu::ComputePipeline, &'a wgpu::BindGroup)>,
    pub(super) inputs: &'a wgpu::BindGroup,
    pub(super) size: [u32; 2],
    pub(super) items: u32,
    pub(super) sample: u32,
    pub(super) budget: u32,
    pub(super) watch: Watch<'a>,
}

impl Workspace {
    pub(super) fn new(gpu: &Gpu, rays: &Rays, size: [u32; 2], band_bytes: u64) -> Result<Self, GpuError> {
        let limit = super::bindings::limit(gpu);
        let row_bytes = u64::from(size[0]) * STACK_OF_PIXEL;
        if row_bytes > limit {
            let remedy = "choose a smaller --size";
            let what = "rays of one row of pixels in bytes";
            return Err(GpuError::TooLarge { what, found: row_bytes, limit, adapter: gpu.name(), remedy });
        }
        let rows = (band_bytes.min(limit) / row_bytes).max(1).min(u64::from(size[1]));
        // Groups are eight rows high, and a dispatch may have 65 535 of them: more than any texture has rows.
        let band_rows = rows as u32;
        let pixels = u64::from(size[0]) * rows;
        let storage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let buffer = |label, bytes, usage| super::bindings::buffer(gpu, label, bytes, usage);
        let states = buffer("rays of pixels", pixels * size_of::<PixelRays>() as u64, storage);
        let stacks = buffer("stacks of suspended rays", pixels * STACK_OF_PIXEL, storage);
        let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniforms = buffer("dispatches of rays", STRIDE * (DISPATCHES + 2), uniform);
        let counts = buffer("counts of rays", 8, storage | wgpu::BufferUsages::COPY_SRC);
        let read = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let counts_read = buffer("counts of rays, read", 8, read);
        let dispatch = wgpu::BufferBinding {
            buffer: &uniforms,
            offset: 0,
            size: std::num::NonZeroU64::new(size_of::<RaysDispatch>() as u64),
        };
        let resources = [
            wgpu::BindingResource::Buffer(dispatch),
            rays.nodes.as_entire_binding(),
            rays.triangles.as_entire_binding(),
            states.as_entire_binding(),
            stacks.as_entire_binding(),
            counts.as_entire_binding(),
        ];
        let holes = rays.holes.as_ref().map(|holes| holes.words.as_entire_binding());
        let group =
            super::bindings::bind(gpu, &rays.layouts.tracing, (0..).zip(resources.into_iter().chain(holes)));
        Ok(Self { size, band_rows, pixels: states, uniforms, counts, counts_read, group })
    }

    /// Whether it serves pictures of `size`.
    pub(super) fn fits(&self, size: [u32; 2]) -> bool {
        self.size == size
    }
}

impl Rays {
    pub(super) fn band_bytes() -> u64 {
        STACK_BYTES
    }

    /// Submits what `encoder` holds, then traces all rays of a pass; `encoder` is a new one then.
    pub(super) fn run(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        pass: &Pass<'_>,
    ) -> Result<Traced, GpuError> {
        let fresh = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        gpu.queue.submit([std::mem::replace(encoder, fresh).finish()]);
        // What came before has its own times.
        gpu.wait()?;
        let start = Instant::now();
        let mut traced = Traced::default();
        if let Some(workspace) = &self.workspace {
            let rows = workspace.band_rows;
            for first_row in (0..pass.size[1]).step_by(rows as usize) {
                let band = first_row..(first_row + rows).min(pass.size[1]);
                if !traced.stopped {
                    self.run_band(gpu, workspace, pass, band, &mut traced)?;
                }
            }
        }
        traced.ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(traced)
    }

    fn run_band(
        &self,
        gpu: &Gpu,
        workspace: &Workspace,
        pass: &Pass<'_>,
        band: Range<u32>,
        traced: &mut Traced,
    ) -> Result<(), GpuError> {
        let rows = band.end - band.start;
        let groups = [pass.size[0].div_ceil(8), rows.div_ceil(8)];
        let [lo, hi] = self.bounds.map(|corner| corner.to_array());
        let uniform = |end, items| RaysDispatch {
            lo,
            end,
            hi,
            items,
            first_row: band.start,
            rows,
            sample: pass.sample,
            budget: pass.budget,
        };
        let mut clear = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        clear.clear_buffer(&workspace.pixels, 0, None);
        gpu.queue.submit([clear.finish()]);

        let mut steps = Vec::new();
        if let Some(pipeline) = pass.weigh {
            let weighing = (0..pass.items).step_by(WEIGHED as usize).map(|first| Step {
                pipeline,
                uniform: uniform((first + WEIGHED).min(pass.items), first),
                groups,
            });
            steps.extend(weighing);
        }
        let trace = |end| Step { pipeline: pass.trace, uniform: uniform(end, pass.items), groups };
        steps.extend((0..pass.items.div_ceil(ITEMS)).map(|i| trace(((i + 1) * ITEMS).min(pass.items))));
        if pass.items == 0 {
            steps.push(trace(0));
        }
        let pixels = u64::from(pass.size[0]) * u64::from(rows);
        let together = (SUBMITTED / (pixels * u64::from(ITEMS)).max(1)).clamp(1, DISPATCHES) as usize;
        let mut unfinished = 0;
        for (i, steps_now) in steps.chunks(together).enumerate() {
            if pass.watch.check().is_err() {
                traced.stopped = true;
                return Ok(());
            }
            let share = (i * together) as f64 / steps.len() as f64;
            pass.watch.report((f64::from(band.start) + share * f64::from(rows)) / f64::from(pass.size[1]));
            unfinished = self.submit(gpu, workspace, pass.inputs, steps_now, traced)?;
        }
        // Pixels whose rays took long; each dispatch brings each of them forward.
        let (mut more, mut left) = (1, self.most_dispatches(pass.items));
        while unfinished > 0 {
            if left == 0 {
                let reason =
                    format!("the rays of {unfinished} pixels do not end: its driver stops loops early");
                return Err(GpuError::Device { reason });
            }
            if pass.watch.check().is_err() {
                traced.stopped = true;
                return Ok(());
            }
            let steps: Vec<_> = (0..more).map(|_| trace(pass.items)).collect();
            unfinished = self.submit(gpu, workspace, pass.inputs, &steps, traced)?;
            left = left.saturating_sub(more as u64);
            more = (more * 2).min(DISPATCHES as usize);
        }
        if let Some((pipeline, sums)) = pass.sum_rows {
            let step = Step { pipeline, uniform: uniform(0, 0), groups: [rows.div_ceil(64), 1] };
            self.submit(gpu, workspace, sums, &[step], traced)?;
        }
        Ok(())
    }

    /// More dispatches than the rays to `items` can need: a ray takes at most two turns for each node and one for each
    /// triangle, and a dispatch does at least half of its turns or all that is left.
    fn most_dispatches(&self, items: u32) -> u64 {
        let (nodes, triangles) = (self.nodes.size() / 80, self.triangles.size() / 48);
        let turns = u64::from(items).saturating_mul(2 * nodes + triangles + 64);
        turns / u64::from(RAY_TURNS / 2) + u64::from(RAY_STACK)
    }

    /// Runs `steps` and waits; returns the number of pixels that the last one left unfinished.
    fn submit(
        &self,
        gpu: &Gpu,
        workspace: &Workspace,
        inputs: &wgpu::BindGroup,
        steps: &[Step<'_>],
        traced: &mut Traced,
    ) -> Result<u32, GpuError> {
        let mut uniforms = vec![0; steps.len() * STRIDE as usize];
        for (bytes, step) in uniforms.chunks_exact_mut(STRIDE as usize).zip(steps) {
            bytes[..size_of::<RaysDispatch>()].copy_from_slice(bytemuck::bytes_of(&step.uniform));
        }
        gpu.queue.write_buffer(&workspace.uniforms, 0, &uniforms);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&workspace.counts, 0, None);
        for (i, step) in steps.iter().enumerate() {
            if i + 1 == steps.len() {
                encoder.clear_buffer(&workspace.counts, 0, Some(4));
            }
            let label = Some("rays");
            let mut pass =
                encoder.begin_compute_pass(&wgpu::ComputePassDescriptor { label, timestamp_writes: None });
            pass.set_pipeline(step.pipeline);
            pass.set_bind_group(0, inputs, &[]);
            pass.set_bind_group(1, &workspace.group, &[i as u32 * STRIDE as u32]);
            pass.dispatch_workgroups(step.groups[0], step.groups[1], 1);
        }
        encoder.copy_buffer_to_buffer(&workspace.counts, 0, &workspace.counts_read, 0, 8);
        gpu.queue.submit([encoder.finish()]);
        workspace.counts_read.map_async(wgpu::MapMode::Read, .., |_| {});
        gpu.wait()?;
        let counts: [u32; 2] = {
            let bytes = workspace
                .counts_read
                .get_mapped_range(..)
                .map_err(|error| GpuError::Device { reason: error.to_string() })?;
            bytemuck::pod_read_unaligned(&bytes)
        };
        workspace.counts_read.unmap();
        traced.rays += u64::from(counts[1]);
        traced.dispatches += steps.len() as u64;
        Ok(counts[0])
    }
}
