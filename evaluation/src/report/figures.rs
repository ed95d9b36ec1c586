//! Turns remade figures of paper B into a part of a scene's section.

use super::{escape, figure, portrait::image};
use crate::{EvaluateError, figures::Figure, flip::Exposure, maps::Picture};
use photonstream_film::Film;
use photonstream_renderer::LayerKind;

/// The part; empty where there are no figures. `truth` is the reference.
pub(super) fn part(figures: &[Figure], truth: &Film, exposure: Exposure) -> Result<String, EvaluateError> {
    if figures.is_empty() {
        return Ok(String::new());
    }
    let shown = |film: &Film| -> Result<Picture, EvaluateError> {
        let rgb = exposure.srgb8(&film.layer(LayerKind::Full.name())?.pixels);
        Ok(Picture { width: film.width(), height: film.height(), rgb })
    };
    let mut out = String::from(
        "<h3>After the figures of paper B</h3><p>What of its figures can be remade, in this scene, beside the path-traced \
         reference of all bounces. Shadows of indirect light are by rays unless said otherwise.</p>",
    );
    for Figure { title, shots } in figures {
        out.push_str(&format!("<h4>{}</h4><div class=\"portraits\">", escape(title)));
        for shot in shots {
            let errors = shot.errors.map_or(String::new(), |(rel_rmse, flip)| {
                format!("; relative RMSE {}, FLIP {}", figure(rel_rmse), figure(flip))
            });
            out.push_str(&format!(
                "<figure>{}<figcaption><strong>{}</strong><br>{} lights{errors}</figcaption></figure>",
                image(&shown(&shot.film)?, &format!("{title}, {}", shot.what))?,
                escape(&shot.what),
                shot.lights
            ));
        }
        if shots.iter().all(|shot| shot.errors.is_some()) {
            out.push_str(&format!(
                "<figure>{}<figcaption><strong>reference</strong></figcaption></figure>",
                image(&shown(truth)?, &format!("{title}, reference"))?
            ));
        }
        out.push_str("</div>");
    }
    Ok(out)
}
