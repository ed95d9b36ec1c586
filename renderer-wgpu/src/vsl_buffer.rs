//! Turns published records into lights on the device: changed chunks are uploaded, then unpacked and checked there.

use crate::{
    Gpu, GpuError,
    geometry::{Geometry, buffer},
    layout::{BATCH_LIGHTS, BatchNumbers, VslUniform},
    map_buffer::MapBuffer,
    pipelines::{self, groups_of_64, whole},
    readback,
    scope::Scope,
    shader,
    textures::Textures,
    vsl_shadow_maps::{Surroundings, VslShadowMaps},
};
use photonstream_protocol::{DistanceRecord, PatchRecord, VslFrame, VslRecord};
use std::ops::Range;
use wgpu::BufferUsages;

/// What [`crate::Renderer::set_frame`] has sent to the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Upload {
    /// Records sent.
    pub records: u64,
    /// Bytes sent.
    pub bytes: u64,
    /// Polygons sent.
    pub patches: u64,
    /// Pieces of distance maps sent.
    pub distances: u64,
    /// Whether all records were sent, because their number or the segment changed.
    pub complete: bool,
}

/// The virtual surface lights on the device.
#[derive(Debug)]
pub(crate) struct VslBuffer {
    unpack: wgpu::ComputePipeline,
    records: wgpu::Buffer,
    /// Lights as shaders read them, in whole batches; those beyond the last are dark.
    pub(crate) lights: wgpu::Buffer,
    refused: wgpu::Buffer,
    /// The polygons as they were published; one without corners where there are none.
    pub(crate) patches: wgpu::Buffer,
    /// What it holds.
    patch_records: Vec<PatchRecord>,
    /// Whether the records came to the device without their polygons.
    pub(crate) lacks_patches: bool,
    /// What the lights see around themselves.
    pub(crate) maps: MapBuffer,
    /// The same, as it is drawn here.
    pub(crate) shadow_maps: VslShadowMaps,
    /// [`BatchNumbers`] of each batch, [`NUMBERS_STRIDE`] apart.
    numbers: wgpu::Buffer,
    /// Where changed records lie before the device puts each in its place.
    staging: Option<wgpu::Buffer>,
    /// The places of the records in `staging`, one after the other, until [`VslBuffer::flush`].
    pending: Vec<Range<usize>>,
    pub(crate) count: u32,
    /// The records as they were uploaded; `None` where they came to the device without this process.
    mirror: Option<Vec<VslRecord>>,
    /// Segment and number of the frame that is uploaded.
    seen: Option<(u64, u64)>,
}

/// Distance between two in a buffer of uniforms: what every device takes as an offset.
const NUMBERS_STRIDE: u64 = 256;
/// Bytes of a polygon's record.
const PATCH_BYTES: u64 = size_of::<PatchRecord>() as u64;
/// Bytes of a piece of a distance map.
const DISTANCE_BYTES: u64 = size_of::<DistanceRecord>() as u64;
/// Bytes of a record.
const RECORD_BYTES: u64 = size_of::<VslRecord>() as u64;
/// Records between two that may have changed apart.
const CHUNK: usize = photonstream_protocol::CHUNK_RECORDS;

impl VslBuffer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            unpack: pipelines::computing(gpu, &shader::UNPACK, "unpack"),
            records: buffer(gpu, "records", size_of::<VslRecord>() as u64, RECORDS),
            lights: buffer(gpu, "virtual surface lights", batches_bytes(0), LIGHTS),
            refused: buffer(gpu, "records refused", 4, BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            patches: buffer(gpu, "patches", PATCH_BYTES, BufferUsages::STORAGE),
            patch_records: Vec::new(),
            lacks_patches: false,
            maps: MapBuffer::new(gpu),
            shadow_maps: VslShadowMaps::new(gpu),
            numbers: buffer(gpu, "batches", NUMBERS_STRIDE, BufferUsages::UNIFORM),
            staging: None,
            pending: Vec::new(),
            count: 0,
            mirror: None,
            seen: None,
        }
    }

    /// Number of batches.
    pub(crate) fn batches(&self) -> u32 {
        self.count.div_ceil(BATCH_LIGHTS).max(1)
    }

    /// Byte range of a batch in `lights`.
    pub(crate) fn batch(&self, index: u32) -> (u64, u64) {
        let bytes = u64::from(BATCH_LIGHTS) * size_of::<VslUniform>() as u64;
        (u64::from(index) * bytes, bytes)
    }

    /// What is said of a batch.
    pub(crate) fn batch_numbers(&self, index: u32) -> BatchNumbers {
        let first = index * BATCH_LIGHTS;
        let lights = self.count.saturating_sub(first).min(BATCH_LIGHTS);
        BatchNumbers {
            first,
            is_last: u32::from(index + 1 == self.batches()),
            lights,
            words: lights.div_ceil(32),
        }
    }

    /// The same as a uniform.
    pub(crate) fn numbers(&self, index: u32) -> Option<wgpu::BindingResource<'_>> {
        pipelines::part(&self.numbers, u64::from(index) * NUMBERS_STRIDE, size_of::<BatchNumbers>() as u64)
    }

    fn set_count(&mut self, gpu: &Gpu, count: u32) {
        self.count = count;
        let mut blocks = vec![0u8; self.batches() as usize * NUMBERS_STRIDE as usize];
        for (index, block) in (0..).zip(blocks.chunks_exact_mut(NUMBERS_STRIDE as usize)) {
            block[..size_of::<BatchNumbers>()]
                .copy_from_slice(bytemuck::bytes_of(&self.batch_numbers(index)));
        }
        if self.numbers.size() < blocks.len() as u64 {
            self.numbers = buffer(gpu, "batches", blocks.len() as u64, BufferUsages::UNIFORM);
        }
        gpu.queue.write_buffer(&self.numbers, 0, &blocks);
    }

    /// Uploads what `frame` changed.
    pub(crate) fn update(&mut self, gpu: &Gpu, frame: &VslFrame) -> Result<Upload, GpuError> {
        let count = frame.vsls.len() as u32;
        self.reserve(gpu, count)?;
        let newer_patches = self.update_patches(gpu, frame)?;
        let distances = self.maps.update(gpu, frame)?;
        self.lacks_patches = false;
        let follows = self.seen.is_some_and(|(epoch, last)| epoch == frame.epoch && last <= frame.frame);
        let complete = !follows || self.count != count;
        if complete {
            self.set_count(gpu, count);
        }
        let since = self.seen.replace((frame.epoch, frame.frame)).map_or(0, |(_, last)| last);
        // After records that this process has not seen, all are sent.
        let complete = complete || self.mirror.is_none();
        let mut upload = Upload { complete, ..Upload::default() };
        let mirror = self.mirror.get_or_insert_default();
        mirror.resize_with(frame.vsls.len(), VslRecord::default);
        if complete {
            self.pending.clear();
            mirror.copy_from_slice(&frame.vsls);
            gpu.queue.write_buffer(&self.records, 0, bytemuck::cast_slice(&frame.vsls));
            upload.records = frame.vsls.len() as u64;
        } else {
            let runs = changed_runs(frame, since);
            for run in &runs {
                mirror[run.clone()].copy_from_slice(&frame.vsls[run.clone()]);
            }
            upload.records = self.send(gpu, &frame.vsls, &runs);
        }
        upload.bytes =
            upload.records * RECORD_BYTES + newer_patches * PATCH_BYTES + distances * DISTANCE_BYTES;
        (upload.patches, upload.distances) = (newer_patches, distances);
        Ok(upload)
    }

    /// Uploads the polygons of `frame` if any differs; how many were sent.
    fn update_patches(&mut self, gpu: &Gpu, frame: &VslFrame) -> Result<u64, GpuError> {
        let has_patches = frame.patches.len() == frame.vsls.len();
        let records = if has_patches { frame.patches.as_slice() } else { &[] };
        let seen = self.seen.filter(|(epoch, _)| *epoch == frame.epoch).map(|(_, last)| last);
        let versions = &frame.patch_chunk_frames;
        let is_known = self.patch_records.len() == records.len()
            && versions.len() == records.len().div_ceil(CHUNK)
            && seen.is_some_and(|last| versions.iter().all(|&version| version <= last));
        if is_known || self.patch_records == records {
            return Ok(0);
        }
        let bytes = records.len().max(1) as u64 * PATCH_BYTES;
        let limits = gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > limit {
            let remedy = "publish fewer virtual surface lights (streaming.vsls)";
            let what = "patches of virtual surface lights in bytes";
            return Err(GpuError::TooLarge { what, found: bytes, limit, adapter: gpu.name(), remedy });
        }
        // As long as the records say, for shaders take its length for theirs.
        if self.patches.size() != bytes.next_multiple_of(16) {
            self.patches = buffer(gpu, "patches", bytes, BufferUsages::STORAGE);
        }
        let none = [PatchRecord::default()];
        let sent = if records.is_empty() { &none } else { records };
        gpu.queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(sent));
        self.patch_records.clear();
        self.patch_records.extend_from_slice(records);
        Ok(records.len() as u64)
    }

    /// Sends runs of records all at once, to where [`VslBuffer::flush`] takes each from: an upload costs the device's
    /// library far more than a copy.
    fn send(&mut self, gpu: &Gpu, records: &[VslRecord], runs: &[Range<usize>]) -> u64 {
        let packed: Vec<VslRecord> = runs.iter().flat_map(|run| &records[run.clone()]).copied().collect();
        if packed.is_empty() {
            return 0;
        }
        self.flush_now(gpu);
        let bytes = packed.len() as u64 * RECORD_BYTES;
        let staging = match self.staging.take() {
            Some(buffer) if buffer.size() >= bytes => buffer,
            _ => buffer(gpu, "records, changed", bytes, BufferUsages::COPY_SRC),
        };
        gpu.queue.write_buffer(&staging, 0, bytemuck::cast_slice(&packed));
        self.pending.extend_from_slice(runs);
        self.staging = Some(staging);
        packed.len() as u64
    }

    /// Has the device put what was sent in its place.
    pub(crate) fn flush(&self, encoder: &mut wgpu::CommandEncoder) {
        let Some(staging) = &self.staging else { return };
        let mut from = 0;
        for run in &self.pending {
            let bytes = run.len() as u64 * RECORD_BYTES;
            encoder.copy_buffer_to_buffer(
                staging,
                from,
                &self.records,
                run.start as u64 * RECORD_BYTES,
                bytes,
            );
            from += bytes;
        }
    }

    /// To be called once the commands of [`VslBuffer::flush`] are on their way: until then a picture that is given up
    /// loses nothing.
    pub(crate) fn delivered(&mut self) {
        self.pending.clear();
        self.shadow_maps.delivered();
    }

    /// Draws the shadow maps of `edge`² texels that are due; how many.
    ///
    /// # Errors
    /// A failed device.
    pub(crate) fn draw_shadow_maps(
        &mut self,
        scope: &mut Scope<'_>,
        edge: u32,
        surroundings: Surroundings,
        solids: (&Geometry, Option<&Textures>),
    ) -> Result<u32, GpuError> {
        self.mirror(scope.gpu)?;
        let records = self.mirror.as_deref().unwrap_or_default();
        self.shadow_maps.update(scope.gpu, records, edge, surroundings);
        Ok(self.shadow_maps.encode(scope, solids))
    }

    fn flush_now(&mut self, gpu: &Gpu) {
        if !self.pending.is_empty() {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.flush(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
            self.delivered();
        }
    }

    /// Takes over `count` records that are on the device already.
    #[cfg(all(feature = "import", unix))]
    pub(crate) fn take(&mut self, gpu: &Gpu, records: &wgpu::Buffer, count: u32) -> Result<(), GpuError> {
        self.reserve(gpu, count)?;
        self.pending.clear();
        let bytes = u64::from(count) * size_of::<VslRecord>() as u64;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if bytes > 0 {
            encoder.copy_buffer_to_buffer(records, 0, &self.records, 0, bytes);
        }
        gpu.queue.submit([encoder.finish()]);
        self.set_count(gpu, count);
        (self.seen, self.mirror, self.lacks_patches) = (None, None, true);
        self.maps.edge = 0;
        Ok(())
    }

    /// The records in this process; read from the device where they came there without it.
    pub(crate) fn mirror(&mut self, gpu: &Gpu) -> Result<&[VslRecord], GpuError> {
        if self.mirror.is_none() {
            let mut records: Vec<VslRecord> = readback::buffer(gpu, &self.records)?;
            records.truncate(self.count as usize);
            self.mirror = Some(records);
            // The next frame may have other changes than those since this one.
            self.seen = None;
        }
        Ok(self.mirror.as_deref().unwrap_or_default())
    }

    fn reserve(&mut self, gpu: &Gpu, count: u32) -> Result<(), GpuError> {
        let bytes = u64::from(count.max(1)) * size_of::<VslRecord>() as u64;
        let limits = gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes.max(batches_bytes(count)) > limit {
            let remedy = "publish fewer virtual surface lights (streaming.vsls)";
            let what = "virtual surface lights in bytes";
            return Err(GpuError::TooLarge { what, found: bytes, limit, adapter: gpu.name(), remedy });
        }
        if self.records.size() < bytes {
            self.records = buffer(gpu, "records", bytes, RECORDS);
            self.seen = None;
        }
        if self.lights.size() != batches_bytes(count) {
            self.lights = buffer(gpu, "virtual surface lights", batches_bytes(count), LIGHTS);
        }
        Ok(())
    }

    /// Unpacks the records for the kernel and range of the frame uniform.
    pub(crate) fn encode(&self, scope: &mut Scope<'_>) {
        self.flush(&mut scope.encoder);
        scope.encoder.clear_buffer(&self.refused, 0, None);
        let layout = self.unpack.get_bind_group_layout(0);
        let resources = [
            whole(scope.frame),
            whole(&self.records),
            whole(&self.lights),
            whole(&self.refused),
            whole(&self.patches),
        ];
        let group = pipelines::bind(scope.gpu, &layout, &resources);
        let edge = scope.alone("unpacking");
        scope.compute(edge, &self.unpack, &[&group], groups_of_64(self.batches() * BATCH_LIGHTS));
    }

    /// Number of records that were not shown because of values that no picture may show; waits for the device.
    pub(crate) fn refused(&self, gpu: &Gpu) -> Result<u32, GpuError> {
        Ok(readback::buffer::<u32>(gpu, &self.refused)?[0])
    }
}

const RECORDS: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::COPY_SRC);
const LIGHTS: BufferUsages = BufferUsages::STORAGE.union(BufferUsages::UNIFORM).union(BufferUsages::COPY_SRC);

fn batches_bytes(count: u32) -> u64 {
    u64::from(count.div_ceil(BATCH_LIGHTS).max(1)) * u64::from(BATCH_LIGHTS) * size_of::<VslUniform>() as u64
}

/// Runs of records whose chunks changed after frame `since`.
fn changed_runs(frame: &VslFrame, since: u64) -> Vec<Range<usize>> {
    let count = frame.vsls.len();
    let mut runs: Vec<Range<usize>> = Vec::new();
    let mut add = |chunk: usize| {
        let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
        match runs.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => runs.push(range),
        }
    };
    let chunks = 0..count.div_ceil(CHUNK);
    if frame.chunk_frames.len() == chunks.len() {
        chunks.filter(|&chunk| frame.chunk_frames[chunk] > since).for_each(&mut add);
    } else {
        // A frame that was put together by hand: all records of a chunk say the same.
        chunks.filter(|&chunk| frame.vsls[chunk * CHUNK].changed_frame > since).for_each(&mut add);
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_chunks_are_sent_together_and_unchanged_ones_not() {
        let vsls = vec![VslRecord { changed_frame: 3, ..Default::default() }; CHUNK * 5 + 7];
        let mut frame = VslFrame { vsls, ..VslFrame::default() };
        let mut chunk_frames = vec![3; 6];
        assert_eq!(changed_runs(&frame, 3), []);
        for chunk in [1, 2, 5] {
            frame.vsls[chunk * CHUNK].changed_frame = 4;
            chunk_frames[chunk] = 4;
        }
        // The same by the records as by the list of a frame that was read.
        for chunk_frames in [Vec::new(), chunk_frames] {
            frame.chunk_frames = chunk_frames;
            assert_eq!(changed_runs(&frame, 3), [CHUNK..CHUNK * 3, CHUNK * 5..CHUNK * 5 + 7]);
            let whole = 0..frame.vsls.len();
            assert_eq!(changed_runs(&frame, 2), [whole]);
        }
    }
}
