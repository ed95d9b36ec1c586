//! Turns published distance maps into texels on the device: changed chunks are uploaded, and nothing else.

use crate::{Gpu, GpuError, geometry::buffer};
use photonstream_protocol::{CHUNK_RECORDS, DistanceRecord, VslFrame};
use photonstream_renderer::distance_map_edge;
use std::ops::Range;
use wgpu::BufferUsages;

/// Bytes of a record.
const BYTES: u64 = size_of::<DistanceRecord>() as u64;

/// The distance maps of the virtual surface lights on the device.
#[derive(Debug)]
pub(crate) struct MapBuffer {
    /// The records as they were published; one where there are none.
    pub(crate) texels: wgpu::Buffer,
    /// Edge of each map in texels; 0 where there are none.
    pub(crate) edge: u32,
    records: usize,
    /// Segment and number of the frame that is uploaded.
    seen: Option<(u64, u64)>,
}

impl MapBuffer {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let texels = buffer(gpu, "distance maps", BYTES, BufferUsages::STORAGE);
        Self { texels, edge: 0, records: 0, seen: None }
    }

    /// Uploads what `frame` changed; how many records that were.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub(crate) fn update(&mut self, gpu: &Gpu, frame: &VslFrame) -> Result<u64, GpuError> {
        let edge = distance_map_edge(frame.distances.len(), frame.vsls.len()).unwrap_or(0);
        let records = if edge > 0 { frame.distances.as_slice() } else { &[] };
        let seen = self.seen.replace((frame.epoch, frame.frame));
        let follows = seen.is_some_and(|(epoch, last)| epoch == frame.epoch && last <= frame.frame);
        let had = std::mem::replace(&mut self.edge, edge);
        if records.is_empty() {
            self.records = 0;
            return Ok(u64::from(had != edge));
        }
        let bytes = records.len() as u64 * BYTES;
        let limits = gpu.device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if bytes > limit {
            self.seen = None;
            let remedy = "publish smaller maps (streaming.distance_map_px) or fewer virtual surface lights";
            let what = "distance maps of virtual surface lights in bytes";
            return Err(GpuError::TooLarge { what, found: bytes, limit, adapter: gpu.name(), remedy });
        }
        let known = self.records == records.len() && follows && had == edge;
        if self.texels.size() < bytes {
            self.texels = buffer(gpu, "distance maps", bytes, BufferUsages::STORAGE);
        }
        self.records = records.len();
        let since = seen.filter(|_| known).map(|(_, last)| last);
        let mut sent = 0;
        for run in changed_runs(frame, since) {
            sent += run.len() as u64;
            let at = run.start as u64 * BYTES;
            gpu.queue.write_buffer(&self.texels, at, bytemuck::cast_slice(&records[run]));
        }
        Ok(sent)
    }
}

/// Runs of records whose chunks changed after frame `since`; all of them where nothing is known of that.
fn changed_runs(frame: &VslFrame, since: Option<u64>) -> Vec<Range<usize>> {
    let count = frame.distances.len();
    let chunks = count.div_ceil(CHUNK_RECORDS);
    let since = since.filter(|_| frame.distance_chunk_frames.len() == chunks);
    let Some(since) = since else { return std::iter::once(0..count).collect() };
    let mut runs: Vec<Range<usize>> = Vec::new();
    for (chunk, _) in frame.distance_chunk_frames.iter().enumerate().filter(|(_, version)| **version > since)
    {
        let range = chunk * CHUNK_RECORDS..((chunk + 1) * CHUNK_RECORDS).min(count);
        match runs.last_mut() {
            Some(last) if last.end == range.start => last.end = range.end,
            _ => runs.push(range),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_chunks_are_sent_and_all_where_nothing_is_known() {
        let distances = vec![DistanceRecord::default(); CHUNK_RECORDS * 4 + 3];
        let mut frame = VslFrame { distances, ..VslFrame::default() };
        let whole = 0..CHUNK_RECORDS * 4 + 3;
        assert_eq!(changed_runs(&frame, Some(3)), std::slice::from_ref(&whole));
        frame.distance_chunk_frames = vec![3, 5, 4, 3, 4];
        let runs = [CHUNK_RECORDS..CHUNK_RECORDS * 3, CHUNK_RECORDS * 4..CHUNK_RECORDS * 4 + 3];
        assert_eq!(changed_runs(&frame, Some(3)), runs);
        assert_eq!(changed_runs(&frame, Some(5)), [] as [Range<usize>; 0]);
        assert_eq!(changed_runs(&frame, None), std::slice::from_ref(&whole));
    }
}
