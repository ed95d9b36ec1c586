//! Turns virtual surface lights that shine into shadow maps, each drawn again only when its light has moved or the geometry has
//! changed.

mod slots;
#[cfg(test)]
mod tests;

use self::slots::{Slot, Slots};
use crate::{
    Gpu,
    deferred::depth_test,
    geometry::{self, Geometry},
    layout::{Corner, TextureCorner, VslView},
    pipelines::{self, Drawing},
    scope::Scope,
    shader,
    shadow_maps::{self, maps_texture},
    targets::DEPTH,
    textures::Textures,
};
use glam::{Vec2, Vec3};
use photonstream_protocol::VslRecord;
use photonstream_shading::{distance_map::Axes, light::Bounds, surface::RELATIVE_OFFSET};
use wgpu::BufferUsages;

/// Most virtual surface lights that have shadow maps: at 256² texels 256 MiB.
pub(crate) const MAX_MAPS: u32 = 1024;

/// Distance between two views in a buffer of uniforms: what every device takes as an offset.
const VIEW_STRIDE: u64 = 256;

/// Faces of the octahedron above a light.
const QUARTERS: u32 = 4;

/// What all maps depend on beside their lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Surroundings {
    /// Count of changes of the geometry.
    pub(crate) shape: u64,
    /// What is nearer to a light is not seen, m in the 1-norm of its axes.
    pub(crate) near: f32,
    /// How far lights are moved off their surfaces, m.
    pub(crate) offset: f32,
}

impl Surroundings {
    /// Those of a scene within `bounds` whose largest coordinate is `magnitude`, in m.
    pub(crate) fn new(shape: u64, bounds: Bounds, magnitude: f32) -> Self {
        Self { shape, near: near(bounds), offset: magnitude * RELATIVE_OFFSET }
    }
}

/// What is nearer to a light than this is not seen, in m.
pub(crate) fn near(bounds: Bounds) -> f32 {
    (bounds.radius * 1e-4).max(f32::MIN_POSITIVE)
}

/// The shadow maps of virtual surface lights.
#[derive(Debug)]
pub(crate) struct VslShadowMaps {
    depths: Option<wgpu::RenderPipeline>,
    /// The same where textures have holes.
    holes: Option<wgpu::RenderPipeline>,
    slots: Slots,
    surroundings: Option<Surroundings>,
    /// The slots whose maps are among the commands that are being written.
    pending: Vec<u32>,
    drawn_views: wgpu::Buffer,
    /// The layer of each light.
    pub(crate) layers: wgpu::Buffer,
    texture: wgpu::Texture,
    /// All maps, as layers.
    pub(crate) maps: wgpu::TextureView,
    pub(crate) nearest: wgpu::Sampler,
}

impl VslShadowMaps {
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let texture = maps_texture(gpu, DEPTH, 1, 1);
        Self {
            depths: None,
            holes: None,
            slots: Slots::default(),
            surroundings: None,
            pending: Vec::new(),
            drawn_views: geometry::buffer(
                gpu,
                "views of virtual surface lights",
                VIEW_STRIDE,
                BufferUsages::UNIFORM,
            ),
            layers: geometry::buffer(gpu, "layers of virtual surface lights", 4, BufferUsages::STORAGE),
            maps: shadow_maps::layers(&texture),
            texture,
            nearest: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("shadow maps of virtual surface lights"),
                ..Default::default()
            }),
        }
    }

    /// Takes over the lights that shine in `records`, for maps of `edge`² texels.
    pub(crate) fn update(&mut self, gpu: &Gpu, records: &[VslRecord], edge: u32, surroundings: Surroundings) {
        let most = MAX_MAPS.min(gpu.device.limits().max_texture_array_layers);
        self.slots.assign(records, most as usize);
        if self.surroundings.replace(surroundings) != Some(surroundings) {
            self.slots.forget();
        }
        let count = self.slots.len().max(1) as u32;
        if self.texture.width() != edge || self.texture.depth_or_array_layers() < count {
            let layers = count.next_power_of_two().min(most);
            self.texture = maps_texture(gpu, DEPTH, edge, layers);
            self.maps = shadow_maps::layers(&self.texture);
            let bytes = u64::from(layers) * VIEW_STRIDE;
            self.drawn_views =
                geometry::buffer(gpu, "views of virtual surface lights", bytes, BufferUsages::UNIFORM);
            self.slots.forget();
        }
        for (number, slot) in self.slots.due() {
            let view = view(slot, edge, surroundings);
            gpu.queue.write_buffer(
                &self.drawn_views,
                u64::from(number) * VIEW_STRIDE,
                bytemuck::bytes_of(&view),
            );
        }
        let layers = self.slots.of_light.as_slice();
        let bytes = size_of_val(layers) as u64;
        if self.layers.size() < bytes {
            self.layers =
                geometry::buffer(gpu, "layers of virtual surface lights", bytes, BufferUsages::STORAGE);
        }
        gpu.queue.write_buffer(&self.layers, 0, bytemuck::cast_slice(layers));
    }

    /// Lights that shine through everything, because there are more than maps.
    pub(crate) fn without(&self) -> u32 {
        self.slots.without
    }

    /// Draws the maps that are due, with the holes of textures if there are any; how many.
    pub(crate) fn encode(
        &mut self,
        scope: &mut Scope<'_>,
        (geometry, holes): (&Geometry, Option<&Textures>),
    ) -> u32 {
        self.pending.clear();
        self.pending.extend(self.slots.due().map(|(number, _)| number));
        if self.pending.is_empty() {
            return 0;
        }
        let gpu = scope.gpu;
        let pipeline = match holes {
            Some(_) => self.holes.get_or_insert_with(|| {
                let set = Drawing {
                    fragment: Some("holes"),
                    texture_corners: Some(TextureCorner::layout()),
                    ..depths_drawing()
                };
                pipelines::drawing(gpu, &shader::VSL_SHADOW_MAP_HOLES, &set)
            }),
            None => self
                .depths
                .get_or_insert_with(|| pipelines::drawing(gpu, &shader::VSL_SHADOW_MAP, &depths_drawing())),
        };
        let layout = pipeline.get_bind_group_layout(0);
        let span = scope.timer.span("shadow maps of virtual surface lights");
        let count = self.pending.len();
        let edge = self.texture.width();
        let due: Vec<(u32, Slot)> = self.slots.due().map(|(number, slot)| (number, *slot)).collect();
        for (index, (number, slot)) in due.iter().enumerate() {
            let offset = u64::from(*number) * VIEW_STRIDE;
            let group = pipelines::bind(
                gpu,
                &layout,
                &[
                    pipelines::part(&self.drawn_views, offset, size_of::<VslView>() as u64),
                    holes.and_then(|textures| pipelines::whole(&textures.texels)),
                    holes.and_then(|textures| pipelines::whole(&textures.layouts)),
                ],
            );
            let mut pass = scope.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("shadow map of a virtual surface light"),
                color_attachments: &[],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &shadow_maps::one_layer(&self.texture, *number),
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Store,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: scope.timer.render_writes(span, index == 0, index + 1 == count),
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            if let Some(textures) = holes {
                pass.set_vertex_buffer(1, textures.corners.slice(..));
            }
            let axes = Axes::of(slot.normal);
            for quarter in 0..QUARTERS {
                let [x, y, width, height] = quarter_box(quarter, edge);
                pass.set_scissor_rect(x, y, width, height);
                geometry.draw(&mut pass, quarter..quarter + 1, |centre, radius| {
                    is_in_quarter(axes.local(centre - slot.position), radius, quarter)
                });
            }
        }
        count as u32
    }

    /// To be called once the commands of [`VslShadowMaps::encode`] are on their way: until then a picture that is given up
    /// has drawn nothing.
    pub(crate) fn delivered(&mut self) {
        self.slots.drawn(&self.pending);
        self.pending.clear();
    }
}

/// How depths are drawn: as they are, for receivers are compared with their own planes.
fn depths_drawing() -> Drawing<'static> {
    Drawing {
        vertex: "corner",
        fragment: Some("depth"),
        corners: Some(Corner::layout()),
        depth: Some(depth_test(true, wgpu::CompareFunction::Greater)),
        ..Drawing::default()
    }
}

fn view(slot: &Slot, edge: u32, surroundings: Surroundings) -> VslView {
    let axes = Axes::of(slot.normal);
    VslView {
        position: (slot.position + slot.normal * surroundings.offset).to_array(),
        near: surroundings.near,
        tangent: axes.tangent.to_array(),
        bitangent: axes.bitangent.to_array(),
        normal: slot.normal.to_array(),
        edge: edge as f32,
        ..VslView::default()
    }
}

/// The signs of x and y, in the light's axes, of a quarter of the hemisphere; twin of `quarter_signs` in vsl_quarter.wgsl.
fn quarter_signs(quarter: u32) -> Vec2 {
    let sign = |bit: u32| if quarter & bit == 0 { 1.0 } else { -1.0 };
    Vec2::new(sign(1), sign(2))
}

/// The part of the map, a half, that a quarter's triangle lies in: x, y, width and height in texels.
fn quarter_box(quarter: u32, edge: u32) -> [u32; 4] {
    let half = edge / 2;
    match quarter {
        0 => [half, 0, half, edge],
        1 => [0, 0, edge, half],
        2 => [0, half, edge, half],
        _ => [0, 0, half, edge],
    }
}

/// Whether any of a sphere around `centre`, in the light's axes, may be in a quarter of its hemisphere.
fn is_in_quarter(centre: Vec3, radius: f32, quarter: u32) -> bool {
    (quarter_signs(quarter) * centre.truncate()).min_element() > -radius && centre.z > -radius
}
