//! Turns the views of lights into depth maps, drawn again only when a light or the geometry has changed.

use crate::{
    Gpu,
    geometry::{self, Geometry},
    layout::{Corner, ShadowView},
    pipelines::{self, Drawing},
    shader,
    shadow_views::LightTable,
    timer::Timer,
};
use wgpu::{BufferUsages, TextureUsages};

/// Distance between two views in a buffer of uniforms: what every device takes as an offset.
const VIEW_STRIDE: u64 = 256;

/// The shadow maps of a scene's lights.
#[derive(Debug)]
pub(crate) struct ShadowMaps {
    pipeline: wgpu::RenderPipeline,
    pub(crate) sampler: wgpu::Sampler,
    /// The lights that shaders read.
    pub(crate) lights: wgpu::Buffer,
    /// The views that shaders read.
    pub(crate) views: wgpu::Buffer,
    drawn_views: wgpu::Buffer,
    /// All maps, as layers.
    pub(crate) maps: wgpu::TextureView,
    texture: wgpu::Texture,
    table: LightTable,
}

impl ShadowMaps {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let set = Drawing {
            vertex: "corner",
            corners: Some(Corner::layout()),
            depth: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                // Away from the light, which in reversed depth is down; more for slopes.
                bias: wgpu::DepthBiasState { constant: -2, slope_scale: -1.5, clamp: 0.0 },
            }),
            ..Drawing::default()
        };
        let texture = maps_texture(gpu, 1, 1);
        Self {
            pipeline: pipelines::drawing(gpu, &shader::SHADOW_MAP, &set),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow comparison"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                ..Default::default()
            }),
            lights: geometry::buffer(gpu, "lights", 96, BufferUsages::STORAGE),
            views: geometry::buffer(gpu, "shadow views", 80, BufferUsages::STORAGE),
            drawn_views: geometry::buffer(gpu, "shadow views, drawn", VIEW_STRIDE, BufferUsages::UNIFORM),
            maps: layers(&texture),
            texture,
            table: LightTable::default(),
        }
    }

    /// Takes over lights; whether any map has to be drawn again, and whether anything changed at all.
    pub(crate) fn update(&mut self, gpu: &Gpu, table: LightTable) -> (bool, bool) {
        if table == self.table {
            return (false, false);
        }
        let new_views = table.views != self.table.views;
        let grow = |buffer: &mut wgpu::Buffer, label, bytes: usize, usage| {
            if (buffer.size() as usize) < bytes {
                *buffer = geometry::buffer(gpu, label, bytes as u64, usage);
            }
        };
        grow(&mut self.lights, "lights", size_of_val(table.lights.as_slice()), BufferUsages::STORAGE);
        gpu.queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&table.lights));
        if new_views {
            grow(&mut self.views, "shadow views", size_of_val(table.views.as_slice()), BufferUsages::STORAGE);
            gpu.queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&table.views));
            let mut spread = vec![0u8; table.views.len() * VIEW_STRIDE as usize];
            for (slot, view) in spread.chunks_exact_mut(VIEW_STRIDE as usize).zip(&table.views) {
                slot[..size_of::<ShadowView>()].copy_from_slice(bytemuck::bytes_of(view));
            }
            grow(&mut self.drawn_views, "shadow views, drawn", spread.len(), BufferUsages::UNIFORM);
            gpu.queue.write_buffer(&self.drawn_views, 0, &spread);
            let count = table.views.len().max(1) as u32;
            let resolution = table.resolution.max(1);
            if self.texture.width() != resolution || self.texture.depth_or_array_layers() != count {
                self.texture = maps_texture(gpu, resolution, count);
                self.maps = layers(&self.texture);
            }
        }
        self.table = table;
        (new_views, true)
    }

    /// Lights that shine through everything, because there are more than maps.
    pub(crate) fn unshadowed(&self) -> u32 {
        self.table.unshadowed
    }

    pub(crate) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        geometry: &Geometry,
        timer: &mut Timer,
    ) {
        let span = timer.span("shadow maps");
        let count = self.table.views.len();
        let layout = self.pipeline.get_bind_group_layout(0);
        for layer in 0..count {
            let view = self.texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer as u32,
                array_layer_count: Some(1),
                ..Default::default()
            });
            let offset = layer as u64 * VIEW_STRIDE;
            let group = pipelines::bind(
                gpu,
                &layout,
                &[pipelines::part(&self.drawn_views, offset, size_of::<ShadowView>() as u64)],
            );
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow map"),
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: timer.render_writes(span, layer == 0, layer + 1 == count),
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            geometry.draw(&mut pass, 0..1, |_, _| true);
        }
    }
}

fn maps_texture(gpu: &Gpu, resolution: u32, count: u32) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow maps"),
        size: wgpu::Extent3d { width: resolution, height: resolution, depth_or_array_layers: count },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Depth32Float,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

fn layers(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}
