//! Turns command-line arguments into what the renderer process does; shared by its own program and the launcher.

use crate::{LayerKind, RenderOptions};
use photonstream_protocol::ChannelName;
use photonstream_scene::{RangeCulling, RenderSettings, SHADOW_MAP_EDGES, Visibility};
use photonstream_shading::Kernel;
use std::{path::PathBuf, str::FromStr};

/// Arguments of a renderer that attaches to a channel: those of every plug-in renderer, and this one's own.
#[derive(clap::Args, Clone, Debug, PartialEq)]
pub struct Args {
    /// Channel of the simulator.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub channel: ChannelName,
    /// Folder for the pictures: frame-0001.exr, frame-0001.png …
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Run without a window; this renderer always does.
    #[arg(long)]
    pub headless: bool,
    /// Pictures to write as the light goes on, then end; without it, one picture once the light has converged.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub frames: Option<u32>,
    /// Number of the first picture, for going on with earlier ones.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub first: u32,
    /// Picture size in pixels, such as 800x600; the scene's own if not given.
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// How light falls off: paper, disc or patch; the scene's own if not given.
    #[arg(long, value_name = "K")]
    pub kernel: Option<Kernel>,
    /// Shadows of indirect light: none, rays, octahedral, shadow-maps (rays without the GPU renderer), or ao with the GPU renderer;
    /// the scene's own if not given.
    #[arg(long, value_name = "V")]
    pub visibility: Option<Visibility>,
    /// Edge of each virtual surface light's shadow map for visibility shadow-maps: 32, 64, 128 or 256 texels; the scene's own if not
    /// given.
    #[arg(long, value_name = "N", value_parser = shadow_map_px)]
    pub shadow_map_px: Option<u32>,
    /// Smallest radiance worth adding, W/(m² sr), which ends the range of a light; 0: no range; the scene's own if not given.
    #[arg(long, value_name = "L")]
    pub epsilon: Option<f32>,
    /// Lights beyond their range: cut (skipped) or stochastic (drawn by lot); the scene's own if not given.
    #[arg(long, value_name = "C")]
    pub culling: Option<RangeCulling>,
    /// Layers to render: full, direct, indirect, albedo, normal, vsl, flux, depth.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', default_value = "full")]
    pub show: Vec<LayerKind>,
    /// Camera samples per pixel: 1 is the pixel's centre.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub samples: u32,
    /// Render threads; one per core if not given.
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

/// The edge of a shadow map from its text on the command line.
///
/// # Errors
/// What is expected, for any other than one of [`SHADOW_MAP_EDGES`].
pub fn shadow_map_px(text: &str) -> Result<u32, String> {
    let edge = text.parse().ok().filter(|edge| SHADOW_MAP_EDGES.contains(edge));
    edge.ok_or_else(|| format!("found \"{text}\", expected 32, 64, 128 or 256"))
}

/// A picture size, written as 800x600.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("found \"{text}\", expected WIDTHxHEIGHT in pixels, such as 800x600");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
        let side = |s: &str| s.parse().ok().filter(|&n: &u32| n > 0).ok_or_else(wrong);
        Ok(Self { width: side(width)?, height: side(height)? })
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl Args {
    /// What is rendered: the scene's own settings, and these arguments over them.
    pub fn options(&self, settings: &RenderSettings) -> RenderOptions {
        let defaults = RenderOptions::from_settings(settings);
        RenderOptions {
            width: self.size.map_or(defaults.width, |s| s.width),
            height: self.size.map_or(defaults.height, |s| s.height),
            kernel: self.kernel.unwrap_or(defaults.kernel),
            visibility: self.visibility.unwrap_or(defaults.visibility),
            shadow_map_px: self.shadow_map_px.unwrap_or(defaults.shadow_map_px),
            epsilon: self.epsilon.unwrap_or(defaults.epsilon),
            culling: self.culling.unwrap_or(defaults.culling),
            layers: self.show.clone(),
            samples_per_pixel: self.samples,
            threads: self.threads,
            ..defaults
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn arguments_override_the_settings_and_defaults_do_not() {
        let settings = RenderSettings::default();
        let args = Command::try_parse_from(["r"]).unwrap().args;
        assert_eq!(args.options(&settings), RenderOptions::from_settings(&settings));
        let line = "r --channel a-1 --out x --headless --frames 3 --size 64x48 --kernel paper --visibility none \
                    --epsilon 0.5 --culling cut --show full,normal --samples 4 --threads 2 --first 12 --shadow-map-px 64";
        let args = Command::try_parse_from(line.split_whitespace()).unwrap().args;
        let options = args.options(&settings);
        assert_eq!((options.width, options.height, options.samples_per_pixel), (64, 48, 4));
        assert_eq!((options.kernel, options.visibility), (Kernel::Paper, Visibility::None));
        assert_eq!((options.epsilon, options.culling), (0.5, RangeCulling::Cut));
        assert_eq!((settings.shadow_map_px, options.shadow_map_px), (128, 64));
        assert_eq!(options.layers, [LayerKind::Full, LayerKind::Normal]);
        assert_eq!((args.frames, args.first, options.threads), (Some(3), 12, Some(2)));
    }

    #[test]
    fn wrong_arguments_say_what_is_expected() {
        for (line, expected) in [
            ("r --size 800", "such as 800x600"),
            ("r --size 0x5", "such as 800x600"),
            ("r --kernel box", "paper, disc, patch"),
            ("r --culling some", "cut, stochastic"),
            ("r --show ful", "full, direct, indirect"),
            ("r --shadow-map-px 48", "32, 64, 128 or 256"),
            ("r --frames 0", "0 is not in 1.."),
            ("r --first 0", "0 is not in 1.."),
        ] {
            let Err(error) = Command::try_parse_from(line.split_whitespace()) else { panic!("{line}") };
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
