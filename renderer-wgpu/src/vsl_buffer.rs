//! Turns published records into lights on the device: changed chunks are uploaded, then unpacked and checked there.

use crate::{
    Gpu, GpuError,
    geometry::buffer,
    layout::{BATCH_LIGHTS, VslUniform},
    pipelines::{self, groups_of_64, whole},
    readback, shader,
};
use photonstream_protocol::{VslFrame, VslRecord};
use std::ops::Range;
use wgpu::BufferUsages;

/// What [`crate::Renderer::set_frame`] has sent to the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Upload {
    /// Records sent.
    pub records: u64,
    /// Bytes sent.
    pub bytes: u64,
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
    pub(crate) count: u32,
    /// The records as they were uploaded; `None` where they came to the device without this process.
    mirror: Option<Vec<VslRecord>>,
    /// Segment and number of the frame that is uploaded.
    seen: Option<(u64, u64)>,
}

/// Records between two that may have changed apart.
const CHUNK: usize = photonstream_protocol::CHUNK_RECORDS;

impl VslBuffer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        Self {
            unpack: pipelines::computing(gpu, &shader::UNPACK, "unpack"),
            records: buffer(gpu, "records", size_of::<VslRecord>() as u64, RECORDS),
            lights: buffer(gpu, "virtual surface lights", batches_bytes(0), LIGHTS),
            refused: buffer(gpu, "records refused", 4, BufferUsages::STORAGE | BufferUsages::COPY_SRC),
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

    /// Uploads what `frame` changed.
    pub(crate) fn update(&mut self, gpu: &Gpu, frame: &VslFrame) -> Result<Upload, GpuError> {
        let count = frame.vsls.len() as u32;
        self.reserve(gpu, count)?;
        let follows = self.seen.is_some_and(|(epoch, last)| epoch == frame.epoch && last <= frame.frame);
        let complete = !follows || self.count != count;
        self.count = count;
        let since = self.seen.replace((frame.epoch, frame.frame)).map_or(0, |(_, last)| last);
        // After records that this process has not seen, all are sent.
        let complete = complete || self.mirror.is_none();
        let mut upload = Upload { complete, ..Upload::default() };
        let mirror = self.mirror.get_or_insert_default();
        mirror.resize_with(frame.vsls.len(), VslRecord::default);
        let mut send = |range: Range<usize>| {
            let records = &frame.vsls[range.clone()];
            mirror[range.clone()].copy_from_slice(records);
            gpu.queue.write_buffer(
                &self.records,
                (range.start * size_of::<VslRecord>()) as u64,
                bytemuck::cast_slice(records),
            );
            upload.records += records.len() as u64;
            upload.bytes += size_of_val(records) as u64;
        };
        if complete {
            if count > 0 {
                send(0..count as usize);
            }
            return Ok(upload);
        }
        for range in changed_runs(&frame.vsls, since) {
            send(range);
        }
        Ok(upload)
    }

    /// Takes over `count` records that are on the device already.
    #[cfg(all(feature = "import", unix))]
    pub(crate) fn take(&mut self, gpu: &Gpu, records: &wgpu::Buffer, count: u32) -> Result<(), GpuError> {
        self.reserve(gpu, count)?;
        let bytes = u64::from(count) * size_of::<VslRecord>() as u64;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if bytes > 0 {
            encoder.copy_buffer_to_buffer(records, 0, &self.records, 0, bytes);
        }
        gpu.queue.submit([encoder.finish()]);
        (self.count, self.seen, self.mirror) = (count, None, None);
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
    pub(crate) fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::Buffer) {
        encoder.clear_buffer(&self.refused, 0, None);
        let layout = self.unpack.get_bind_group_layout(0);
        let resources = [whole(frame), whole(&self.records), whole(&self.lights), whole(&self.refused)];
        let group = pipelines::bind(gpu, &layout, &resources);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("unpack"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&self.unpack);
        pass.set_bind_group(0, &group, &[]);
        let (x, y) = groups_of_64(self.batches() * BATCH_LIGHTS);
        pass.dispatch_workgroups(x, y, 1);
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
fn changed_runs(records: &[VslRecord], since: u64) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (index, chunk) in records.chunks(CHUNK).enumerate() {
        // All records of a chunk say the same.
        if chunk[0].changed_frame > since {
            let range = index * CHUNK..index * CHUNK + chunk.len();
            match runs.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => runs.push(range),
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_chunks_are_sent_together_and_unchanged_ones_not() {
        let mut records = vec![VslRecord { changed_frame: 3, ..Default::default() }; CHUNK * 5 + 7];
        assert_eq!(changed_runs(&records, 3), []);
        for chunk in [1, 2, 5] {
            records[chunk * CHUNK].changed_frame = 4;
        }
        assert_eq!(changed_runs(&records, 3), [CHUNK..CHUNK * 3, CHUNK * 5..CHUNK * 5 + 7]);
        assert_eq!(changed_runs(&records, 2), [0..records.len()]);
    }
}
