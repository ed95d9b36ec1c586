//! Turns the albedos of a closed scene into a notice where its light has no steady state.

use crate::{
    features::Features,
    scene::{Material, Object},
};

/// Up to here furnaces are tested to have the energy that they should have; above, paths are cut before they are absorbed.
const LARGEST_ALBEDO: f32 = 0.999;

/// What to tell of a scene in which nothing takes some colour of light away: no surface absorbs it, and none ends in the
/// open. A black thing somewhere, or a gap, is enough to say nothing: where light goes is not followed here.
pub(super) fn notice(features: &Features, objects: &[Object], materials: &[Material]) -> Option<String> {
    if !features.is_closed() || objects.is_empty() {
        return None;
    }
    let least = objects
        .iter()
        .map(|object| materials[object.material.0 as usize].albedo)
        .reduce(|least, albedo| least.min(albedo))?;
    let colours: Vec<&str> = ["red", "green", "blue"]
        .into_iter()
        .zip(least.to_array())
        .filter(|(_, albedo)| *albedo > LARGEST_ALBEDO)
        .map(|(colour, _)| colour)
        .collect();
    (!colours.is_empty()).then(|| {
        format!(
            "closed, and every surface reflects more than {LARGEST_ALBEDO} of {}: such light has no steady state, or hardly \
             one; its paths are cut after some thousand bounces and counted as `truncated`, and the picture is darker than it \
             would be; give one surface an albedo of {LARGEST_ALBEDO} or less",
            colours.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use crate::SceneConfig;
    use std::path::Path;

    fn notices(albedo: &str, more: &str) -> Vec<String> {
        let text = format!(
            "[camera]\nposition_m = [0.5, 0, 0]\ntarget_m = [0, 0, 0]\nvertical_fov_deg = 60\n\
             [material.wall]\nalbedo = {albedo}\n\
             [object.room]\nmaterial = \"wall\"\nsides = \"back\"\nbox = {{ size_m = [2, 2, 2] }}\n\
             [light.lamp]\npower_w = 1\npoint = {{ position_m = [0, 0, 0] }}\n{more}"
        );
        SceneConfig::from_text(&text, Path::new("test.toml")).unwrap().build().unwrap().notices
    }

    #[test]
    fn a_closed_scene_that_absorbs_nothing_is_told() {
        let told = notices("1", "");
        assert_eq!(told.len(), 1);
        assert!(told[0].contains("red, green, blue") && told[0].contains("`truncated`"), "{told:?}");
        let of_one_colour = notices("[0.2, 0.9995, 0.999]", "");
        assert!(of_one_colour[0].contains("more than 0.999 of green:"), "{of_one_colour:?}");
    }

    #[test]
    fn what_takes_light_away_is_enough() {
        assert!(notices("0.999", "").is_empty());
        let black = "[material.black]\nalbedo = 0\n\
                     [object.ball]\nmaterial = \"black\"\nsphere = { radius_m = 0.1, segments = 8 }\n";
        assert!(notices("1", black).is_empty());
        let open = "[object.sheet]\nmaterial = \"wall\"\nquad = { corner_m = [0, 0.5, 0], \
                    edge_u_m = [0.1, 0, 0], edge_v_m = [0, 0, 0.1] }\n";
        assert!(notices("1", open).is_empty());
    }
}
