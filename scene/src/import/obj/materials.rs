//! Turns an MTL file into reflectances with their textures, and radiances.

use super::{Beside, Pictures};
use crate::{
    import::{ImportedMaterial, texture::decode},
    picture::{Picture, Texture},
};
use glam::{DAffine2, DVec2, DVec3};
use photonstream_shading::texture::Wrap;
use std::sync::Arc;

/// The alpha below which a texture has holes.
const CUTOFF: f32 = 0.5;

/// The materials of the MTL file called `name`.
///
/// # Errors
/// A sentence on what is wrong with it.
pub(super) fn library(name: &str, beside: &mut Beside<'_>) -> Result<Vec<tobj::Material>, String> {
    let content = beside.read(name).map_err(|e| format!("material file {e}"))?;
    let at = |problem: String| format!("material file {name}: {problem}");
    let text = complete_colours(&String::from_utf8_lossy(&content)).map_err(at)?;
    let (materials, _) = tobj::load_mtl_buf(&mut text.as_bytes()).map_err(|e| at(e.to_string()))?;
    Ok(materials)
}

/// Writes colours of one number, which MTL allows for greys, with the three that tobj wants, and refuses others.
fn complete_colours(text: &str) -> Result<String, String> {
    let mut complete = String::with_capacity(text.len());
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        match words.as_slice() {
            ["Ka" | "Kd" | "Ks" | "Ke", numbers @ ..] if numbers.len() != 3 => match numbers {
                [grey] => complete.push_str(&format!("{} {grey} {grey} {grey}", words[0])),
                _ => {
                    let found = words.join(" ");
                    return Err(format!(
                        "line {}: found `{found}`, expected one or three numbers",
                        index + 1
                    ));
                }
            },
            _ => complete.push_str(line),
        }
        complete.push('\n');
    }
    Ok(complete)
}

/// The materials of MTL files, with each picture read once.
pub(super) struct Surfaces<'p> {
    pub(super) beside: Beside<'p>,
    pub(super) pictures: Pictures<[Option<String>; 2]>,
    pub(super) notices: Vec<String>,
}

impl Surfaces<'_> {
    /// A material, and the map from the texture coordinates of the file to those of its picture, if it has one.
    pub(super) fn material(&mut self, material: &tobj::Material) -> (ImportedMaterial, Option<DAffine2>) {
        let vector =
            |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
        let albedo = vector(material.diffuse, DVec3::ONE);
        let dissolve = dissolve(material);
        let (texture, map) = self.texture(material, dissolve).unzip();
        if dissolve < 1.0 && texture.as_ref().is_none_or(|texture: &Texture| texture.cutoff.is_none()) {
            self.note(format!(
                "material \"{}\": d is not read: it is opaque, not {dissolve}; `transmit` lets light pass",
                material.name
            ));
        }
        let radiance = vector(material.emissive, DVec3::ZERO);
        (ImportedMaterial { albedo, texture, radiance, two_sided: false }, map)
    }

    fn note(&mut self, notice: String) {
        if !self.notices.contains(&notice) {
            self.notices.push(notice);
        }
    }

    /// The picture of a material, with holes where `map_d` says, and the map to its coordinates.
    fn texture(&mut self, material: &tobj::Material, dissolve: f32) -> Option<(Texture, DAffine2)> {
        let mut note = |problem: String| self.note(format!("material \"{}\": {problem}", material.name));
        let colour = material.diffuse_texture.as_deref().map(Map::read);
        let mut mask = material.dissolve_texture.as_deref().map(Map::read);
        if let (Some(colour), Some(of_mask)) = (&colour, &mask)
            && colour.name != of_mask.name
            && (colour.transform, colour.wrap) != (of_mask.transform, of_mask.wrap)
        {
            note("map_d is not read: its -s, -o or -clamp are others than those of map_Kd".into());
            mask = None;
        }
        let name = |map: &Option<Map<'_>>| map.as_ref().map(|map| map.name.to_owned());
        let mut names = [name(&colour), name(&mask)];
        if names.iter().all(Option::is_none) {
            return None;
        }
        let mut has_holes = mask.is_some();
        let mut picture = self.picture(&names);
        if let (Err(problem), [Some(_), Some(_)]) = (&picture, &names) {
            // One of two can stand alone.
            self.note(format!("material \"{}\": texture {problem}", material.name));
            for alone in [[names[0].clone(), None], [None, names[1].clone()]] {
                if picture.is_err() {
                    has_holes = alone[1].is_some();
                    picture = self.picture(&alone);
                    names = alone;
                }
            }
        }
        match picture {
            Ok(picture) => {
                let map = if names[0].is_some() { colour } else { mask };
                let map = map?;
                // The picture's alpha counts times `d`.
                let cutoff = has_holes.then_some(CUTOFF / dissolve);
                Some((Texture::new(picture, [map.wrap; 2], cutoff), map.transform))
            }
            Err(problem) => {
                self.note(format!("material \"{}\": texture {problem}; Kd is used alone", material.name));
                None
            }
        }
    }

    /// The picture of these colours with holes by that mask.
    fn picture(&mut self, names: &[Option<String>; 2]) -> Result<Arc<Picture>, String> {
        let Self { beside, pictures, .. } = self;
        let mut decoded = |name: &str| {
            let bytes = beside.read(name)?;
            decode(&bytes).map_err(|e| format!("\"{name}\" is no picture ({e})"))
        };
        let label =
            names.iter().flatten().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(" with ");
        let read = || match names {
            [Some(colour), Some(mask)] if colour != mask => {
                let colour = decoded(colour)?;
                decoded(mask)?.masking(Some(&colour))
            }
            [Some(colour), mask] => Ok(decoded(colour)?.picture(mask.is_some())),
            [None, Some(mask)] => decoded(mask)?.masking(None),
            [None, None] => Err("none".into()),
        };
        let holes = names[1].is_some();
        pictures.get(names.clone(), holes, &label, read)
    }
}

/// How opaque a material is: `d`, else 1 less `Tr`; 1 where neither is a share.
fn dissolve(material: &tobj::Material) -> f32 {
    let through = material.unknown_param.get("Tr").and_then(|text| text.trim().parse::<f32>().ok());
    let d = material.dissolve.or(through.map(|through| 1.0 - through)).unwrap_or(1.0);
    if (0.0..=1.0).contains(&d) { d } else { 1.0 }
}

/// What a `map_` line says: options, then the name of a file.
#[derive(Debug, PartialEq)]
struct Map<'l> {
    name: &'l str,
    wrap: Wrap,
    /// Scale, then offset.
    transform: DAffine2,
}

impl<'l> Map<'l> {
    fn read(line: &'l str) -> Self {
        let (mut scale, mut offset, mut wrap) = (DVec2::ONE, DVec2::ZERO, Wrap::Repeat);
        let mut rest = line.trim();
        while rest.starts_with('-') {
            let (option, after) = word(rest);
            rest = after;
            // Each option has its arguments: two or three numbers, of which all but the first may be missing, or a word.
            let mut numbers = Vec::new();
            match option {
                "-s" | "-o" | "-t" | "-mm" => {
                    while numbers.len() < 3
                        && let Ok(number) = word(rest).0.parse::<f64>()
                        && !word(rest).1.is_empty()
                    {
                        numbers.push(number);
                        rest = word(rest).1;
                    }
                }
                _ => {
                    if option == "-clamp" && word(rest).0 == "on" {
                        wrap = Wrap::Clamp;
                    }
                    rest = word(rest).1;
                }
            }
            let pair = |default: f64| {
                let of = |i: usize| numbers.get(i).copied().unwrap_or(default);
                DVec2::new(of(0), of(1))
            };
            match option {
                "-s" => scale = pair(1.0),
                "-o" => offset = pair(0.0),
                _ => {}
            }
        }
        let transform = DAffine2::from_scale_angle_translation(scale, 0.0, offset);
        Self { name: rest, wrap, transform }
    }
}

/// The first word, and what follows it.
fn word(text: &str) -> (&str, &str) {
    let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_have_options_before_their_name() {
        let map = Map::read("-s 2 3 1 -o 0.5 -clamp on -blendu off my picture.png");
        assert_eq!((map.name, map.wrap), ("my picture.png", Wrap::Clamp));
        assert_eq!(map.transform.transform_point2(DVec2::new(1.0, 1.0)), DVec2::new(2.5, 3.0));
        assert_eq!(Map::read("brick.png").transform, DAffine2::IDENTITY);
        assert_eq!(Map::read("-s 1 1 1 1.png").name, "1.png");
        assert_eq!(Map::read("-s 2").name, "2");
        assert_eq!(Map::read("-").name, "");
    }
}
