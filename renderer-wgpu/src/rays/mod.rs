//! Turns lights and virtual surface lights into irradiance by shadow rays that compute shaders trace.
//!
//! The scene's triangles lie in a compressed eight-wide tree (`tree`). Every ray that a shader asks gets the answer of
//! `scene.bvh.occluded`: the same shear, edge functions of exact sign, the same padded boxes, the same holes (`holes`). Distances
//! are `f32` here and `f64` there, so answers may differ for rays that end within rounding of a surface or of a hole's outline.
//!
//! A driver may end an invocation's loops in silence after 65 535 turns (Mesa's software rasteriser before 23), counted
//! over all of them by the longest of up to 16 lanes. So a dispatch stops after [`RAY_TURNS`] turns of a pixel, keeps the
//! pixel's sums, and the stack of a ray that is not finished, and the next dispatch goes on (`dispatch`). That is also
//! what keeps each submission short. Passes are submitted and waited for here, for only the device knows when the last
//! pixel has finished.
//!
//! # Measured
//! On Mesa 22.3.6's llvmpipe, two cores shared with other work, 2²⁰ shadow rays between points of the surfaces, best of
//! five (`cargo test -p photonstream-renderer-wgpu --lib -- --ignored --nocapture rays_per_second`):
//!
//! | scene | triangles | targets | device | CPU, one thread | answers that differ |
//! |---|---|---|---|---|---|
//! | cornell-box | 2 006 | random | 2.6 M rays/s | 5.1 | 0 |
//! | cornell-box | 2 006 | runs of 4 096 to one | 3.0 | 5.5 | 0 |
//! | cornell-knot | 100 022 | random | 1.7 | 3.5 | 0 |
//! | cornell-knot | 100 022 | runs of 4 096 to one | 1.9 | 3.4 | 0 |

mod bindings;
mod dispatch;
mod holes;
mod noise;
#[cfg(test)]
mod tests;
mod tree;

use crate::{Gpu, GpuError, shader, sky::SkyOnDevice, textures::Source};
use bindings::{Layouts, bind, pipeline, upload};
use dispatch::{Pass, Workspace};
use glam::Vec3;
use holes::HolesOnDevice;
use noise::Noise;
use photonstream_renderer::{
    Watch,
    shadow_rays::{LIGHT_SEED, SHADOW_REACH},
};
use photonstream_scene::{
    Geometry,
    bvh::{NODE_PAD_ORIGIN, SMALLEST_COMPONENT, TRIANGLE_PAD},
};
use std::sync::Arc;
use tree::Tree;

/// Groups that a ray's stack holds.
pub(crate) const RAY_STACK: u32 = tree::STACK;
/// Turns of loops after which a pixel's ray is suspended: 16 lanes that never agree stay below 65 535.
pub(crate) const RAY_TURNS: u32 = 3_800;
/// Turns of loops after which a pixel starts no further ray, so that few have to be suspended.
const RAY_TURNS_FOR_NEW: u32 = 2_400;
/// Turns that looking up a sample of a sky takes at most: two searches among 2¹⁴.
const SKY_TURNS: u32 = 30;
/// Turns that choosing a triangle of an emitting mesh takes at most: a search among 2¹⁶.
const MESH_TURNS: u32 = 17;
/// Unit round-off of `f32`.
const ROUND_OFF: f32 = f32::EPSILON * 0.5;
/// Padding of node boxes, in multiples of the distance of the scene's farthest corner: twice that of the scene's own
/// structure, for a box here is also rounded when it is compressed, and taken apart by one more product and sum.
const NODE_PAD_DISTANCE: f32 = 48.0 * ROUND_OFF;
/// Scrambles the choice of virtual surface lights apart from all others.
const VSL_SEED: u32 = 0x7673_6C73;

/// The numbers above as WGSL.
pub(crate) fn constants() -> String {
    let mut text = String::new();
    let seeds = [
        ("LIGHT_SEED_LOW", LIGHT_SEED as u32),
        ("LIGHT_SEED_HIGH", (LIGHT_SEED >> 32) as u32),
        ("VSL_SEED", VSL_SEED),
    ];
    let turns = [
        ("RAY_STACK", RAY_STACK),
        ("RAY_TURNS", RAY_TURNS),
        ("RAY_TURNS_FOR_NEW", RAY_TURNS_FOR_NEW),
        ("SKY_TURNS", SKY_TURNS),
        ("MESH_TURNS", MESH_TURNS),
    ];
    for (name, value) in seeds.into_iter().chain(turns) {
        text.push_str(&format!("const {name}: u32 = {value}u;\n"));
    }
    for (name, value) in [
        ("SHADOW_REACH", SHADOW_REACH),
        ("ONE_MINUS_EPSILON", photonstream_shading::sampling::ONE_MINUS_EPSILON),
        ("TRIANGLE_PAD", TRIANGLE_PAD),
        ("NODE_PAD_DISTANCE", NODE_PAD_DISTANCE),
        ("NODE_PAD_ORIGIN", NODE_PAD_ORIGIN),
        ("SMALLEST_COMPONENT", SMALLEST_COMPONENT),
    ] {
        text.push_str(&format!("const {name}: f32 = {value:?}f;\n"));
    }
    let [r, g, b] = [Vec3::X, Vec3::Y, Vec3::Z].map(photonstream_shading::tone::luminance);
    text.push_str(&holes::constants());
    text.push_str(&format!("const LUMINANCE: vec3f = vec3f({r:?}f, {g:?}f, {b:?}f);\n"));
    text
}

/// What tracing has done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Traced {
    /// Rays.
    pub(crate) rays: u64,
    /// Dispatches.
    pub(crate) dispatches: u64,
    /// Time until all was done, in ms.
    pub(crate) ms: f64,
    /// Whether the watch stopped it: the output is not complete.
    pub(crate) stopped: bool,
}

/// What both kinds of rays start from.
#[derive(Clone, Copy)]
pub(crate) struct RayInputs<'a> {
    /// The frame's uniforms.
    pub(crate) frame: &'a wgpu::Buffer,
    /// What each pixel sees.
    pub(crate) gbuffer: &'a wgpu::TextureView,
    /// Width and height in pixels, as in the uniforms.
    pub(crate) size: [u32; 2],
    /// `Light` records for direct light, `Vsl` records for indirect light.
    pub(crate) lights: &'a wgpu::Buffer,
    /// Polygons of the virtual surface lights; whatever there is for direct light.
    pub(crate) patches: &'a wgpu::Buffer,
    /// The sky among the lights, or none.
    pub(crate) sky: &'a SkyOnDevice,
    /// Number of lights, as in the uniforms.
    pub(crate) count: u32,
    /// Number of the camera sample, from 0: each has other samples of lights.
    pub(crate) sample: u32,
    /// Where irradiance goes, `Rgba32Float` with storage binding.
    pub(crate) output: &'a wgpu::TextureView,
    /// Who may stop it.
    pub(crate) watch: Watch<'a>,
}

/// Shadow rays against one scene.
#[derive(Debug)]
pub(crate) struct Rays {
    layouts: Layouts,
    direct: wgpu::ComputePipeline,
    weigh: wgpu::ComputePipeline,
    indirect: wgpu::ComputePipeline,
    source: Arc<Geometry>,
    nodes: wgpu::Buffer,
    triangles: wgpu::Buffer,
    holes: Option<HolesOnDevice>,
    bounds: [Vec3; 2],
    workspace: Option<Workspace>,
    noise: Noise,
    band_bytes: u64,
}

impl Rays {
    /// Traces against `geometry`, through its `holes`: shaders ask for them only where there are any.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for more triangles or masks than a binding holds, or a tree deeper than a ray's stack;
    /// [`GpuError::Unsupported`] where the device has too few bindings for holes.
    pub(crate) fn new(
        gpu: &Gpu,
        geometry: &Arc<Geometry>,
        holes: Option<&Arc<Source>>,
    ) -> Result<Self, GpuError> {
        if holes.is_some() {
            let limits = gpu.device.limits();
            holes::check_buffers(limits.max_storage_buffers_per_shader_stage, &gpu.name())?;
        }
        let tree = Tree::new(geometry);
        check_size(gpu, &tree)?;
        let holes = holes.map(|source| HolesOnDevice::new(gpu, source, &tree.ids)).transpose()?;
        let layouts = Layouts::new(gpu, holes.is_some());
        let pipeline = |source, entry, inputs| pipeline(gpu, source, entry, [inputs, &layouts.tracing]);
        let [direct, indirect] = match &holes {
            None => [&shader::RAYS_DIRECT, &shader::RAYS_INDIRECT],
            Some(_) => [&shader::RAYS_DIRECT_HOLES, &shader::RAYS_INDIRECT_HOLES],
        };
        let upload = |label, bytes| upload(gpu, label, bytes);
        Ok(Self {
            direct: pipeline(direct, "trace_direct", &layouts.inputs[0]),
            weigh: pipeline(indirect, "weigh", &layouts.inputs[0]),
            indirect: pipeline(indirect, "trace_indirect", &layouts.inputs[0]),
            noise: Noise::new(pipeline(&shader::RAYS_NOISE, "sum_rows", &layouts.inputs[1])),
            nodes: upload("ray-tracing nodes", bytemuck::cast_slice(&tree.nodes)),
            triangles: upload("ray-tracing triangles", bytemuck::cast_slice(&tree.triangles)),
            holes,
            bounds: tree.bounds,
            layouts,
            source: Arc::clone(geometry),
            workspace: None,
            band_bytes: Self::band_bytes(),
        })
    }

    /// Traces against `geometry` from now on; its tree is built only when it has changed, and masks of holes are uploaded
    /// only when they have.
    ///
    /// # Errors
    /// As [`Rays::new`].
    pub(crate) fn set_geometry(
        &mut self,
        gpu: &Gpu,
        geometry: &Arc<Geometry>,
        holes: Option<&Arc<Source>>,
    ) -> Result<(), GpuError> {
        if self.holes.is_some() != holes.is_some() {
            *self = Self::new(gpu, geometry, holes)?;
            return Ok(());
        }
        let same_holes = match (&self.holes, holes) {
            (Some(known), Some(source)) => known.are_of(source),
            _ => true,
        };
        let same = Arc::ptr_eq(&self.source, geometry) || *self.source == **geometry;
        self.source = Arc::clone(geometry);
        if same && same_holes {
            return Ok(());
        }
        let tree = Tree::new(geometry);
        check_size(gpu, &tree)?;
        self.nodes = upload(gpu, "ray-tracing nodes", bytemuck::cast_slice(&tree.nodes));
        self.triangles = upload(gpu, "ray-tracing triangles", bytemuck::cast_slice(&tree.triangles));
        if let Some(source) = holes {
            let linked = same_holes && self.holes.as_ref().is_some_and(|known| known.relink(gpu, &tree.ids));
            if !linked {
                self.holes = Some(HolesOnDevice::new(gpu, source, &tree.ids)?);
            }
        }
        self.bounds = tree.bounds;
        self.workspace = None;
        Ok(())
    }

    /// Traces rays to all lights, `light_samples` (as in the frame's uniforms) to each area light; what `encoder` holds is
    /// submitted before, and `encoder` is a new one afterwards.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], and what the device reports.
    pub(crate) fn encode_direct(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &RayInputs<'_>,
        light_samples: u32,
    ) -> Result<Traced, GpuError> {
        let items = u64::from(inputs.count) * (1 + u64::from(light_samples));
        let items = count_of("samples of lights", items, gpu)?;
        self.reserve(gpu, inputs.size)?;
        let group = self.bind_inputs(gpu, inputs);
        self.run(
            gpu,
            encoder,
            &Pass {
                trace: &self.direct,
                weigh: None,
                sum_rows: None,
                inputs: &group,
                size: inputs.size,
                items,
                sample: inputs.sample,
                budget: 0,
                watch: inputs.watch,
            },
        )
    }

    /// Traces rays to virtual surface lights: to each, or at most `rays_per_pixel` (0: to each) to some, chosen by what
    /// they would add, in two independent sets, stratified each. The mean over `sample` is that of rays to each.
    /// What `encoder` holds is submitted before, and `encoder` is a new one afterwards.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], and what the device reports.
    pub(crate) fn encode_indirect(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        inputs: &RayInputs<'_>,
        rays_per_pixel: u32,
    ) -> Result<Traced, GpuError> {
        let budget = if rays_per_pixel < inputs.count { rays_per_pixel } else { 0 };
        let items = count_of("virtual surface lights", inputs.count.into(), gpu)?;
        self.reserve(gpu, inputs.size)?;
        let group = self.bind_inputs(gpu, inputs);
        self.noise.prepare(gpu, inputs.size[1], budget);
        let sums = self.noise.group(gpu, &self.layouts.inputs[1], inputs.frame);
        self.run(
            gpu,
            encoder,
            &Pass {
                trace: &self.indirect,
                weigh: (budget > 0).then_some(&self.weigh),
                sum_rows: (budget > 0).then_some((&self.noise.pipeline, &sums)),
                inputs: &group,
                size: inputs.size,
                items,
                sample: inputs.sample,
                budget,
                watch: inputs.watch,
            },
        )
    }

    /// Forgets the noise of earlier samples: what follows belongs to another picture.
    pub(crate) fn restart_noise(&mut self) {
        self.noise.restart();
    }

    /// Standard error of the mean indirect irradiance of all samples since the last restart, as rel. RMSE over the
    /// picture; 0 where rays went to every light, `None` before the first sample and for a single ray per pixel.
    ///
    /// # Errors
    /// What the device reports.
    pub(crate) fn noise(&self, gpu: &Gpu) -> Result<Option<f64>, GpuError> {
        self.noise.read(gpu)
    }

    fn reserve(&mut self, gpu: &Gpu, size: [u32; 2]) -> Result<(), GpuError> {
        if !self.workspace.as_ref().is_some_and(|w| w.fits(size)) {
            self.workspace = None;
            self.workspace = Some(Workspace::new(gpu, self, size, self.band_bytes)?);
        }
        Ok(())
    }

    fn bind_inputs(&self, gpu: &Gpu, inputs: &RayInputs<'_>) -> wgpu::BindGroup {
        bind(
            gpu,
            &self.layouts.inputs[0],
            (0..).zip([
                inputs.frame.as_entire_binding(),
                wgpu::BindingResource::TextureView(inputs.gbuffer),
                inputs.lights.as_entire_binding(),
                wgpu::BindingResource::TextureView(inputs.output),
                inputs.patches.as_entire_binding(),
                inputs.sky.numbers.as_entire_binding(),
                wgpu::BindingResource::TextureView(&inputs.sky.map),
            ]),
        )
    }
}

/// Whether the device takes a tree, and a ray's stack its depth.
fn check_size(gpu: &Gpu, tree: &Tree) -> Result<(), GpuError> {
    let limit = bindings::limit(gpu);
    let sizes = [
        ("ray-tracing nodes in bytes", size_of_val(&tree.nodes[..]) as u64, limit),
        ("ray-tracing triangles in bytes", size_of_val(&tree.triangles[..]) as u64, limit),
        ("levels of the ray-tracing tree", tree.depth.into(), RAY_STACK.into()),
    ];
    for (what, found, limit) in sizes {
        if found > limit {
            let remedy = "choose --visibility none and --shadows maps, or --renderer cpu";
            return Err(GpuError::TooLarge { what, found, limit, adapter: gpu.name(), remedy });
        }
    }
    Ok(())
}

/// A number of items that shaders can count.
fn count_of(what: &'static str, found: u64, gpu: &Gpu) -> Result<u32, GpuError> {
    // A dispatch's end is counted in u32, and the pixel that has finished stands one beyond.
    let limit = u64::from(u32::MAX - 1024);
    if found > limit {
        let remedy = "choose fewer lights or light samples";
        return Err(GpuError::TooLarge { what, found, limit, adapter: gpu.name(), remedy });
    }
    Ok(found as u32)
}
