//! Turns the colours of a primitive's vertices into a picture with a pixel for each colour that a triangle has.

use super::{Group, accessor::Accessors, primitive::Surface};
use crate::{
    import::{ImportedMaterial, NO_MATERIAL},
    picture::{Picture, Texture},
};
use glam::{DVec3, Vec2, Vec4};
use gltf::json::{
    Root,
    accessor::Type,
    mesh::{Primitive, Semantic},
    validation::Checked,
};
use photonstream_shading::texture::Wrap;
use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::Arc,
};

/// Most colours of a material that are kept as they are; further ones are rounded.
const MOST_EXACT: usize = 61_440;
/// Steps of each channel of rounded colours: 4096 of them.
const ROUNDED: f64 = 15.0;
/// Pixels in a row of the picture.
const WIDTH: u32 = 256;

const COLOURS: Checked<Semantic> = Checked::Valid(Semantic::Colors(0));

/// The colours of triangles, by material.
///
/// Each triangle has the mean of its corners' colours: it is looked up at the middle of its pixel, so that it is the same
/// however finely. Their alpha is passed over.
pub(super) struct Palettes {
    /// The materials of which some primitive has colours; none for the material of those without.
    coloured: BTreeSet<Option<usize>>,
    by_name: BTreeMap<String, Palette>,
    is_textured: bool,
}

#[derive(Default)]
struct Palette {
    places: HashMap<[u16; 3], u32>,
    colours: Vec<DVec3>,
    is_rounded: bool,
}

impl Palettes {
    pub(super) fn new(root: &Root) -> Self {
        let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let with_colours = primitives.filter(|primitive| primitive.attributes.contains_key(&COLOURS));
        let coloured = with_colours.map(|primitive| primitive.material.map(|m| m.value())).collect();
        Self { coloured, by_name: BTreeMap::new(), is_textured: false }
    }

    /// Whether a primitive's triangles get colours: it, or another of its material, has some, and there is no texture.
    pub(super) fn paints(&mut self, primitive: &Primitive, is_textured: bool) -> bool {
        let is_coloured = self.coloured.contains(&primitive.material.map(|m| m.value()));
        self.is_textured |= is_coloured && is_textured;
        is_coloured && !is_textured
    }

    /// Gives the triangles of a surface their colours, as texture coordinates that [`Palettes::finish`] completes; `sources`
    /// are the numbers of its vertices in the primitive.
    ///
    /// # Errors
    /// A sentence on what is wrong with the colours.
    pub(super) fn paint(
        &mut self,
        surface: &mut Surface,
        primitive: &Primitive,
        accessors: &Accessors<'_>,
        material: &str,
    ) -> Result<(), String> {
        let palette = self.by_name.entry(material.to_owned()).or_default();
        let colours = colours(surface, primitive, accessors)?;
        let plain = std::mem::take(surface);
        let mut own: HashMap<(u32, u32), u32> = HashMap::new();
        surface.read = plain.read;
        for triangle in plain.triangles {
            let mean = colours
                .as_ref()
                .map_or(DVec3::ONE, |of| triangle.iter().map(|&i| of[i as usize]).sum::<DVec3>() / 3.0);
            let colour = palette.place(mean);
            surface.triangles.push(triangle.map(|i| {
                *own.entry((i, colour)).or_insert_with(|| {
                    surface.vertices.push(plain.vertices[i as usize]);
                    surface.normals.extend(plain.normals.get(i as usize));
                    surface.uvs.push(Vec2::new(colour as f32, 0.0));
                    surface.vertices.len() as u32 - 1
                })
            }));
        }
        Ok(())
    }

    /// Gives the materials their pictures, or the one colour that all triangles have; returns what there is to say.
    pub(super) fn finish(
        self,
        groups: &mut BTreeMap<(String, String), Group>,
        materials: &mut BTreeMap<String, ImportedMaterial>,
    ) -> Vec<String> {
        let (mut notices, mut sizes) = (Vec::new(), BTreeMap::new());
        if self.is_textured {
            notices.push("colours of vertices are not read where there is a texture".to_owned());
        }
        for (name, palette) in self.by_name {
            if palette.is_rounded {
                notices.push(format!(
                    "material \"{name}\": colours of triangles beyond {MOST_EXACT} are rounded to a 15th"
                ));
            }
            let white = || ImportedMaterial {
                albedo: DVec3::ONE,
                texture: None,
                radiance: DVec3::ZERO,
                two_sided: false,
            };
            let material = match name.as_str() {
                NO_MATERIAL => materials.entry(name.clone()).or_insert_with(white),
                _ => materials.get_mut(&name).expect("invariant: a material is read before its primitives"),
            };
            let (width, height) = match palette.colours.as_slice() {
                [] => continue,
                &[colour] => {
                    material.albedo *= colour;
                    (0, 0)
                }
                colours => {
                    let width = WIDTH.min(colours.len() as u32);
                    let height = (colours.len() as u32).div_ceil(width);
                    let mut pixels: Vec<Vec4> = colours.iter().map(|c| c.as_vec3().extend(1.0)).collect();
                    pixels.resize((width * height) as usize, Vec4::ONE);
                    let picture = Arc::new(Picture::new(width, height, pixels, false));
                    material.texture = Some(Texture::new(picture, [Wrap::Clamp; 2], None));
                    (width, height)
                }
            };
            sizes.insert(name, (width, height));
        }
        for ((_, material), group) in groups {
            let Some(&(width, height)) = sizes.get(material) else { continue };
            if width == 0 {
                group.mesh.uvs.clear();
            }
            for uv in &mut group.mesh.uvs {
                let place = uv.x as u32;
                let pixel = Vec2::new((place % width) as f32, (place / width) as f32);
                *uv = (pixel + 0.5) / Vec2::new(width as f32, height as f32);
            }
        }
        notices
    }
}

impl Palette {
    /// The number of a colour.
    fn place(&mut self, colour: DVec3) -> u32 {
        let key = |c: DVec3| (c * 65535.0).round().to_array().map(|x| x as u16);
        let mut colour = colour;
        if self.colours.len() >= MOST_EXACT && !self.places.contains_key(&key(colour)) {
            colour = (colour * ROUNDED).round() / ROUNDED;
            self.is_rounded = true;
        }
        *self.places.entry(key(colour)).or_insert_with(|| {
            self.colours.push(colour);
            self.colours.len() as u32 - 1
        })
    }
}

/// Linear RGB in [0, 1] of the vertices of a surface; `None` for a primitive without.
fn colours(
    surface: &Surface,
    primitive: &Primitive,
    accessors: &Accessors<'_>,
) -> Result<Option<Vec<DVec3>>, String> {
    let Some(&accessor) = primitive.attributes.get(&COLOURS) else { return Ok(None) };
    let is_rgba = accessors.root.accessors[accessor.value()].type_ == Checked::Valid(Type::Vec4);
    let (count, of): (usize, Box<dyn Fn(u32) -> DVec3>) = if is_rgba {
        let elements = accessors.elements::<4>(accessor, Type::Vec4)?;
        (elements.count, Box::new(move |i| DVec3::from_slice(&elements.get(i)[..3])))
    } else {
        let elements = accessors.elements::<3>(accessor, Type::Vec3)?;
        (elements.count, Box::new(move |i| DVec3::from_array(elements.get(i))))
    };
    if let Some(bad) = surface.sources.iter().find(|&&i| i as usize >= count) {
        return Err(format!("{count} colours, but there is a vertex {bad}"));
    }
    let colours: Vec<DVec3> = surface.sources.iter().map(|&i| of(i)).collect();
    match colours.iter().find(|colour| !colour.is_finite()) {
        Some(bad) => Err(format!("a colour is not finite: {bad}")),
        None => Ok(Some(colours.into_iter().map(|c| c.clamp(DVec3::ZERO, DVec3::ONE)).collect())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 70 000 greys and as many others: never more than 2¹⁶ colours, each within a 30th of what it was.
    #[test]
    fn palettes_are_bounded() {
        let mut palette = Palette::default();
        for i in 0..140_000u32 {
            let colour = DVec3::new(f64::from(i % 373) / 372.0, f64::from(i / 373 % 373) / 372.0, 0.5);
            let place = palette.place(colour) as usize;
            assert!((palette.colours[place] - colour).abs().max_element() <= 0.5 / ROUNDED + 1e-9);
        }
        assert!(palette.is_rounded && palette.colours.len() <= 65_536, "{}", palette.colours.len());
    }
}
