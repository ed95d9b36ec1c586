//! Turns the name of a built-in renderer and its options into the renderer.

use crate::error::LauncherError;
use photonstream_renderer::FrameRenderer;
use photonstream_renderer_cpu::CpuRenderer;

/// Renderers of this build.
pub(crate) const BUILT_IN_RENDERERS: &[&str] =
    if cfg!(feature = "wgpu") { &["cpu", "wgpu"] } else { &["cpu"] };

/// Options of the GPU renderer; none in a build without it.
#[cfg(feature = "wgpu")]
pub(crate) use photonstream_renderer_wgpu::cli::GpuArgs;

/// Options of the GPU renderer; none in a build without it.
#[cfg(not(feature = "wgpu"))]
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub(crate) struct GpuArgs {}

#[cfg(not(feature = "wgpu"))]
impl GpuArgs {
    pub(crate) fn to_arguments(&self) -> Vec<String> {
        Vec::new()
    }
}

/// The renderer called `name`, which is one of [`BUILT_IN_RENDERERS`].
///
/// # Errors
/// No adapter that does.
pub(crate) fn renderer(name: &str, gpu: &GpuArgs) -> Result<Box<dyn FrameRenderer>, LauncherError> {
    check([name], gpu)?;
    match name {
        #[cfg(feature = "wgpu")]
        "wgpu" => Ok(Box::new(gpu.renderer().map_err(photonstream_renderer::RenderError::from)?)),
        _ => Ok(Box::new(CpuRenderer)),
    }
}

/// Refuses options of the GPU renderer where no such renderer is among `names`.
///
/// # Errors
/// [`LauncherError::Usage`].
pub(crate) fn check<'a>(
    names: impl IntoIterator<Item = &'a str>,
    gpu: &GpuArgs,
) -> Result<(), LauncherError> {
    let options = gpu.to_arguments();
    if options.is_empty() || names.into_iter().any(|name| name == "wgpu") {
        return Ok(());
    }
    Err(LauncherError::Usage(format!("{} is for --renderer wgpu alone", options.join(" "))))
}
