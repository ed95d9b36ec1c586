//! Turns the `sky` of a `[light.NAME]` table into a light from all directions.

use super::{
    Inputs,
    imported::{asset_error, find},
    lights::{PlainLight, PlainShape, not_one_of},
};
use crate::{
    config::{Field, LightConfig, OneOrThree, SkyConfig},
    error::SceneError,
    import::{AssetRoots, read_file, read_radiances},
};
use glam::DVec3;
use photonstream_shading::Sky;
use std::sync::Arc;

/// Most bytes of a map's file: 1 GiB, twice what its texels may take.
const MAX_BYTES: u64 = 1 << 30;

/// The light of a table that has a `sky`. Fills in the defaults.
///
/// # Errors
/// If it has another shape, too, a power, or a value or file that is not valid.
pub(super) fn read(
    light: &mut LightConfig,
    field: &Field<'_>,
    roots: &AssetRoots,
    inputs: &mut Inputs<'_>,
) -> Result<PlainLight, SceneError> {
    let LightConfig { power_w, irradiance_w_m2, spot, point, directional, rectangle, sky } = light;
    let given = [
        ("spot", spot.is_some()),
        ("point", point.is_some()),
        ("directional", directional.is_some()),
        ("rectangle", rectangle.is_some()),
        ("sky", sky.is_some()),
    ];
    let Some(sky) = sky.as_mut().filter(|_| given.iter().filter(|(_, given)| *given).count() == 1) else {
        return Err(not_one_of(field, &given));
    };
    for (key, given) in [("power_w", power_w.is_some()), ("irradiance_w_m2", irradiance_w_m2.is_some())] {
        if given {
            let remedy = "leave it out; sky.scale makes a sky brighter";
            return Err(field.key(key).invalid(key, "the radiances of the sky", remedy));
        }
    }
    let field = field.key("sky");
    let scale = *sky.scale.get_or_insert(OneOrThree([1.0; 3]));
    let scale = read_scale(scale, &field)?;
    let sky = Arc::new(spread(sky, &field, roots, inputs)?);
    Ok(PlainLight { power: scale * sky.mean().as_dvec3(), shape: PlainShape::Sky(sky) })
}

/// What the radiances of a sky are multiplied by.
pub(crate) fn read_scale(scale: OneOrThree, field: &Field<'_>) -> Result<DVec3, SceneError> {
    field.key("scale").power(scale)
}

fn spread(
    sky: &mut SkyConfig,
    field: &Field<'_>,
    roots: &AssetRoots,
    inputs: &mut Inputs<'_>,
) -> Result<Sky, SceneError> {
    let SkyConfig {
        radiance_w_m2_sr,
        zenith_w_m2_sr,
        horizon_w_m2_sr,
        ground_w_m2_sr,
        map,
        rotation_deg,
        scale: _,
    } = sky;
    let is_gradient = zenith_w_m2_sr.is_some() || horizon_w_m2_sr.is_some() || ground_w_m2_sr.is_some();
    let given = [
        ("radiance_w_m2_sr", radiance_w_m2_sr.is_some()),
        ("zenith_w_m2_sr with horizon_w_m2_sr", is_gradient),
        ("map", map.is_some()),
    ];
    if given.iter().filter(|(_, given)| *given).count() != 1 {
        return Err(not_one_of(field, &given));
    }
    if rotation_deg.is_some() && map.is_none() {
        let remedy = "leave it out: other skies look the same from all sides";
        return Err(field.key("rotation_deg").invalid("rotation_deg without map", "map", remedy));
    }
    if let Some(path) = map {
        let turn = *rotation_deg.get_or_insert(0.0);
        let turn = field
            .key("rotation_deg")
            .number(turn, "an angle within ±36000 degrees", |x| x.abs() <= 36_000.0)?;
        return read_map(path, turn, &field.key("map"), roots, inputs);
    }
    if let Some(radiance) = *radiance_w_m2_sr {
        let radiance = field.key("radiance_w_m2_sr").power(radiance)?;
        return Ok(Sky::gradient(radiance, radiance, radiance));
    }
    let zenith = zenith_w_m2_sr.ok_or_else(|| field.missing("zenith_w_m2_sr"))?;
    let horizon = horizon_w_m2_sr.ok_or_else(|| field.missing("horizon_w_m2_sr"))?;
    let ground = *ground_w_m2_sr.get_or_insert(OneOrThree([0.0; 3]));
    Ok(Sky::gradient(
        field.key("zenith_w_m2_sr").power(zenith)?,
        field.key("horizon_w_m2_sr").power(horizon)?,
        field.key("ground_w_m2_sr").power(ground)?,
    ))
}

fn read_map(
    path: &mut String,
    rotation_deg: f64,
    field: &Field<'_>,
    roots: &AssetRoots,
    inputs: &mut Inputs<'_>,
) -> Result<Sky, SceneError> {
    let (file, absolute) = find(path, field, roots)?;
    let wrong = |problem| {
        asset_error(
            field,
            file.clone(),
            problem,
            "choose an equirectangular .exr or .hdr picture of radiances",
        )
    };
    let length = std::fs::metadata(&file).map_or(0, |metadata| metadata.len());
    if length > MAX_BYTES {
        return Err(wrong(format!("its {length} bytes are more than {MAX_BYTES}")));
    }
    let bytes = read_file(&file).map_err(&wrong)?;
    // What is kept of the light is the same wherever its text was read.
    path.clone_from(&absolute);
    inputs.sky_content = Some((absolute, blake3::hash(&bytes)));
    let map = read_radiances(&bytes).map_err(&wrong)?;
    inputs.files.push(file.clone());
    Ok(Sky::map(map.width, map.height, &map.texels, rotation_deg))
}
