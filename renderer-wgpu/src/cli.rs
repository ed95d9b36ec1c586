//! Turns command-line arguments into a renderer on a device; shared by its own program and the launcher.

use crate::{Accumulation, AdapterChoice, Choices, Gpu, GpuError, Shadows, WgpuRenderer};

/// Arguments of the GPU renderer beyond those of every renderer.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct GpuArgs {
    /// How indirect light is summed: tiled, splat or forward [default: tiled].
    #[arg(long, value_name = "A")]
    pub accumulation: Option<Accumulation>,
    /// Edge of the pattern of interleaved sampling: 1 exact, 2 or 4 faster [default: 1].
    #[arg(long, value_name = "N", value_parser = ["1", "2", "4"])]
    pub interleave: Option<String>,
    /// Shadows of lights: maps, rays or none [default: maps].
    #[arg(long, value_name = "S")]
    pub shadows: Option<Shadows>,
    /// Shadow rays of indirect light per pixel with --visibility rays; 0: one to each light [default: 32].
    #[arg(long, value_name = "N")]
    pub rays: Option<u32>,
    /// Graphics adapter whose name contains this [default: the most capable one].
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Take a software rasteriser: the same picture on every machine.
    #[arg(long)]
    pub software: bool,
    /// Tell the time of each pass.
    #[arg(long)]
    pub stats: bool,
}

impl GpuArgs {
    /// What the arguments choose; what they do not say is the default.
    pub fn choices(&self) -> Choices {
        let defaults = Choices::default();
        Choices {
            accumulation: self.accumulation.unwrap_or(defaults.accumulation),
            interleave: self.interleave.as_deref().map_or(defaults.interleave, |n| {
                n.parse().expect("invariant: the parser takes 1, 2 and 4 alone")
            }),
            shadows: self.shadows.unwrap_or(defaults.shadows),
            rays_per_pixel: self.rays.unwrap_or(defaults.rays_per_pixel),
            timed: self.stats,
        }
    }

    /// Which adapter to take.
    pub fn adapter(&self) -> AdapterChoice {
        AdapterChoice { name: self.adapter.clone(), software: self.software }
    }

    /// A renderer on the chosen adapter; says which it is, and why others were passed over.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] and those of [`WgpuRenderer::new`].
    pub fn renderer(&self) -> Result<WgpuRenderer, GpuError> {
        let gpu = Gpu::headless(&self.adapter())?;
        for reason in &gpu.passed_over {
            tracing::info!("adapter passed over: {reason}");
        }
        if gpu.is_software() && !self.software {
            tracing::warn!("software rendering: {} is no graphics processor", gpu.name());
        } else {
            tracing::info!("rendering on {}", gpu.name());
        }
        WgpuRenderer::new(gpu, self.choices())
    }

    /// As arguments of a renderer process.
    pub fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        let mut add = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                arguments.extend([format!("--{name}"), value]);
            }
        };
        add("accumulation", self.accumulation.map(|a| a.to_string()));
        add("interleave", self.interleave.clone());
        add("shadows", self.shadows.map(|s| s.to_string()));
        add("rays", self.rays.map(|n| n.to_string()));
        add("adapter", self.adapter.clone());
        for (name, given) in [("software", self.software), ("stats", self.stats)] {
            if given {
                arguments.push(format!("--{name}"));
            }
        }
        arguments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        args: GpuArgs,
    }

    #[test]
    fn arguments_survive_being_passed_on() {
        let line =
            "r --accumulation splat --interleave 2 --shadows rays --rays 7 --adapter pipe --software --stats";
        let line: Vec<_> = line.split(' ').collect();
        let args = Command::try_parse_from(&line).unwrap().args;
        assert_eq!(args.to_arguments(), line[1..]);
        let choices = args.choices();
        assert_eq!(
            (choices.accumulation, choices.interleave, choices.shadows),
            (Accumulation::Splat, 2, Shadows::Rays)
        );
        assert_eq!((choices.rays_per_pixel, choices.timed), (7, true));
        assert_eq!(GpuArgs::default().choices(), Choices::default());
        assert_eq!(GpuArgs::default().to_arguments(), Vec::<String>::new());
        assert!(Command::try_parse_from(["r", "--interleave", "3"]).is_err());
    }
}
