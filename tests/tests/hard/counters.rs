//! Turns counts at and beyond the limits of their types (a pool of 1, samples past 2³², 10⁹ replacements) into exact flux.

use crate::rooms::{Lit, closed_box, figure};
use photonstream_shading::sobol::Sequence;
use photonstream_simulator::{
    counters::Counters,
    flux::{Deposit, MAX_DEPOSITS, MAX_THROUGHPUT, VslFlux},
    pool::PathPool,
    simulation::Simulation,
    tracer::{Draw, PathBatch, Wave},
};

const BULB: &str = "power_w = 10\npoint = { position_m = [0.3, 0.2, -0.7] }";

/// A pool of one path, replayed: traced once, at rest, finite, and its error is stated as what it is: for one path, n = 1,
/// the mean of squares less the square of the mean is 0. Streamed: 3 000 replacements, of which the mean over time is
/// P ρ/(1 − ρ): 4.5 σ, σ = √2/√3000. A pool that divided by n − 1 would publish NaN.
#[test]
fn a_pool_of_one_path() {
    let lit = Lit::new(&closed_box(0.5, BULB, "vsls = 20\npool_paths = 1"));
    lit.assert_sane();
    assert_eq!(lit.ledger.pool().slots(), 1);
    assert!(lit.ledger.is_done());
    lit.picture(8);
    let scene = closed_box(0.5, BULB, "vsls = 20\npool_paths = 1\nsampling = \"fresh\"");
    let simulation = Simulation::new(scene);
    let mut ledger = simulation.ledger();
    let mut sum = 0.0;
    for _ in 0..3000 {
        simulation.advance(&mut ledger, 1);
        sum += ledger.readings(&simulation.scene).map(|r| f64::from(r.flux.x)).sum::<f64>();
    }
    assert_eq!(ledger.counters().paths, 3000);
    assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux());
    figure("pool of 1, mean of 3 000", sum / 3000.0 / 10.0 - 1.0, 4.5 * (2.0f64 / 3000.0).sqrt());
}

/// 10⁹ replacements and more, fast-forwarded: each slot's count of refills is set to what it is after 0, 10⁹, 2³² and 10¹⁵
/// samples of the light and then run for a round. Flux is an integer sum, so its state after any number of replacements
/// depends on the paths in the pool alone: it must equal a rebuild, bit for bit, in the middle of each round and at its end;
/// that the sum of 10⁷ *successive* replacements is exact is tested in `simulator/tests/streaming/exactness.rs`. And each
/// block of samples, past 2³², too, has the light of the first: P ρ/(1 − ρ), 4.5 σ; correlation with the first below 4.5/√N.
///
/// N = 4 096 slots. Samples addressed by u32 would repeat after 2³²: the same paths, and a stream that no longer converges.
#[test]
fn a_billion_replacements_and_samples_past_two_to_the_32() {
    const SLOTS: u32 = 4096;
    let scene = closed_box(0.5, BULB, &format!("vsls = 30\npool_paths = {SLOTS}\nsampling = \"fresh\""));
    let simulation = Simulation::new(scene);
    let mut pool = PathPool::new(vec![(SLOTS, 0)], 30);
    let mut first: Vec<f64> = Vec::new();
    let generations: [u64; 6] =
        [0, 1_000_000_000 / 4096, (1 << 20) - 1, 1 << 20, 244_140_625, u64::from(u32::MAX)];
    for generation in generations {
        let mut totals = Vec::new();
        for start in (0..SLOTS).step_by(512) {
            let draws: Vec<Draw> =
                (start..start + 512).map(|slot| Draw { slot, generation: generation as u32 }).collect();
            let mut batch = PathBatch::default();
            simulation.tracer.trace(&draws, &mut Wave::default(), &mut batch);
            totals.extend(batch.paths().map(|p| p.deposits.iter().map(|d| f64::from(d.rgb[0])).sum::<f64>()));
            pool.replace(&batch, generation as u32);
            if start == 2048 {
                assert!(pool.flux() == &pool.rebuilt_flux(), "in the middle of generation {generation}");
            }
        }
        assert!(pool.flux() == &pool.rebuilt_flux(), "after generation {generation}");
        let totals: Vec<f64> = totals.iter().map(|t| t / f64::from(1 << 24)).collect();
        let sigma = (2.0 / f64::from(SLOTS)).sqrt();
        let mean = totals.iter().sum::<f64>() / f64::from(SLOTS);
        figure(&format!("generation {generation}, σ"), (mean - 1.0) / sigma, 4.5);
        if first.is_empty() {
            first = totals;
        } else {
            let products = first.iter().zip(&totals).map(|(a, b)| (a - 1.0) * (b - 1.0));
            // The variance of a path's deposits is ρ/(1 − ρ)² = 2.
            let correlation = products.sum::<f64>() / f64::from(SLOTS) / 2.0;
            figure(
                &format!("correlation of generation {generation} with 0"),
                correlation,
                4.5 / f64::from(SLOTS).sqrt(),
            );
        }
    }
    (0..SLOTS).for_each(|slot| pool.remove(slot));
    assert!(pool.flux() == &VslFlux::new(30, 1), "what is taken out leaves exactly nothing");
}

/// Sample numbers around 2³², 2⁴⁸ and 2⁶⁴ are numbers in [0, 1), differ from those 2³² before, and are as even as the
/// first: of 4 096 successive points each of 4 096 intervals holds exactly one ((0, 2)-sequence).
#[test]
fn samples_past_two_to_the_32_are_stratified() {
    let sequence = Sequence::new(1, 2);
    for base in [1u64 << 32, 1 << 48, u64::MAX - 4095] {
        let mut counts = [0u8; 4096];
        let mut equal = 0;
        for i in 0..4096u64 {
            let x = sequence.sample(base + i).next_1d();
            assert!((0.0..1.0).contains(&x));
            counts[(x * 4096.0) as usize] += 1;
            equal += u32::from(x == sequence.sample((base + i) as u32 as u64).next_1d());
        }
        assert!(counts.iter().all(|&c| c == 1), "from {base}");
        assert!(equal < 4, "the points of block {} are those of the first", base >> 32);
    }
}

/// The largest of everything on one light: 2¹³ deposits of 4 in each of as many paths as fit in memory here, births at
/// the end of u32 milliseconds (49 days), counted up and down again. Sums of births would pass 2⁶⁴ with a full pool: i128.
#[test]
fn the_largest_deposits_add_up_and_vanish() {
    let largest = Deposit::new(0, glam::Vec3::splat(MAX_THROUGHPUT)).unwrap();
    let path = vec![largest; MAX_DEPOSITS];
    let mut flux = VslFlux::new(1, 1);
    for _ in 0..256 {
        flux.add(0, &path, u32::MAX);
    }
    let cell = flux.column(0)[0];
    assert_eq!(cell.rgb, [256 << (26 + 13); 3]);
    assert_eq!(cell.births_ms, i128::from(u32::MAX) << 21);
    for _ in 0..256 {
        flux.subtract(0, &path, u32::MAX);
    }
    assert!(flux == VslFlux::new(1, 1));
}

/// Counters of events past 2³², as a day of streaming has them: 4.3 · 10⁹ paths take 20 minutes of a large machine.
#[test]
fn counters_pass_two_to_the_32() {
    let mut counters = Counters::default();
    let step =
        Counters { paths: u64::from(u32::MAX), rays: 1 << 40, deposits: 1 << 40, ..Counters::default() };
    for _ in 0..1000 {
        counters += step;
    }
    assert_eq!(counters.paths, u64::from(u32::MAX) * 1000);
    assert_eq!(counters.rays, 1000 << 40);
}
