//! Checks that the documented keys and defaults are those that exist.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::settings::{PhantomSurfaces, VplVisibility, Weights};
use std::{collections::BTreeSet, path::Path};
use toml::{Table, Value};

const README: &str = include_str!("../../../configs/README.md");

/// A config with every key there is: a struct literal each, so that a new key does not compile until it is here.
fn every_key() -> SceneConfig {
    let v = Vector([1.0, 2.0, 3.0]);
    let c = Some(OneOrThree([1.0; 3]));
    let part = PartOverride {
        rename: Some("n".into()),
        material: Some("m".into()),
        sides: Some(Sides::Both),
        radiance_w_m2_sr: c,
    };
    let object = ObjectConfig {
        material: Some("m".into()),
        sides: Some(Sides::Both),
        position_m: Some(v),
        rotation_deg: Some(v),
        scale: c,
        quad: Some(QuadConfig { corner_m: v, edge_u_m: v, edge_v_m: v }),
        cuboid: Some(BoxConfig { size_m: v, centre_m: Some(v) }),
        sphere: Some(SphereConfig { radius_m: 1.0, segments: Some(1) }),
        torus_knot: Some(TorusKnotConfig {
            p: Some(1),
            q: Some(1),
            radius_m: 1.0,
            tube_radius_m: 1.0,
            segments: Some(1),
            tube_segments: Some(1),
        }),
        obj: Some(ObjConfig {
            path: "p".into(),
            up_axis: Some(UpAxis::Z),
            unit_m: Some(1.0),
            smooth: Some(true),
            exclude: Some(vec!["x".into()]),
            transmit: Some(vec!["x".into()]),
            materials: Some([("NAME".into(), "m".into())].into()),
            parts: Some([("NAME".into(), part.clone())].into()),
        }),
        ply: Some(PlyConfig {
            path: "p".into(),
            up_axis: Some(UpAxis::Z),
            unit_m: Some(1.0),
            smooth: Some(true),
        }),
        gltf: Some(GltfConfig {
            path: "p".into(),
            up_axis: Some(UpAxis::Z),
            unit_m: Some(1.0),
            smooth: Some(true),
            exclude: Some(vec!["x".into()]),
            transmit: Some(vec!["x".into()]),
            materials: Some([("NAME".into(), "m".into())].into()),
            parts: Some([("NAME".into(), part.clone())].into()),
            lights: Some(
                [("NAME".into(), LightOverride { power_w: c, irradiance_w_m2: c, exclude: Some(true) })]
                    .into(),
            ),
            animation: Some(AnimationChoice::Named("a".into())),
            animation_time_s: Some(1.0),
        }),
    };
    let light = LightConfig {
        power_w: c,
        irradiance_w_m2: c,
        spot: Some(SpotConfig {
            position_m: v,
            target_m: Some(v),
            direction: Some(v),
            outer_half_angle_deg: 1.0,
            inner_half_angle_deg: Some(1.0),
        }),
        point: Some(PointConfig { position_m: v }),
        directional: Some(DirectionalConfig { direction: v }),
        rectangle: Some(RectangleConfig {
            corner_m: v,
            edge_u_m: v,
            edge_v_m: v,
            albedo: c,
            position_m: Some(v),
            rotation_deg: Some(v),
            scale: c,
        }),
        sky: Some(SkyConfig {
            radiance_w_m2_sr: c,
            zenith_w_m2_sr: c,
            horizon_w_m2_sr: c,
            ground_w_m2_sr: c,
            map: Some("p".into()),
            rotation_deg: Some(1.0),
            scale: c,
        }),
    };
    let animation = AnimationConfig {
        light: Some("l".into()),
        object: Some("o".into()),
        property: Some(AnimatedProperty::Position),
        times_s: Some(vec![0.0, 1.5]),
        values: Some(vec![AnimatedValue::One(1.0), AnimatedValue::Three([1.0, 2.0, 3.0])]),
        interpolation: Some(Interpolation::Smooth),
        orbit: Some(OrbitConfig { centre_m: v, axis: v, radius_m: 1.0, period_s: 1.0, phase_deg: Some(1.0) }),
        repeat: Some(Repeat::Bounce),
    };
    SceneConfig {
        name: Some("n".into()),
        origin_m: Some(v),
        camera: CameraConfig {
            node: Some("n".into()),
            position_m: Some(v),
            target_m: Some(v),
            up: Some(v),
            vertical_fov_deg: Some(1.0),
        },
        material: [("NAME".into(), MaterialConfig { albedo: OneOrThree([0.5; 3]) })].into(),
        object: [("NAME".into(), object)].into(),
        light: [("NAME".into(), light)].into(),
        animation: vec![animation.clone(), animation],
        streaming: StreamingConfig {
            method: Some(Method::StaticVpl),
            update_budget_us: Some(1.0),
            vsls: Some(1),
            pool_paths: Some(1),
            sampling: Some(Sampling::Fresh),
            seed: Some(1),
            placement_scale: Some(1.0),
            publish_period_ms: Some(1.0),
            threads: Some(1),
            light_columns: Some(1),
            fixed_step_ms: Some(1.0),
            distance_map_px: Some(8),
            target_error: Some(1.0),
            latency_ms: Some(1.0),
            adaptive: Some(true),
        },
        render: RenderConfig {
            width_px: Some(1),
            height_px: Some(1),
            kernel: Some(Kernel::Paper),
            visibility: Some(Visibility::None),
            shadow_map_px: Some(32),
            epsilon: Some(1.0),
            culling: Some(RangeCulling::Cut),
            light_samples: Some(1),
            exposure_ev: Some(1.0),
            tone_map: Some(ToneMap::Linear),
        },
        vpls: Some(VplsConfig {
            area_per_weight_m2: Some(1.0),
            cull_intensity_w_sr: Some(1.0),
            weights: Some(Weights::Amortised),
            visibility: Some(VplVisibility::Rays),
            phantom_surfaces: Some(PhantomSurfaces::Proxies),
            softening_m2: Some(1.0),
            smoothing_s: Some(1.0),
            second_bounce_albedo: Some(1.0),
            second_bounce_distance_m: Some(1.0),
            photons: Some(1),
            placed: Some(PlacedConfig {
                from: Some("a".into()),
                given: vec!["a".into()],
                sites: vec!["a".into()],
            }),
        }),
        vpl: vec![VplConfig {
            position_m: v,
            normal: v,
            albedo: OneOrThree([0.5; 3]),
            weight: Some(1.0),
            object: Some("o".into()),
            placed: Some("a".into()),
        }],
        blocker: vec![BlockerConfig { position_m: v, radius_m: 1.0, object: Some("o".into()) }],
        proxy: vec![ProxyConfig {
            position_m: Some(v),
            rotation_deg: Some(v),
            cuboid: Some(BoxConfig { size_m: v, centre_m: Some(v) }),
            sphere: Some(ProxySphereConfig { radius_m: 1.0 }),
            hull: Some(HullConfig { points_m: vec![v] }),
            object: Some("o".into()),
        }],
        document: Document::default(),
        chosen: Vec::new(),
    }
}

fn leaves(value: &Value, path: &str, out: &mut BTreeSet<String>) {
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| {
            leaves(value, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, out)
        }),
        // Arrays of tables; those of values are leaves.
        Value::Array(array) if array.iter().all(Value::is_table) => {
            array.iter().for_each(|value| leaves(value, &format!("{path}[]"), out));
        }
        _ => _ = out.insert(path.to_owned()),
    }
}

/// The rows of the key table: (key, default).
fn documented() -> Vec<(String, String)> {
    let (_, table) = README.split_once("| key | type |").unwrap();
    let rows = table.lines().skip(2).filter(|line| line.starts_with("| `"));
    rows.map(|line| {
        let cells: Vec<_> = line.trim_matches('|').split('|').map(str::trim).collect();
        assert_eq!(cells.len(), 5, "{line}");
        (cells[0].trim_matches('`').to_owned(), cells[3].to_owned())
    })
    .collect()
}

#[test]
fn the_table_lists_exactly_the_keys_that_exist() {
    let config = every_key();
    let mut existing = BTreeSet::new();
    leaves(&Value::Table(Table::try_from(&config).unwrap()), "", &mut existing);
    let rows = documented();
    let listed: BTreeSet<String> = rows.iter().map(|(key, _)| key.clone()).collect();
    assert_eq!(listed.len(), rows.len(), "a key is listed twice");
    assert_eq!(listed, existing);
    // All of it survives being written and read.
    let again = SceneConfig::from_text(&toml::to_string(&config).unwrap(), Path::new("")).unwrap();
    assert_eq!(SceneConfig { document: Document::default(), ..again }, config);
}

#[test]
fn documented_defaults_are_those_of_a_resolved_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    std::fs::write(folder.path().join("a.ply"), ply).unwrap();
    // Positions (0, 0, 0), (1, 0, 0), (0, 1, 0).
    let gltf = r#"{ "asset": { "version": "2.0" }, "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }] }"#;
    std::fs::write(folder.path().join("a.gltf"), gltf).unwrap();
    std::fs::write(
        folder.path().join("a.hdr"),
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x80\x80\x80\x80",
    )
    .unwrap();
    let text = r#"
        camera = { position_m = [0, 0, 5], target_m = [0, 0, 0], vertical_fov_deg = 40 }
        material.m.albedo = 0.5
        object.a = { material = "m", sphere = { radius_m = 1 } }
        object.b = { material = "m", torus-knot = { radius_m = 1, tube_radius_m = 0.1 } }
        object.c = { obj = { path = "a.obj" } }
        object.p = { material = "m", ply = { path = "a.ply" } }
        object.g = { gltf = { path = "a.gltf" } }
        animation = [
            { light = "f", property = "position_m", orbit = { centre_m = [0, 1, 0], axis = [0, 1, 0], radius_m = 1, period_s = 1 } },
            { object = "b", property = "position_m", times_s = [0], values = [[0, 0, 0]] },
        ]
        proxy = [{ box = { size_m = [1, 1, 1] } }]
        object.e = { material = "m", box = { size_m = [1, 1, 1] } }
        light.f = { power_w = 1, point = { position_m = [0, 1, 0] } }
        light.s = { sky = { map = "a.hdr" } }
        light.d = { power_w = 1, rectangle = { corner_m = [0, 3, 0], edge_u_m = [1, 0, 0], edge_v_m = [0, 0, 1] } }
    "#;
    let config = SceneConfig::from_text(text, &folder.path().join("scene.toml")).unwrap();
    let scene = config.build().unwrap();
    let resolved: Table = scene.resolved_text.parse().unwrap();
    let mut checked = 0;
    for (key, default) in documented() {
        let Some(default) = default.strip_prefix('`').and_then(|d| d.strip_suffix('`')) else { continue };
        let expected: Table = format!("value = {default}").parse().unwrap();
        let mut found = Vec::new();
        if let Some((table, rest)) = key.split_once(".NAME.") {
            let named = resolved[table].as_table().unwrap();
            found.extend(named.values().filter_map(|value| look_up(value, rest)));
        } else if let Some((array, rest)) = key.split_once("[].") {
            let tables = resolved[array].as_array().unwrap();
            found.extend(tables.iter().filter_map(|value| look_up(value, rest)));
        } else {
            found.extend(look_up(&Value::Table(resolved.clone()), &key));
        }
        assert!(!found.is_empty(), "{key} is not resolved");
        assert!(
            found.iter().all(|value| *value == expected["value"]),
            "{key}: {found:?}, documented {default}"
        );
        checked += 1;
    }
    assert!(checked >= 20, "only {checked} defaults found in the table");
}

fn look_up(value: &Value, path: &str) -> Option<Value> {
    path.split('.').try_fold(value, |value, key| value.get(key)).cloned()
}
