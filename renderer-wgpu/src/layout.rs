//! Gathers the structures that shaders read, byte for byte, and the numbers that shaders share with Rust.

use bytemuck::{Pod, Zeroable};

/// Edge of a tile in pixels.
pub(crate) const TILE_EDGE: u32 = 16;
/// Words of a tile's list: one bit for each light of a batch.
pub(crate) const BATCH_WORDS: u32 = 42;
/// Lights of a batch: as many whole words as fit into a block of uniforms.
pub(crate) const BATCH_LIGHTS: u32 = BATCH_WORDS * 32;
/// Maps around one point of an area light: the half cube that it shines into.
pub(crate) const AREA_FACES: u32 = 5;
/// Largest coordinate or area of a published light, in m or m²: its square and its fourth power stay finite.
pub(crate) const MAX_COORDINATE: f32 = 1e9;
/// Largest flux of a published light, in W.
pub(crate) const MAX_FLUX: f32 = 1e30;
/// Distance in pixels, times the edge of the pattern of interleaved sampling, within which a light is not interleaved.
/// Measured: ARCHITECTURE.md.
pub(crate) const STEEP_PIXELS: f32 = 16.0;
/// Scrambles the points of an area light that have shadow maps.
pub(crate) const MAP_SEED: u32 = 0x6D61_7073;
/// Means: every light.
pub(crate) const ALL_LIGHTS: u32 = u32::MAX;
/// Means: no light.
pub(crate) const NO_LIGHT: u32 = u32::MAX;
/// Means: nobody owns this.
pub(crate) const NO_OWNER: u32 = u32::MAX;
/// Texels by which a receiver is moved off its surface before it is looked up in a shadow map.
pub(crate) const SHADOW_NORMAL_TEXELS: f32 = 2.0;

/// Texels by which a plane lies off a receiver at least if it is to shadow the receiver beside its triangle: more than the
/// neighbours of a fine curved surface bulge over each other.
pub(crate) const COVERED_TEXELS: f32 = 1.0;

/// Texels by which a surface may lie behind what a sky's beam sees, and the share of its own change of depth within a texel: for
/// normals that are bent, and surfaces that are curved.
pub(crate) const BEAM_BIAS_TEXELS: f32 = 0.25;
pub(crate) const BEAM_SLOPE_TOLERANCE: f32 = 0.25;

/// Stands for the layer of a view whose map does not name triangles, and of a virtual surface light without a shadow map.
pub(crate) const NO_LAYER: u32 = u32::MAX;

const _: () = assert!(BATCH_LIGHTS as usize * size_of::<VslUniform>() <= crate::UNIFORM_BLOCK_BYTES as usize);

/// What a composite shows, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Shown {
    Full,
    Direct,
    Indirect,
    Albedo,
    Normal,
    Depth,
    Owner,
    Tiles,
}

impl Shown {
    const NAMES: [(&'static str, Self); 8] = [
        ("FULL", Self::Full),
        ("DIRECT", Self::Direct),
        ("INDIRECT", Self::Indirect),
        ("ALBEDO", Self::Albedo),
        ("NORMAL", Self::Normal),
        ("DEPTH", Self::Depth),
        ("OWNER", Self::Owner),
        ("TILES", Self::Tiles),
    ];
}

/// The numbers above as WGSL.
pub(crate) fn constants() -> String {
    let mut text = String::new();
    let mut unsigned = |name: &str, value: u32| text.push_str(&format!("const {name}: u32 = {value}u;\n"));
    unsigned("TILE_EDGE", TILE_EDGE);
    unsigned("BATCH_WORDS", BATCH_WORDS);
    unsigned("BATCH_LIGHTS", BATCH_LIGHTS);
    unsigned("AREA_FACES", AREA_FACES);
    unsigned("MAP_SEED", MAP_SEED);
    unsigned("ALL_LIGHTS", ALL_LIGHTS);
    unsigned("NO_OWNER", NO_OWNER);
    unsigned("NO_BEND", NO_BEND);
    unsigned("NO_LAYER", NO_LAYER);
    for (name, shown) in Shown::NAMES {
        unsigned(&format!("SHOW_{name}"), shown as u32);
    }
    let mut float = |name: &str, value: f32| text.push_str(&format!("const {name}: f32 = {value:?}f;\n"));
    float("MAX_COORDINATE", MAX_COORDINATE);
    float("MAX_FLUX", MAX_FLUX);
    float("STEEP_PIXELS", STEEP_PIXELS);
    float("SHADOW_NORMAL_TEXELS", SHADOW_NORMAL_TEXELS);
    float("COVERED_TEXELS", COVERED_TEXELS);
    float("BEAM_BIAS_TEXELS", BEAM_BIAS_TEXELS);
    float("BEAM_SLOPE_TOLERANCE", BEAM_SLOPE_TOLERANCE);
    float("COMPATIBLE_COS", photonstream_renderer::owner::COMPATIBLE_COS);
    float("EPSILON_OF_ONE", f32::EPSILON);
    float("SQRT_3", 3f32.sqrt());
    text
}

macro_rules! shared {
    ($($(#[$meta:meta])* $name:ident as $wgsl:literal { $($field:ident: $type:ty,)* })*) => {
        $(
            $(#[$meta])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
            pub(crate) struct $name { $(pub(crate) $field: $type,)* }
        )*

        /// Name in WGSL, size and fields (name, offset, size) of each structure that shaders read.
        #[cfg(test)]
        pub(crate) const SHARED: &[(&str, usize, &[(&str, usize, usize)])] = &[$((
            $wgsl,
            size_of::<$name>(),
            &[$((stringify!($field), std::mem::offset_of!($name, $field), size_of::<$type>()),)*],
        ),)*];
    };
}

shared! {
    /// Twin of `Camera` in camera.wgsl.
    CameraUniform as "Camera" {
        position: [f32; 3],
        tan_half_fov: f32,
        forward: [f32; 3],
        near: f32,
        right: [f32; 3],
        pad_0: f32,
        up: [f32; 3],
        pad_1: f32,
    }

    /// Twin of `Frame` in frame.wgsl.
    FrameUniform as "Frame" {
        camera: CameraUniform,
        size: [u32; 2],
        tiles: [u32; 2],
        jitter: [f32; 2],
        epsilon: f32,
        albedo_max: f32,
        magnitude: f32,
        area_factor: f32,
        interleave: u32,
        vsls: u32,
        lights: u32,
        light_samples: u32,
        seed_low: u32,
        seed_high: u32,
        only_light: u32,
        show: u32,
        exposure_ev: f32,
        tone_map: u32,
        ao_radius: f32,
        ao_samples: u32,
        flux_of_range: f32,
        first_lot: u32,
        map_edge: u32,
        map_depth_scale: f32,
        pad_0: u32,
        pad_1: u32,
    }

    /// Twin of `Object` in frame.wgsl.
    ObjectUniform as "Object" {
        albedo: [f32; 3],
        sides: u32,
        emitted: [f32; 3],
        pad_0: u32,
    }

    /// Twin of `TextureLayout` in texture.wgsl.
    TextureLayoutUniform as "TextureLayout" {
        first: u32,
        width: u32,
        height: u32,
        levels: u32,
        wrap_u: u32,
        wrap_v: u32,
        cutoff: f32,
        pad_0: u32,
    }

    /// Twin of `Light` in light.wgsl.
    LightUniform as "Light" {
        position: [f32; 3],
        kind: u32,
        direction: [f32; 3],
        versine_inner: f32,
        edge_u: [f32; 3],
        versine_outer: f32,
        edge_v: [f32; 3],
        emitter_offset: f32,
        power: [f32; 3],
        first_map: u32,
        maps: u32,
        map_points: u32,
        first_direction: u32,
        pad_0: u32,
    }

    /// Twin of `Sky` in sky.wgsl.
    SkyUniform as "Sky" {
        zenith: [f32; 3],
        kind: u32,
        horizon: [f32; 3],
        channels: f32,
        ground: [f32; 3],
        turn: f32,
        power: [f32; 3],
        width: u32,
        height: u32,
        light: u32,
        pad_0: u32,
        pad_1: u32,
    }

    /// Twin of `Vsl` in vsl.wgsl.
    VslUniform as "Vsl" {
        position: [f32; 3],
        range_sq: f32,
        normal: [f32; 3],
        area_term: f32,
        flux: [f32; 3],
        object: u32,
    }

    /// Twin of `BatchNumbers` in vsl.wgsl.
    BatchNumbers as "BatchNumbers" {
        first: u32,
        is_last: u32,
        lights: u32,
        words: u32,
    }

    /// Twin of `TileBounds` in cull.wgsl.
    TileBounds as "TileBounds" {
        lo: [f32; 3],
        receivers: u32,
        hi: [f32; 3],
        pad_0: u32,
        normal_lo: [f32; 3],
        pad_1: u32,
        normal_hi: [f32; 3],
        pad_2: u32,
    }

    /// Twin of `RaysDispatch` in rays_pixel.wgsl.
    RaysDispatch as "RaysDispatch" {
        lo: [f32; 3],
        end: u32,
        hi: [f32; 3],
        items: u32,
        first_row: u32,
        rows: u32,
        sample: u32,
        budget: u32,
    }

    /// Twin of `PixelRays` in rays_pixel.wgsl.
    PixelRays as "PixelRays" {
        sum_a: [f32; 3],
        next: u32,
        sum_b: [f32; 3],
        suspended: u32,
        total: f32,
        running: f32,
        taken_a: u32,
        taken_b: u32,
        weight_a: f32,
        weight_b: f32,
        group: [u32; 2],
    }

    /// Twin of `ShadowView` in shadow.wgsl.
    ShadowView as "ShadowView" {
        clip_from_world: [[f32; 4]; 4],
        texel: f32,
        parallel: u32,
        layer: u32,
        pad_1: u32,
    }

    /// Twin of `VslView` in vsl_quarter.wgsl.
    VslView as "VslView" {
        position: [f32; 3],
        near: f32,
        tangent: [f32; 3],
        pad_0: u32,
        bitangent: [f32; 3],
        pad_1: u32,
        normal: [f32; 3],
        edge: f32,
    }
}

/// A corner of a triangle, as the vertex stage reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Corner {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) object: u32,
    /// The shading normal, folded onto a square of 16-bit numbers; [`NO_BEND`] in flat triangles.
    pub(crate) bent: u32,
}

/// Means: no shading normal. Numbers that are packed never are -32 768.
pub(crate) const NO_BEND: u32 = 0x8000_8000;

impl Corner {
    pub(crate) const ATTRIBUTES: [wgpu::VertexAttribute; 4] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Uint32, 5 => Uint32];

    pub(crate) fn layout() -> wgpu::VertexBufferLayout<'static> {
        wgpu::VertexBufferLayout {
            array_stride: size_of::<Self>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &Self::ATTRIBUTES,
        }
    }
}

/// A corner's part of the vertices of a scene with textures.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub(crate) struct TextureCorner {
    pub(crate) uv: [f32; 2],
    /// Texels of the finest level in a metre.
    pub(crate) density: f32,
}

impl TextureCorner {
    const ATTRIBUTES: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![3 => Float32x2, 4 => Float32];

    pub(crate) fn layout() -> wgpu::VertexBufferLayout<'static> {
        wgpu::VertexBufferLayout {
            array_stride: size_of::<Self>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &Self::ATTRIBUTES,
        }
    }
}
