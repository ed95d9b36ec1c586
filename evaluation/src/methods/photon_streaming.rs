//! Turns a scene into streamed virtual surface lights, and those into a picture.

use crate::{EvaluateError, point::Point};
use photonstream_film::Film;
use photonstream_protocol::VslFrame;
use photonstream_renderer::{RenderOptions, VslSet, Watch};
use photonstream_renderer_cpu::render;
use photonstream_scene::{Method, Sampling, Scene, StreamingSettings, Visibility};
use photonstream_simulator::{
    distance_maps,
    emitters::Emitters,
    exposure,
    ledger::{Ledger, PATHS_PER_TASK},
    owner::OwnerTable,
    placement::Placement,
    records,
    simulation::Simulation,
    tracer::Tracer,
};
use std::{sync::Arc, time::Instant};

/// Paper A draws 1.1 points for each light that stays, and shrinks triangles to 0.9.
const PAPER_OVERSAMPLING: f64 = 1.1;
const PAPER_SCALE: f32 = 0.9;

/// Places lights for (number, seed, as paper A does), and how long that took, in ms.
pub(super) fn place(scene: &Scene, (vsls, seed, is_as_paper): (u32, u64, bool)) -> (Simulation, f64) {
    let mut scene = scene.clone();
    (scene.streaming.vsls, scene.streaming.seed) = (vsls, seed);
    scene.streaming.method = Method::PhotonStreaming;
    let scene = Arc::new(scene);
    let begun = Instant::now();
    let simulation = if is_as_paper {
        let mut placement = Placement::with(&scene, vsls, seed, PAPER_SCALE, PAPER_OVERSAMPLING);
        let owners = Arc::new(OwnerTable::new(&scene, &placement));
        placement.measure_areas(&scene, &owners);
        let emitters = Arc::new(Emitters::new(&scene));
        let tracer = Tracer::new(Arc::clone(&scene), Arc::clone(&owners), Arc::clone(&emitters));
        let exposed = exposure::shares(&scene, &placement).into();
        let method = Method::PhotonStreaming;
        Simulation { scene, placement: Arc::new(placement), owners, emitters, tracer, exposed, method }
    } else {
        Simulation::new(scene).adapted()
    };
    (simulation, begun.elapsed().as_secs_f64() * 1e3)
}

/// The same lights with the pool, sampling and seed of `point`.
pub(super) fn with_pool(base: &Simulation, point: &Point) -> Simulation {
    let mut scene = Scene::clone(&base.scene);
    let streaming = &mut scene.streaming;
    (streaming.pool_paths, streaming.sampling, streaming.seed) = (point.pool, point.sampling, point.seed);
    streaming.distance_map_px = match point.visibility {
        Visibility::Octahedral if streaming.distance_map_px == 0 => {
            StreamingSettings::default_distance_map_px(point.vsls)
        }
        Visibility::Octahedral => streaming.distance_map_px,
        _ => 0,
    };
    // Refining goes on for as long as it takes; here a pool is a pool.
    streaming.target_error = 0.0;
    with_scene_and_pool(base, scene)
}

/// The same lights in `scene`, with the pool that its settings ask for.
pub(crate) fn with_scene_and_pool(base: &Simulation, scene: Scene) -> Simulation {
    let scene = Arc::new(scene);
    let emitters = Arc::new(Emitters::new(&scene));
    let tracer = Tracer::new(Arc::clone(&scene), Arc::clone(&base.owners), Arc::clone(&emitters));
    Simulation { scene, emitters, tracer, ..base.clone() }
}

/// Fills the pool, reads the flux and traces the distance maps, if there are to be any: the lights, and the time in ms. A
/// stream of fresh samples is timed, and read, in its second turn, when all its slots hold a path to be replaced.
pub(crate) fn lights_of(simulation: &Simulation) -> Result<(VslSet, f64), EvaluateError> {
    timed(simulation, |ledger| vsls_of(simulation, ledger))
}

/// The same as a frame that a simulator would publish: its records alone.
pub(super) fn frame_of(simulation: &Simulation) -> Result<(VslFrame, f64), EvaluateError> {
    timed(simulation, |ledger| {
        let scene = &simulation.scene;
        let mut vsls = records::vsl_records(scene, &simulation.placement);
        records::write_flux(&mut vsls, ledger.readings(scene), 0);
        let patches = records::patch_records(simulation);
        let maps = distance_maps::all(scene, &simulation.placement);
        let distances = records::distance_records(&maps);
        Ok(VslFrame { epoch: 1, frame: 1, vsls, patches, distances, ..VslFrame::default() })
    })
}

fn timed<T>(
    simulation: &Simulation,
    read: impl FnOnce(&Ledger) -> Result<T, EvaluateError>,
) -> Result<(T, f64), EvaluateError> {
    let mut begun = Instant::now();
    let mut ledger = simulation.fill();
    if simulation.scene.streaming.sampling == Sampling::Fresh {
        begun = Instant::now();
        simulation.advance(&mut ledger, tasks(simulation));
    }
    let light = read(&ledger)?;
    Ok((light, begun.elapsed().as_secs_f64() * 1e3))
}

/// Tasks that are a turn of the whole pool.
pub(crate) fn tasks(simulation: &Simulation) -> u64 {
    let lights = simulation.emitters.lights.iter();
    lights.map(|l| u64::from((l.slots.end - l.slots.start).div_ceil(PATHS_PER_TASK))).sum()
}

/// What renderers get of the present state of `ledger`.
pub(crate) fn vsls_of(simulation: &Simulation, ledger: &Ledger) -> Result<VslSet, EvaluateError> {
    let mut vsls = records::vsl_records(&simulation.scene, &simulation.placement);
    records::write_flux(&mut vsls, ledger.readings(&simulation.scene), 0);
    let patches = records::patch_records(simulation);
    let maps = distance_maps::all(&simulation.scene, &simulation.placement);
    Ok(VslSet::from_records(&vsls)?.with_patches(&patches).with_distances(&records::distance_records(&maps)))
}

/// A picture of the light of `simulation`, its pool filled.
pub(crate) fn render_streamed(
    simulation: &Simulation,
    options: &RenderOptions,
    watch: Watch<'_>,
) -> Result<Film, EvaluateError> {
    let (vsls, _) = lights_of(simulation)?;
    Ok(render(&simulation.scene, &vsls, options, watch)?.film)
}
