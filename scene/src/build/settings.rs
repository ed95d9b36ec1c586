//! Turns `[streaming]` and `[render]` into validated settings, and writes their defaults into the config.

use crate::{
    config::{Field, RenderConfig, StreamingConfig},
    error::SceneError,
    settings::{RenderSettings, SHADOW_MAP_EDGES, StreamingSettings, Visibility},
};
use photonstream_shading::distance_map;

/// Largest width and height of a picture in pixels.
const MAX_PICTURE_PX: u32 = 1 << 14;

pub(super) fn streaming(
    config: &mut StreamingConfig,
    visibility: Visibility,
    field: &Field<'_>,
) -> Result<StreamingSettings, SceneError> {
    let d = StreamingSettings::default();
    let vsls = *config.vsls.get_or_insert(d.vsls);
    let pool_paths = *config.pool_paths.get_or_insert(d.pool_paths);
    let seed = *config.seed.get_or_insert(d.seed);
    let placement_scale = *config.placement_scale.get_or_insert(widen(d.placement_scale));
    let publish_period_ms = *config.publish_period_ms.get_or_insert(widen(d.publish_period_ms));
    let light_columns = *config.light_columns.get_or_insert(d.light_columns);
    let default_px = match visibility {
        Visibility::Octahedral => StreamingSettings::default_distance_map_px(vsls),
        _ => d.distance_map_px,
    };
    let distance_map_px = *config.distance_map_px.get_or_insert(default_px);
    if distance_map_px != 0 && !distance_map::EDGES.contains(&distance_map_px) {
        let remedy = "choose one of them, or leave the key out";
        return Err(field.key("distance_map_px").invalid(distance_map_px, "0, 8, 16, 32 or 64", remedy));
    }
    let method = *config.method.get_or_insert(d.method);
    if let Some(budget) = config.update_budget_us {
        field
            .key("update_budget_us")
            .number(budget, "a time above 0, up to 1e9 µs", |x| x > 0.0 && x <= 1e9)?;
    }
    let adaptive = *config.adaptive.get_or_insert(d.adaptive);
    // Lights that move have a map where they were and one where they are.
    let maps = u64::from(vsls) * if adaptive { 2 } else { 1 };
    let texels = maps * u64::from(distance_map_px * distance_map_px);
    if texels > StreamingSettings::MAX_DISTANCE_TEXELS {
        let expected = "at most 2³⁰ texels in the maps of all virtual surface lights, twice as many where they are adaptive";
        let remedy = "choose a smaller distance_map_px or fewer vsls, or adaptive = false";
        return Err(field.key("distance_map_px").invalid(distance_map_px, expected, remedy));
    }
    let target_error = *config.target_error.get_or_insert(d.target_error);
    let latency_ms = *config.latency_ms.get_or_insert(d.latency_ms);
    if let Some(step) = config.fixed_step_ms {
        field
            .key("fixed_step_ms")
            .number(step, "a time above 0, up to 60000 ms", |x| x > 0.0 && x <= 60_000.0)?;
    }
    if i64::try_from(seed).is_err() {
        return Err(field.key("seed").invalid(
            seed,
            "a whole number from 0 to 9223372036854775807",
            "choose a smaller seed",
        ));
    }
    if let Some(threads) = config.threads {
        field.key("threads").count(threads, 1..=1024)?;
    }
    Ok(StreamingSettings {
        method,
        update_budget_us: config.update_budget_us,
        vsls: field.key("vsls").count(vsls, 1..=StreamingSettings::MAX_VSLS)?,
        pool_paths: field.key("pool_paths").count(pool_paths, 1..=StreamingSettings::MAX_POOL_PATHS)?,
        sampling: *config.sampling.get_or_insert(d.sampling),
        seed,
        placement_scale: field
            .key("placement_scale")
            .number(placement_scale, "a factor in (0, 1]", |x| x > 0.0 && x <= 1.0)?
            as f32,
        publish_period_ms: field.key("publish_period_ms").number(
            publish_period_ms,
            "a time from 0.1 to 60000 ms",
            |x| (0.1..=60_000.0).contains(&x),
        )? as f32,
        threads: config.threads,
        light_columns: field.key("light_columns").count(light_columns, 1..=1024)?,
        fixed_step_ms: config.fixed_step_ms,
        distance_map_px,
        target_error: field.key("target_error").number(
            target_error,
            "a relative error from 0 to 1",
            |x| (0.0..=1.0).contains(&x),
        )?,
        latency_ms: field
            .key("latency_ms")
            .number(latency_ms, "a time from 0 to 60000 ms", |x| (0.0..=60_000.0).contains(&x))?,
        adaptive,
    })
}

pub(super) fn render(config: &mut RenderConfig, field: &Field<'_>) -> Result<RenderSettings, SceneError> {
    let d = RenderSettings::default();
    let width = *config.width_px.get_or_insert(d.width);
    let height = *config.height_px.get_or_insert(d.height);
    let epsilon = *config.epsilon.get_or_insert(widen(d.epsilon));
    let light_samples = *config.light_samples.get_or_insert(d.light_samples);
    let shadow_map_px = *config.shadow_map_px.get_or_insert(d.shadow_map_px);
    if !SHADOW_MAP_EDGES.contains(&shadow_map_px) {
        let remedy = "choose one of them, or leave the key out";
        return Err(field.key("shadow_map_px").invalid(shadow_map_px, "32, 64, 128 or 256", remedy));
    }
    let exposure_ev = *config.exposure_ev.get_or_insert(widen(d.exposure_ev));
    Ok(RenderSettings {
        width: field.key("width_px").count(width, 1..=MAX_PICTURE_PX)?,
        height: field.key("height_px").count(height, 1..=MAX_PICTURE_PX)?,
        kernel: *config.kernel.get_or_insert(d.kernel),
        visibility: *config.visibility.get_or_insert(d.visibility),
        shadow_map_px,
        epsilon: field
            .key("epsilon")
            .number(epsilon, "a radiance from 0 to 1e6 W/(m² sr)", |x| (0.0..=1e6).contains(&x))?
            as f32,
        culling: *config.culling.get_or_insert(d.culling),
        light_samples: field.key("light_samples").count(light_samples, 1..=4096)?,
        exposure_ev: field.key("exposure_ev").number(exposure_ev, "stops within ±32", |x| x.abs() <= 32.0)?
            as f32,
        tone_map: *config.tone_map.get_or_insert(d.tone_map),
    })
}

/// The shortest decimal of `x` as f64: 0.9 for 0.9_f32, so that resolved configs read as documented.
pub(super) fn widen(x: f32) -> f64 {
    x.to_string().parse().expect("invariant: a displayed number parses")
}
