//! Turns the views of lights into depth maps, drawn again only when a light or the geometry has changed.

use crate::{
    Gpu,
    deferred::depth_test,
    geometry::{self, Geometry},
    layout::{Corner, NO_LAYER, ShadowView, TextureCorner},
    pipelines::{self, Drawing},
    shader,
    shadow_views::LightTable,
    targets::DEPTH,
    textures::Textures,
    timer::Timer,
};
use wgpu::{BufferUsages, TextureUsages};

/// Distance between two views in a buffer of uniforms: what every device takes as an offset.
const VIEW_STRIDE: u64 = 256;

/// The shadow maps of a scene's lights.
#[derive(Debug)]
pub(crate) struct ShadowMaps {
    /// Draws depths alone, biased: they are compared with receivers.
    depths: wgpu::RenderPipeline,
    /// The same where textures have holes.
    holes: Option<wgpu::RenderPipeline>,
    /// Draws which triangles are nearest.
    naming: wgpu::RenderPipeline,
    pub(crate) sampler: wgpu::Sampler,
    pub(crate) nearest: wgpu::Sampler,
    /// The lights that shaders read.
    pub(crate) lights: wgpu::Buffer,
    /// The views that shaders read.
    pub(crate) views: wgpu::Buffer,
    drawn_views: wgpu::Buffer,
    /// All maps, as layers.
    pub(crate) maps: wgpu::TextureView,
    texture: wgpu::Texture,
    /// Which triangles lights without extent see, as layers.
    pub(crate) names: wgpu::TextureView,
    names_texture: wgpu::Texture,
    table: LightTable,
}

impl ShadowMaps {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let depth = depth_test(true, wgpu::CompareFunction::Greater);
        let naming = Drawing {
            vertex: "corner",
            fragment: Some("name"),
            format: Some(NAMES),
            corners: Some(Corner::layout()),
            depth: Some(depth),
            ..Drawing::default()
        };
        let texture = maps_texture(gpu, DEPTH, 1, 1);
        let names_texture = maps_texture(gpu, NAMES, 1, 1);
        Self {
            depths: pipelines::drawing(gpu, &shader::SHADOW_MAP, &depths_drawing()),
            holes: None,
            naming: pipelines::drawing(gpu, &shader::SHADOW_MAP, &naming),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow comparison"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                ..Default::default()
            }),
            nearest: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("names of triangles"),
                ..Default::default()
            }),
            lights: geometry::buffer(gpu, "lights", 96, BufferUsages::STORAGE),
            views: geometry::buffer(gpu, "shadow views", 80, BufferUsages::STORAGE),
            drawn_views: geometry::buffer(gpu, "shadow views, drawn", VIEW_STRIDE, BufferUsages::UNIFORM),
            maps: layers(&texture),
            texture,
            names: layers(&names_texture),
            names_texture,
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
                self.texture = maps_texture(gpu, DEPTH, resolution, count);
                self.maps = layers(&self.texture);
            }
            // A place for one that is never looked up stands in where no map names triangles.
            let (edge, named) = if table.named == 0 { (1, 1) } else { (resolution, table.named) };
            if self.names_texture.width() != edge || self.names_texture.depth_or_array_layers() != named {
                self.names_texture = maps_texture(gpu, NAMES, edge, named);
                self.names = layers(&self.names_texture);
            }
        }
        self.table = table;
        (new_views, true)
    }

    /// Whether any map names triangles.
    pub(crate) fn is_named(&self) -> bool {
        self.table.named > 0
    }

    /// Lights that shine through everything, because there are more than maps.
    pub(crate) fn unshadowed(&self) -> u32 {
        self.table.unshadowed
    }

    /// Draws all maps, with the holes of textures if there are any: then no map names triangles.
    pub(crate) fn encode(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (geometry, holes): (&Geometry, Option<&Textures>),
        timer: &mut Timer,
    ) {
        if holes.is_some() && self.holes.is_none() {
            let set = Drawing {
                fragment: Some("holes"),
                texture_corners: Some(TextureCorner::layout()),
                ..depths_drawing()
            };
            self.holes = Some(pipelines::drawing(gpu, &shader::SHADOW_MAP_HOLES, &set));
        }
        let span = timer.span("shadow maps");
        let count = self.table.views.len();
        for (layer, shadow_view) in self.table.views.iter().enumerate() {
            let view = one_layer(&self.texture, layer as u32);
            let names =
                (shadow_view.layer != NO_LAYER).then(|| one_layer(&self.names_texture, shadow_view.layer));
            let pipeline = match (&names, holes, &self.holes) {
                (Some(_), ..) => &self.naming,
                (None, Some(_), Some(pipeline)) => pipeline,
                _ => &self.depths,
            };
            let layout = pipeline.get_bind_group_layout(0);
            let colours = [names.as_ref().map(|view| wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })];
            let offset = layer as u64 * VIEW_STRIDE;
            let group = pipelines::bind(
                gpu,
                &layout,
                &[
                    pipelines::part(&self.drawn_views, offset, size_of::<ShadowView>() as u64),
                    holes.and_then(|textures| pipelines::whole(&textures.texels)),
                    holes.and_then(|textures| pipelines::whole(&textures.layouts)),
                ],
            );
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow map"),
                color_attachments: if names.is_some() { &colours } else { &[] },
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &view,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: if names.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store },
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: timer.render_writes(span, layer == 0, layer + 1 == count),
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            if let Some(textures) = holes {
                pass.set_vertex_buffer(1, textures.corners.slice(..));
            }
            geometry.draw(&mut pass, 0..1, |_, _| true);
        }
    }
}

/// How depths alone are drawn.
fn depths_drawing() -> Drawing<'static> {
    Drawing {
        vertex: "corner",
        corners: Some(Corner::layout()),
        // Away from the light, which in reversed depth is down; more for slopes.
        depth: Some(wgpu::DepthStencilState {
            bias: wgpu::DepthBiasState { constant: -2, slope_scale: -1.5, clamp: 0.0 },
            ..depth_test(true, wgpu::CompareFunction::Greater)
        }),
        ..Drawing::default()
    }
}

/// Names of triangles: their numbers plus one, 0 for none.
const NAMES: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// A texture of `count` layers of `resolution`² texels to draw to.
pub(crate) fn maps_texture(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    resolution: u32,
    count: u32,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("shadow maps"),
        size: wgpu::Extent3d { width: resolution, height: resolution, depth_or_array_layers: count },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT
            | TextureUsages::TEXTURE_BINDING
            | if cfg!(test) { TextureUsages::COPY_SRC } else { TextureUsages::empty() },
        view_formats: &[],
    })
}

/// One layer, to draw to.
pub(crate) fn one_layer(texture: &wgpu::Texture, layer: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

/// All layers, for shaders.
pub(crate) fn layers(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}
