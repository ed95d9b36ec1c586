//! Turns `[vpls]`, `[[vpl]]`, `[[blocker]]` and `[[proxy]]` into what the methods of few lights know of a scene.

use super::{lights::not_one_of, settings::widen};
use crate::{
    config::{Field, ProxyConfig, Vector, VplsConfig},
    error::{SceneError, nearest},
    placement::Placement,
    pose::RestMesh,
    scene::{Object, ObjectId},
    settings::{Method, PhantomSurfaces, VplSettings},
    vpls::{Blocker, MOST_POINTS, Proxy, ProxyShape, Vpl, VplSet, VplTables, hull, moved_normal},
};
use glam::{DAffine3, DVec3};

/// Most photons of instant radiosity, and most VPLs: for more there is photon streaming.
const MOST_LIGHTS: u32 = 100_000;

/// Most VPLs whose weights are computed, in a tenth of a second.
const MOST_COMPARED: usize = 10_000;

/// A scene's objects as loaded, and where the scene's space lies.
pub(crate) struct Anchors<'a> {
    pub(crate) objects: &'a [Object],
    pub(crate) rest_meshes: &'a [RestMesh],
    pub(crate) origin: DVec3,
}

impl Anchors<'_> {
    /// The object of that name, and the map from the config's coordinates to the space of what is attached to it.
    fn find(
        &self,
        name: Option<&String>,
        field: &Field<'_>,
    ) -> Result<(Option<ObjectId>, DAffine3), SceneError> {
        let scene_from_config = DAffine3::from_translation(-self.origin);
        let Some(name) = name else { return Ok((None, scene_from_config)) };
        let Ok(index) = self.objects.binary_search_by(|o| o.name.as_str().cmp(name)) else {
            let known = self.objects.iter().map(|o| o.name.as_str());
            return Err(SceneError::UnknownName {
                place: field.key("object").place(),
                kind: "object",
                found: name.clone(),
                nearest: nearest(name, known.clone()),
                known: known.map(str::to_owned).collect(),
            });
        };
        let mesh = &self.rest_meshes[index];
        let loaded_from_scene = mesh.world_from_loaded(&mesh.loaded).inverse();
        Ok((Some(ObjectId(index as u32)), loaded_from_scene * scene_from_config))
    }
}

/// Validates tables, and writes their defaults into them where there are any, or a method that needs them.
pub(crate) fn read(
    mut config: VplTables,
    root: &Field<'_>,
    method: Method,
    anchors: &Anchors<'_>,
) -> Result<VplSet, SceneError> {
    let has_tables = !(config.vpl.is_empty() && config.blocker.is_empty() && config.proxy.is_empty());
    if has_tables || method != Method::PhotonStreaming {
        config.vpls.get_or_insert_default();
    }
    let settings = match &mut config.vpls {
        Some(vpls) => settings(vpls, !config.proxy.is_empty(), &root.key("vpls"))?,
        None => VplSettings::default(),
    };
    let mut set = VplSet { settings, ..VplSet::default() };
    let config = &mut config;
    for (number, vpl) in config.vpl.iter().enumerate() {
        let field = root.key("vpl").element(number);
        let (object, map) = anchors.find(vpl.object.as_ref(), &field)?;
        let normal = field.key("normal").direction(vpl.normal)?;
        if let Some(weight) = vpl.weight {
            field.key("weight").number(weight, "a weight from 0 to 1e9", |x| (0.0..=1e9).contains(&x))?;
        }
        set.vpls.push(Vpl {
            position: map.transform_point3(field.key("position_m").metres(vpl.position_m)?),
            normal: moved_normal(&map.matrix3, normal),
            albedo: field.key("albedo").albedo(vpl.albedo)?.as_vec3(),
            weight: vpl.weight.map(|w| w as f32),
            object,
        });
    }
    for (number, blocker) in config.blocker.iter().enumerate() {
        let field = root.key("blocker").element(number);
        let (object, map) = anchors.find(blocker.object.as_ref(), &field)?;
        let centre = map.transform_point3(field.key("position_m").metres(blocker.position_m)?);
        let radius = field.key("radius_m").length(blocker.radius_m)? as f32;
        set.blockers.push(Blocker { centre, radius, object });
    }
    for (number, proxy) in config.proxy.iter_mut().enumerate() {
        let field = root.key("proxy").element(number);
        let (object, map) = anchors.find(proxy.object.as_ref(), &field)?;
        let stands = Placement::resolve(&mut proxy.position_m, &mut proxy.rotation_deg, &mut None, &field)?;
        let config_from_own = DAffine3 { matrix3: stands.rotation, translation: stands.position };
        let shape = shape(proxy, &field)?;
        set.proxies.push(Proxy { anchor_from_own: map * config_from_own, shape, object });
    }
    check(&set, method, root)?;
    set.tables = std::mem::take(config);
    Ok(set)
}

/// Whether the method has what it needs.
fn check(set: &VplSet, method: Method, root: &Field<'_>) -> Result<(), SceneError> {
    let vpls = set.vpls.len();
    if vpls > MOST_LIGHTS as usize {
        let expected = format!("at most {MOST_LIGHTS} of them");
        return Err(root.key("vpl").invalid(
            vpls,
            expected,
            "leave some out, or use method photon-streaming",
        ));
    }
    let unweighted = set.vpls.iter().filter(|vpl| vpl.weight.is_none()).count();
    if unweighted > 0 && vpls > MOST_COMPARED {
        let expected = format!(
            "weights where there are more than {MOST_COMPARED}: all are compared with all for the others"
        );
        let remedy = "give each a weight, as `photonstream place` does";
        return Err(root.key("vpl").invalid(format!("{unweighted} without a weight"), expected, remedy));
    }
    if vpls == 0 && matches!(method, Method::StaticVpl | Method::PhantomVpl) {
        return Err(root.key("streaming").key("method").invalid(
            method.name(),
            "a method that needs no [[vpl]] tables, as there are none",
            "add some, by hand or by `photonstream place CONFIG --out PLACED.toml`",
        ));
    }
    if set.proxies.is_empty() && set.settings.phantom_surfaces == PhantomSurfaces::Proxies {
        return Err(root.key("vpls").key("phantom_surfaces").invalid(
            "proxies, of which there are none",
            "scene, or at least one [[proxy]]",
            "add a [[proxy]], or write \"scene\"",
        ));
    }
    Ok(())
}

fn settings(
    config: &mut VplsConfig,
    has_proxies: bool,
    field: &Field<'_>,
) -> Result<VplSettings, SceneError> {
    let d = VplSettings::default();
    let surfaces = if has_proxies { PhantomSurfaces::Proxies } else { PhantomSurfaces::Scene };
    let number = |value: &mut Option<f64>, default: f32, key: &str, expected: &str, most: f64| {
        let value = *value.get_or_insert(widen(default));
        let valid = |x: f64| (0.0..=most).contains(&x);
        field.key(key).number(value, expected, valid).map(|x| x as f32)
    };
    let area_per_weight = number(
        &mut config.area_per_weight_m2,
        d.area_per_weight,
        "area_per_weight_m2",
        "an area from 0 to 1e9 m²",
        1e9,
    )?;
    let cull_intensity = number(
        &mut config.cull_intensity_w_sr,
        d.cull_intensity,
        "cull_intensity_w_sr",
        "an intensity from 0 to 1e9 W/sr",
        1e9,
    )?;
    let softening =
        number(&mut config.softening_m2, d.softening, "softening_m2", "an area from 0 to 1e9 m²", 1e9)?;
    let smoothing_s =
        number(&mut config.smoothing_s, d.smoothing_s, "smoothing_s", "a time from 0 to 60 s", 60.0)?;
    let second_bounce_albedo = number(
        &mut config.second_bounce_albedo,
        d.second_bounce_albedo,
        "second_bounce_albedo",
        "an albedo from 0 to 1",
        1.0,
    )?;
    let second_bounce_distance = number(
        &mut config.second_bounce_distance_m,
        d.second_bounce_distance,
        "second_bounce_distance_m",
        "a distance from 0 to 1e9 m",
        1e9,
    )?;
    if area_per_weight == 0.0 {
        let expected = "an area above 0 m²";
        return Err(field.key("area_per_weight_m2").invalid(0, expected, "write for example 1"));
    }
    Ok(VplSettings {
        area_per_weight,
        cull_intensity,
        weights: *config.weights.get_or_insert(d.weights),
        visibility: *config.visibility.get_or_insert(d.visibility),
        phantom_surfaces: *config.phantom_surfaces.get_or_insert(surfaces),
        softening,
        smoothing_s,
        second_bounce_albedo,
        second_bounce_distance,
        photons: field.key("photons").count(*config.photons.get_or_insert(d.photons), 1..=MOST_LIGHTS)?,
    })
}

fn shape(proxy: &mut ProxyConfig, field: &Field<'_>) -> Result<ProxyShape, SceneError> {
    match (&mut proxy.cuboid, &proxy.sphere, &proxy.hull) {
        (Some(cuboid), None, None) => {
            let field = field.key("box");
            let centre = *cuboid.centre_m.get_or_insert(Vector::default());
            Ok(ProxyShape::Cuboid {
                centre: field.key("centre_m").metres(centre)?,
                half: field.key("size_m").lengths(cuboid.size_m)? * 0.5,
            })
        }
        (None, Some(sphere), None) => {
            Ok(ProxyShape::Sphere { radius: field.key("sphere").key("radius_m").length(sphere.radius_m)? })
        }
        (None, None, Some(hull_config)) => {
            let field = field.key("hull").key("points_m");
            let count = hull_config.points_m.len();
            if count > MOST_POINTS {
                let remedy = "leave out those within, or make several proxies";
                return Err(field.invalid(count, format!("at most {MOST_POINTS} points"), remedy));
            }
            let points: Vec<DVec3> =
                hull_config.points_m.iter().map(|&p| field.metres(p)).collect::<Result<_, _>>()?;
            let Some(planes) = hull(&points) else {
                let expected = "at least four points that are not in one plane";
                return Err(field.invalid(format!("{count} points"), expected, "add a point beside it"));
            };
            Ok(ProxyShape::Hull { points, planes })
        }
        (cuboid, sphere, hull) => Err(not_one_of(
            field,
            &[("box", cuboid.is_some()), ("sphere", sphere.is_some()), ("hull", hull.is_some())],
        )),
    }
}
