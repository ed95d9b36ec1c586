//! Turns command-line arguments into what the window shows first; shared by its own program and the launcher.

use crate::Fault;
use photonstream_protocol::ChannelName;
use photonstream_renderer::{
    LayerKind,
    cli::{Size, shadow_map_px},
};
use photonstream_renderer_wgpu::cli::GpuArgs;
use photonstream_scene::{RangeCulling, Visibility};
use photonstream_shading::Kernel;
use std::path::PathBuf;

/// Arguments of a window on a channel.
#[derive(clap::Args, Clone, Debug, PartialEq)]
pub struct Args {
    /// Channel of the simulator.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub channel: ChannelName,
    /// Folder for screenshots: screenshot-0001.exr, screenshot-0001.png …
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: PathBuf,
    /// Size of the window's picture in pixels, such as 800x600; the scene's own if not given.
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// End after having shown so many published frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// How light falls off at first: patch, disc or paper; the scene's own if not given.
    #[arg(long, value_name = "K")]
    pub kernel: Option<Kernel>,
    /// Shadows of indirect light at first: none, ao, rays, octahedral or shadow-maps; the scene's own if not given.
    #[arg(long, value_name = "V")]
    pub visibility: Option<Visibility>,
    /// Edge of each virtual surface light's shadow map at first: 32, 64, 128 or 256 texels; the scene's own if not given.
    #[arg(long, value_name = "N", value_parser = shadow_map_px)]
    pub shadow_map_px: Option<u32>,
    /// A virtual surface light's range ends where it adds less than this radiance, W m⁻² sr⁻¹; 0: never. The scene's own if
    /// not given.
    #[arg(long, value_name = "E")]
    pub epsilon: Option<f32>,
    /// Lights beyond their range at first: stochastic or cut; the scene's own if not given.
    #[arg(long, value_name = "C")]
    pub culling: Option<RangeCulling>,
    /// What is shown at first: full, direct, indirect, albedo, normal, vsl, flux, depth.
    #[arg(long, value_name = "LAYER", default_value = "full")]
    pub show: LayerKind,
    /// What only the GPU renderer has; accumulation, interleave, shadows and rays at first.
    #[command(flatten)]
    pub gpu: GpuArgs,
    /// Fault injection: once, after so many pictures.
    #[arg(long, value_name = "KIND@PICTURES", hide = true)]
    pub fault: Option<Fault>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use photonstream_renderer_wgpu::{Accumulation, AdapterChoice, Shadows};

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn arguments_are_read_and_wrong_ones_say_what_is_expected() {
        let args = Command::try_parse_from(["w"]).unwrap().args;
        assert_eq!((args.channel.as_str(), args.show, args.frames), ("default", LayerKind::Full, None));
        let line = "w --channel a --out x --size 320x200 --adapter llvm --software --frames 3 --kernel paper \
                    --visibility ao --epsilon 0.5 --culling cut --accumulation splat --shadows rays --show indirect";
        let args = Command::try_parse_from(line.split_whitespace()).unwrap().args;
        assert_eq!(args.gpu.adapter(), AdapterChoice { name: Some("llvm".into()), software: true });
        assert_eq!(args.size, Some(Size { width: 320, height: 200 }));
        assert_eq!(
            (args.gpu.accumulation, args.gpu.shadows),
            (Some(Accumulation::Splat), Some(Shadows::Rays))
        );
        for (line, expected) in [
            ("w --accumulation til", "forward, splat, tiled"),
            ("w --shadows soft", "maps, rays, none"),
            ("w --frames 0", "0 is not in 1.."),
            ("w --size 5", "such as 800x600"),
        ] {
            let Err(error) = Command::try_parse_from(line.split_whitespace()) else { panic!("{line}") };
            assert!(error.to_string().contains(expected), "{error}");
        }
    }
}
