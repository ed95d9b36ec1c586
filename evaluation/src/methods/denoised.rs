//! Turns a path-traced picture into a denoised one: Intel Open Image Denoise, where the build has it.

use crate::EvaluateError;
use photonstream_film::Film;

/// Whether this build can denoise.
pub(crate) const IS_BUILT_IN: bool = cfg!(feature = "oidn");

/// `noisy` with every layer denoised, by the albedo and the normals of its pixels' centres in `guides`.
///
/// # Errors
/// [`EvaluateError::Denoise`] where the library fails.
#[cfg(feature = "oidn")]
pub(super) fn denoise(noisy: &Film, guides: &Film) -> Result<Film, EvaluateError> {
    use glam::Vec3;
    use oidn::{Device, RayTracing};
    use photonstream_renderer::LayerKind;

    let failed = |error: oidn::Error| EvaluateError::Denoise { reason: error.to_string() };
    let flat =
        |pixels: &mut dyn Iterator<Item = Vec3>| -> Vec<f32> { pixels.flat_map(|p| p.to_array()).collect() };
    let guide =
        |kind: LayerKind| -> Result<&[Vec3], EvaluateError> { Ok(&guides.layer(kind.name())?.pixels) };
    let albedo = flat(&mut guide(LayerKind::Albedo)?.iter().copied());
    // The layer holds (n + 1)/2, and black where nothing is.
    let normal = |p: Vec3| if p == Vec3::ZERO { p } else { p * 2.0 - Vec3::ONE };
    let normal = flat(&mut guide(LayerKind::Normal)?.iter().map(|&p| normal(p)));
    let (width, height) = (noisy.width(), noisy.height());
    let device = Device::cpu().map_err(failed)?;
    let mut film = Film::new(width, height)?;
    for layer in noisy.layers() {
        let mut pixels = flat(&mut layer.pixels.iter().copied());
        let mut filter = RayTracing::try_new(&device).map_err(failed)?;
        filter
            .image_dimensions(width as usize, height as usize)
            .hdr(true)
            .srgb(false)
            .albedo_normal(&albedo, &normal)
            .clean_aux(true);
        filter.filter_in_place(&mut pixels).map_err(failed)?;
        device.get_error().map_err(failed)?;
        film.push(&layer.name, pixels.chunks_exact(3).map(Vec3::from_slice).collect())?;
    }
    Ok(film)
}

/// Not without the library.
#[cfg(not(feature = "oidn"))]
pub(super) fn denoise(_: &Film, _: &Film) -> Result<Film, EvaluateError> {
    let option = "method";
    let expected = "a build with the feature oidn, where the library Open Image Denoise 2 is installed";
    let found = crate::point::Method::PathTracingDenoised.name().to_owned();
    Err(photonstream_renderer::RenderError::Option { option, found, expected }.into())
}

#[cfg(all(test, feature = "oidn"))]
mod tests {
    use super::*;
    use crate::{
        methods::Bench,
        point::{Method, Point},
    };
    use photonstream_renderer::Watch;
    use photonstream_scene::SceneConfig;
    use std::{path::Path, sync::Arc};

    /// The Cornell box with 16 paths a pixel, 64 × 64 pixels, against 1 024: denoising takes away more than half of the error.
    #[test]
    fn denoising_takes_noise_away() {
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/cornell-box.toml");
        let scene = Arc::new(SceneConfig::from_file(&config).unwrap().build().unwrap());
        let base = Point::of_scene(&scene, 1);
        let mut bench = Bench::new(scene, (64, 64));
        let mut picture = |method, spp, seed| {
            let point = Point { method, spp, seed, ..base.clone() };
            bench.shoot(&point, Watch::default()).unwrap().film
        };
        let truth = picture(Method::PathTracing, 1024, 7);
        let error = |film: &Film| crate::compare(film, &truth, "full").unwrap().whole.rel_rmse;
        let (noisy, clean) = (
            error(&picture(Method::PathTracing, 16, 1)),
            error(&picture(Method::PathTracingDenoised, 16, 1)),
        );
        assert!(clean < 0.5 * noisy, "{clean} of {noisy}");
    }
}
