//! Turns timestamps on the device into a named span of time for each pass.

use crate::{Gpu, GpuError};

/// Time that one pass took: by the device's clock, shadow rays by that of this process, their dispatches' ends included.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// What it did.
    pub name: &'static str,
    /// How long, in ms.
    pub ms: f64,
}

/// Spans of a picture: more are not timed.
const MAX_SPANS: u32 = 24;

/// Collects the spans of one picture.
#[derive(Debug)]
pub(crate) struct Timer {
    queries: Option<Queries>,
    names: Vec<&'static str>,
    /// Whether the span's begin and end have been written.
    written: Vec<[bool; 2]>,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
}

/// A span, by number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span(usize);

impl Timer {
    /// A timer; on devices without timestamps it measures nothing.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let queries = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| {
            let buffer = |label, usage| {
                let size = u64::from(MAX_SPANS) * 16;
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(label),
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            };
            Queries {
                set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("pass times"),
                    ty: wgpu::QueryType::Timestamp,
                    count: MAX_SPANS * 2,
                }),
                resolved: buffer(
                    "timestamps",
                    wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                ),
                readable: buffer(
                    "timestamps, read",
                    wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                ),
            }
        });
        Self { queries, names: Vec::new(), written: Vec::new() }
    }

    /// Forgets the last picture's spans.
    pub(crate) fn restart(&mut self) {
        self.names.clear();
        self.written.clear();
    }

    /// A new span.
    pub(crate) fn span(&mut self, name: &'static str) -> Span {
        self.names.push(name);
        self.written.push([false; 2]);
        Span(self.names.len() - 1)
    }

    /// What a drawing pass writes: the begin of its span if it is the `first` of it, the end if the `last`.
    pub(crate) fn render_writes(
        &mut self,
        span: Span,
        first: bool,
        last: bool,
    ) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let [begin, end] = self.indices(span, first, last)?;
        let queries = self.queries.as_ref()?;
        Some(wgpu::RenderPassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: begin,
            end_of_pass_write_index: end,
        })
    }

    /// The same for a computing pass.
    pub(crate) fn compute_writes(
        &mut self,
        span: Span,
        first: bool,
        last: bool,
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let [begin, end] = self.indices(span, first, last)?;
        let queries = self.queries.as_ref()?;
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: begin,
            end_of_pass_write_index: end,
        })
    }

    fn indices(&mut self, span: Span, first: bool, last: bool) -> Option<[Option<u32>; 2]> {
        if span.0 >= MAX_SPANS as usize || self.queries.is_none() || !(first || last) {
            return None;
        }
        self.written[span.0][0] |= first;
        self.written[span.0][1] |= last;
        let at = span.0 as u32 * 2;
        Some([first.then_some(at), last.then_some(at + 1)])
    }

    /// To be called after the last pass.
    pub(crate) fn encode(&self, encoder: &mut wgpu::CommandEncoder) {
        let Some(queries) = &self.queries else { return };
        let count = self.names.len().min(MAX_SPANS as usize) as u32 * 2;
        if count > 0 {
            encoder.resolve_query_set(&queries.set, 0..count, &queries.resolved, 0);
            encoder.copy_buffer_to_buffer(&queries.resolved, 0, &queries.readable, 0, u64::from(count) * 8);
        }
    }

    /// The times, once the device has finished; waits for it.
    pub(crate) fn read(&self, gpu: &Gpu) -> Result<Vec<PassTime>, GpuError> {
        let Some(queries) = &self.queries else { return Ok(Vec::new()) };
        let count = self.names.len().min(MAX_SPANS as usize);
        if count == 0 {
            return Ok(Vec::new());
        }
        let slice = queries.readable.slice(..count as u64 * 16);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait()?;
        let stamps: Vec<u64> = match slice.get_mapped_range() {
            Ok(bytes) => bytemuck::pod_collect_to_vec(&bytes),
            Err(error) => return Err(GpuError::Device { reason: error.to_string() }),
        };
        queries.readable.unmap();
        let ns = f64::from(gpu.queue.get_timestamp_period());
        let spans = self.names.iter().zip(&self.written).zip(stamps.chunks_exact(2));
        let times = spans.filter(|((_, written), _)| **written == [true; 2]).map(|((&name, _), stamps)| {
            PassTime { name, ms: stamps[1].saturating_sub(stamps[0]) as f64 * ns * 1e-6 }
        });
        Ok(times.collect())
    }
}
