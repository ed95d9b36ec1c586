//! Turns a scene into its path-traced reference, once: the next evaluation finds it in the cache.

use crate::EvaluateError;
use photonstream_film::Film;
use photonstream_renderer::{LayerKind, Watch};
use photonstream_renderer_cpu::{
    ReferenceOptions, reference,
    reference::{PixelFilter, Stop},
};
use photonstream_scene::Scene;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Seed of references: far from the seeds of what is measured, so that no path tracing repeats its reference's samples.
const SEED: u64 = 0x7e57_ab1e;

/// The layers of a reference.
const LAYERS: [LayerKind; 3] = [LayerKind::Full, LayerKind::Direct, LayerKind::Indirect];

/// A reference picture and how noisy it is.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Layers full, direct and indirect.
    pub film: Film,
    /// Its noise, and what it took.
    pub noise: Noise,
    /// Whether it came from the cache.
    pub cached: bool,
}

/// How noisy a reference is, from two independent halves of its samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Paths per pixel.
    pub spp: u64,
    /// Relative RMSE of the full picture.
    pub full: f64,
    /// Relative RMSE of the indirect light.
    pub indirect: f64,
    /// Time it took, ms.
    pub render_ms: f64,
}

/// The reference of `scene`: from `cache` where it is there, else traced and put there.
///
/// # Errors
/// Cancelled, an impossible size, a folder that cannot be written.
pub fn truth(
    scene: &Scene,
    (width, height): (u32, u32),
    spp: u64,
    cache: &Path,
    watch: Watch<'_>,
) -> Result<Truth, EvaluateError> {
    let path = path(scene.hash, (width, height), spp, cache);
    if let Some((film, noise)) = read(&path, scene.hash, (width, height)) {
        return Ok(Truth { film, noise, cached: true });
    }
    let options = ReferenceOptions {
        width,
        height,
        stop: Stop::Samples(spp),
        layers: LAYERS.to_vec(),
        seed: SEED,
        pixel_filter: PixelFilter::Centre,
        threads: None,
    };
    let traced = reference(scene, &options, watch)?;
    let stats = traced.stats;
    let noise = Noise {
        spp: stats.samples_per_pixel,
        full: stats.noise_rel_rmse,
        indirect: stats.noise_indirect_rel_rmse,
        render_ms: stats.render_ms,
    };
    std::fs::create_dir_all(cache).map_err(|e| EvaluateError::write(cache, e))?;
    let text = serde_json::to_vec(&noise).map_err(|e| EvaluateError::write(&path, e))?;
    // The figures last: a picture without them is not read.
    traced.film.write_exr(&path)?;
    std::fs::write(path.with_extension("json"), text).map_err(|e| EvaluateError::write(&path, e))?;
    Ok(Truth { film: traced.film, noise, cached: false })
}

/// Whoever changes what a reference is of changes the name of its file.
fn path(hash: u64, (width, height): (u32, u32), spp: u64, cache: &Path) -> PathBuf {
    let version = env!("CARGO_PKG_VERSION");
    cache.join(format!("reference-{hash:016x}-{width}x{height}-{spp}spp-v{version}.exr"))
}

fn read(path: &Path, hash: u64, size: (u32, u32)) -> Option<(Film, Noise)> {
    let noise = serde_json::from_slice(&std::fs::read(path.with_extension("json")).ok()?).ok()?;
    let film = Film::read_exr(path).ok()?;
    let is_whole = LAYERS.iter().all(|layer| film.layer(layer.name()).is_ok());
    let is_this = film.metadata.scene_hash == Some(hash) && (film.width(), film.height()) == size;
    (is_whole && is_this).then_some((film, noise))
}

#[cfg(test)]
mod tests {
    use super::*;
    use photonstream_scene::SceneConfig;

    #[test]
    fn a_hit_gives_the_same_and_a_broken_file_is_traced_again() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
        let scene = SceneConfig::from_file(&config).unwrap().build().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let get = || truth(&scene, (16, 12), 8, folder.path(), Watch::default()).unwrap();
        let first = get();
        assert!(!first.cached && first.noise.full > 0.0 && first.noise.spp == 8);
        let second = get();
        assert!(second.cached);
        // Figures go through JSON, whose reader may be off in the last bit.
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-15 * a;
        assert!(
            same(first.noise.full, second.noise.full) && same(first.noise.indirect, second.noise.indirect)
        );
        for layer in LAYERS {
            let pixels = |t: &Truth| t.film.layer(layer.name()).unwrap().pixels.clone();
            assert_eq!(pixels(&first), pixels(&second), "{layer}");
        }
        let file = path(scene.hash, (16, 12), 8, folder.path());
        std::fs::write(&file, b"half").unwrap();
        assert!(!get().cached);
        assert!(get().cached);
        let other = truth(&scene, (16, 12), 10, folder.path(), Watch::default()).unwrap();
        assert!(!other.cached, "other samples, another picture");
    }
}
