//! Turns a frame of virtual surface lights into picture files, one for each layer asked for.

use crate::{error::LauncherError, progress::Share};
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{
    FrameRenderer, LayerKind, RenderOptions, RenderStats, Watch,
    cli::{Size, shadow_map_px},
    published::PublishedScene,
};
use photonstream_scene::{RangeCulling, RenderSettings, Visibility};
use photonstream_shading::Kernel;
use photonstream_simulator::cli::{MapEdge, Overrides};
use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
    time::Instant,
};

/// What a picture shall be like; what is not given is as the scene says.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct Look {
    /// Size in pixels [default: as the scene says]
    #[arg(long, value_name = "WxH")]
    pub(crate) size: Option<Size>,
    /// How a light's flux falls off: `patch` (near ones as polygons), `disc` (bounded) or `paper` (1/πr²) [default: as the scene says]
    #[arg(long)]
    pub(crate) kernel: Option<Kernel>,
    /// Shadows of indirect light: `rays`, `octahedral` (distance maps that the simulator traces), `shadow-maps` (drawn by wgpu for few lights; rays on the cpu), `none`, or `ao` (ambient occlusion, wgpu only) [default: as the scene says]
    #[arg(long)]
    pub(crate) visibility: Option<Visibility>,
    /// Edge of each virtual surface light's shadow map in texels, for `shadow-maps`: 32, 64, 128 or 256 [default: as the scene says]
    #[arg(long, value_name = "N", value_parser = shadow_map_px)]
    pub(crate) shadow_map_px: Option<u32>,
    /// Smallest radiance worth adding, in W/(m² sr): where a light's range ends, 0 never [default: as the scene says]
    #[arg(long, value_name = "L")]
    pub(crate) epsilon: Option<f32>,
    /// Lights beyond their range: `stochastic` (drawn by lot, right on average) or `cut` (skipped) [default: as the scene says]
    #[arg(long)]
    pub(crate) culling: Option<RangeCulling>,
}

impl Look {
    /// As arguments of a renderer process.
    pub(crate) fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        let mut add = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                arguments.extend([format!("--{name}"), value]);
            }
        };
        add("size", self.size.map(|s| s.to_string()));
        add("kernel", self.kernel.map(|k| k.name().to_owned()));
        add("visibility", self.visibility.map(|v| v.name().to_owned()));
        add("shadow-map-px", self.shadow_map_px.map(|n| n.to_string()));
        add("epsilon", self.epsilon.map(|e| e.to_string()));
        add("culling", self.culling.map(|c| c.name().to_owned()));
        arguments
    }

    /// `overrides`, with what the simulator has to publish for the visibility asked for.
    pub(crate) fn overrides(&self, overrides: &Overrides) -> Overrides {
        let mut overrides = overrides.clone();
        if self.visibility == Some(Visibility::Octahedral) {
            overrides.distance_map_px.get_or_insert(MapEdge::Auto);
        }
        overrides
    }

    fn options(&self, settings: &RenderSettings, layers: &[LayerKind]) -> RenderOptions {
        let mut options = RenderOptions::from_settings(settings);
        if let Some(size) = self.size {
            (options.width, options.height) = (size.width, size.height);
        }
        options.kernel = self.kernel.unwrap_or(options.kernel);
        options.visibility = self.visibility.unwrap_or(options.visibility);
        options.shadow_map_px = self.shadow_map_px.unwrap_or(options.shadow_map_px);
        options.epsilon = self.epsilon.unwrap_or(options.epsilon);
        options.culling = self.culling.unwrap_or(options.culling);
        options.layers = layers.to_vec();
        options
    }
}

/// What pictures of a frame are to be made.
pub(crate) struct Job<'a> {
    pub(crate) look: &'a Look,
    pub(crate) layers: &'a [LayerKind],
    /// Files; all get the same picture.
    pub(crate) outs: &'a [PathBuf],
    /// Whether a quick picture without shadows of the virtual surface lights comes first, in the last of `outs`.
    pub(crate) preview: bool,
    /// When the work on it began.
    pub(crate) begun: Instant,
    pub(crate) cancelled: &'a AtomicBool,
}

/// The pictures of a [`Job`].
pub(crate) struct Made {
    pub(crate) paths: Vec<PathBuf>,
    pub(crate) film: Film,
    pub(crate) stats: RenderStats,
    /// From the beginning to the first picture on disk, in s.
    pub(crate) first_picture_s: f64,
}

impl Job<'_> {
    /// Renders `frame` and writes the files.
    ///
    /// # Errors
    /// Those of the renderer and of the files; cancelled.
    pub(crate) fn make(
        &self,
        frame: &VslFrame,
        renderer: &mut dyn FrameRenderer,
    ) -> Result<Made, LauncherError> {
        let bar = Share::start("picture");
        let mut published = PublishedScene::default();
        let scene = published.update(frame)?;
        let options = self.look.options(&scene.render, self.layers);
        let progress = |share: f64| bar.set(share);
        let mut make = |options: &RenderOptions, outs: &[PathBuf]| -> Result<_, LauncherError> {
            let watch = Watch { progress: Some(&progress), cancelled: Some(self.cancelled) };
            let rendered = renderer.render(scene, frame, options, watch)?;
            let film = rendered.film;
            let mut paths = Vec::new();
            for out in outs {
                paths.extend(write(&film, out, self.layers, &scene.render)?);
            }
            Ok((paths, film, rendered.stats))
        };
        let mut first_picture_s = None;
        let by_rays = matches!(options.visibility, Visibility::Rays | Visibility::ShadowMaps);
        if let (true, true, Some(out)) = (self.preview, by_rays, self.outs.last()) {
            let quick = RenderOptions { visibility: Visibility::None, ..options.clone() };
            make(&quick, std::slice::from_ref(out))?;
            let seconds = self.begun.elapsed().as_secs_f64();
            first_picture_s = Some(seconds);
            tracing::info!(
                "{}: first picture after {seconds:.2} s; the final one, with shadows of all lights, will replace it",
                out.display()
            );
        }
        let (paths, film, stats) = make(&options, self.outs)?;
        let first_picture_s = first_picture_s.unwrap_or_else(|| self.begun.elapsed().as_secs_f64());
        Ok(Made { paths, film, stats, first_picture_s })
    }
}

/// Writes each of `layers`: one to `out` itself, several to files whose names end with the layer's.
///
/// # Errors
/// Those of the files.
pub(crate) fn write(
    film: &Film,
    out: &Path,
    layers: &[LayerKind],
    settings: &RenderSettings,
) -> Result<Vec<PathBuf>, LauncherError> {
    if let Some(folder) = out.parent().filter(|f| !f.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| LauncherError::io("create folder", folder, e))?;
    }
    let mut written = Vec::new();
    for &layer in layers {
        let path = if layers.len() == 1 { out.to_owned() } else { with_layer(out, layer) };
        match Format::of(&path)? {
            Format::Exr => film.only(layer.name())?.write_exr(&path)?,
            Format::Png => film.write_png(&path, layer.name(), layer.display(settings))?,
        }
        written.push(path);
    }
    Ok(written)
}

/// `dir/img.png` as `dir/img-LAYER.png`.
fn with_layer(out: &Path, layer: LayerKind) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let extension = out.extension().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}-{layer}.{extension}"))
}

/// Format of a picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Linear floating point.
    Exr,
    /// Exposed, tone mapped, 8 bits.
    Png,
}

impl Format {
    /// By the end of the file's name.
    ///
    /// # Errors
    /// For any other end than `.exr` and `.png`.
    pub(crate) fn of(path: &Path) -> Result<Self, LauncherError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr),
            Some("png") => Ok(Self::Png),
            _ => Err(LauncherError::Usage(format!(
                "{}: expected a name that ends with .exr (linear) or .png (tone mapped)",
                path.display()
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_layers_make_several_names() {
        let name = with_layer(Path::new("a.b/img.v2.png"), LayerKind::Indirect);
        assert_eq!(name, Path::new("a.b/img.v2-indirect.png"));
        assert_eq!(Format::of(Path::new("x/Y.EXR")).unwrap(), Format::Exr);
        for bad in ["x", "x.jpg", "exr", "a.png/b"] {
            assert!(Format::of(Path::new(bad)).is_err(), "{bad}");
        }
    }
}
