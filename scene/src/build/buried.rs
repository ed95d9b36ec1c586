//! Turns predefined VPLs that lie below the surface they stand for into a notice: shadow rays to them end in the dark.

use crate::{scene::Scene, settings::Method, vpls::moved_normal};

/// What to tell of VPLs that lie below a surface which reflects to where their normals point, where the method needs VPLs.
pub(super) fn notice(scene: &Scene) -> Option<String> {
    let method = scene.streaming.method;
    if !matches!(method, Method::StaticVpl | Method::PhantomVpl | Method::Auto) {
        return None;
    }
    let depths = (0..scene.vpls.vpls.len()).filter_map(|index| Some((index, depth_m(scene, index)?)));
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

/// How far a VPL lies below a surface that reflects to where its normal points, m; `None` where there is none.
fn depth_m(scene: &Scene, index: usize) -> Option<f32> {
    let vpl = &scene.vpls.vpls[index];
    let map = scene.world_from_anchor(vpl.object);
    let origin = map.transform_point3(vpl.position).as_vec3();
    let direction = moved_normal(&map.matrix3, vpl.normal).as_vec3();
    scene.depth_below_surface(origin, direction)
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
}
