//! Turns shader modules into pipelines of the two kinds that passes here are made of, and buffers into bind groups.

use crate::{Gpu, shader::Source};

/// How a drawing pass is set up beyond its shader.
#[derive(Default)]
pub(crate) struct Drawing<'a> {
    pub(crate) vertex: &'a str,
    pub(crate) fragment: Option<&'a str>,
    pub(crate) format: Option<wgpu::TextureFormat>,
    pub(crate) constants: &'a [(&'a str, f64)],
    /// A second target of the same format.
    pub(crate) second: bool,
    /// Adds to the target instead of replacing it.
    pub(crate) additive: bool,
    pub(crate) depth: Option<wgpu::DepthStencilState>,
    pub(crate) corners: Option<wgpu::VertexBufferLayout<'a>>,
    /// Texture coordinates of the corners.
    pub(crate) texture_corners: Option<wgpu::VertexBufferLayout<'a>>,
    pub(crate) cull: Option<wgpu::Face>,
    pub(crate) strip: bool,
}

/// A pipeline that draws; its bind group layouts are those that the shader uses.
pub(crate) fn drawing(gpu: &Gpu, source: &Source, drawing: &Drawing<'_>) -> wgpu::RenderPipeline {
    let module = source.module(&gpu.device);
    let options = || wgpu::PipelineCompilationOptions { constants: drawing.constants, ..Default::default() };
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let target = drawing.format.map(|format| wgpu::ColorTargetState {
        format,
        blend: drawing.additive.then_some(wgpu::BlendState { color: add, alpha: add }),
        write_mask: wgpu::ColorWrites::ALL,
    });
    let targets = match (drawing.format, drawing.second) {
        (None, _) => Vec::new(),
        (_, second) => vec![target; if second { 2 } else { 1 }],
    };
    let corners: Vec<_> = drawing.corners.iter().chain(&drawing.texture_corners).cloned().map(Some).collect();
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(source.name),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(drawing.vertex),
            compilation_options: options(),
            buffers: &corners,
        },
        primitive: wgpu::PrimitiveState {
            topology: if drawing.strip {
                wgpu::PrimitiveTopology::TriangleStrip
            } else {
                wgpu::PrimitiveTopology::TriangleList
            },
            cull_mode: drawing.cull,
            ..Default::default()
        },
        depth_stencil: drawing.depth.clone(),
        multisample: wgpu::MultisampleState::default(),
        fragment: drawing.fragment.map(|entry| wgpu::FragmentState {
            module: &module,
            entry_point: Some(entry),
            compilation_options: options(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A pipeline that covers the picture with one fragment for each pixel; vertex stage `cover`.
pub(crate) fn covering(
    gpu: &Gpu,
    source: &Source,
    fragment: &str,
    format: wgpu::TextureFormat,
    constants: &[(&str, f64)],
) -> wgpu::RenderPipeline {
    let set = Drawing {
        vertex: "cover",
        fragment: Some(fragment),
        format: Some(format),
        constants,
        ..Drawing::default()
    };
    drawing(gpu, source, &set)
}

/// A pipeline that computes.
pub(crate) fn computing(gpu: &Gpu, source: &Source, entry: &str) -> wgpu::ComputePipeline {
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: None,
        module: &source.module(&gpu.device),
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// A bind group of `resources` at bindings 0, 1, 2 …, those that are `None` left out: a shader that was specialised
/// does not have them.
pub(crate) fn bind(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    resources: &[Option<wgpu::BindingResource<'_>>],
) -> wgpu::BindGroup {
    let entries: Vec<_> = resources
        .iter()
        .enumerate()
        .filter_map(|(binding, resource)| {
            Some(wgpu::BindGroupEntry { binding: binding as u32, resource: resource.clone()? })
        })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// The whole of a buffer.
pub(crate) fn whole(buffer: &wgpu::Buffer) -> Option<wgpu::BindingResource<'_>> {
    Some(buffer.as_entire_binding())
}

/// A part of a buffer.
pub(crate) fn part(buffer: &wgpu::Buffer, offset: u64, bytes: u64) -> Option<wgpu::BindingResource<'_>> {
    let size = std::num::NonZeroU64::new(bytes);
    Some(wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size }))
}

/// A texture.
pub(crate) fn texture(view: &wgpu::TextureView) -> Option<wgpu::BindingResource<'_>> {
    Some(wgpu::BindingResource::TextureView(view))
}

/// Workgroups of 64 for `count` invocations, in two dimensions: no device has to take more than 65 535 in one.
pub(crate) fn groups_of_64(count: u32) -> (u32, u32) {
    let groups = count.div_ceil(64).max(1);
    let rows = groups.div_ceil(32_768);
    (groups.div_ceil(rows), rows)
}
