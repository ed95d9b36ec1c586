//! Gathers in what the last picture falls short of the published light.

use photonstream_protocol::VslFrame;
use photonstream_renderer::distance_map_edge;
use photonstream_renderer_wgpu::{GpuError, Renderer, Shadows, Show, View};
use photonstream_scene::Visibility;

/// In what the last picture falls short.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Flaws {
    /// Lights beyond the last shadow map.
    unshadowed: u32,
    /// Virtual surface lights beyond the last shadow map.
    unshadowed_vsls: u32,
    /// Published records with impossible values.
    refused: u32,
    /// Standard error of indirect light by shadow rays, as rel. RMSE.
    noise: Option<f64>,
    /// Distance maps are asked for, and there are none.
    lacks_maps: bool,
    is_known: bool,
    /// The segment, its frame and the view of it that `refused` is about.
    counted: Option<(u64, u64, Show)>,
}

impl Flaws {
    /// There is another picture.
    pub(crate) fn forget(&mut self) {
        self.is_known = false;
    }

    /// Looks at the picture of `view` that `renderer` has just drawn, unless it did already; waits for the device.
    ///
    /// # Errors
    /// A failed device.
    pub(crate) fn look(
        &mut self,
        renderer: &Renderer,
        view: &View,
        frame: &VslFrame,
    ) -> Result<(), GpuError> {
        if self.is_known {
            return Ok(());
        }
        self.unshadowed = if view.shadows == Shadows::Maps { renderer.unshadowed_lights() } else { 0 };
        let by_maps = view.visibility == Visibility::ShadowMaps && has_indirect(view);
        self.unshadowed_vsls = if by_maps { renderer.unshadowed_vsls() } else { 0 };
        let counted = Some((frame.epoch, frame.frame, view.show));
        if self.counted != counted {
            self.refused = renderer.refused_records()?;
            self.counted = counted;
        }
        let by_rays = view.visibility == Visibility::Rays && has_indirect(view);
        self.noise = if by_rays { renderer.noise()? } else { None };
        let has_maps = distance_map_edge(frame.distances.len(), frame.vsls.len()).is_some();
        self.lacks_maps = view.visibility == Visibility::Octahedral && has_indirect(view) && !has_maps;
        self.is_known = true;
        Ok(())
    }

    /// The noise, where there is any.
    pub(crate) fn noise(&self) -> Option<f64> {
        self.noise.filter(|&noise| noise > 0.0)
    }

    /// What the user should know.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.lacks_maps {
            warnings.push("no distance maps are published; set streaming.distance_map_px = 32".to_owned());
        }
        if self.unshadowed > 0 {
            let n = self.unshadowed;
            warnings.push(format!("{n} lights without shadows: too many for maps; choose shadows rays"));
        }
        if self.unshadowed_vsls > 0 {
            let n = self.unshadowed_vsls;
            warnings.push(format!(
                "{n} indirect lights without shadows: too many for maps; choose visibility rays"
            ));
        }
        if self.refused > 0 {
            let n = self.refused;
            warnings.push(format!("{n} published lights have impossible values and are not shown"));
        }
        warnings
    }
}

/// In what a picture of `view` is approximate by choice, in few words.
pub(crate) fn approximation(view: &View) -> Option<String> {
    let mut words = Vec::new();
    if view.visibility == Visibility::Ao {
        words.push("ambient occlusion".to_owned());
    }
    if view.visibility == Visibility::Octahedral {
        words.push("shadows from distance maps".to_owned());
    }
    if view.visibility == Visibility::ShadowMaps {
        words.push(format!("shadow maps of {0}×{0}", view.shadow_map_px));
    }
    if view.interleave > 1 && view.visibility != Visibility::Rays {
        words.push(format!("interleaved {0}×{0}", view.interleave));
    }
    (has_indirect(view) && !words.is_empty()).then(|| format!("approximate: {}", words.join(", ")))
}

fn has_indirect(view: &View) -> bool {
    matches!(view.show, Show::Layer(kind) if kind.needs_indirect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use photonstream_renderer::LayerKind;
    use photonstream_scene::RenderSettings;
    use photonstream_shading::Camera;

    #[test]
    fn only_what_falls_short_is_told() {
        let flawless = Flaws { noise: Some(0.0), ..Flaws::default() };
        assert_eq!((flawless.warnings(), flawless.noise()), (vec![], None));
        let flaws =
            Flaws { unshadowed: 3, unshadowed_vsls: 5, refused: 7, noise: Some(0.02), ..Flaws::default() };
        let warnings = flaws.warnings();
        let begins = ["3 lights", "5 indirect", "7 "];
        assert!(
            warnings.len() == 3 && warnings.iter().zip(begins).all(|(w, b)| w.starts_with(b)),
            "{warnings:?}"
        );
        assert_eq!(flaws.noise(), Some(0.02));
    }

    #[test]
    fn an_approximate_picture_says_so() {
        let camera = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0).unwrap();
        let view = |visibility, interleave, kind| View {
            visibility,
            interleave,
            show: Show::Layer(kind),
            ..View::from_settings(&RenderSettings::default(), &camera)
        };
        let say = |visibility, interleave| approximation(&view(visibility, interleave, LayerKind::Full));
        assert_eq!(say(Visibility::None, 1), None);
        assert_eq!(say(Visibility::Rays, 4), None, "rays go from every pixel");
        assert_eq!(say(Visibility::Ao, 1).as_deref(), Some("approximate: ambient occlusion"));
        assert_eq!(
            say(Visibility::Ao, 4).as_deref(),
            Some("approximate: ambient occlusion, interleaved 4×4")
        );
        assert_eq!(say(Visibility::ShadowMaps, 1).as_deref(), Some("approximate: shadow maps of 128×128"));
        assert_eq!(approximation(&view(Visibility::Ao, 4, LayerKind::Albedo)), None);
    }
}
