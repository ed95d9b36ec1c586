//! Turns the sky of a scene into what shaders read of it: its numbers and, for a map, a texture of radiances and shares.

use crate::{
    Gpu, GpuError,
    layout::{NO_LIGHT, SkyUniform},
};
use photonstream_scene::SceneLight;
use photonstream_shading::{
    Sky,
    sky::{SkyMap, Spread},
    wgsl,
};
use std::sync::Arc;
use wgpu::{BufferUsages, Extent3d, TextureFormat, TextureUsages};

/// The sky that is on the device; without one, a place for it that is never looked at.
#[derive(Debug)]
pub(crate) struct SkyOnDevice {
    source: Option<Arc<Sky>>,
    uniform: SkyUniform,
    pub(crate) numbers: wgpu::Buffer,
    pub(crate) map: wgpu::TextureView,
}

impl SkyOnDevice {
    /// None.
    pub(crate) fn new(gpu: &Gpu) -> Self {
        let uniform = SkyUniform { light: NO_LIGHT, ..SkyUniform::default() };
        let numbers =
            crate::geometry::buffer(gpu, "sky", size_of::<SkyUniform>() as u64, BufferUsages::UNIFORM);
        gpu.queue.write_buffer(&numbers, 0, bytemuck::bytes_of(&uniform));
        Self { source: None, uniform, numbers, map: texture(gpu, &[[0.0; 4]], 1, 1) }
    }

    /// Whether there is a sky.
    pub(crate) fn is_there(&self) -> bool {
        self.source.is_some()
    }

    /// Takes over the sky among `lights`; its map is uploaded only when it is another one.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for a map that is larger than the device's textures.
    pub(crate) fn update(&mut self, gpu: &Gpu, lights: &[SceneLight]) -> Result<(), GpuError> {
        let found = (0u32..).zip(lights).find_map(|(i, l)| Some((i, l.light.shape.sky()?, l.light.power)));
        let uniform = match found {
            None => SkyUniform { light: NO_LIGHT, ..SkyUniform::default() },
            Some((light, sky, power)) => {
                let is_known =
                    self.source.as_ref().is_some_and(|known| Arc::ptr_eq(known, sky) || known == sky);
                if !is_known && let Spread::Map(map, _) = sky.spread() {
                    self.map = upload(gpu, map)?;
                }
                let mut uniform = numbers(sky);
                (uniform.light, uniform.power) = (light, power.to_array());
                uniform
            }
        };
        self.source = found.map(|(_, sky, _)| Arc::clone(sky));
        if uniform != self.uniform {
            self.uniform = uniform;
            gpu.queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(&uniform));
        }
        Ok(())
    }
}

/// How a sky is spread, without its strength.
fn numbers(sky: &Sky) -> SkyUniform {
    let base = SkyUniform { channels: sky.channels(), kind: wgsl::sky_kind(sky), ..SkyUniform::default() };
    match sky.spread() {
        Spread::Gradient(gradient) => SkyUniform {
            zenith: gradient.zenith.to_array(),
            horizon: gradient.horizon.to_array(),
            ground: gradient.ground.to_array(),
            ..base
        },
        Spread::Map(map, turn) => {
            SkyUniform { turn: *turn, width: map.width(), height: map.height(), ..base }
        }
    }
}

fn upload(gpu: &Gpu, map: &SkyMap) -> Result<wgpu::TextureView, GpuError> {
    let rows_of_shares = map.height().div_ceil(map.width());
    let height = map.height() + rows_of_shares;
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let found = map.width().max(height);
    if found > limit {
        return Err(GpuError::TooLarge {
            what: "texels along an edge of the sky's map",
            found: found.into(),
            limit: limit.into(),
            adapter: gpu.name(),
            remedy: "scale the map down, or choose --renderer cpu",
        });
    }
    let mut texels = map.texels().to_vec();
    texels.extend(map.rows().iter().map(|&end| [0.0, 0.0, 0.0, end]));
    texels.resize(map.width() as usize * height as usize, [0.0; 4]);
    Ok(texture(gpu, &texels, map.width(), height))
}

fn texture(gpu: &Gpu, texels: &[[f32; 4]], width: u32, height: u32) -> wgpu::TextureView {
    let size = Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba32Float,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let row =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 16), rows_per_image: None };
    gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(texels), row, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
