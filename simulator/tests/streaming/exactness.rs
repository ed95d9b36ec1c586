//! The pool's flux is exact: equal to a rebuild bit for bit, on any number of threads, and zero when light is gone.
#![allow(clippy::unwrap_used)]

use photonstream_simulator::{
    flux::{Deposit, VslFlux},
    pool::PathPool,
    simulation::Simulation,
    tracer::PathBatch,
};
use std::sync::Arc;

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A batch of one to four paths of zero to eleven deposits; `decades` scales their size down by up to as many.
    fn batch(&mut self, slots: u32, vsls: u32, decades: u32) -> PathBatch {
        let mut batch = PathBatch::default();
        let first = (self.next() % u64::from(slots - 4)) as u32;
        for slot in first..=first + (self.next() % 4) as u32 {
            let length = self.next() % 12;
            for _ in 0..length {
                let bits = self.next();
                let scale = 10i32.pow((bits >> 60) as u32 % (decades + 1));
                let rgb = [bits, bits >> 20, bits >> 40].map(|b| (b as i32 & 0x3FF_FFFF) / scale);
                batch.deposits.push(Deposit { vsl: (bits >> 32) as u32 % vsls, rgb });
            }
            batch.slots.push(slot);
            batch.lengths.push(length as u16);
            batch.point_counts.push(0);
        }
        batch
    }
}

/// N = 10⁷ replacements of random slots in three columns, seed 1. Exact: no tolerance.
#[test]
fn ten_million_replacements_equal_a_rebuild() {
    let (slots, vsls) = (5000, 700);
    let mut pool = PathPool::new(vec![(2000, 0), (2300, 1), (slots, 2)], vsls);
    let mut random = Random(1);
    let mut replaced = 0;
    while replaced < 10_000_000 {
        let batch = random.batch(slots, vsls as u32, 5);
        replaced += batch.lengths.len();
        pool.replace(&batch, (replaced / 1000) as u32);
        if replaced % 1_000_000 < 4 {
            assert!(pool.flux() == &pool.rebuilt_flux());
        }
    }
    assert!(pool.flux() == &pool.rebuilt_flux());
    // Memory does not grow with replacements: a slot's share is at most its longest path's, rounded up.
    assert!(pool.bytes() < slots as usize * (16 * 16 * 4 + 64), "{} bytes", pool.bytes());
}

/// Deposits over five decades of size come and go: what is left of them is exactly nothing.
#[test]
fn a_sweep_over_five_decades_leaves_nothing_behind() {
    let (slots, vsls) = (1000, 100);
    let mut pool = PathPool::new(vec![(slots, 0)], vsls);
    let mut random = Random(2);
    for step in 0..200_000 {
        pool.replace(&random.batch(slots, vsls as u32, 5), step);
    }
    assert!(pool.flux() != &VslFlux::new(vsls, 1));
    (0..slots).for_each(|slot| pool.remove(slot));
    assert!(pool.flux() == &VslFlux::new(vsls, 1));
    assert_eq!(pool.valid(), [0]);
}

/// The same tasks on 1, 2 and 7 threads, both ways of sampling, in the middle of a second round: identical flux.
#[test]
fn any_number_of_threads_gives_identical_flux() {
    for sampling in ["replay", "fresh"] {
        let scene = Arc::new(crate::support::scene(&format!(
            "[material.a]\nalbedo = [0.8, 0.5, 0.2]\n\
             [object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
             [object.ball]\nmaterial = \"a\"\nsphere = {{ radius_m = 0.4, segments = 24 }}\n\
             [light.a]\npower_w = [10, 5, 1]\npoint = {{ position_m = [0.7, 0.7, 0.7] }}\n\
             [light.b]\npower_w = 3\nspot = {{ position_m = [-0.8, 0, 0], target_m = [0, 0, 0], outer_half_angle_deg = 40 }}\n\
             [streaming]\nvsls = 200\npool_paths = 20000\nsampling = \"{sampling}\"\n"
        )));
        let flux = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let simulation = Simulation::new(Arc::clone(&scene));
                let mut ledger = simulation.ledger();
                simulation.advance(&mut ledger, 100);
                assert!(ledger.pool().flux() == &ledger.pool().rebuilt_flux());
                (simulation.placement, ledger.pool().flux().clone(), ledger.counters())
            })
        };
        let one = flux(1);
        assert!(one.2.deposits > 30_000);
        for threads in [2, 7] {
            assert!(flux(threads) == one, "{sampling} on {threads} threads");
        }
    }
}

/// Lights that share a column give what they give in columns of their own, to the rounding of deposits: 2⁻²⁴ each.
#[test]
fn shared_columns_agree_with_columns_of_their_own() {
    let scene = |columns: u32| {
        let lights: String = (0..5)
            .map(|i| {
                let power = [10.0, 0.1, 1.0, 3.0, 0.0][i];
                format!(
                    "[light.l{i}]\npower_w = [{power}, 1, 0]\npoint = {{ position_m = [0.{i}, 0, 0.1] }}\n"
                )
            })
            .collect();
        crate::support::filled(crate::support::scene(&format!(
            "[material.a]\nalbedo = 0.5\n[object.room]\nmaterial = \"a\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
             {lights}[streaming]\nvsls = 50\npool_paths = 20000\nlight_columns = {columns}\n"
        )))
    };
    let (own, own_ledger) = scene(8);
    let (shared, shared_ledger) = scene(2);
    assert_eq!(own.emitters.columns.len(), 5);
    assert_eq!(shared.emitters.columns.len(), 2);
    for (a, b) in own_ledger.readings(&own.scene).zip(shared_ledger.readings(&shared.scene)) {
        assert!((a.flux - b.flux).abs().max_element() < 1e-4 * a.flux.max_element(), "{} {}", a.flux, b.flux);
    }
}
