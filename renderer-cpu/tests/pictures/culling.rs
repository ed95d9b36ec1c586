//! Turns lights with a range into pictures, and compares what is cut off and what is drawn by lot with the whole sum.
#![allow(clippy::unwrap_used)]

use crate::scenes::{cornell, mean, options, scattered_vsls};
use glam::Vec3;
use photonstream_renderer::{LayerKind, RenderOptions, RenderStats, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{
    RangeCulling::{self, Cut, Stochastic},
    Scene, Visibility,
};
use photonstream_shading::Kernel;

/// Pictures of 40 × 30 pixels of the Cornell box, 300 lights of random flux.
struct Box300 {
    scene: Scene,
    vsls: VslSet,
    options: RenderOptions,
}

impl Box300 {
    fn new() -> Self {
        let scene = cornell();
        let vsls = scattered_vsls(&scene, 300);
        Self { scene, vsls, options: options(40, 30, &[LayerKind::Indirect]) }
    }

    fn picture(&self, epsilon: f32, culling: RangeCulling, seed: u64) -> (Vec<Vec3>, RenderStats) {
        let options = RenderOptions { epsilon, culling, seed, ..self.options.clone() };
        let rendered = render(&self.scene, &self.vsls, &options, Watch::default()).unwrap();
        (rendered.film.layers()[0].pixels.clone(), rendered.stats)
    }
}

fn rel_rmse(found: &[Vec3], exact: &[Vec3]) -> f64 {
    let square: f64 = found.iter().zip(exact).map(|(f, e)| (*f - *e).as_dvec3().length_squared()).sum();
    (square / (3 * exact.len()) as f64).sqrt() / mean(exact)
}

/// Over seeds, pictures by lot scatter about the whole sum and the cut ones lie below it, by 10 to 86 % of it; ε from 3e-5 to
/// 1e-3, S = 64 seeds from 1. The mean of all lies within 4 standard errors of the whole sum, the cut 50 of them and more
/// away; one picture has less than half the cut's RMSE and a tenth of its bias; the RMSE of the mean picture is below a quarter
/// of one's, where an eighth is expected. The RMSE is at most what is reported, and that at most 20 times it: a bound without
/// cosines, albedo and evenness.
#[test]
fn lots_are_right_on_average_and_the_cut_is_not() {
    const SEEDS: u64 = 64;
    let room = Box300::new();
    let (exact, stats) = room.picture(0.0, Stochastic, 1);
    assert_eq!((stats.range_loss_share, stats.range_error), (0.0, 0.0));
    for epsilon in [3e-5, 1e-4, 1e-3] {
        let (cut, cut_stats) = room.picture(epsilon, Cut, 1);
        assert!(cut_stats.range_loss_share > 0.0 && cut_stats.range_error == 0.0);
        let pictures: Vec<_> = (1..=SEEDS).map(|seed| room.picture(epsilon, Stochastic, seed)).collect();
        let bias = |pixels: &[Vec3]| mean(pixels) / mean(&exact) - 1.0;
        let biases: Vec<f64> = pictures.iter().map(|(p, _)| bias(p)).collect();
        let of_all = biases.iter().sum::<f64>() / SEEDS as f64;
        let variance = biases.iter().map(|b| (b - of_all).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
        let sigma = (variance / SEEDS as f64).sqrt();
        let mut sum = vec![Vec3::ZERO; exact.len()];
        for (picture, _) in &pictures {
            sum.iter_mut().zip(picture).for_each(|(s, p)| *s += *p / SEEDS as f32);
        }
        let squares: f64 = pictures.iter().map(|(p, _)| rel_rmse(p, &exact).powi(2)).sum();
        let error = (squares / SEEDS as f64).sqrt();
        let (of_mean, stated) = (rel_rmse(&sum, &exact), pictures[0].1.range_error);
        println!(
            "epsilon {epsilon}: cut bias {:+.4}, rel. RMSE {:.4}; by lot, one: bias {:+.5}, rel. RMSE {error:.4}, stated \
             {stated:.4}; mean of {SEEDS}: bias {of_all:+.6} ± {sigma:.6}, rel. RMSE {of_mean:.5}",
            bias(&cut),
            rel_rmse(&cut, &exact),
            biases[0]
        );
        assert!(of_all.abs() <= 4.0 * sigma, "{of_all} ± {sigma}");
        assert!(bias(&cut) < -50.0 * sigma);
        assert!(biases[0].abs() < -0.1 * bias(&cut) && error < 0.5 * rel_rmse(&cut, &exact));
        assert!(of_mean < 0.25 * error, "{of_mean} of {error}");
        assert!(error <= stated && stated <= 20.0 * error, "{error}, stated {stated}");
        assert!(pictures.iter().all(|(_, stats)| stats.range_loss_share == 0.0));
    }
}

/// Every kernel, with and without shadow rays: the same frame twice has the same bits, another seed other ones, and without a
/// range the culling changes no bit.
#[test]
fn lots_stay_as_they_are_and_need_a_range() {
    let mut room = Box300::new();
    for kernel in Kernel::ALL {
        for visibility in [Visibility::None, Visibility::Rays] {
            (room.options.kernel, room.options.visibility) = (kernel, visibility);
            let (whole, _) = room.picture(0.0, Cut, 1);
            let (by_lot, _) = room.picture(3e-3, Stochastic, 1);
            let (again, _) = room.picture(3e-3, Stochastic, 1);
            let (other, _) = room.picture(3e-3, Stochastic, 2);
            assert_eq!(by_lot, again, "{kernel}: the same frame twice gives the same bits");
            assert!(rel_rmse(&by_lot, &other) > 1e-3, "{kernel}: another seed, other lots");
            assert!(rel_rmse(&by_lot, &whole) > 1e-3, "{kernel}: a range that matters");
            for culling in [Cut, Stochastic] {
                assert_eq!(
                    room.picture(0.0, culling, 1).0,
                    whole,
                    "{kernel}: without a range no bit changes"
                );
            }
        }
    }
}

/// The samples of a pixel have lots of their own: 16 of them lower the error of one to below a half (a quarter is what
/// independent ones would bring).
#[test]
fn samples_average_lots() {
    let mut room = Box300::new();
    let one = rel_rmse(&room.picture(1e-3, Stochastic, 1).0, &room.picture(0.0, Cut, 1).0);
    room.options.samples_per_pixel = 16;
    let many = rel_rmse(&room.picture(1e-3, Stochastic, 1).0, &room.picture(0.0, Cut, 1).0);
    println!("rel. RMSE of lots: {one:.4} with one sample per pixel, {many:.4} with 16");
    assert!(many < 0.5 * one, "{many} of {one}");
}
