//! Turns predefined VPLs that cannot light what they should into notices: those below their surface, and those without an area.

use crate::{scene::Scene, settings::Method, vpls::moved_normal};
use glam::Vec3;
use std::collections::HashMap;

/// What to tell of VPLs, where the method needs them.
pub(super) fn notices(scene: &Scene) -> Vec<String> {
    let needs_vpls = matches!(scene.streaming.method, Method::StaticVpl | Method::PhantomVpl | Method::Auto);
    let placed = if needs_vpls { placed(scene) } else { Vec::new() };
    [buried(scene, &placed), coinciding(scene, &placed)].into_iter().flatten().collect()
}

/// Where the VPLs are, and their unit normals.
fn placed(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let vpls = scene.vpls.vpls.iter().map(|vpl| {
        let map = scene.world_from_anchor(vpl.object);
        (map.transform_point3(vpl.position).as_vec3(), moved_normal(&map.matrix3, vpl.normal).as_vec3())
    });
    vpls.collect()
}

/// Those that lie below a surface which reflects to where their normals point: shadow rays to them end in the dark.
fn buried(scene: &Scene, placed: &[(Vec3, Vec3)]) -> Option<String> {
    let depths = placed.iter().enumerate().filter_map(|(index, &(position, normal))| {
        Some((index, scene.depth_below_surface(position, normal)?))
    });
    let buried: Vec<(usize, f32)> = depths.collect();
    let &(first, depth) = buried.first()?;
    let others = match buried.len() {
        1 => String::new(),
        n => format!(", and {} more lie below surfaces", n - 1),
    };
    Some(format!(
        "vpl[{first}] lies {depth:.2e} m below the surface that it lights{others}: pictures whose visibility is rays or \
         shadow-maps have it in shadow; move it along its normal, onto the surface"
    ))
}

/// Those without a weight of their own that are where another one is: a disc half way to it has no area.
fn coinciding(scene: &Scene, placed: &[(Vec3, Vec3)]) -> Option<String> {
    let mut first_at: HashMap<[u32; 3], usize> = HashMap::new();
    let pairs = placed.iter().enumerate().filter_map(|(index, (position, _))| {
        // Zero is the same with either sign.
        let key = (*position + 0.0).to_array().map(f32::to_bits);
        let first = *first_at.entry(key).or_insert(index);
        let are_free = [first, index].map(|vpl| scene.vpls.vpls[vpl].weight.is_none());
        (first != index && are_free.contains(&true)).then_some((first, index))
    });
    let pairs: Vec<_> = pairs.collect();
    let &(a, b) = pairs.first()?;
    let others = match pairs.len() {
        1 => String::new(),
        n => format!(", and {} more coincide", n - 1),
    };
    Some(format!(
        "vpl[{a}] and vpl[{b}] are in one place{others}: what has no weight of its own has no area there, and stays dark; give them \
         weights, or move them apart"
    ))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::SceneConfig;
    use std::path::Path;

    /// The notices of a room of 4 m, of which `sides` reflect, with a shelf 0.1 m over its floor and a VPL `above_m` its floor.
    fn notices(sides: &str, above_m: f64, method: &str) -> Vec<String> {
        let text = format!(
            "camera = {{ position_m = [0, 0, 1.9], target_m = [0, 0, 0], vertical_fov_deg = 40 }}\n\
             [material.a]\nalbedo = 0.5\n\
             [object.room]\nmaterial = \"a\"\nsides = \"{sides}\"\nbox = {{ size_m = [4, 4, 4] }}\n\
             [object.shelf]\nmaterial = \"a\"\nposition_m = [0, -1.8, 0]\nbox = {{ size_m = [1, 0.2, 1] }}\n\
             [light.l]\npower_w = 1\npoint = {{ position_m = [0, 1, 0] }}\n\
             [[vpl]]\nposition_m = [0, {}, 0]\nnormal = [0, 1, 0]\nalbedo = 0.5\n\
             [streaming]\nmethod = \"{method}\"\n",
            above_m - 2.0,
        );
        SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap().notices
    }

    #[test]
    fn what_lies_below_its_surface_is_told() {
        for depth_m in [1e-4, 1e-3, 0.1] {
            let told = notices("back", -depth_m, "static-vpl");
            assert!(told.len() == 1 && told[0].contains("vpl[0]") && told[0].contains("normal"), "{told:?}");
        }
        assert_eq!(notices("both", -1e-3, "static-vpl").len(), 1);
        // On the surface; a little above it and below a body; so deep that the floor is somebody else's; below a sheet; not used.
        for (sides, above_m) in [("back", 0.0), ("back", 0.05), ("back", -0.5), ("both", -0.1)] {
            assert_eq!(notices(sides, above_m, "static-vpl"), [""; 0], "{sides} {above_m}");
        }
        assert_eq!(notices("back", -1e-3, "photon-streaming"), [""; 0]);
    }

    #[test]
    fn what_coincides_without_a_weight_is_told() {
        let told = |weights: [&str; 2]| {
            let vpl = |y: f32, weight: &str| {
                format!("[[vpl]]\nposition_m = [0, 0, -0.0]\nnormal = [0, {y}, 0]\nalbedo = 0.5\n{weight}\n")
            };
            let text = format!(
                "camera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
                 origin_m = [0, 0, 0]\nmaterial.m.albedo = 0.5\n\
                 object.wall = {{ material = \"m\", sides = \"both\", quad = {{ corner_m = [-4, 0, 4], edge_u_m = [8, 0, 0], edge_v_m = [0, 0, -8] }} }}\n\
                 light.l = {{ power_w = 9, point = {{ position_m = [0, 4, 0] }} }}\nstreaming.method = \"static-vpl\"\n{}{}",
                vpl(1.0, weights[0]),
                vpl(-1.0, weights[1])
            );
            SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap().notices
        };
        for weights in [["", ""], ["weight = 1", ""]] {
            let told = told(weights);
            assert!(told.len() == 1 && told[0].contains("vpl[0] and vpl[1]"), "{told:?}");
        }
        assert_eq!(told(["weight = 1", "weight = 2"]), [""; 0]);
    }
}
