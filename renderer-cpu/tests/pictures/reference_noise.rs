//! Turns pairs of reference pictures into a check of the noise that they state of themselves.
#![allow(clippy::unwrap_used)]

use crate::scenes::cornell;
use photonstream_evaluation::compare;
use photonstream_renderer::{LayerKind, Watch};
use photonstream_renderer_cpu::{Reference, ReferenceOptions, reference, reference::Stop};
use photonstream_scene::RenderSettings;

fn trace(seed: u64, stop: Stop, threads: Option<usize>) -> Reference {
    let defaults = ReferenceOptions::from_settings(&RenderSettings::default(), stop);
    let layers = vec![LayerKind::Full, LayerKind::Direct, LayerKind::Indirect];
    let options = ReferenceOptions { width: 64, height: 48, layers, seed, threads, ..defaults };
    reference(&cornell(), &options, Watch::default()).unwrap()
}

/// The difference of two seeds is √2 times the noise that each states. N = 64 × 48 pixels × 64 paths, seeds 1 and 2.
/// An RMS over n = 3 072 pixels of kurtosis κ has a relative σ of √((κ − 1)/4n): 6 % for κ = 45, as heavy as the tails
/// here; 3 σ of three such estimates is 30 %.
#[test]
fn stated_noise_is_honest() {
    let (a, b) = (trace(1, Stop::Samples(64), None), trace(2, Stop::Samples(64), None));
    assert_eq!(a.stats.samples_per_pixel, 64);
    for (layer, noise) in [
        ("full", [a.stats.noise_rel_rmse, b.stats.noise_rel_rmse]),
        ("indirect", [a.stats.noise_indirect_rel_rmse, b.stats.noise_indirect_rel_rmse]),
    ] {
        let found = compare(&a.film, &b.film, layer).unwrap().whole.rel_rmse;
        let stated = noise[0].hypot(noise[1]);
        assert!((found / stated - 1.0).abs() < 0.3, "{layer}: {found} between seeds, {stated} stated");
    }
    assert_eq!(a.film.metadata.noise_rel_rmse, Some(a.stats.noise_rel_rmse));
}

#[test]
fn threads_do_not_matter() {
    let one = trace(5, Stop::Samples(6), Some(1));
    for threads in [2, 3] {
        let other = trace(5, Stop::Samples(6), Some(threads));
        assert_eq!(other.film, one.film);
        assert_eq!(other.stats.rays, one.stats.rays);
    }
}

/// `--error` stops at the first pass that reaches it, and four times the samples would have been too many.
#[test]
fn an_error_target_is_reached_and_not_overshot() {
    let target = 0.25;
    let picture = trace(1, Stop::Error { rel_rmse: target, max_samples: 4096 }, None);
    let found = picture.stats.noise_rel_rmse;
    assert!(found <= target && found > target / 2.5, "{found} after {}", picture.stats.samples_per_pixel);
    let cut = trace(1, Stop::Error { rel_rmse: 1e-6, max_samples: 10 }, None);
    assert_eq!(cut.stats.samples_per_pixel, 10);
}
