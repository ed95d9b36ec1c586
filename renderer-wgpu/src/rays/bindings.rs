//! Turns what ray shaders read and write into layouts, pipelines, buffers and bind groups.

use crate::{Gpu, shader};
use wgpu::{BufferUsages, TextureFormat};

/// Layouts of the bind groups.
#[derive(Debug)]
pub(super) struct Layouts {
    /// Of passes over lights, and of the sums by rows.
    pub(super) inputs: [wgpu::BindGroupLayout; 2],
    /// What all passes share.
    pub(super) tracing: wgpu::BindGroupLayout,
}

impl Layouts {
    /// With a place for the masks of holes if there are any.
    pub(super) fn new(gpu: &Gpu, with_holes: bool) -> Self {
        use wgpu::{
            BindingType, BufferBindingType, StorageTextureAccess, TextureSampleType, TextureViewDimension,
        };
        let buffer =
            |ty, has_dynamic_offset| BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
        let read = || buffer(BufferBindingType::Storage { read_only: true }, false);
        let write = || buffer(BufferBindingType::Storage { read_only: false }, false);
        let frame = buffer(BufferBindingType::Uniform, false);
        let view_dimension = TextureViewDimension::D2;
        let gbuffer = BindingType::Texture {
            sample_type: TextureSampleType::Uint,
            view_dimension,
            multisampled: false,
        };
        let map = BindingType::Texture {
            sample_type: TextureSampleType::Float { filterable: false },
            view_dimension,
            multisampled: false,
        };
        let (access, format) = (StorageTextureAccess::WriteOnly, TextureFormat::Rgba32Float);
        let output = BindingType::StorageTexture { access, format, view_dimension };
        let layout = |bindings: &[(u32, BindingType)]| {
            let entries: Vec<_> = bindings
                .iter()
                .map(|&(binding, ty)| wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: wgpu::ShaderStages::COMPUTE,
                    ty,
                    count: None,
                })
                .collect();
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some("rays"),
                entries: &entries,
            })
        };
        let dispatch = buffer(BufferBindingType::Uniform, true);
        let tracing =
            [(0, dispatch), (1, read()), (2, read()), (3, write()), (4, write()), (5, write()), (6, read())];
        Self {
            inputs: [
                layout(&[
                    (0, frame),
                    (1, gbuffer),
                    (2, read()),
                    (3, output),
                    (4, read()),
                    (5, frame),
                    (6, map),
                ]),
                layout(&[(0, frame), (4, write())]),
            ],
            tracing: layout(if with_holes { &tracing } else { &tracing[..6] }),
        }
    }
}

pub(super) fn pipeline(
    gpu: &Gpu,
    source: &shader::Source,
    entry: &str,
    groups: [&wgpu::BindGroupLayout; 2],
) -> wgpu::ComputePipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &groups.map(Some),
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module: &source.module(&gpu.device),
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

pub(super) fn bind<'a>(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: impl IntoIterator<Item = (u32, wgpu::BindingResource<'a>)>,
) -> wgpu::BindGroup {
    let entries = resources.into_iter().map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource });
    let entries: Vec<_> = entries.collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("rays"),
        layout,
        entries: &entries,
    })
}

pub(super) fn buffer(gpu: &Gpu, label: &str, size: u64, usage: BufferUsages) -> wgpu::Buffer {
    let label = Some(label);
    gpu.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
}

/// Most bytes of a buffer that shaders read.
pub(super) fn limit(gpu: &Gpu) -> u64 {
    let limits = gpu.device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}

pub(super) fn upload(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    let buffer = buffer(gpu, label, bytes.len() as u64, BufferUsages::STORAGE | BufferUsages::COPY_DST);
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}
