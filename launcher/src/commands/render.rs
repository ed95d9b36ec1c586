//! Turns a scene, or a running simulation, into one picture.

use crate::{
    backend::{self, BUILT_IN_RENDERERS, GpuArgs},
    cli::Global,
    error::LauncherError,
    follow,
    output::{self, grouped, si},
    pictures::{Format, Job, Look},
    signals::Listener,
    supervise::{ChildOutput, Kind, Role, Supervisor},
};
use photonstream_protocol::{ChannelName, ProtocolError, VslFrame};
use photonstream_renderer::{FrameRenderer, LayerKind};
use photonstream_scene::SceneConfig;
use photonstream_simulator::cli::Overrides;
use serde::Serialize;
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    time::Instant,
};

/// Arguments of `photonstream render`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
With CONFIG a simulator is started, the picture is rendered once its light has converged (or after --after PATHS), and
the simulator ended. With --channel the present light of a running simulation is rendered.

Examples:
  photonstream render configs/cornell-box.toml --out box.png
  photonstream render configs/cornell-box.toml --out box.exr --vsls 4000 --size 400x300
  photonstream render configs/cornell-box.toml --out box.png --renderer wgpu --visibility ao --stats
  photonstream render configs/cornell-ball.toml --out ball.png --time 2.5       an animated scene at 2.5 s (else at 0 s)
  photonstream render --channel demo --out light.png --show full,indirect,vsl

JSON: { \"scene\", \"scene_hash\", \"pictures\": [paths], \"frame\", \"vsls\", \"photon_paths\", \"rays_per_s\", \"converged\",
  \"simulation_ms\": time the simulation had run, \"first_picture_s\", \"render_ms\", \"total_s\", \"width_px\",
  \"height_px\", \"range_loss_share\": what the lights' range may have lost at most, as a share of the indirect light,
  \"range_error\": what lights drawn by lot may add to its error at most, as rel. RMSE }")]
pub(crate) struct Args {
    /// Scene to simulate and render
    #[arg(required_unless_present = "channel", conflicts_with = "channel")]
    pub(crate) config: Option<PathBuf>,
    /// Channel of a running simulation
    #[arg(long)]
    pub(crate) channel: Option<ChannelName>,
    /// Renderer: cpu or wgpu (the GPU)
    #[arg(long, default_value = "cpu", value_name = "NAME")]
    pub(crate) renderer: String,
    /// Picture file: .exr (linear) or .png (tone mapped)
    #[arg(long, value_name = "IMG")]
    pub(crate) out: PathBuf,
    #[command(flatten)]
    pub(crate) look: Look,
    /// What to show: full, direct, indirect, albedo, normal, vsl, flux, depth; several make IMG-LAYER files
    #[arg(long, value_name = "LAYER", value_delimiter = ',', default_value = "full")]
    pub(crate) show: Vec<LayerKind>,
    /// Render after this many photon paths instead of waiting for convergence
    #[arg(long, value_name = "PATHS", conflicts_with = "channel")]
    pub(crate) after: Option<u64>,
    #[command(flatten)]
    pub(crate) gpu: GpuArgs,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
}

/// What is told of a picture.
#[derive(Serialize)]
pub(crate) struct Report {
    scene: String,
    scene_hash: String,
    pub(crate) pictures: Vec<PathBuf>,
    frame: u64,
    vsls: usize,
    photon_paths: u64,
    rays_per_s: f64,
    converged: bool,
    simulation_ms: f64,
    first_picture_s: f64,
    render_ms: f64,
    total_s: f64,
    width_px: u32,
    height_px: u32,
    range_loss_share: f64,
    range_error: f64,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let begun = Instant::now();
    if !BUILT_IN_RENDERERS.contains(&args.renderer.as_str()) {
        return Err(LauncherError::Usage(format!(
            "`render` uses the renderers of this build ({}); run the plug-in \"{}\" with `photonstream run --renderer`",
            BUILT_IN_RENDERERS.join(", "),
            args.renderer
        )));
    }
    // Before any work is done.
    Format::of(&args.out)?;
    let mut renderer = backend::renderer(&args.renderer, &args.gpu)?;
    let outs = [args.out.clone()];
    let report = match (&args.config, &args.channel) {
        (Some(config), _) => {
            let (overrides, after) = (&args.overrides, args.after);
            let light = Simulated { config, overrides, after, preview: false, begun };
            light.picture(renderer.as_mut(), &args.look, &args.show, &outs, global)?
        }
        (None, Some(channel)) => {
            if !args.overrides.to_arguments().is_empty() {
                return Err(LauncherError::Usage(format!(
                    "{} cannot be changed for the running simulation of --channel; give a CONFIG instead",
                    args.overrides.to_arguments().join(" ")
                )));
            }
            let cancelled = Listener::flag_only()?;
            let subscriber = follow::present_frame(channel)?;
            let frame = subscriber.frame().expect("invariant: present_frame waits for one");
            let (look, layers, preview) = (&args.look, args.show.as_slice(), false);
            picture(
                frame,
                renderer.as_mut(),
                &Job { look, layers, outs: &outs, preview, begun, cancelled: &cancelled },
            )?
        }
        (None, None) => unreachable!("invariant: clap requires one of them"),
    };
    output::report(global.json, &report, text)
}

/// A scene whose light is to be simulated for one picture.
pub(crate) struct Simulated<'a> {
    pub(crate) config: &'a Path,
    pub(crate) overrides: &'a Overrides,
    pub(crate) after: Option<u64>,
    /// Whether a quick picture comes first.
    pub(crate) preview: bool,
    pub(crate) begun: Instant,
}

impl Simulated<'_> {
    /// Simulates until the light has converged, and renders it.
    ///
    /// # Errors
    /// Those of the simulator and of the renderer; interruption.
    pub(crate) fn picture(
        &self,
        renderer: &mut dyn FrameRenderer,
        look: &Look,
        show: &[LayerKind],
        outs: &[PathBuf],
        global: &Global,
    ) -> Result<Report, LauncherError> {
        // A mistake in the file is told at once, and by this process.
        SceneConfig::from_file(self.config)?;
        let channel: ChannelName = format!("render-{}", std::process::id()).parse()?;
        let mut supervisor = Supervisor::new(ChildOutput::Aside)?;
        let mut overrides = look.overrides(self.overrides);
        // What moves without end never comes to rest.
        overrides.time.get_or_insert(0.0);
        let mut simulator = simulator(self.config, &channel, &overrides, self.after, global);
        // Nobody watches until it has come to rest.
        simulator.arguments.push("--no-fade".into());
        supervisor.start(simulator)?;
        let frame = follow::converged_frame(&mut supervisor, &channel);
        supervisor.end();
        remove_channel(&channel);
        let cancelled = supervisor.end_flag();
        let (preview, begun) = (self.preview, self.begun);
        picture(&frame?, renderer, &Job { look, layers: show, outs, preview, begun, cancelled: &cancelled })
    }
}

/// The simulator of `config` as a process.
pub(crate) fn simulator(
    config: &Path,
    channel: &ChannelName,
    overrides: &Overrides,
    after: Option<u64>,
    global: &Global,
) -> Role {
    let mut arguments: Vec<OsString> = vec!["simulate".into(), config.into()];
    arguments.push(format!("--channel={channel}").into());
    arguments.extend(after.map(|paths| format!("--after={paths}").into()));
    arguments.extend(overrides.to_arguments().into_iter().map(OsString::from));
    arguments.extend(verbosity(global));
    Role {
        name: "simulator".into(),
        kind: Kind::Simulator,
        plug_in: None,
        arguments,
        sequence: None,
        stand_in: None,
    }
}

/// The options that make a child as talkative as this process.
pub(crate) fn verbosity(global: &Global) -> Vec<OsString> {
    let times = |flag: &str, n: u8| vec![OsString::from(flag); n.into()];
    [times("-v", global.verbose), times("-q", global.quiet)].concat()
}

/// Removes the folder of a channel of our own, and whatever a crash left in it.
pub(crate) fn remove_channel(channel: &ChannelName) {
    match photonstream_protocol::clean_one(channel) {
        // Nothing left, or taken by somebody else in the meantime.
        Ok(_) | Err(ProtocolError::NotCreated { .. } | ProtocolError::ChannelBusy { .. }) => {}
        Err(error) => {
            tracing::warn!("channel {channel} could not be removed: {error}; try `photonstream clean`")
        }
    }
}

fn picture(
    frame: &VslFrame,
    renderer: &mut dyn FrameRenderer,
    job: &Job<'_>,
) -> Result<Report, LauncherError> {
    let made = job.make(frame, renderer)?;
    Ok(Report {
        scene: made.film.metadata.scene_name.clone().unwrap_or_default(),
        scene_hash: format!("{:016x}", frame.scene_hash),
        pictures: made.paths,
        frame: frame.frame,
        vsls: frame.vsls.len(),
        photon_paths: frame.statistics.paths_total,
        rays_per_s: frame.statistics.rays_per_s,
        converged: frame.statistics.converged == 1,
        simulation_ms: frame.statistics.simulation_time_s * 1e3,
        first_picture_s: made.first_picture_s,
        render_ms: made.stats.render_ms,
        total_s: job.begun.elapsed().as_secs_f64(),
        width_px: made.film.width(),
        height_px: made.film.height(),
        range_loss_share: made.stats.range_loss_share,
        range_error: made.stats.range_error,
    })
}

pub(crate) fn text(report: &Report) -> String {
    let mut out: String = report.pictures.iter().map(|path| format!("{}\n", path.display())).collect();
    out.push_str(&format!(
        "{} VSLs, {} paths, {}rays/s, {} {:.0} ms, rendered in {:.0} ms, total {:.2} s",
        grouped(report.vsls as u64),
        grouped(report.photon_paths),
        si(report.rays_per_s),
        if report.converged { "converged in" } else { "simulated for" },
        report.simulation_ms,
        report.render_ms,
        report.total_s,
    ));
    out
}
