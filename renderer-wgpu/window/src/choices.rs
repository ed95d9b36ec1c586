//! Gathers what the user has chosen to see, and turns it into the renderer's view of it.

use crate::Args;
use photonstream_film::Display;
use photonstream_renderer::LayerKind;
use photonstream_renderer_wgpu::{Accumulation, Show, View};
use photonstream_scene::{RenderSettings, Visibility};
use photonstream_shading::{Camera, tone::ToneMap};

/// Most stops of exposure up or down.
pub(crate) const EXPOSURE_MOST: f32 = 20.0;

/// Virtual surface lights up to which a device in software draws shadow maps of all where nobody says so.
const FEW_LIGHTS: usize = 256;

/// What the user has chosen to see.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Choices {
    /// All that the renderer is told, but for size and camera.
    pub(crate) view: View,
    /// Exposure in stops.
    pub(crate) exposure_ev: f32,
    /// Tone map.
    pub(crate) tone_map: ToneMap,
}

impl Choices {
    /// The scene's own settings, and `args` over them.
    pub(crate) fn new(settings: &RenderSettings, camera: &Camera, args: &Args) -> Self {
        let mut view = View::from_settings(settings, camera);
        view.kernel = args.kernel.unwrap_or(view.kernel);
        view.visibility = args.visibility.unwrap_or(view.visibility);
        view.shadow_map_px = args.shadow_map_px.unwrap_or(view.shadow_map_px);
        view.epsilon = args.epsilon.unwrap_or(view.epsilon);
        view.culling = args.culling.unwrap_or(view.culling);
        let gpu = args.gpu.choices();
        (view.accumulation, view.interleave) = (gpu.accumulation, gpu.interleave);
        (view.shadows, view.rays_per_pixel) = (gpu.shadows, gpu.rays_per_pixel);
        view.show = Show::Layer(args.show);
        Self { view, exposure_ev: settings.exposure_ev, tone_map: settings.tone_map }
    }

    /// Takes the cheaper way where `args` do not say which: for rays the distance maps, where `has_maps`, else shadow maps of at most
    /// 256 of `vsls` lights, else ambient occlusion; and interleaved sampling.
    pub(crate) fn ease(&mut self, args: &Args, has_maps: bool, vsls: usize) {
        if args.visibility.is_none() && self.view.visibility == Visibility::Rays {
            self.view.visibility = match vsls {
                _ if has_maps => Visibility::Octahedral,
                1..=FEW_LIGHTS => Visibility::ShadowMaps,
                _ => Visibility::Ao,
            };
        }
        if args.gpu.interleave.is_none() {
            self.view.interleave = 4;
        }
    }

    /// The view from `camera` onto `width` × `height` pixels of a scene with `lights` lights.
    pub(crate) fn view(&self, camera: &Camera, width: u32, height: u32, lights: usize) -> View {
        let interleave = if self.view.accumulation == Accumulation::Tiled { self.view.interleave } else { 1 };
        let only_light = self.view.only_light.filter(|&light| (light as usize) < lights);
        View { width, height, camera: *camera, interleave, only_light, ..self.view }
    }

    /// How the picture becomes display colours.
    pub(crate) fn display(&self) -> Display {
        let settings = RenderSettings {
            exposure_ev: self.exposure_ev,
            tone_map: self.tone_map,
            ..RenderSettings::default()
        };
        match self.view.show {
            Show::Layer(kind) => kind.display(&settings),
            Show::Discs => LayerKind::Full.display(&settings),
            Show::Age | Show::Tiles => Display::Data,
        }
    }

    /// The layer that a screenshot holds: the one shown, or for debug views the picture they explain.
    pub(crate) fn layer(&self) -> LayerKind {
        match self.view.show {
            Show::Layer(kind) => kind,
            Show::Discs | Show::Age | Show::Tiles => LayerKind::Full,
        }
    }
}

/// What can be shown, with the name in the overlay.
pub(crate) const SHOWS: [(Show, &str); 11] = [
    (Show::Layer(LayerKind::Full), "full"),
    (Show::Layer(LayerKind::Direct), "direct"),
    (Show::Layer(LayerKind::Indirect), "indirect"),
    (Show::Layer(LayerKind::Albedo), "albedo"),
    (Show::Layer(LayerKind::Normal), "normal"),
    (Show::Layer(LayerKind::Vsl), "owners"),
    (Show::Layer(LayerKind::Flux), "flux"),
    (Show::Layer(LayerKind::Depth), "depth"),
    (Show::Discs, "discs"),
    (Show::Age, "age"),
    (Show::Tiles, "tiles"),
];

/// The name of what is shown.
pub(crate) fn show_name(show: Show) -> &'static str {
    SHOWS.iter().find(|(s, _)| *s == show).map_or("", |(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use glam::Vec3;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    fn choices(line: &str) -> (Choices, Camera) {
        let args = Command::try_parse_from(line.split_whitespace()).unwrap().args;
        let camera = Camera::look_at(Vec3::Z, Vec3::ZERO, Vec3::Y, 40.0).unwrap();
        (Choices::new(&RenderSettings::default(), &camera, &args), camera)
    }

    #[test]
    fn impossible_combinations_never_reach_the_renderer() {
        let (mut choices, camera) = choices("w --show depth");
        choices.view.interleave = 4;
        choices.view.only_light = Some(2);
        let view = choices.view(&camera, 30, 20, 3);
        assert_eq!((view.width, view.height, view.interleave, view.only_light), (30, 20, 4, Some(2)));
        choices.view.accumulation = Accumulation::Splat;
        let view = choices.view(&camera, 30, 20, 2);
        assert_eq!((view.interleave, view.only_light), (1, None));
        assert_eq!(choices.display(), Display::Scaled);
    }

    #[test]
    fn software_is_spared_what_nobody_asked_for() {
        let eased_with = |line: &str, has_maps: bool, vsls: usize| {
            let args = Command::try_parse_from(line.split_whitespace()).unwrap().args;
            let (mut choices, _) = choices(line);
            choices.ease(&args, has_maps, vsls);
            (choices.view.visibility, choices.view.interleave)
        };
        let eased = |line| eased_with(line, false, 1000);
        assert_eq!(eased_with("w", true, 20), (Visibility::Octahedral, 4));
        assert_eq!(eased_with("w --visibility rays", true, 20), (Visibility::Rays, 4));
        assert_eq!(eased_with("w", false, 20), (Visibility::ShadowMaps, 4));
        assert_eq!(eased_with("w", false, 0), (Visibility::Ao, 4));
        assert_eq!(eased("w"), (Visibility::Ao, 4));
        assert_eq!(eased("w --visibility rays --interleave 1"), (Visibility::Rays, 1));
        assert_eq!(eased("w --visibility none"), (Visibility::None, 4));
    }

    #[test]
    fn every_layer_can_be_shown_and_saved() {
        let (mut choices, _) = choices("w");
        for kind in LayerKind::ALL {
            assert!(SHOWS.iter().any(|(show, _)| *show == Show::Layer(kind)));
            choices.view.show = Show::Layer(kind);
            assert_eq!(choices.layer(), kind);
        }
        choices.view.show = Show::Tiles;
        assert_eq!((choices.layer(), show_name(Show::Tiles)), (LayerKind::Full, "tiles"));
    }
}
