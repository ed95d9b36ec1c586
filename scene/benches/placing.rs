//! Turns scenes of `configs/` into what placing at most 500 VPLs takes: median and best of 9 runs, on all cores.
//!
//! `PHOTONSTREAM_SCENES` names the folder with the model of Sponza; without it only the Cornell box is placed.
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use photonstream_scene::{
    AssetRoots, Scene,
    vpl_placement::{VplPlacementSettings, place_vpls},
};
use std::{path::Path, time::Instant};

const RUNS: usize = 9;

fn main() {
    let settings = VplPlacementSettings { most: 500, ..VplPlacementSettings::default() };
    for name in ["cornell-box.toml", "sponza.toml"] {
        if name == "sponza.toml" && std::env::var_os(AssetRoots::VARIABLE).is_none() {
            println!("SKIP {name}: set {} to the folder of the models", AssetRoots::VARIABLE);
            continue;
        }
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs").join(name);
        let scene = Scene::load(&path).unwrap();
        let mut found = 0;
        let mut times: Vec<f64> = (0..RUNS)
            .map(|_| {
                let clock = Instant::now();
                found = place_vpls(&scene, &settings, &[]).unwrap().vpls.len();
                clock.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{name}: {found} VPLs, median {:.3} s, best {:.3} s", times[RUNS / 2], times[0]);
    }
}
