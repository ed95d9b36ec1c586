//! Turns command-line arguments into a running simulator.

use crate::{
    cancel::Cancel,
    error::SimulatorError,
    service::{self, ConfigSource, Options, Summary},
    simulation::Simulation,
};
use photonstream_protocol::ChannelName;
use photonstream_scene::{Method, Sampling, Scene, SceneConfig, SceneError, StreamingSettings};
use photonstream_shading::distance_map::EDGES;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::{
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

/// Arguments of `photonstream simulate` and `photonstream-simulator`.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Scene to simulate: a TOML file, or a model (glTF, OBJ, PLY)
    pub config: PathBuf,
    /// Channel to publish on
    #[arg(long, default_value_t)]
    pub channel: ChannelName,
    /// Tracer threads [default: the config's, else one per core]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub threads: Option<u32>,
    /// Rest after this many paths
    #[arg(long, value_name = "PATHS")]
    pub after: Option<u64>,
    /// Load the config once: later changes of the file change nothing
    #[arg(long)]
    pub no_watch: bool,
    /// Show virtual surface lights that move where they are at once, instead of fading over for a second
    #[arg(long)]
    pub no_fade: bool,
    /// Settings that override the config's
    #[command(flatten)]
    pub overrides: Overrides,
    /// The channel is left at an orderly end, for the caller to remove
    #[arg(skip)]
    pub leaves_channel: bool,
}

/// Settings that override the config's `[streaming]` table.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Overrides {
    /// How light is simulated: `photon-streaming`, `static-vpl`, `phantom-vpl`, `instant-radiosity`, or `auto`
    #[arg(long)]
    pub method: Option<Method>,
    /// Number of virtual surface lights
    #[arg(long)]
    pub vsls: Option<u32>,
    /// Number of paths in the pool
    #[arg(long, value_name = "PATHS")]
    pub pool: Option<u32>,
    /// Seed of placement and streaming
    #[arg(long)]
    pub seed: Option<u64>,
    /// Hold an animated scene at this moment, in seconds
    #[arg(long, value_name = "SECONDS")]
    pub time: Option<f64>,
    /// Whether virtual surface lights move to where the light is
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    pub adaptive: Option<bool>,
    /// Texels along the edge of the virtual surface lights' distance maps, for visibility octahedral: 0 (none), 8, 16, 32,
    /// 64, or `auto` (32, fewer for more than 32 768 lights)
    #[arg(long, value_name = "PX")]
    pub distance_map_px: Option<MapEdge>,
    /// `replay` (unchanged scene, unchanged light) or `fresh` (a stream of new samples)
    #[arg(long)]
    pub sampling: Option<Sampling>,
}

/// Edge of distance maps, as it is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MapEdge {
    /// As many texels as fit the number of lights, unless the config says how many.
    Auto,
    /// So many texels.
    Px(u32),
}

impl std::str::FromStr for MapEdge {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "0" => Ok(Self::Px(0)),
            _ => {
                let known = EDGES.into_iter().find(|px| px.to_string() == text);
                known.map(Self::Px).ok_or_else(|| "expected auto, 0, 8, 16, 32 or 64".to_owned())
            }
        }
    }
}

impl std::fmt::Display for MapEdge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Px(px) => px.fmt(f),
        }
    }
}

impl Overrides {
    /// `config` with what is given.
    ///
    /// # Errors
    /// If it is to be held at a moment, and has none such.
    pub fn apply(&self, config: SceneConfig) -> Result<SceneConfig, SceneError> {
        let mut config = match self.time {
            Some(time_s) => config.at(time_s)?,
            None => config,
        };
        let streaming = &mut config.streaming;
        streaming.method = self.method.or(streaming.method);
        streaming.vsls = self.vsls.or(streaming.vsls);
        streaming.pool_paths = self.pool.or(streaming.pool_paths);
        streaming.seed = self.seed.or(streaming.seed);
        streaming.sampling = self.sampling.or(streaming.sampling);
        streaming.adaptive = self.adaptive.or(streaming.adaptive);
        match self.distance_map_px {
            Some(MapEdge::Px(px)) => streaming.distance_map_px = Some(px),
            Some(MapEdge::Auto) => {
                let vsls = streaming.vsls.unwrap_or(StreamingSettings::default().vsls);
                // A resolved text says 0 where none were needed.
                if streaming.distance_map_px.unwrap_or(0) == 0 {
                    streaming.distance_map_px = Some(StreamingSettings::default_distance_map_px(vsls));
                }
            }
            None => {}
        }
        Ok(config)
    }

    /// As arguments for another process.
    pub fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        let mut add = |name: &str, value: Option<String>| {
            arguments.extend(value.map(|value| format!("--{name}={value}")));
        };
        add("method", self.method.map(|m| m.name().to_owned()));
        add("time", self.time.map(|t| t.to_string()));
        add("vsls", self.vsls.map(|v| v.to_string()));
        add("pool", self.pool.map(|v| v.to_string()));
        add("seed", self.seed.map(|v| v.to_string()));
        add("distance-map-px", self.distance_map_px.map(|px| px.to_string()));
        add("adaptive", self.adaptive.map(|v| v.to_string()));
        add("sampling", self.sampling.map(|v| v.name().to_owned()));
        arguments
    }
}

/// Loading for so long is told of, and what comes next.
const LONG: Duration = Duration::from_secs(1);

/// Simulates until a signal (Ctrl-C, SIGTERM, SIGHUP) or a client of the control socket ends it.
///
/// # Errors
/// If the scene cannot be loaded, the channel is taken, or the simulation fails.
pub fn run(args: &Args) -> Result<Summary, SimulatorError> {
    let stop = stop_on_signals()?;
    let begun = Instant::now();
    let mut source = ConfigSource::new(&args.config, args.overrides.clone());
    let scene = source.load()?;
    for choice in &scene.choices {
        tracing::info!("{}: chosen {choice}", scene.name);
    }
    for notice in &scene.notices {
        tracing::warn!("{}: {notice}", scene.name);
    }
    let loaded = begun.elapsed();
    if loaded >= LONG {
        let triangles = scene.geometry.triangles.len();
        tracing::info!(
            "{}: read {triangles} triangles in {:.1} s; placing lights",
            scene.name,
            loaded.as_secs_f64()
        );
    }
    let name = scene.name.clone();
    let Some(simulation) = place(scene, &stop)? else {
        return Ok(Summary::of_nothing(name, begun.elapsed()));
    };
    tracing::info!(
        scene = %simulation.scene.name,
        triangles = simulation.scene.geometry.triangles.len(),
        lights = simulation.scene.lights.len(),
        method = simulation.method.name(),
        vsls = simulation.published_lights(),
        pool_paths = simulation.emitters.slots,
        load_ms = loaded.as_millis() as u64,
        place_ms = (begun.elapsed() - loaded).as_millis() as u64,
        channel = %args.channel,
        "simulating",
    );
    let options = Options {
        channel: args.channel.clone(),
        threads: args.threads.map(|t| t as usize),
        after_paths: args.after,
        has_no_fade: args.no_fade,
        leaves_channel: args.leaves_channel,
        config: (!args.no_watch).then_some(source),
    };
    service::run(simulation, &options, &stop)
}

/// Places the lights of the first scene; `None` where it is told to stop before.
fn place(scene: Scene, stop: &flume::Receiver<()>) -> Result<Option<Simulation>, SimulatorError> {
    let cancel = Cancel::default();
    let (sender, placed) = flume::bounded(1);
    let placer = {
        let cancel = cancel.clone();
        service::spawn("placer", move || {
            // Whoever stops does not wait for it.
            let _ = sender.send(Simulation::new_unless(Arc::new(scene), &cancel));
        })?
    };
    let simulation = flume::Selector::new()
        .recv(stop, |_| Ok(None))
        .recv(&placed, |placed| placed.map_err(|_| SimulatorError::ActorStopped { actor: "placer" }))
        .wait();
    cancel.cancel();
    // What it had to say has been said.
    let _ = placer.join();
    simulation
}

/// A channel that gets a message with the first signal that asks for the end.
fn stop_on_signals() -> Result<flume::Receiver<()>, SimulatorError> {
    let (sender, stop) = flume::bounded(1);
    let mut signals =
        signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP]).map_err(SimulatorError::Signals)?;
    service::spawn("signals", move || {
        for _ in signals.forever() {
            // A second signal changes nothing: the end is under way.
            let _ = sender.try_send(());
        }
    })?;
    Ok(stop)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// `auto` gives maps where the config has none or says 0, as resolved texts do, and keeps the edge that a config says.
    #[test]
    fn maps_come_where_none_are_said() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
        let px = |said: Option<u32>, asked: &str| {
            let mut config = SceneConfig::from_file(&path).unwrap();
            config.streaming.distance_map_px = said;
            let overrides =
                Overrides { distance_map_px: Some(asked.parse().unwrap()), ..Overrides::default() };
            overrides.apply(config).unwrap().build().unwrap().streaming.distance_map_px
        };
        let cases = [
            (None, "auto", 32),
            (Some(0), "auto", 32),
            (Some(8), "auto", 8),
            (Some(8), "64", 64),
            (Some(8), "0", 0),
        ];
        for (said, asked, expected) in cases {
            assert_eq!(px(said, asked), expected, "{said:?}, {asked}");
        }
        assert!("12".parse::<MapEdge>().is_err());
    }

    /// Told to stop before half a million lights are placed; and not told to, for one a surface.
    #[test]
    fn a_stop_ends_the_first_placement() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
        let scene = |vsls| {
            let overrides = Overrides { vsls: Some(vsls), ..Overrides::default() };
            ConfigSource::new(&path, overrides).load().unwrap()
        };
        let (sender, stop) = flume::bounded(1);
        assert!(place(scene(1), &stop).unwrap().is_some());
        sender.send(()).unwrap();
        assert!(place(scene(500_000), &stop).unwrap().is_none());
    }
}
