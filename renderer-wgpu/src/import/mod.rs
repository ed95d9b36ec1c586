//! Turns the mapped segment of a simulator into records on the device, without a copy by the CPU.
//!
//! The map's pages become a buffer of the device (`VK_EXT_external_memory_host`), and each new frame's records are
//! copied by the device into a buffer of its own. The publisher may overwrite a slot meanwhile, so the device does what
//! every reader does: after the copy has ended the slot's sequence is looked at again, and where it has moved the copy is
//! dropped and repeated. What was copied before stays usable until then. Values are not looked at: the pass that unpacks
//! records leaves out those that no picture may show.
//!
//! On a discrete device the copy reads the pages over its bus, once a frame.
//!
//! # Measured
//! All records changed, until the device is done; llvmpipe of Mesa 22.3.6, two cores shared with other work, best of 40
//! (`cargo test -p photonstream-renderer-wgpu --features import --lib -- --ignored --nocapture import_against_upload`):
//!
//! | records | import, once | `copy_newest` | read by the CPU + `write_buffer` |
//! |---|---|---|---|
//! | 1 000 | 0.05 ms | 0.04 ms | 0.003 + 0.03 ms |
//! | 10 000 | 0.04 ms | 0.23 ms | 0.06 + 0.26 ms |
//! | 100 000 | 0.06 ms | 1.0 ms | 1.1 + 1.4 ms |

#[cfg(test)]
mod picture_tests;
#[cfg(test)]
mod tests;
mod vulkan;

use crate::{AdapterChoice, Gpu, GpuError};
use photonstream_protocol::{MappedSegment, ProtocolError, Subscriber, VslRecord};
use wgpu::BufferUsages;

/// Frames that one call tries before it leaves the last one in place.
const ATTEMPTS: u32 = 8;
const RECORD_BYTES: u64 = size_of::<VslRecord>() as u64;

/// Why records could not be imported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The device cannot.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The segment is not sound.
    #[error(transparent)]
    Protocol(#[from] ProtocolError),
}

impl Gpu {
    /// A device without a window that can import segments.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] with what was found and why it does not do; Vulkan adapters alone can.
    pub fn headless_importing(choice: &AdapterChoice) -> Result<Self, GpuError> {
        Self::headless_by(choice, vulkan::request)
    }
}

/// A segment as a buffer of the device, and the records of the newest frame that was copied from it.
#[derive(Debug)]
pub struct ImportedSegment {
    segment: MappedSegment,
    source: wgpu::Buffer,
    /// The records of the last whole frame, and the buffer that the next one is copied into.
    records: [wgpu::Buffer; 2],
    count: u32,
    seen: u64,
    dropped: u64,
}

impl ImportedSegment {
    /// Imports the segment that `subscriber` is attached to. When it follows another one, the epochs differ: import again.
    ///
    /// # Errors
    /// [`GpuError::Unsupported`] for a device without the extension ([`Gpu::headless_importing`] opens one with it) and
    /// for a subscriber without a map, [`GpuError::TooLarge`], and what the driver reports.
    pub fn new(gpu: &Gpu, subscriber: &Subscriber) -> Result<Self, ImportError> {
        let segment = subscriber.mapped().ok_or_else(|| GpuError::Unsupported {
            option: "import".into(),
            adapter: gpu.name(),
            lacks: "a mapped segment".into(),
            remedy: "attach with AccessMode::Mapped, or upload the records",
        })?;
        let limits = gpu.device.limits();
        let check = |what, found, limit| {
            if found <= limit {
                return Ok(());
            }
            let remedy = "publish fewer virtual surface lights (streaming.vsls), or upload the records";
            Err(GpuError::TooLarge { what, found, limit, adapter: gpu.name(), remedy })
        };
        check("imported segment in bytes", segment.bytes(), limits.max_buffer_size)?;
        let bytes = u64::from(segment.vsl_capacity().max(1)) * RECORD_BYTES;
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        check("virtual surface lights in bytes", bytes, limit)?;
        let source = vulkan::import(gpu, &segment)?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST | BufferUsages::COPY_SRC;
        let records = ["imported records", "imported records, spare"].map(|label| {
            let label = Some(label);
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label,
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        });
        gpu.check()?;
        Ok(Self { segment, source, records, count: 0, seen: 0, dropped: 0 })
    }

    /// Copies the records of the newest frame on the device and waits for it; the frame's number, or `None` where there is
    /// no newer one, or where the publisher overwrote each of several frames before its copy had ended.
    ///
    /// # Errors
    /// A corrupt segment, a failed device; the records of the last frame stay.
    pub fn copy_newest(&mut self, gpu: &Gpu) -> Result<Option<u64>, ImportError> {
        for _ in 0..ATTEMPTS {
            let Some(frame) = self.segment.newest()? else { continue };
            if frame.frame == self.seen {
                return Ok(None);
            }
            if frame.frame < self.seen {
                let reason = format!("published frame {} after frame {}", frame.frame, self.seen);
                return Err(GpuError::Device { reason }.into());
            }
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let bytes = u64::from(frame.vsl_count) * RECORD_BYTES;
            if bytes > 0 {
                encoder.copy_buffer_to_buffer(&self.source, frame.vsl_offset, &self.records[1], 0, bytes);
            }
            gpu.queue.submit([encoder.finish()]);
            // The device has told the CPU that it is done: what `holds` reads next happens after every read of the copy.
            gpu.wait()?;
            if self.segment.holds(&frame)? {
                self.records.swap(0, 1);
                (self.count, self.seen) = (frame.vsl_count, frame.frame);
                return Ok(Some(frame.frame));
            }
            self.dropped += 1;
        }
        Ok(None)
    }

    /// The records of the last frame that was copied, [`VslRecord`]s as published, not checked; there is room for as many
    /// as the segment holds.
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records[0]
    }

    /// Number of records of that frame.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Number of the segment.
    pub fn epoch(&self) -> u64 {
        self.segment.epoch()
    }

    /// Number of copies that were dropped because the publisher was faster.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}
