//! Turns a scene at one moment into files that another renderer reads.

use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped},
};
use photonstream_scene::SceneConfig;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `photonstream export`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Writes DIR/scene.xml with its meshes, direct.xml and full.xml (scene.xml with the depths of these layers), and scene.toml,
the same moment for photonstream itself. Spot lights with a smooth edge become sums of Mitsuba's.

Examples:
  photonstream export configs/door-room.toml --mitsuba out/door --time 4
  mitsuba -m llvm_ad_rgb -Dspp=1024 out/door/full.xml
  photonstream reference out/door/scene.toml --out out/door.exr --filter box
  python evaluation/mitsuba/compare.py configs/cornell-box.toml

JSON: { \"scene\", \"scene_hash\", \"time_s\", \"mitsuba\": path of scene.xml, \"files\", \"meshes\", \"triangles\", \"emitters\" }")]
pub(crate) struct Args {
    /// Scene to export
    config: PathBuf,
    /// Folder for a scene of Mitsuba 3: XML and PLY
    #[arg(long, value_name = "DIR")]
    mitsuba: PathBuf,
    /// The moment of an animated scene
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    time: f64,
}

#[derive(Serialize)]
struct Report {
    scene: String,
    scene_hash: String,
    time_s: f64,
    mitsuba: PathBuf,
    files: usize,
    meshes: usize,
    triangles: usize,
    emitters: usize,
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let scene = SceneConfig::from_file(&args.config)?.at(args.time)?.build()?;
    let exported = photonstream_mitsuba::export(&scene, &args.mitsuba)?;
    let report = Report {
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", scene.hash),
        time_s: args.time,
        files: exported.files.len(),
        meshes: exported.meshes,
        triangles: exported.triangles,
        emitters: exported.emitters,
        mitsuba: exported.files.into_iter().next().unwrap_or_default(),
    };
    output::report(global.json, &report, |report| {
        format!(
            "{}\n{} meshes, {} triangles, {} emitters; {} files",
            report.mitsuba.display(),
            grouped(report.meshes as u64),
            grouped(report.triangles as u64),
            grouped(report.emitters as u64),
            grouped(report.files as u64),
        )
    })
}
