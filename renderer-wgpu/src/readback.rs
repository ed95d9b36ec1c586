//! Turns textures and buffers of the device into numbers of this process.

use crate::{Gpu, GpuError};
use glam::Vec3;

/// The colours of an `Rgba32Float` texture, row by row from the top.
pub(crate) fn colours(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<Vec3>, GpuError> {
    let (width, height) = (texture.width(), texture.height());
    let row_bytes = (width * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let size = u64::from(row_bytes) * u64::from(height);
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture, read"),
        size,
        usage,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row_bytes),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue.submit([encoder.finish()]);
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    mapped(gpu, &buffer, |bytes| {
        for row in bytes.chunks_exact(row_bytes as usize) {
            let texels = row[..width as usize * 16].chunks_exact(16);
            pixels.extend(texels.map(|texel| {
                let [r, g, b, _]: [f32; 4] = bytemuck::pod_read_unaligned(texel);
                Vec3::new(r, g, b)
            }));
        }
    })?;
    Ok(pixels)
}

/// The content of a buffer that can be copied from.
pub(crate) fn buffer<T: bytemuck::Pod>(gpu: &Gpu, source: &wgpu::Buffer) -> Result<Vec<T>, GpuError> {
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let target = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("buffer, read"),
        size: source.size(),
        usage,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(source, 0, &target, 0, source.size());
    gpu.queue.submit([encoder.finish()]);
    let mut values = Vec::new();
    mapped(gpu, &target, |bytes| values = bytemuck::pod_collect_to_vec(bytes))?;
    Ok(values)
}

/// The depths of a layer of a depth texture, row by row from the top.
#[cfg(test)]
pub(crate) fn depths(gpu: &Gpu, texture: &wgpu::Texture, layer: u32) -> Result<Vec<f32>, GpuError> {
    let (width, height) = (texture.width(), texture.height());
    let row_bytes = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("depths, read"),
        size: u64::from(row_bytes) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let origin = wgpu::Origin3d { z: layer, ..wgpu::Origin3d::ZERO };
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo { origin, ..texture.as_image_copy() },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row_bytes),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
    gpu.queue.submit([encoder.finish()]);
    let mut depths = Vec::new();
    mapped(gpu, &buffer, |bytes| {
        for row in bytes.chunks_exact(row_bytes as usize) {
            depths.extend(bytemuck::pod_collect_to_vec::<u8, f32>(&row[..width as usize * 4]));
        }
    })?;
    Ok(depths)
}

fn mapped(gpu: &Gpu, buffer: &wgpu::Buffer, read: impl FnOnce(&[u8])) -> Result<(), GpuError> {
    buffer.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait()?;
    let bytes =
        buffer.get_mapped_range(..).map_err(|error| GpuError::Device { reason: error.to_string() })?;
    read(&bytes);
    Ok(())
}
