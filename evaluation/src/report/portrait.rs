//! Turns measured pictures into those worth showing, side by side with their errors.

use super::{again, escape, figure, figures, series::kind, time};
use crate::{
    EvaluateError,
    figures::Figure,
    flip::{Exposure, flip},
    maps::{Picture, flip_picture, mean_luminance, signed_error},
    plan,
    results::Row,
    truth::{Noise, Truth},
};
use base64::{Engine, engine::general_purpose::STANDARD};
use glam::Vec3;
use photonstream_film::Film;
use photonstream_renderer::LayerKind;
use photonstream_scene::{Scene, features::Decision};

/// A picture and the row that it belongs to.
#[derive(Clone, Debug)]
pub struct Portrait {
    /// What was measured.
    pub row: Row,
    /// Its picture, with a full layer.
    pub film: Film,
}

/// What the report needs of a scene beside its rows.
#[derive(Clone, Debug)]
pub struct SceneSheet {
    pub(super) name: String,
    pub(super) hash: String,
    pub(super) decisions: Vec<Decision>,
    pub(super) notices: Vec<String>,
    pub(super) noise: Noise,
    pub(super) triangles: usize,
    exposure: Exposure,
    truth: Film,
    portraits: Vec<Portrait>,
    /// Figures of paper B.
    pub figures: Vec<Figure>,
}

/// Most pictures of one scene.
const MOST: usize = 16;

impl SceneSheet {
    /// A scene without pictures yet.
    pub fn new(scene: &Scene, truth: &Truth) -> Self {
        Self {
            name: scene.name.clone(),
            hash: format!("{:016x}", scene.hash),
            decisions: scene.features.decisions(),
            notices: scene.notices.clone(),
            noise: truth.noise,
            triangles: scene.geometry.triangles.len(),
            exposure: Exposure { ev: scene.render.exposure_ev, tone_map: scene.render.tone_map },
            truth: truth.film.clone(),
            portraits: Vec::new(),
            figures: Vec::new(),
        }
    }

    /// Takes a picture if it shows its kind better than the one that is there: of those that take about as long as the
    /// scene's own settings the one with the least error, else the fastest.
    pub fn offer(&mut self, portrait: Portrait) {
        let about = self.portraits.first().map_or(f64::INFINITY, |own| own.row.total_ms * 1.15);
        let rank = |row: &Row| {
            if row.total_ms <= about { (0, row.rel_rmse) } else { (1, row.total_ms) }
        };
        let is_own = |row: &Row| row.sweeps.split(' ').any(|s| s == plan::CONFIG || s == "point");
        if is_own(&portrait.row) {
            self.portraits.push(portrait);
            self.portraits.truncate(MOST);
            return;
        }
        let name = kind(&portrait.row);
        match self.portraits.iter().position(|p| kind(&p.row) == name) {
            Some(at) => {
                let known = &self.portraits[at].row;
                if !is_own(known) && rank(&portrait.row) < rank(known) {
                    self.portraits[at] = portrait;
                }
            }
            None if self.portraits.len() < MOST => self.portraits.push(portrait),
            None => {}
        }
    }

    /// Paper B's figures, remade.
    pub(super) fn figures_html(&self) -> Result<String, EvaluateError> {
        figures::part(&self.figures, &self.truth, self.exposure)
    }

    /// The reference, and every picture with its errors.
    pub(super) fn html(&self) -> Result<String, EvaluateError> {
        let (width, height) = (self.truth.width(), self.truth.height());
        let truth = &self.truth.layer(LayerKind::Full.name())?.pixels;
        let mean = mean_luminance(truth);
        let shown = |pixels: &[Vec3]| Picture { width, height, rgb: self.exposure.srgb8(pixels) };
        let mut out = String::from("<div class=\"portraits\">");
        out.push_str(&format!(
            "<figure><div class=\"trio\">{}</div><figcaption><strong>Reference</strong><br>{} paths per pixel, relative \
             RMSE {} from noise</figcaption></figure>",
            image(&shown(truth), &format!("Reference picture of {}", self.name))?,
            self.noise.spp,
            figure(self.noise.full)
        ));
        for portrait in &self.portraits {
            let row = &portrait.row;
            let pixels = &portrait.film.layer(LayerKind::Full.name())?.pixels;
            let flip = flip(width, height, pixels, truth, self.exposure);
            let name = kind(row);
            let trio = [
                image(&shown(pixels), &format!("{name}: picture"))?,
                image(&signed_error(width, height, pixels, truth, mean), &format!("{name}: signed error"))?,
                image(&flip_picture(width, height, &flip), &format!("{name}: FLIP"))?,
            ];
            let settings = settings(row);
            out.push_str(&format!(
                "<figure><div class=\"trio\">{}</div><figcaption><strong>{}</strong><br>{}<br>{}: relative RMSE {}, bias \
                 {:+.1} %, FLIP {}{}</figcaption></figure>",
                trio.concat(),
                escape(&name),
                escape(&settings),
                time(row.total_ms),
                figure(row.rel_rmse),
                100.0 * row.bias,
                figure(row.flip),
                again::command(&row.command)
            ));
        }
        out.push_str("</div>");
        out.push_str(&format!(
            "<p class=\"note\">Each trio: picture, signed error, FLIP. Orange is too bright, blue too dark, full colour at a \
             difference of {} W m⁻² sr⁻¹, the mean of the reference. FLIP from black (no difference) to pale yellow.</p>",
            figure(f64::from(mean))
        ));
        Ok(out)
    }
}

/// What a row was measured with, beside its method.
pub(super) fn settings(row: &Row) -> String {
    let mut parts = Vec::new();
    let mut add = |what: &str, value: Option<String>| parts.extend(value.map(|v| format!("{v}{what}")));
    add(" lights", row.vsls.map(|v| v.to_string()));
    add(" paths", row.pool_paths.map(|v| v.to_string()));
    add("", row.kernel.clone().map(|k| format!("kernel {k}")));
    add("", row.visibility.clone().map(|v| format!("visibility {v}")));
    add("", row.accumulation.clone());
    add("", row.interleave.filter(|&n| n > 1).map(|n| format!("interleave {n}")));
    add("", row.sampling.clone().filter(|s| s != "replay"));
    add(" paths per pixel", row.spp.map(|v| v.to_string()));
    add("", (row.threads != row.cores).then(|| format!("{} threads", row.threads)));
    parts.join(", ")
}

pub(super) fn image(picture: &Picture, alt: &str) -> Result<String, EvaluateError> {
    let png = picture.png().map_err(|e| EvaluateError::draw(alt, e))?;
    Ok(format!(
        "<img src=\"data:image/png;base64,{}\" width=\"{}\" height=\"{}\" alt=\"{}\">",
        STANDARD.encode(png),
        picture.width,
        picture.height,
        escape(alt)
    ))
}
