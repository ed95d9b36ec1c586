//! Turns what the renderer shows into a pair of files, without the interface.

use crate::{choices::Choices, following::Published};
use photonstream_renderer::{RenderError, SOFTWARE};
use photonstream_renderer_wgpu::{Renderer, View};
use std::path::{Path, PathBuf};

/// Draws `view` and writes it as screenshot-NNNN.exr and .png into `folder`; the EXR first.
///
/// # Errors
/// [`RenderError`]: the device has failed, or a file cannot be written.
pub(crate) fn write(
    renderer: &mut Renderer,
    published: &Published,
    choices: &Choices,
    view: &View,
    folder: &Path,
) -> Result<[PathBuf; 2], RenderError> {
    let kind = choices.layer();
    let mut film = renderer.film(view, &[kind])?;
    let (frame, metadata) = (&published.frame, &mut film.metadata);
    metadata.frame = Some(frame.frame);
    metadata.scene_hash = Some(frame.scene_hash);
    metadata.scene_name = Some(published.scene.name.clone());
    metadata.method = Some("photon-streaming".into());
    metadata.kernel = Some(view.kernel.name().into());
    metadata.visibility = Some(view.visibility.name().into());
    metadata.samples_per_pixel = Some(1);
    metadata.photon_paths = Some(frame.statistics.pool_valid);
    metadata.vsls = Some(frame.vsls.len() as u64);
    metadata.software = Some(SOFTWARE.into());
    std::fs::create_dir_all(folder)
        .map_err(|source| photonstream_film::FilmError::Write { path: folder.into(), source })?;
    let [exr, png] = names(folder, Path::exists);
    film.write_exr(&exr)?;
    let settings = photonstream_scene::RenderSettings {
        exposure_ev: choices.exposure_ev,
        tone_map: choices.tone_map,
        ..published.scene.render.clone()
    };
    film.write_png(&png, kind.name(), kind.display(&settings))?;
    // As precise as the numbers are, so that the same picture can be made again.
    tracing::info!("{}: frame {}, {:?}", exr.display(), frame.frame, view.camera);
    Ok([exr, png])
}

/// The first pair of names that are not taken.
fn names(folder: &Path, exists: impl Fn(&Path) -> bool) -> [PathBuf; 2] {
    let pair = |n: u32| ["exr", "png"].map(|end| folder.join(format!("screenshot-{n:04}.{end}")));
    let mut n = 1;
    while pair(n).iter().any(|path| exists(path)) {
        n += 1;
    }
    pair(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_picture_is_overwritten() {
        let taken = ["o/screenshot-0001.exr", "o/screenshot-0002.png", "o/screenshot-0004.exr"];
        let [exr, png] = names(Path::new("o"), |path| taken.iter().any(|t| path == Path::new(t)));
        assert_eq!((exr, png), ("o/screenshot-0003.exr".into(), "o/screenshot-0003.png".into()));
        assert_eq!(names(Path::new(""), |_| false)[0], Path::new("screenshot-0001.exr"));
    }
}
