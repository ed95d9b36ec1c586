//! Turns the simulator's state into the records that renderers read.

use crate::{
    counters::Counters, flux::FluxReading, patch::Patch, placement::Placement, simulation::Simulation,
    vsl::Vsl,
};
use glam::Vec3;
use photonstream_protocol::{DistanceRecord, LightRecord, ObjectRecord, PatchRecord, VslRecord};
use photonstream_scene::{ObjectId, Scene};
use photonstream_shading::LightShape;

/// One record for each virtual surface light: where it is, without its flux.
pub fn vsl_records(scene: &Scene, placement: &Placement) -> Vec<VslRecord> {
    let mut records: Vec<VslRecord> = placement
        .vsls
        .iter()
        .map(|vsl| VslRecord { object: vsl.surface.object.0, area: vsl.area, ..VslRecord::default() })
        .collect();
    write_places(&mut records, scene, placement);
    records
}

/// Writes where each virtual surface light is in this version of the scene.
pub fn write_places(records: &mut [VslRecord], scene: &Scene, placement: &Placement) {
    for (record, vsl) in records.iter_mut().zip(&placement.vsls) {
        record.position = vsl.position_ws(&scene.geometry).to_array();
        record.normal = vsl.normal_ws(&scene.geometry).to_array();
    }
}

/// The polygon of each virtual surface light, as it lies in this version of the scene.
pub fn patch_records(simulation: &Simulation) -> Vec<PatchRecord> {
    let mut records = vec![PatchRecord::default(); simulation.placement.patches.len()];
    write_patches(&mut records, simulation, |_| true);
    records
}

/// Writes the polygons of those virtual surface lights, by their index, that differ, as they lie in this version of the scene.
pub fn write_patches(records: &mut [PatchRecord], simulation: &Simulation, differs: impl Fn(usize) -> bool) {
    let Simulation { scene, placement, exposed, .. } = simulation;
    let record = |(patch, vsl): (&Patch, &Vsl), exposed: f32| {
        let mut record = PatchRecord::default();
        let mut area = Vec3::ZERO;
        let mut last = None;
        for (place, corner) in record.corners.chunks_exact_mut(3).zip(patch.corners_ws(&scene.geometry, vsl))
        {
            place.copy_from_slice(&corner.to_array());
            area += last.map_or(Vec3::ZERO, |last: Vec3| last.cross(corner));
            last = Some(corner);
            record.count += 1;
        }
        let first = Vec3::from_slice(&record.corners);
        area += last.map_or(Vec3::ZERO, |last| last.cross(first));
        record.area = 0.5 * area.length() * exposed;
        // A mirrored or crushed object may leave nothing of a polygon.
        let is_usable = record.area > 0.0 && record.corners.iter().all(|x| x.is_finite());
        if is_usable { record } else { PatchRecord::default() }
    };
    let lights = placement.patches.iter().zip(&placement.vsls).zip(exposed.iter());
    for (index, (place, (light, exposed))) in records.iter_mut().zip(lights).enumerate() {
        if differs(index) {
            *place = record(light, *exposed);
        }
    }
}

/// The pieces of distance maps, whose words lie one map after the other: [`crate::distance_maps::all`].
pub fn distance_records(maps: &[u32]) -> Vec<DistanceRecord> {
    maps.as_chunks().0.iter().map(|&texels| DistanceRecord { texels }).collect()
}

/// Writes flux, standard error and age into the records; `now_ms` counts since the simulation started.
pub fn write_flux(records: &mut [VslRecord], readings: impl Iterator<Item = FluxReading>, now_ms: u32) {
    for (record, reading) in records.iter_mut().zip(readings) {
        record.flux = reading.flux.to_array();
        record.standard_error = reading.standard_error;
        record.mean_age_s =
            reading.mean_birth_ms.map_or(0.0, |birth| ((f64::from(now_ms) - birth) / 1e3).max(0.0) as f32);
    }
}

/// The relative standard error of a light's flux in the mean over lights, weighted by flux; 0 where there is no light.
pub fn relative_error(records: &[VslRecord]) -> f64 {
    let sum = |value: &dyn Fn(&VslRecord) -> f64| records.iter().map(value).sum::<f64>();
    let flux = sum(&|r| r.flux.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0);
    let errors = sum(&|r| f64::from(r.standard_error));
    if flux > 0.0 { errors / flux } else { 0.0 }
}

/// One record for each object: the map from its rest space as loaded to the scene's space, and what it reflects.
pub fn object_records(scene: &Scene) -> Vec<ObjectRecord> {
    (0u32..)
        .take(scene.objects.len())
        .map(|id| ObjectRecord {
            id,
            world_from_object: scene.world_from_loaded(ObjectId(id)).to_cols_array(),
            albedo: scene.albedo(ObjectId(id)).to_array(),
            ..ObjectRecord::default()
        })
        .collect()
}

/// One record for each light.
pub fn light_records(scene: &Scene) -> Vec<LightRecord> {
    scene
        .lights
        .iter()
        .map(|light| {
            let mut record = LightRecord {
                enabled: u32::from(light.enabled),
                power: light.light.power.to_array(),
                object: light.object.map_or(u32::MAX, |o| o.0),
                ..LightRecord::default()
            };
            match light.light.shape {
                // Renderers have its radiances from the text.
                LightShape::Sky { .. } => record.kind = 5,
                // And its triangles from its object.
                LightShape::Mesh { .. } => record.kind = 6,
                LightShape::Point { position } => record.position = position.to_array(),
                LightShape::Spot { position, direction, versine_inner, versine_outer } => {
                    record.kind = 1;
                    record.position = position.to_array();
                    record.direction = direction.to_array();
                    record.versine_inner = versine_inner;
                    record.versine_outer = versine_outer;
                }
                LightShape::Directional { direction } => {
                    record.kind = 2;
                    record.direction = direction.to_array();
                }
                LightShape::Parallelogram { corner, edge_u, edge_v }
                | LightShape::Triangle { corner, edge_u, edge_v } => {
                    record.kind =
                        if matches!(light.light.shape, LightShape::Triangle { .. }) { 4 } else { 3 };
                    record.position = corner.to_array();
                    record.edge_u = edge_u.to_array();
                    record.edge_v = edge_v.to_array();
                    record.direction = light.light.shape.emitter_normal().to_array();
                }
            }
            record
        })
        .collect()
}

/// Copies counters into the published statistics.
pub(crate) fn write_counters(statistics: &mut photonstream_protocol::StatisticsRecord, counters: &Counters) {
    statistics.paths_total = counters.paths;
    statistics.rays_total = counters.rays;
    statistics.deposits_total = counters.deposits;
    statistics.escaped = counters.escaped;
    statistics.rejected = counters.rejected;
    statistics.truncated = counters.truncated;
    statistics.absorbed_back = counters.absorbed_back;
}
