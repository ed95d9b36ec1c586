//! Turns a bare `photonstream` into the built-in Cornell box: in a window, or as a picture where there can be none.

use super::{
    render::{self, Simulated},
    run,
};
use crate::{
    backend::GpuArgs,
    cli::Global,
    error::LauncherError,
    output,
    pictures::Look,
    window::{self, WINDOW},
};
use photonstream_renderer::LayerKind;
use photonstream_renderer_cpu::CpuRenderer;
use photonstream_simulator::cli::Overrides;
use std::{
    path::{Path, PathBuf},
    time::Instant,
};
use tempfile::TempDir;

const SCENE: &str = include_str!("../../../configs/cornell-box.toml");

/// Where the pictures go, in the working folder.
const OUT: &str = "out";

pub(crate) fn run(global: &Global) -> Result<(), LauncherError> {
    let begun = Instant::now();
    match window::find(&GpuArgs::default()) {
        Ok(()) => return run::show(&run::Args::built_in(), &[WINDOW.to_owned()], global),
        Err(reason) => {
            tracing::info!("rendering the built-in Cornell box on the CPU, without a window: {reason}")
        }
    }
    let scene = BuiltInScene::new()?;
    let outs = ["exr", "png"].map(|end| PathBuf::from(OUT).join("cornell-box").with_extension(end));
    let overrides = Overrides::default();
    let light = Simulated { config: scene.path(), overrides: &overrides, after: None, preview: true, begun };
    let report = light.picture(&mut CpuRenderer, &Look::default(), &[LayerKind::Full], &outs, global)?;
    output::report(global.json, &report, render::text)
}

/// The built-in scene as a file, for as long as it is needed.
pub(crate) struct BuiltInScene {
    _folder: TempDir,
    path: PathBuf,
}

impl BuiltInScene {
    pub(crate) fn new() -> Result<Self, LauncherError> {
        let folder = tempfile::Builder::new()
            .prefix("photonstream-")
            .tempdir()
            .map_err(|e| LauncherError::io("create a folder in", std::env::temp_dir(), e))?;
        let path = folder.path().join("cornell-box.toml");
        std::fs::write(&path, SCENE).map_err(|e| LauncherError::io("write", &path, e))?;
        Ok(Self { _folder: folder, path })
    }

    /// The scene, where `wanted`.
    pub(crate) fn new_if(wanted: bool) -> Result<Option<Self>, LauncherError> {
        wanted.then(Self::new).transpose()
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }
}
