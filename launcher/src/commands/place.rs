//! Turns a scene file into one with static virtual point lights placed in it.

use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped},
};
use photonstream_scene::{
    ModelOptions, ModelScene, Scene, SceneConfig, SceneError, is_model,
    vpl_placement::{PlacedWeights, VplFile, VplFileCounts, VplPlacement, VplPlacementSettings, place_vpls},
};
use serde::Serialize;
use std::{
    io::Write,
    path::{Path, PathBuf},
    time::Instant,
};

/// Arguments of `photonstream place`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Free space is explored from the camera's eye (or from --from): each point is half the free
distance along a random direction from one before. From these points and from the lights, paths
are traced that are reflected as by matt surfaces. What they meet is put together where it is
nearer than the spacing, looks the same way within 45 degrees, and is of alike material; nothing
is put where no path comes. Without --spacing-m, eight reflections or more make up a VPL in the
mean: --population allows for more VPLs.

FILE is CONFIG with [[vpl]] entries; the methods static-vpl and phantom-vpl use them
(streaming.method). Each weighs the surface around it, as static-vpl needs it. A phantom takes
the weights of those nearby, but stands for all that its beam lights: for phantom-vpl give larger
weights by hand, as configs/cell.toml does, or it is nearly black.

Where FILE is there already, or is CONFIG itself, entries that were made by hand or edited stay,
none is put beside them, and what was deleted stays deleted; the others are replaced. An entry at
which a comment was written counts as edited.

Where FILE was made from CONFIG before, both are merged: the scene is that of CONFIG as it is now
(of FILE where only that was changed since; where both were, nothing is written), and entries
made, edited or deleted by hand in either are so in FILE, once. Where both have one at the same
place, that of FILE stays.

Examples:
  photonstream place configs/sponza.toml --out sponza-vpls.toml --max 500
  photonstream place room.toml --out room.toml --spacing-m 0.5 --from 0,1.5,0 --from 4,1.5,0
  photonstream place model.glb --out model.toml

JSON: { \"scene\", \"scene_from\", \"out\", \"vpls\", \"attached\", \"by_hand\", \"edited\", \"deleted\",
  \"replaced\", \"left_out\", \"taken\", \"without_surface\", \"wants_population\", \"spacing_m\",
  \"origins\", \"reflections\", \"seconds\" }")]
pub(crate) struct Args {
    /// Scene file or model
    config: PathBuf,
    /// Scene file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Paths traced: more find more, and average colours better
    #[arg(long, value_name = "PATHS", default_value_t = VplPlacementSettings::default().population)]
    population: u32,
    /// Distance within which reflections are put together [default: the finest that needs no more than --max]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true)]
    spacing_m: Option<f64>,
    /// Reflections of each path
    #[arg(long, value_name = "N", default_value_t = VplPlacementSettings::default().depth)]
    depth: u32,
    /// Points explored from each start
    #[arg(long, value_name = "N", default_value_t = VplPlacementSettings::default().explore)]
    explore: u32,
    /// How far VPLs are drawn back into their surface, where shadow rays do not find them; negative: lifted off it
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, default_value_t = VplPlacementSettings::default().normal_bias_m)]
    normal_bias_m: f64,
    /// Seed of exploration and paths
    #[arg(long, value_name = "N", default_value_t = VplPlacementSettings::default().seed)]
    seed: u64,
    /// Where exploration starts, in metres; may be given several times [default: the camera's eye]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    from: Vec<[f64; 3]>,
    /// Most VPLs: those of most reflections are kept
    #[arg(long, value_name = "N", default_value_t = VplPlacementSettings::default().most)]
    max: u32,
    /// What they weigh: the area of the surface around them, measured, or nothing, for automatic weights
    #[arg(long, value_enum, default_value_t)]
    weights: Weights,
}

/// `--weights`.
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum Weights {
    #[default]
    Surface,
    Automatic,
}

#[derive(Serialize)]
struct Report {
    scene: String,
    scene_from: PathBuf,
    out: PathBuf,
    vpls: usize,
    attached: usize,
    by_hand: u32,
    edited: u32,
    deleted: u32,
    replaced: u32,
    left_out: u32,
    taken: u32,
    without_surface: u32,
    wants_population: bool,
    spacing_m: f32,
    origins: u32,
    reflections: u32,
    seconds: f64,
}

fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let expected = "expected three numbers of metres such as 0,1.5,-2";
    numbers.ok().and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| expected.into())
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    if is_model(&args.out) {
        return Err(LauncherError::Usage(format!(
            "--out {} is called like a model: expected a scene file such as scene.toml",
            args.out.display()
        )));
    }
    let Opened { scene, scene_from, file } = opened(&args.config, &args.out)?;
    let counts = file.counts;
    let begun = Instant::now();
    let placement = place_vpls(&scene, &settings(args), &file.taken(&scene))?;
    let seconds = begun.elapsed().as_secs_f64();
    let text = file.with(&scene, &placement, scene.vpls.settings.area_per_weight.into());
    SceneConfig::from_text(&text, &args.out)?;
    write(&args.out, &text).map_err(|e| LauncherError::io("write", &args.out, e))?;
    let report = report(args, (&scene, scene_from), &placement, (counts, seconds));
    output::report(global.json, &report, |report| text_of(report, &args.config))
}

fn settings(args: &Args) -> VplPlacementSettings {
    VplPlacementSettings {
        population: args.population,
        spacing_m: args.spacing_m,
        depth: args.depth,
        explore: args.explore,
        normal_bias_m: args.normal_bias_m,
        seed: args.seed,
        starts: args.from.iter().map(|start| (*start).into()).collect(),
        most: args.max,
        weights: match args.weights {
            Weights::Surface => PlacedWeights::Surface,
            Weights::Automatic => PlacedWeights::Automatic,
        },
    }
}

/// What VPLs are placed in.
struct Opened {
    scene: Scene,
    /// The file that says what the scene is apart from its VPLs.
    scene_from: PathBuf,
    /// With the VPLs that are there.
    file: VplFile,
}

/// The scene, and the file to write: `config`, merged with `out` where that is there already.
fn opened(config: &Path, out: &Path) -> Result<Opened, LauncherError> {
    let read = |path: &Path| {
        let failed = |source| SceneError::Read { file: path.to_owned(), source };
        std::fs::read_to_string(path).map_err(failed)
    };
    let text = match is_model(config) {
        true => ModelScene::of(config, &ModelOptions::default())?.text,
        false => read(config)?,
    };
    let mut file = VplFile::parse(&text, config)?;
    let scene = built(SceneConfig::from_text(&text, config)?)?;
    let is_same = out.canonicalize().is_ok_and(|out| config.canonicalize().is_ok_and(|config| out == config));
    if is_same {
        return Ok(Opened { scene, scene_from: config.to_owned(), file });
    }
    file.rebase_assets(config, out);
    let name = config.file_name().unwrap_or_default().to_string_lossy();
    if !out.exists() {
        file.made_from(&name);
        return Ok(Opened { scene, scene_from: config.to_owned(), file });
    }
    let there = VplFile::parse(&read(out)?, out)?;
    let (file, keeps_out) = file.merged(there, &name).map_err(|problem| {
        let (out, config) = (out.display(), config.display());
        LauncherError::Usage(format!(
            "{out} is there already, beside {config}: {problem}; VPLs in it are renewed by place {out} --out {out}; else \
             delete it, or choose another file"
        ))
    })?;
    let scene = built(SceneConfig::from_text(&file.text(), out)?)?;
    let scene_from = if keeps_out { out } else { config };
    Ok(Opened { scene, scene_from: scene_from.to_owned(), file })
}

/// The scene, whose method may need the VPLs that it is to get.
fn built(mut config: SceneConfig) -> Result<Scene, LauncherError> {
    config.streaming.method = None;
    Ok(config.build()?)
}

/// Replaces the file as a whole: a simulation that watches it never reads a part of it. A link stays one: what it leads to
/// is replaced.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    let target = match (path.canonicalize(), path.read_link()) {
        (Ok(target), _) => target,
        // What the link leads to is not there yet.
        (Err(_), Ok(target)) => path.parent().unwrap_or(Path::new("")).join(target),
        (Err(_), Err(_)) => path.to_owned(),
    };
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".photonstream-");
    // Temporary files are private by default; scenes are as readable as the user's umask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    if let Ok(before) = std::fs::metadata(&target) {
        file.as_file().set_permissions(before.permissions())?;
    }
    file.persist(&target).map_err(|e| e.error)?;
    Ok(())
}

fn report(
    args: &Args,
    (scene, scene_from): (&Scene, PathBuf),
    placement: &VplPlacement,
    (counts, seconds): (VplFileCounts, f64),
) -> Report {
    Report {
        scene: scene.name.clone(),
        scene_from,
        out: args.out.clone(),
        vpls: placement.vpls.len(),
        attached: placement.vpls.iter().filter(|vpl| vpl.is_attached).count(),
        by_hand: counts.by_hand,
        edited: counts.edited,
        deleted: counts.deleted,
        replaced: counts.replaced,
        left_out: placement.left_out,
        taken: placement.taken,
        without_surface: placement.without_surface,
        wants_population: placement.wants_population,
        spacing_m: placement.spacing_m,
        origins: placement.origins,
        reflections: placement.reflections,
        seconds,
    }
}

fn text_of(report: &Report, config: &Path) -> String {
    let Report { scene, vpls, attached, by_hand, edited, deleted, replaced, left_out, taken, .. } = report;
    let number = |n: u32| grouped(n.into());
    let mut out = format!(
        "{}: {vpls} VPLs placed in {scene}, {:.3} m apart, {attached} of them on moving objects\n\
         {} reflections of paths from {} points; {:.2} s\n",
        report.out.display(),
        report.spacing_m,
        number(report.reflections),
        number(report.origins),
        report.seconds,
    );
    if by_hand + edited + deleted + replaced > 0 {
        out.push_str(&format!(
            "{by_hand} made by hand and {edited} edited stay, {deleted} stay deleted, {replaced} were replaced; {taken} \
             were not put beside them\n"
        ));
    }
    if *left_out > 0 {
        out.push_str(&format!("{left_out} more are beyond --max\n"));
    }
    if report.without_surface > 0 {
        out.push_str(&format!(
            "{} more are left out: all surface around them is nearer to others; more --population, or a wider --spacing-m, helps\n",
            number(report.without_surface)
        ));
    }
    if report.wants_population {
        out.push_str(
            "the reflections bear no more, at eight each: more --population gives more, up to --max\n",
        );
    }
    if report.scene_from != config {
        let (from, config) = (report.scene_from.display(), config.display());
        out.push_str(&format!(
            "{from} was changed apart from its VPLs, and {config} was not: the rest stays as in {from}\n"
        ));
    }
    out
}
