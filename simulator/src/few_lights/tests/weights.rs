//! Checks the areas that virtual lights stand for: given, by distance, all at once or a little at a time.

use super::*;

/// Weights of VPLs that have none are discs half way to the closest; what is given stays. Amortised ones begin the same, and
/// come to the same after N² updates.
#[test]
fn weights_are_given_or_by_distance() {
    let vpl = |x: f32, more: &str| {
        format!("[[vpl]]\nposition_m = [{x}, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n{more}\n")
    };
    let vpls = vpl(0.0, "") + &vpl(1.0, "weight = 7") + &vpl(3.0, "object = \"crate\"");
    for weights in ["whole", "amortised"] {
        let scene = static_scene(POINT, &format!("vpls.weights = \"{weights}\"\n{vpls}"));
        let mut few = FewLights::new(&scene, Method::StaticVpl);
        few.update(&scene, 0.0);
        let areas = |few: &FewLights| few.lights().iter().map(|shown| shown.light.area).collect::<Vec<_>>();
        let disc = |nearest: f32| PI * 0.25 * nearest * nearest;
        let is = |few: &FewLights, expected: [f32; 3]| {
            areas(few).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5 * b)
        };
        assert!(is(&few, [disc(1.0), 7.0, disc(2.0)]), "{weights}: {:?}", areas(&few));
        let mut edit = scene.edit();
        let to = serde_json::json!({ "position_m": [0.5, 0.5, 0] });
        edit.move_object("crate", to.as_object().unwrap()).unwrap();
        let moved = edit.finish();
        let expected = [disc(0.5), 7.0, disc(0.5)];
        few.update(&moved, 0.01);
        assert_eq!(is(&few, expected), weights == "whole", "{weights}: {:?}", areas(&few));
        (0..9).for_each(|_| few.update(&moved, 0.01));
        assert!(is(&few, expected) && !few.is_following(), "{weights}: {:?}", areas(&few));
    }
}

/// What moves elsewhere leaves amortised weights as they are: only VPLs that come closer are compared anew, and none where
/// all weights are given.
#[test]
fn weights_are_left_alone_where_nothing_comes_closer() {
    let vpl = |x: f32, more: &str| {
        format!("[[vpl]]\nposition_m = [{x}, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n{more}\n")
    };
    let moved = |vpls: String| {
        let scene = static_scene(POINT, &format!("vpls.weights = \"amortised\"\n{vpls}"));
        let mut few = FewLights::new(&scene, Method::StaticVpl);
        few.update(&scene, 0.0);
        let mut edit = scene.edit();
        let to = serde_json::json!({ "position_m": [0.5, 0.5, 1] });
        edit.move_object("crate", to.as_object().unwrap()).unwrap();
        few.update(&edit.finish(), 0.01);
        few.is_following()
    };
    let riding = "object = \"crate\"";
    assert!(!moved(vpl(0.0, "") + &vpl(1.0, "")), "none has moved");
    assert!(!moved(vpl(0.0, "weight = 1") + &vpl(1.0, &format!("weight = 1\n{riding}"))), "all are given");
    assert!(moved(vpl(0.0, "") + &vpl(1.0, riding)));
}

/// Three VPLs, one of which is carried past the others in 1 to 12 updates and then rests: amortised weights come to rest as
/// whole ones, after N² updates and at most N − 1 that were begun, whatever moment of a pass that is.
#[test]
fn amortised_weights_come_to_rest_after_any_motion() {
    let vpl = |x: f32, more: &str| {
        format!("[[vpl]]\nposition_m = [{x}, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n{more}\n")
    };
    let vpls = vpl(0.0, "") + &vpl(1.0, "") + &vpl(3.0, "object = \"crate\"");
    let first = static_scene(POINT, &format!("vpls.weights = \"amortised\"\n{vpls}"));
    for moves in 1..=12 {
        let mut few = FewLights::new(&first, Method::StaticVpl);
        few.update(&first, 0.0);
        let mut scene = first.clone();
        for i in 0..moves {
            // Close by at first, far away at the end.
            let x = if i + 1 == moves { 3.7 } else { 0.6 + 0.01 * i as f32 };
            let mut edit = scene.edit();
            let to = serde_json::json!({ "position_m": [x, 0.5, 0] });
            edit.move_object("crate", to.as_object().unwrap()).unwrap();
            scene = edit.finish();
            few.update(&scene, 0.01);
        }
        let updates = (0..100)
            .take_while(|_| {
                few.is_following() && {
                    few.update(&scene, 0.01);
                    true
                }
            })
            .count();
        assert!(updates < 9 + 3, "{moves}: {updates}");
        let areas = |few: &FewLights| few.lights().iter().map(|shown| shown.light.area).collect::<Vec<_>>();
        let mut whole = FewLights::new(&scene, Method::StaticVpl);
        whole.update(&scene, 0.0);
        assert_eq!(areas(&few), areas(&whole), "{moves}");
    }
}

/// Automatic weights are discs in any unit of weight, and of what had a weight of its own before: π/4 m² for two VPLs at 1 m.
#[test]
fn other_settings_have_weights_of_their_own() {
    let vpl = |x: f32, more: &str| {
        format!("[[vpl]]\nposition_m = [{x}, 0, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n{more}\n")
    };
    for weights in ["whole", "amortised"] {
        let tables = vpl(0.0, "weight = 50") + &vpl(1.0, "");
        let mut scene = static_scene(POINT, &format!("vpls.weights = \"{weights}\"\n{tables}"));
        let mut few = FewLights::new(&scene, Method::StaticVpl);
        few.update(&scene, 0.0);
        let free =
            |x: f64| serde_json::json!({ "position_m": [x, 0, 0], "normal": [0, 1, 0], "albedo": 0.5 });
        let edits = [
            (serde_json::json!({ "vpls": { "area_per_weight_m2": 2 } }), [100.0, PI / 4.0]),
            (serde_json::json!({ "vpl": [free(0.0), free(1.0)] }), [PI / 4.0; 2]),
            (serde_json::json!({ "vpls": { "area_per_weight_m2": 0.5 } }), [PI / 4.0; 2]),
        ];
        for (values, expected) in edits {
            let mut edit = scene.edit();
            edit.set_vpls(values.as_object().unwrap()).unwrap();
            scene = edit.finish();
            few.update(&scene, 0.01);
            let areas: Vec<f32> = few.lights().iter().map(|shown| shown.light.area).collect();
            let is = areas.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5 * b);
            assert!(is, "{weights}, {values}: {areas:?}, {expected:?}");
        }
    }
}

/// Areas of photons are discs half way to the closest other one, as comparing all with all has them: 300 on a floor.
#[test]
fn photons_have_the_discs_of_automatic_weights() {
    let scene = scene(&format!("{POINT}\nstreaming.method = \"instant-radiosity\"\nvpls.photons = 300\n"));
    let shown: Vec<Shown> =
        updated(&scene).into_iter().filter(|shown| shown.light.flux != Vec3::ZERO).collect();
    assert!(shown.len() > 50);
    let mut vpls: Vec<_> = shown.iter().map(|shown| constellation::as_vpl(&shown.light)).collect();
    photonstream_running_light::automatic_weights(&mut vpls, 1.0);
    for (shown, vpl) in shown.iter().zip(&vpls) {
        assert!((shown.light.area / vpl.weight - 1.0).abs() < 1e-6, "{shown:?}, {vpl:?}");
    }
}
