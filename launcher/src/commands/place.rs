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
Free space is explored from the camera's eye (or from --from): each point is half the free distance along a random direction
from one before. From these points and from the lights, paths are traced that are reflected as by matt surfaces. What they
meet is put together where it is nearer than the spacing, looks the same way within 45 degrees, and is of alike material;
nothing is put where no path comes.

FILE is CONFIG with [[vpl]] entries; the methods static-vpl and phantom-vpl use them (streaming.method). Where FILE is there
already, or is CONFIG itself, entries that were made by hand or edited stay, none is put beside them, and what was deleted
stays deleted; the others are replaced.

Examples:
  photonstream place configs/sponza.toml --out sponza-vpls.toml --max 500
  photonstream place room.toml --out room.toml --spacing-m 0.5 --from 0,1.5,0 --from 4,1.5,0
  photonstream place model.glb --out model.toml

JSON: { \"scene\", \"out\", \"vpls\", \"attached\", \"by_hand\", \"edited\", \"deleted\", \"replaced\", \"left_out\", \"taken\", \"without_surface\",
  \"spacing_m\", \"origins\", \"reflections\", \"seconds\" }")]
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
    #[arg(long, value_name = "METRES")]
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
    let (scene, file) = opened(&args.config, &args.out)?;
    let counts = file.counts;
    let begun = Instant::now();
    let placement = place_vpls(&scene, &settings(args), &file.taken(&scene))?;
    let seconds = begun.elapsed().as_secs_f64();
    let text = file.with(&scene, &placement, scene.vpls.settings.area_per_weight.into());
    SceneConfig::from_text(&text, &args.out)?;
    write(&args.out, &text).map_err(|e| LauncherError::io("write", &args.out, e))?;
    output::report(global.json, &report(args, &scene, &placement, (counts, seconds)), text_of)
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

/// The scene, and the file whose VPLs are renewed: `out` where it is there already, else `config`.
fn opened(config: &Path, out: &Path) -> Result<(Scene, VplFile), LauncherError> {
    let read = |path: &Path| {
        let failed = |source| SceneError::Read { file: path.to_owned(), source };
        std::fs::read_to_string(path).map_err(failed)
    };
    let is_same = out.canonicalize().is_ok_and(|out| config.canonicalize().is_ok_and(|config| out == config));
    if out.exists() && !is_same {
        let text = read(out)?;
        let scene = built(SceneConfig::from_text(&text, out)?)?;
        let given = built(SceneConfig::from_file(config)?)?;
        if !have_one_shape(&given, &scene) {
            return Err(LauncherError::Usage(format!(
                "{out} is there already, and its objects, materials or lights are not those of {config}; VPLs in it are \
                 renewed by place {out} --out {out}; else delete it, or choose another file",
                out = out.display(),
                config = config.display()
            )));
        }
        return Ok((scene, VplFile::parse(&text, out)?));
    }
    let text = match is_model(config) {
        true => ModelScene::of(config, &ModelOptions::default())?.text,
        false => read(config)?,
    };
    let scene = built(SceneConfig::from_text(&text, config)?)?;
    let mut file = VplFile::parse(&text, config)?;
    file.rebase_assets(config, out);
    Ok((scene, file))
}

/// The scene, whose method may need the VPLs that it is to get.
fn built(mut config: SceneConfig) -> Result<Scene, LauncherError> {
    config.streaming.method = None;
    Ok(config.build()?)
}

/// Whether two scenes have the same surfaces and lights.
fn have_one_shape(a: &Scene, b: &Scene) -> bool {
    let objects = |scene: &Scene| -> Vec<_> {
        scene.objects.iter().map(|o| (o.name.clone(), o.material, o.sides, o.triangles.clone())).collect()
    };
    a.geometry == b.geometry
        && objects(a) == objects(b)
        && a.materials == b.materials
        && a.lights == b.lights
        && a.animation == b.animation
}

/// Replaces the file as a whole: a simulation that watches it never reads a part of it.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".photonstream-");
    // Temporary files are private by default; scenes are as readable as the user's umask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

fn report(
    args: &Args,
    scene: &Scene,
    placement: &VplPlacement,
    (counts, seconds): (VplFileCounts, f64),
) -> Report {
    Report {
        scene: scene.name.clone(),
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
        spacing_m: placement.spacing_m,
        origins: placement.origins,
        reflections: placement.reflections,
        seconds,
    }
}

fn text_of(report: &Report) -> String {
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
    out
}
