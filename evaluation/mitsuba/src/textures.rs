//! Turns textures into PFM files, and into the elements that name them.

use crate::document::Document;
use glam::{Vec2, Vec3};
use photonstream_scene::{Material, Scene, Texture};
use photonstream_shading::texture::Wrap;
use std::sync::Arc;

/// Edge of the square of pixels that stands for one of a texture with holes: their outline runs between its pixels.
const MASK_PIXELS: u32 = 4;

/// The file of a material's texture, seen from the folder of `scene.xml`.
fn file(index: usize, what: &str) -> String {
    format!("textures/{index}-{what}.pfm")
}

/// The reflectance of material `index`: a colour, or a texture.
pub(crate) fn reflectance(document: &mut Document, index: usize, material: &Material) {
    let Some(texture) = &material.texture else { return document.rgb("reflectance", material.albedo) };
    bitmap(document, "reflectance", file(index, "albedo"), (texture, "bilinear"));
}

/// The opacity of material `index`, whose texture has holes.
pub(crate) fn opacity(document: &mut Document, index: usize, texture: &Texture) {
    bitmap(document, "opacity", file(index, "mask"), (texture, "nearest"));
}

fn bitmap(document: &mut Document, name: &str, file: String, (texture, filter): (&Texture, &str)) {
    document.begin("texture", &[("type", &"bitmap"), ("name", &name)]);
    document.property("string", "filename", file);
    // Numbers as they are, no colours to be understood.
    document.property("boolean", "raw", "true");
    document.property("string", "filter_type", filter);
    let wrap = match texture.layout.wrap_u {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    };
    document.property("string", "wrap_mode", wrap);
    document.end();
}

/// The files of all textures that objects of `scene` use: name and content.
pub(crate) fn files(scene: &Scene) -> Vec<(String, Vec<u8>)> {
    let mut files = Vec::new();
    for (index, material) in scene.materials.iter().enumerate() {
        let Some(texture) = &material.texture else { continue };
        let (width, height) = (texture.layout.width, texture.layout.height);
        // The centre of a pixel is the pixel itself.
        let at = |x: u32, y: u32, size: [u32; 2]| {
            Vec2::new((x as f32 + 0.5) / size[0] as f32, (y as f32 + 0.5) / size[1] as f32)
        };
        let inside = Texture { picture: Arc::clone(&texture.picture), ..*texture };
        let colour = |x, y| material.albedo * inside.bilinear(at(x, y, [width, height]), 0).truncate();
        files.push((
            file(index, "albedo"),
            encode(width, height, "PF", |x, y| colour(x, y).to_array().to_vec()),
        ));
        if texture.cutoff.is_some() {
            let size = [width * MASK_PIXELS, height * MASK_PIXELS];
            let is_there = |x, y| vec![f32::from(u8::from(!texture.is_hole(at(x, y, size))))];
            files.push((file(index, "mask"), encode(size[0], size[1], "Pf", is_there)));
        }
    }
    files
}

/// A PFM file: rows from the bottom, little-endian.
fn encode(width: u32, height: u32, kind: &str, pixel: impl Fn(u32, u32) -> Vec<f32>) -> Vec<u8> {
    let mut bytes = format!("{kind}\n{width} {height}\n-1.0\n").into_bytes();
    for y in (0..height).rev() {
        for x in 0..width {
            bytes.extend(pixel(x, y).into_iter().flat_map(f32::to_le_bytes));
        }
    }
    bytes
}

/// Black, whatever the material.
pub(crate) fn black(document: &mut Document) {
    document.rgb("reflectance", Vec3::ZERO);
}
