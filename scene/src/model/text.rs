//! Turns what was chosen for a model into the text of a scene file.

use super::{
    file::{GREY, Kind, ModelFile, OBJECT},
    floor::Floor,
    lighting::Added,
    view::View,
};
use glam::{DVec3, Vec3};
use std::fmt::Write;

/// All that a scene file of a model says.
pub(super) struct Chosen<'f> {
    pub(super) file: &'f ModelFile,
    /// The origin that all positions here are relative to, m.
    pub(super) origin: DVec3,
    pub(super) view: View,
    pub(super) floor: Option<Floor>,
    pub(super) added: Option<Added>,
    pub(super) vsls: u32,
    pub(super) exposure_ev: f64,
    /// For the comment at the top.
    pub(super) choices: Vec<String>,
}

/// 64 paths for each virtual surface light, from 2¹⁷ to 2²⁰.
pub(super) fn pool_paths(vsls: u32) -> u32 {
    (vsls.saturating_mul(64)).next_power_of_two().clamp(1 << 17, 1 << 20)
}

impl Chosen<'_> {
    pub(super) fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out).expect("invariant: a string takes all that is written to it");
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let path = std::path::Path::new(&self.file.path);
        let name = path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
        if !self.choices.is_empty() {
            writeln!(out, "# Chosen for this model:")?;
            self.choices.iter().try_for_each(|choice| writeln!(out, "# - {choice}"))?;
        }
        writeln!(out, "name = {}\n", quoted(&name))?;
        let View { position, target, up, vertical_fov_deg, size } = self.view;
        // As precise as the distance between them asks for.
        let step = f64::from((target - position).length()) * 1e-4;
        writeln!(out, "[camera]")?;
        writeln!(out, "position_m = {}", self.point(position, step))?;
        writeln!(out, "target_m = {}", self.point(target, step))?;
        if up != Vec3::Y {
            writeln!(out, "up = {}", numbers(up.as_dvec3(), 1e-6))?;
        }
        writeln!(out, "vertical_fov_deg = {}\n", rounded(vertical_fov_deg.into(), 1e-4))?;
        if self.file.kind == Kind::Ply || self.floor.is_some() {
            writeln!(out, "[material.{}]\nalbedo = {:?}\n", GREY.0, GREY.1)?;
        }
        self.write_model(out)?;
        if let Some(Floor { centre, half }) = self.floor {
            let step = f64::from(half) * 1e-5;
            let corner = self.point(centre + Vec3::new(-half, 0.0, half), step);
            let edge = rounded(2.0 * f64::from(half), step);
            writeln!(out, "[object.floor]\nmaterial = \"{}\"", GREY.0)?;
            writeln!(
                out,
                "quad = {{ corner_m = {corner}, edge_u_m = [{edge:?}, 0.0, 0.0], edge_v_m = [0.0, 0.0, {:?}] }}\n",
                -edge
            )?;
        }
        self.write_lights(out)?;
        writeln!(
            out,
            "[streaming]\nvsls = {}\npool_paths = {}\nadaptive = true\n",
            self.vsls,
            pool_paths(self.vsls)
        )?;
        writeln!(out, "[render]\nwidth_px = {}\nheight_px = {}", size.0, size.1)?;
        writeln!(out, "visibility = \"octahedral\"\nexposure_ev = {:?}", self.exposure_ev)
    }

    fn write_model(&self, out: &mut String) -> std::fmt::Result {
        let ModelFile { kind, path, up_axis, unit_m, two_sided, .. } = self.file;
        writeln!(out, "[object.{OBJECT}]")?;
        let table = match kind {
            Kind::Gltf => "gltf",
            Kind::Obj => "obj",
            Kind::Ply => "ply",
        };
        if *kind == Kind::Ply {
            writeln!(out, "material = \"{}\"", GREY.0)?;
        }
        if *kind != Kind::Gltf {
            writeln!(out, "sides = \"{}\"", if *two_sided { "both" } else { "front" })?;
        }
        let (path, axis) = (quoted(path), up_axis.name());
        writeln!(out, "{table} = {{ path = {path}, up_axis = \"{axis}\", unit_m = {unit_m:?} }}\n")
    }

    fn write_lights(&self, out: &mut String) -> std::fmt::Result {
        match &self.added {
            None => Ok(()),
            Some(Added::Sun { direction, irradiance }) => {
                let (direction, irradiance) =
                    (numbers(direction.as_dvec3(), 1e-3), numbers(irradiance.as_dvec3(), 1e-3));
                writeln!(out, "[light.sun]\nirradiance_w_m2 = {irradiance}")?;
                writeln!(out, "directional = {{ direction = {direction} }}\n")
            }
            Some(Added::Lamps(lamps)) => lamps.iter().enumerate().try_for_each(|(i, (position, power))| {
                let power = numbers(power.as_dvec3(), f64::from(power.max_element()) * 1e-3);
                let step = f64::from((*position - self.view.position).length()) * 1e-4;
                writeln!(out, "[light.lamp{}]\npower_w = {power}", i + 1)?;
                writeln!(out, "point = {{ position_m = {} }}\n", self.point(*position, step))
            }),
        }
    }

    /// A point of the scene's space in the coordinates of the file, rounded to `step`.
    fn point(&self, point: Vec3, step: f64) -> String {
        numbers(self.origin + point.as_dvec3(), step)
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn numbers(v: DVec3, step: f64) -> String {
    let [x, y, z] = v.to_array().map(|x| rounded(x, step));
    format!("[{x:?}, {y:?}, {z:?}]")
}

/// The nearest multiple of the power of ten that is at most `step`, without noise in its digits.
fn rounded(x: f64, step: f64) -> f64 {
    let digits = if step > 0.0 { (-step.log10()).ceil().clamp(0.0, 15.0) as usize } else { 15 };
    let text = format!("{x:.digits$}");
    // No negative zero.
    text.parse::<f64>().unwrap_or(x) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_long_as_they_need_to_be() {
        assert_eq!(rounded(1.23456789, 1e-3), 1.235);
        assert_eq!(rounded(-1e-9, 1e-3).to_bits(), 0);
        assert_eq!(rounded(1234.5678, 0.02), 1234.57);
        assert_eq!(rounded(1.5e-7, 1e-9), 1.5e-7);
        assert_eq!(quoted("a\"b\\c"), "'a\"b\\c'");
    }
}
