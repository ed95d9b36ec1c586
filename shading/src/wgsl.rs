//! Turns this crate's constants into WGSL, and names the shader twins of its functions.
//!
//! A twin has the file stem, names, parameter order and expression order of its Rust function. Constants are printed
//! from Rust, never typed twice.

use crate::{LightShape, Sky, distance_map, patch, sky::Spread, surface, texture::Wrap, tone::ToneMap};
use core::f32::consts::{FRAC_1_PI, PI};
use std::fmt::Write;

/// Twin of [`crate::kernel`].
pub const KERNEL: &str = include_str!("../wgsl/kernel.wgsl");
/// Twin of [`crate::basis`].
pub const BASIS: &str = include_str!("../wgsl/basis.wgsl");
/// Twin of [`crate::distance_map`]; the module that includes it has `distance_map_inverse`, as [`DISTANCE_TEXELS`] do.
pub const DISTANCE_MAP: &str = include_str!("../wgsl/distance_map.wgsl");
/// What texels of published distance maps hold; the module that includes it has `distance_maps: array<u32>`.
pub const DISTANCE_TEXELS: &str = include_str!("../wgsl/distance_texels.wgsl");
/// Twin of [`crate::camera`].
pub const CAMERA: &str = include_str!("../wgsl/camera.wgsl");
/// Twin of [`crate::culling`].
pub const CULLING: &str = include_str!("../wgsl/culling.wgsl");
/// Twin of [`crate::light`]: what arrives, not what is emitted.
pub const LIGHT: &str = include_str!("../wgsl/light.wgsl");
/// Twin of [`crate::octahedral`].
pub const OCTAHEDRAL: &str = include_str!("../wgsl/octahedral.wgsl");
/// Twin of [`crate::patch`].
pub const PATCH: &str = include_str!("../wgsl/patch.wgsl");
/// Twin of [`crate::sky`], without photons; the module that includes it has `sky: Sky` and `sky_map: texture_2d<f32>`, and
/// [`BASIS`].
pub const SKY: &str = include_str!("../wgsl/sky.wgsl");
/// Twin of [`crate::sobol`].
pub const SOBOL: &str = include_str!("../wgsl/sobol.wgsl");
/// Twin of [`crate::surface`]: the shading normal.
pub const SURFACE: &str = include_str!("../wgsl/surface.wgsl");
/// Twin of [`crate::texture`]; the module that includes it has `texels: array<vec2u>`, and [`WRAP`].
pub const TEXTURE: &str = include_str!("../wgsl/texture.wgsl");
/// Twin of [`crate::tone`].
pub const TONE: &str = include_str!("../wgsl/tone.wgsl");
/// Twin of the wraps of [`crate::texture`].
pub const WRAP: &str = include_str!("../wgsl/wrap.wgsl");

/// Every twin with its file's stem.
pub const TWINS: [(&str, &str); 14] = [
    ("kernel", KERNEL),
    ("basis", BASIS),
    ("distance_map", DISTANCE_MAP),
    ("camera", CAMERA),
    ("culling", CULLING),
    ("light", LIGHT),
    ("octahedral", OCTAHEDRAL),
    ("patch", PATCH),
    ("sky", SKY),
    ("sobol", SOBOL),
    ("surface", SURFACE),
    ("texture", TEXTURE),
    ("tone", TONE),
    ("wrap", WRAP),
];

/// Number of a light's kind in shaders and in published records.
pub fn light_kind(shape: &LightShape) -> u32 {
    match shape {
        LightShape::Point { .. } => 0,
        LightShape::Spot { .. } => 1,
        LightShape::Directional { .. } => 2,
        LightShape::Parallelogram { .. } => 3,
        LightShape::Triangle { .. } => 4,
        LightShape::Sky { .. } => 5,
        LightShape::Mesh { .. } => 6,
    }
}

const LIGHT_KINDS: [&str; 7] = ["POINT", "SPOT", "DIRECTIONAL", "PARALLELOGRAM", "TRIANGLE", "SKY", "MESH"];

/// Number of a sky's kind in shaders.
pub fn sky_kind(sky: &Sky) -> u32 {
    match sky.spread() {
        Spread::Gradient(_) => 0,
        Spread::Map(..) => 1,
    }
}

const SKY_KINDS: [&str; 2] = ["GRADIENT", "MAP"];

/// The constants that shaders share with Rust, as WGSL declarations.
pub fn constants() -> String {
    let mut text = String::from("// Printed from Rust.\n");
    let mut float = |name: &str, value: f32| {
        // Rust prints the shortest decimal that is read back as the same f32.
        let _ = writeln!(text, "const {name}: f32 = {value:?}f;");
    };
    float("PI", PI);
    float("FRAC_1_PI", FRAC_1_PI);
    float("F32_MAX", f32::MAX);
    float("F32_MIN_POSITIVE", f32::MIN_POSITIVE);
    float("RELATIVE_OFFSET", surface::RELATIVE_OFFSET);
    float("SHADING_COS", surface::SHADING_COS);
    float("PATCH_NEAR_AREAS", patch::NEAR_AREAS);
    float("DISTANCE_BIAS_TEXELS", distance_map::BIAS_TEXELS);
    let _ = writeln!(text, "const DISTANCE_LEAST: u32 = {}u;", distance_map::LEAST);
    let _ = writeln!(text, "const DISTANCE_SHIFT: u32 = {}u;", distance_map::SHIFT);
    let _ = writeln!(text, "const PATCH_MAX_CORNERS: u32 = {}u;", patch::MAX_CORNERS);
    for (number, name) in LIGHT_KINDS.iter().enumerate() {
        let _ = writeln!(text, "const LIGHT_{name}: u32 = {number}u;");
    }
    for (wrap, name) in [(Wrap::Repeat, "REPEAT"), (Wrap::Mirror, "MIRROR"), (Wrap::Clamp, "CLAMP")] {
        let _ = writeln!(text, "const TEXTURE_{name}: u32 = {}u;", wrap as u32);
    }
    for (number, name) in SKY_KINDS.iter().enumerate() {
        let _ = writeln!(text, "const SKY_{name}: u32 = {number}u;");
    }
    for (number, map) in ToneMap::ALL.iter().enumerate() {
        let _ = writeln!(text, "const TONE_MAP_{}: u32 = {number}u;", map.name().to_uppercase());
    }
    text
}

/// Number of a tone map in shaders.
pub fn tone_map_number(map: ToneMap) -> u32 {
    ToneMap::ALL.iter().position(|&m| m == map).expect("invariant: ALL has every tone map") as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::EmissiveMesh;
    use glam::{DVec3, Vec3};

    #[test]
    fn constants_have_their_values_and_kinds_their_numbers() {
        let text = constants();
        assert!(text.contains("const PI: f32 = 3.1415927f;"), "{text}");
        assert!(text.contains("const TONE_MAP_ACES: u32 = 2u;"), "{text}");
        let shapes = [
            LightShape::Point { position: Vec3::ZERO },
            LightShape::Spot {
                position: Vec3::ZERO,
                direction: Vec3::X,
                versine_inner: 0.1,
                versine_outer: 0.2,
            },
            LightShape::Directional { direction: Vec3::X },
            LightShape::Parallelogram { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y },
            LightShape::Triangle { corner: Vec3::ZERO, edge_u: Vec3::X, edge_v: Vec3::Y },
            LightShape::Sky { sky: Sky::gradient(DVec3::ONE, DVec3::ONE, DVec3::ONE).into() },
            LightShape::Mesh {
                mesh: EmissiveMesh::new([[Vec3::ZERO, Vec3::X, Vec3::Y]]).expect("it has an area").into(),
            },
        ];
        for (shape, name) in shapes.iter().zip(LIGHT_KINDS) {
            assert!(text.contains(&format!("const LIGHT_{name}: u32 = {}u;", light_kind(shape))), "{text}");
        }
    }
}
