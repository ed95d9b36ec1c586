//! Turns objects and lights into Mitsuba shapes, reflectances and emitters.

use super::{
    document::{Document, identifier},
    ply, sky, spot, textures,
};
use core::f32::consts::PI;
use glam::Vec3;
use photonstream_scene::{Material, ObjectId, Scene, Side, Sides};
use photonstream_shading::{Light, LightShape};

/// The mesh of object `index`, seen from the folder of `scene.xml`.
pub(crate) fn mesh_file(index: usize, name: &str) -> String {
    format!("meshes/{index}-{}.ply", identifier(name))
}

/// All objects, emitting ones with their radiance; returns how many emit.
pub(crate) fn write(scene: &Scene, document: &mut Document) -> usize {
    let mut emitting = 0;
    for (index, object) in scene.objects.iter().enumerate() {
        let id = ObjectId(index as u32);
        document.begin(
            "shape",
            &[("type", &"ply"), ("id", &format_args!("object{index}-{}", identifier(&object.name)))],
        );
        document.property("string", "filename", mesh_file(index, &object.name));
        // No normals made up between neighbours.
        let is_smooth = ply::is_smooth(scene, object.triangles.clone());
        document.property("boolean", "face_normals", if is_smooth { "false" } else { "true" });
        let material = object.material.0 as usize;
        reflectance(document, object.sides, (material, &scene.materials[material]));
        let radiance = scene.emitted_radiance(id, Side::Front);
        if radiance != Vec3::ZERO {
            emitting += 1;
            document.begin("emitter", &[("type", &"area")]);
            document.rgb("radiance", radiance);
            document.end();
        }
        document.end();
    }
    emitting
}

/// `diffuse` reflects on the front alone and looks black from behind, as [`Sides::Front`] does.
fn reflectance(document: &mut Document, sides: Sides, (index, material): (usize, &Material)) {
    let diffuse = |document: &mut Document, is_black: bool| {
        document.begin("bsdf", &[("type", &"diffuse")]);
        match is_black {
            true => textures::black(document),
            false => textures::reflectance(document, index, material),
        }
        document.end();
    };
    let mask = material.texture.as_ref().filter(|texture| texture.cutoff.is_some());
    if let Some(texture) = mask {
        document.begin("bsdf", &[("type", &"mask")]);
        textures::opacity(document, index, texture);
    }
    if sides == Sides::Front {
        diffuse(document, false);
    } else {
        document.begin("bsdf", &[("type", &"twosided")]);
        if sides == Sides::Back {
            // The first of two is the front.
            diffuse(document, true);
        }
        diffuse(document, false);
        document.end();
    }
    if mask.is_some() {
        document.end();
    }
}

/// All lights that are no surface and switched on; returns of how many emitters they consist.
pub(crate) fn write_lights(scene: &Scene, document: &mut Document) -> usize {
    let lit = scene.lights.iter().filter(|light| light.light.power != Vec3::ZERO);
    lit.map(|light| write_light(&light.light, document)).sum()
}

fn write_light(light: &Light, document: &mut Document) -> usize {
    match light.shape {
        LightShape::Point { position } => {
            document.begin("emitter", &[("type", &"point")]);
            let [x, y, z] = position.to_array();
            document.leaf("point", &[("name", &"position"), ("x", &x), ("y", &y), ("z", &z)]);
            document.rgb("intensity", light.power / (4.0 * PI));
            document.end();
            1
        }
        LightShape::Spot { position, direction, versine_inner, versine_outer } => {
            let on_axis = light.power / (PI * (versine_inner + versine_outer));
            let cones = spot::cones(versine_inner, versine_outer);
            for cone in &cones {
                document.begin("emitter", &[("type", &"spot")]);
                document.look_along(position, direction, direction.any_orthonormal_vector());
                document.property("float", "beam_width", cone.beam_width_deg);
                document.property("float", "cutoff_angle", cone.cutoff_angle_deg);
                document.rgb("intensity", on_axis * cone.share as f32);
                document.property("float", "sampling_weight", cone.sampling_weight(cones.len()));
                document.end();
            }
            cones.len()
        }
        LightShape::Directional { direction } => {
            document.begin("emitter", &[("type", &"directional")]);
            let [x, y, z] = direction.to_array();
            document.leaf("vector", &[("name", &"direction"), ("x", &x), ("y", &y), ("z", &z)]);
            document.rgb("irradiance", light.power);
            document.end();
            1
        }
        LightShape::Sky { ref sky } => {
            sky::write(sky, light.power, document);
            1
        }
        // Emitted by their object.
        LightShape::Parallelogram { .. } | LightShape::Triangle { .. } | LightShape::Mesh { .. } => 0,
    }
}
