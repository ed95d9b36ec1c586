//! Turns a scene file into a verdict: what is in it, what will be modelled, and why.

use crate::{
    cli::Global,
    error::LauncherError,
    output::{self, grouped},
};
use photonstream_scene::{Method, Scene, SceneConfig, features::Decision};
use photonstream_simulator::{cli::Overrides, few_lights, method};
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `photonstream check`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
JSON: { \"scene\", \"scene_hash\", \"objects\", \"triangles\", \"materials\", \"lights\", \"method\", \"method_reasons\": [texts],
  \"published_lights\", \"vpls\", \"blockers\", \"proxies\", \"vsls\", \"pool_paths\", \"width_px\",
  \"height_px\", \"kernel\", \"visibility\", \"origin_m\": [x, y, z], \"extent_m\": [x, y, z], \"choices\": [texts], \"notices\": [texts],
  \"decisions\": [ { \"what\", \"modelled\", \"reason\" } ] }")]
pub(crate) struct Args {
    /// Scene file or model
    pub(crate) config: PathBuf,
    /// Settings that override the config's: what `simulate` and `run` would do with them
    #[command(flatten)]
    pub(crate) overrides: Overrides,
}

#[derive(Serialize)]
struct Report {
    scene: String,
    scene_hash: String,
    objects: usize,
    triangles: usize,
    materials: usize,
    lights: usize,
    method: &'static str,
    method_reasons: Vec<String>,
    published_lights: usize,
    vpls: usize,
    blockers: usize,
    proxies: usize,
    vsls: u32,
    pool_paths: u32,
    width_px: u32,
    height_px: u32,
    kernel: &'static str,
    visibility: &'static str,
    origin_m: [f64; 3],
    extent_m: [f32; 3],
    choices: Vec<String>,
    notices: Vec<String>,
    decisions: Vec<Feature>,
}

/// A decision of what to model, with its reason.
#[derive(Serialize)]
pub(crate) struct Feature {
    what: &'static str,
    modelled: bool,
    reason: String,
}

impl From<Decision> for Feature {
    fn from(decision: Decision) -> Self {
        Self { what: decision.what, modelled: decision.modelled, reason: decision.reason }
    }
}

impl Feature {
    /// One line of a table.
    pub(crate) fn line(&self) -> String {
        format!("  {:<3} {:<20} {}\n", if self.modelled { "yes" } else { "no" }, self.what, self.reason)
    }
}

pub(crate) fn run(args: &Args, global: &Global) -> Result<(), LauncherError> {
    let scene = args.overrides.apply(SceneConfig::from_file(&args.config)?)?.build()?;
    output::report(global.json, &report(&scene), text)
}

fn report(scene: &Scene) -> Report {
    let (lo, hi) = scene.bvh.bounds();
    let choice = method::choose(scene);
    let streams = choice.method == Method::PhotonStreaming;
    Report {
        scene: scene.name.clone(),
        scene_hash: format!("{:016x}", scene.hash),
        objects: scene.objects.len(),
        triangles: scene.geometry.triangles.len(),
        materials: scene.materials.len(),
        lights: scene.lights.len(),
        method: choice.method.name(),
        method_reasons: choice.reasons,
        published_lights: match streams {
            true => scene.streaming.vsls as usize,
            false => few_lights::count(scene, choice.method),
        },
        vpls: scene.vpls.vpls.len(),
        blockers: scene.vpls.blockers.len(),
        proxies: scene.vpls.proxies.len(),
        vsls: scene.streaming.vsls,
        pool_paths: scene.streaming.pool_paths,
        width_px: scene.render.width,
        height_px: scene.render.height,
        kernel: scene.render.kernel.name(),
        visibility: scene.render.visibility.name(),
        origin_m: scene.origin_m.to_array(),
        extent_m: (hi - lo).to_array(),
        choices: scene.choices.clone(),
        notices: scene.notices.clone(),
        decisions: scene.features.decisions().into_iter().map(Feature::from).collect(),
    }
}

/// What carries the light.
fn light(report: &Report) -> String {
    if report.method == Method::PhotonStreaming.name() {
        let (vsls, paths) = (grouped(report.vsls.into()), grouped(report.pool_paths.into()));
        return format!("{vsls} VSLs, a pool of {paths} paths");
    }
    let Report { published_lights, vpls, blockers, proxies, .. } = report;
    format!("{published_lights} lights of {vpls} VPLs, {blockers} blockers, {proxies} proxies")
}

fn text(report: &Report) -> String {
    let Report { scene, scene_hash, objects, materials, lights, .. } = report;
    let [x, y, z] = report.extent_m;
    let mut out = format!(
        "{scene} is valid (hash {scene_hash})\n\
         {objects} objects, {} triangles, {materials} materials, {lights} lights; {x:.3} x {y:.3} x {z:.3} m\n\
         method {}: {}; pictures {} x {}, kernel {}, visibility {}\n",
        grouped(report.triangles as u64),
        report.method,
        light(report),
        report.width_px,
        report.height_px,
        report.kernel,
        report.visibility,
    );
    out.extend(report.method_reasons.iter().map(|reason| format!("because {reason}\n")));
    out.push_str("modelled:\n");
    out.extend(report.decisions.iter().map(Feature::line));
    out.extend(report.choices.iter().map(|choice| format!("chosen: {choice}\n")));
    out.extend(report.notices.iter().map(|notice| format!("notice: {notice}\n")));
    out
}
