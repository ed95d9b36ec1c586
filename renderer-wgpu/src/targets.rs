//! Turns a picture's size into the textures that its passes write.

use crate::{Gpu, GpuError};
use wgpu::{TextureFormat, TextureUsages};

/// Irradiance and shown radiance: f32, because in f16 adding up many lights loses an eighth of them.
pub(crate) const HDR: TextureFormat = TextureFormat::Rgba32Float;
/// Distance, normal, object and side of what is seen.
pub(crate) const GBUFFER: TextureFormat = TextureFormat::Rgba32Uint;
/// Reversed depth.
pub(crate) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Open share of the hemisphere.
pub(crate) const OPENNESS: TextureFormat = TextureFormat::R32Float;

/// A texture with a view of all of it.
#[derive(Debug)]
pub(crate) struct Target {
    pub(crate) texture: wgpu::Texture,
    pub(crate) view: wgpu::TextureView,
}

impl Target {
    pub(crate) fn new(
        gpu: &Gpu,
        label: &str,
        size: [u32; 2],
        format: TextureFormat,
        usage: TextureUsages,
    ) -> Self {
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { texture, view }
    }
}

/// The textures of one size. Those that not every picture needs are made when first asked for.
#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) size: [u32; 2],
    pub(crate) gbuffer: Target,
    /// Colours of textures, in a scene with.
    pub(crate) texel: Option<Target>,
    pub(crate) depth: Target,
    pub(crate) direct: Target,
    pub(crate) indirect: Target,
    pub(crate) output: Target,
    /// The other one of two that passes read and write in turn.
    pub(crate) spare: Option<Target>,
    /// Irradiance of the lights that interleaved sampling leaves out, two that are read and written in turn.
    pub(crate) near: Option<[Target; 2]>,
    pub(crate) openness: Option<[Target; 2]>,
    pub(crate) owners: Option<[Target; 2]>,
}

const DRAWN: TextureUsages = TextureUsages::RENDER_ATTACHMENT.union(TextureUsages::TEXTURE_BINDING);

impl Targets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        check(gpu, size)?;
        let traced = DRAWN | TextureUsages::STORAGE_BINDING;
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let targets = Self {
            size,
            gbuffer: Target::new(gpu, "G-buffer", size, GBUFFER, DRAWN | TextureUsages::COPY_SRC),
            texel: None,
            depth: Target::new(gpu, "depth", size, DEPTH, TextureUsages::RENDER_ATTACHMENT),
            direct: Target::new(gpu, "direct irradiance", size, HDR, traced),
            indirect: Target::new(gpu, "indirect irradiance", size, HDR, traced),
            output: Target::new(gpu, "shown layer", size, HDR, DRAWN | TextureUsages::COPY_SRC),
            spare: None,
            near: None,
            openness: None,
            owners: None,
        };
        match pollster::block_on(scope.pop()) {
            None => Ok(targets),
            Some(error) => Err(GpuError::OutOfMemory {
                what: format!("a picture of {}x{}", size[0], size[1]),
                reason: error.to_string(),
            }),
        }
    }

    /// Makes what a scene with textures needs.
    pub(crate) fn prepare_texel(&mut self, gpu: &Gpu) {
        let size = self.size;
        self.texel.get_or_insert_with(|| Target::new(gpu, "colours of textures", size, GBUFFER, DRAWN));
    }

    pub(crate) fn spare(&mut self, gpu: &Gpu) -> &Target {
        let size = self.size;
        self.spare.get_or_insert_with(|| {
            Target::new(gpu, "indirect irradiance, spare", size, HDR, DRAWN | TextureUsages::STORAGE_BINDING)
        })
    }

    pub(crate) fn near(&mut self, gpu: &Gpu) -> &[Target; 2] {
        let size = self.size;
        self.near.get_or_insert_with(|| {
            ["near lights", "near lights, spare"].map(|label| Target::new(gpu, label, size, HDR, DRAWN))
        })
    }

    pub(crate) fn openness(&mut self, gpu: &Gpu) -> &[Target; 2] {
        let size = self.size;
        self.openness.get_or_insert_with(|| {
            ["openness, noisy", "openness"].map(|label| Target::new(gpu, label, size, OPENNESS, DRAWN))
        })
    }

    pub(crate) fn owners(&mut self, gpu: &Gpu) -> &[Target; 2] {
        let size = self.size;
        self.owners.get_or_insert_with(|| {
            ["owners", "owners, spare"].map(|label| Target::new(gpu, label, size, GBUFFER, DRAWN))
        })
    }
}

fn check(gpu: &Gpu, size: [u32; 2]) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let too_large = |what, found, limit| {
        let remedy = "choose a smaller --size";
        Err(GpuError::TooLarge { what, found, limit, adapter: gpu.name(), remedy })
    };
    let edge = size[0].max(size[1]);
    if edge > limits.max_texture_dimension_2d {
        return too_large("picture edge in pixels", edge.into(), limits.max_texture_dimension_2d.into());
    }
    // A picture is read back through one buffer.
    let bytes = u64::from(size[0].next_multiple_of(16)) * u64::from(size[1]) * 16;
    if bytes > limits.max_buffer_size {
        return too_large("picture in bytes", bytes, limits.max_buffer_size);
    }
    Ok(())
}
