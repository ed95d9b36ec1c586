//! Turns a scene into a simulator and renderers, each a process of its own, watched until their work is done.

use super::{
    record,
    render::{remove_channel, simulator, verbosity},
};
use crate::{
    backend::{self, BUILT_IN_RENDERERS, GpuArgs},
    cli::Global,
    error::LauncherError,
    follow, output,
    pictures::Look,
    supervise::{ChildOutput, Kind, Role, Sequence, Supervisor, find_plug_in, written_since},
    taking::{Background, Taken},
    window::{self, WINDOW},
};
use photonstream_protocol::ChannelName;
use photonstream_scene::SceneConfig;
use photonstream_simulator::cli::{MapEdge, Overrides};
use serde::Serialize;
use std::{
    ffi::OsString,
    path::{Path, PathBuf},
    time::{Duration, Instant, SystemTime},
};

/// Arguments of `photonstream run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
A renderer NAME that is not built in (cpu, wgpu) is the program photonstream-renderer-NAME beside this one or on the PATH,
called with: --channel C --out DIR [--headless] [--frames N] [--size WxH] [--kernel K] [--visibility V] [--shadow-map-px N] [--epsilon L]
[--culling C].
What crashes is started again; a built-in renderer then goes on with the next picture. Where no graphics device can draw,
cpu takes the place of wgpu and of the window. Several renderers write to folders of their own in DIR.
Without --renderer and --headless a window shows the light, if there is a display and a graphics adapter; closing it ends
the run. Ctrl-C ends all processes in order, a second one at once.

Examples:
  photonstream run configs/cornell-box.toml
  photonstream run room.toml --renderer cpu --renderer wgpu --stats --frames 5
  photonstream run room.toml --renderer cpu --renderer mine --headless --frames 20 --out film

JSON: { \"scene\", \"channel\", \"total_s\", \"simulator_restarts\", \"renderers\": [ { \"name\", \"folder\", \"pictures\": [paths],
  \"restarts\", \"failed\", \"replaced_by\": null or a name } ], \"recording\": null or { \"file\", \"frames\", \"skipped_frames\",
  \"bytes\", \"seconds\" } }")]
pub(crate) struct Args {
    /// Scene [default: the built-in Cornell box]
    config: Option<PathBuf>,
    /// Renderer, built in (cpu, wgpu) or a plug-in; may be given several times [default: a window where there is a
    /// display, else cpu]
    #[arg(long = "renderer", value_name = "NAME")]
    renderers: Vec<String>,
    /// Without a window
    #[arg(long)]
    headless: bool,
    /// End after so many pictures of each renderer [default: one, once the light has converged]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Folder of the pictures
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Channel to publish on [default: one of its own]
    #[arg(long)]
    channel: Option<ChannelName>,
    /// Record the frames of the simulation, from the first one, for `photonstream replay`
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    look: Look,
    #[command(flatten)]
    gpu: GpuArgs,
    #[command(flatten)]
    overrides: Overrides,
}

#[derive(Serialize)]
struct Report {
    scene: String,
    channel: String,
    total_s: f64,
    simulator_restarts: u32,
    renderers: Vec<Renderer>,
    recording: Option<Taken>,
}

#[derive(Serialize)]
struct Renderer {
    name: String,
    folder: PathBuf,
    pictures: Vec<PathBuf>,
    restarts: u32,
    failed: bool,
    replaced_by: Option<String>,
}

/// Time between two looks at the children and the channel.
const LOOK: Duration = Duration::from_millis(50);
/// The same, until there is a first frame.
const FIRST_LOOK: Duration = Duration::from_millis(4);

impl Args {
    /// The built-in scene, with all defaults.
    pub(crate) fn built_in() -> Self {
        Self {
            config: None,
            renderers: Vec::new(),
            headless: false,
            frames: None,
            out: "out".into(),
            channel: None,
            record: None,
            look: Look::default(),
            gpu: GpuArgs::default(),
            overrides: Overrides::default(),
        }
    }
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    show(args, &names(args)?, global)
}

/// Runs the renderers called `names`, which may be [`WINDOW`].
pub(crate) fn show(args: &Args, names: &[String], global: &Global) -> Result<(), LauncherError> {
    let begun = (Instant::now(), SystemTime::now());
    let built_in = super::default_run::BuiltInScene::new_if(args.config.is_none())?;
    let config = match (&args.config, &built_in) {
        (Some(config), _) => config.as_path(),
        (None, Some(scene)) => scene.path(),
        (None, None) => unreachable!("invariant: the built-in scene stands in for a missing one"),
    };
    let channel = match &args.channel {
        Some(channel) => channel.clone(),
        None => format!("run-{}", std::process::id()).parse()?,
    };
    // Mistakes are told at once, by this process, before anything is started.
    let scene = scene_name(config, &SceneConfig::from_file(config)?);
    let folders = folders(&args.out, names);
    let named = names.iter().zip(&folders);
    let renderers = named
        .map(|(name, folder)| renderer(name, names.len(), folder, &channel, begun.1, args, global))
        .collect::<Result<_, _>>()?;
    for folder in &folders {
        std::fs::create_dir_all(folder).map_err(|e| LauncherError::io("create folder", folder, e))?;
    }
    let output = if global.json { ChildOutput::Aside } else { ChildOutput::Through };
    let recording = args.record.as_ref().map(|file| Background::start(file, &channel)).transpose()?;
    let mut supervisor = Supervisor::new(output)?;
    let mut overrides = args.look.overrides(&args.overrides);
    if args.look.visibility.is_none() && names.iter().any(|name| name == WINDOW) {
        // What a window shows indirect shadows with, unless it is told to do otherwise.
        overrides.distance_map_px.get_or_insert(MapEdge::Auto);
    }
    let result = supervisor.start(simulator(config, &channel, &overrides, None, global));
    let result = result.and_then(|()| watch(&mut supervisor, &channel, renderers));
    supervisor.end();
    let recorded = recording.map(Background::finish).transpose();
    remove_channel(&channel);
    result?;
    let (recording, lost) = match recorded {
        Ok(taken) => (taken.flatten(), None),
        Err(error) => (None, Some(error)),
    };
    let fates = supervisor.fates(Kind::Renderer);
    let renderers = names.iter().zip(folders).zip(fates).map(|((name, folder), fate)| Renderer {
        name: name.clone(),
        pictures: pictures_in(&folder, begun.1),
        folder,
        restarts: fate.restarts,
        failed: fate.failed,
        replaced_by: fate.replaced_by,
    });
    let report = Report {
        scene,
        channel: channel.to_string(),
        total_s: begun.0.elapsed().as_secs_f64(),
        simulator_restarts: supervisor.fates(Kind::Simulator).iter().map(|fate| fate.restarts).sum(),
        renderers: renderers.collect(),
        recording,
    };
    output::report(global.json, &report, text)?;
    supervisor.take_failure().or(lost).map_or(Ok(()), Err)
}

/// What is started to show the light: the renderers that were named, else a window if there can be one, else `cpu`.
fn names(args: &Args) -> Result<Vec<String>, LauncherError> {
    if !args.renderers.is_empty() || args.headless {
        let names = if args.renderers.is_empty() { vec!["cpu".to_owned()] } else { args.renderers.clone() };
        backend::check(names.iter().map(String::as_str), &args.gpu)?;
        return Ok(names);
    }
    match window::find(&args.gpu) {
        Ok(()) => Ok(vec![WINDOW.to_owned()]),
        Err(reason) => {
            backend::check(["cpu"], &args.gpu).map_err(|error| {
                LauncherError::Usage(format!("{error}, and there can be no window: {reason}"))
            })?;
            let out = args.out.display();
            tracing::info!("rendering on the CPU, without a window: {reason}; pictures go to {out}");
            Ok(vec!["cpu".to_owned()])
        }
    }
}

/// Starts `renderers` once the channel is there; until all of them are done, or the simulation and then they.
fn watch(
    supervisor: &mut Supervisor,
    channel: &ChannelName,
    mut renderers: Vec<Role>,
) -> Result<(), LauncherError> {
    let light = follow::Light::start();
    let mut subscriber = None;
    while !renderers.is_empty() || !supervisor.is_over(Kind::Renderer) {
        if supervisor.is_over(Kind::Simulator) {
            if !renderers.is_empty() {
                let what = "its first frame";
                return Err(LauncherError::SimulatorEnded { channel: channel.to_string(), what });
            }
            tracing::info!(
                "the simulation was ended; waiting for the last pictures, Ctrl-C ends without them"
            );
            return last_pictures(supervisor);
        }
        supervisor.attend(if renderers.is_empty() { LOOK } else { FIRST_LOOK })?;
        // Only for the start and the bar: what is wrong with the channel is the renderers' to say.
        if let Ok(Some(frame)) = follow::poll(&mut subscriber, channel) {
            light.show(frame);
            renderers.drain(..).try_for_each(|role| supervisor.start(role))?;
        } else if !renderers.is_empty() {
            light.prepare();
        }
    }
    Ok(())
}

/// Waits for renderers to show what there is, for as long as they take: the simulator leaves its last frame, also to one
/// that has not seen it yet, or that crashes and is started again.
fn last_pictures(supervisor: &mut Supervisor) -> Result<(), LauncherError> {
    while !supervisor.is_over(Kind::Renderer) {
        supervisor.attend(LOOK)?;
    }
    Ok(())
}

fn scene_name(config: &Path, parsed: &SceneConfig) -> String {
    let stem = || config.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    parsed.name.clone().unwrap_or_else(stem)
}

/// A renderer as a process.
fn renderer(
    name: &str,
    of: usize,
    folder: &Path,
    channel: &ChannelName,
    begun: SystemTime,
    args: &Args,
    global: &Global,
) -> Result<Role, LauncherError> {
    let mut arguments: Vec<OsString> = Vec::new();
    let is_window = name == WINDOW && args.renderers.is_empty();
    let plug_in = if is_window {
        arguments.push("view".into());
        arguments.extend(verbosity(global));
        None
    } else if BUILT_IN_RENDERERS.contains(&name) {
        arguments.extend(["renderer".into(), name.into()]);
        arguments.extend(verbosity(global));
        None
    } else {
        Some(find_plug_in(name)?)
    };
    arguments.extend(["--channel".into(), channel.as_str().into(), "--out".into(), folder.into()]);
    if !is_window {
        arguments.push("--headless".into());
    }
    // A plug-in numbers its pictures, if it has any, in its own way.
    let sequence = match &plug_in {
        None if !is_window => Some(Sequence { folder: folder.to_owned(), begun, frames: args.frames }),
        _ => {
            arguments.extend(args.frames.iter().flat_map(|n| ["--frames".into(), n.to_string().into()]));
            None
        }
    };
    arguments.extend(args.look.to_arguments().into_iter().map(OsString::from));
    if name == "wgpu" || is_window {
        arguments.extend(args.gpu.to_arguments().into_iter().map(OsString::from));
    }
    // With several renderers their folders are named after them, and told apart.
    let shown = if of == 1 { name.into() } else { folder.file_name().unwrap_or_default().to_string_lossy() };
    let name_of_stand_in = if of == 1 { "cpu".to_owned() } else { format!("cpu (for {shown})") };
    let stand_in = (name == "wgpu" || is_window)
        .then(|| renderer("cpu", of, folder, channel, begun, args, global))
        .transpose()?
        .map(|role| Box::new(Role { name: name_of_stand_in, ..role }));
    Ok(Role { name: shown.into_owned(), kind: Kind::Renderer, plug_in, arguments, sequence, stand_in })
}

/// Where each renderer writes: `out`, or with several of them `out/NAME`, `out/NAME-2` …
fn folders(out: &Path, renderers: &[String]) -> Vec<PathBuf> {
    if renderers.len() == 1 {
        return vec![out.to_owned()];
    }
    let folder = |(i, name): (usize, &String)| match renderers[..i].iter().filter(|n| *n == name).count() {
        0 => out.join(name),
        n => out.join(format!("{name}-{}", n + 1)),
    };
    renderers.iter().enumerate().map(folder).collect()
}

/// Picture files in `folder` that were written since `begun`, by name.
fn pictures_in(folder: &Path, begun: SystemTime) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let is_new = |path: &PathBuf| {
        let end = path.extension().and_then(|e| e.to_str());
        matches!(end, Some("exr" | "png" | "ppm")) && written_since(path, begun)
    };
    let mut pictures: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_new).collect();
    pictures.sort();
    pictures
}

/// So many names of pictures are listed; of more, the first and the last.
const LISTED: usize = 6;

fn text(report: &Report) -> String {
    let mut out = String::new();
    for renderer in &report.renderers {
        let names: Vec<_> = renderer.pictures.iter().map(|path| path.display().to_string()).collect();
        if names.len() <= LISTED {
            out.extend(names.iter().map(|name| format!("{name}\n")));
        } else {
            out.push_str(&format!("{} … {} ({} files)\n", names[0], names[names.len() - 1], names.len()));
        }
    }
    let restarts: u32 = report.renderers.iter().map(|r| r.restarts).sum();
    out.extend(report.recording.iter().map(|taken| format!("{}\n", record::text(taken))));
    out.push_str(&format!("{}: {:.2} s", report.scene, report.total_s));
    if report.simulator_restarts + restarts > 0 {
        out.push_str(&format!("; restarts: simulator {}, renderers {restarts}", report.simulator_restarts));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_renderers_have_folders_of_their_own() {
        let names = |list: &[&str]| list.iter().map(|&n| n.to_owned()).collect::<Vec<_>>();
        assert_eq!(folders(Path::new("out"), &names(&["cpu"])), [Path::new("out")]);
        let several = folders(Path::new("o"), &names(&["cpu", "mine", "cpu", "cpu"]));
        assert_eq!(several, ["o/cpu", "o/mine", "o/cpu-2", "o/cpu-3"].map(PathBuf::from));
    }
}
