//! Turns a place in the window into the light or the object that is there.

use crate::{gizmos::Gizmo, navigation::project};
use glam::Vec3;
use photonstream_scene::{LightId, ObjectId, Scene, bvh::Ray};
use photonstream_shading::{Camera, Light, LightShape};

/// Radius of a light's icon on the screen, in points.
pub(crate) const ICON_POINTS: f32 = 11.0;
/// From this share of the scene's radius on an object is taken for a wall, which is not moved by accident.
const WALL_SHARE: f32 = 0.5;

/// What can be selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// A light, by its icon.
    Light(LightId),
    /// An object, by its surface.
    Object(ObjectId),
    /// A VPL, blocker or proxy.
    Gizmo(Gizmo),
}

/// What is under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pick {
    /// Light or object.
    pub(crate) target: Target,
    /// The point that was taken hold of, in metres from the scene's origin.
    pub(crate) point: Vec3,
}

/// A picture of a scene: where things are on the screen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye<'a> {
    /// From where it is seen.
    pub(crate) camera: &'a Camera,
    /// Width in pixels.
    pub(crate) width: u32,
    /// Height in pixels.
    pub(crate) height: u32,
}

impl Eye<'_> {
    /// Unit direction through `cursor`, in pixels from the upper left corner.
    pub(crate) fn direction(&self, cursor: [f32; 2]) -> Vec3 {
        self.camera.direction(cursor[0], cursor[1], self.width, self.height)
    }

    /// The light whose icon is under `cursor`, else the nearest surface; `radius` of the icons in pixels, `None` where
    /// they are not shown. A gizmo that is there, at its distance in pixels, comes before surfaces and farther icons.
    pub(crate) fn pick(
        &self,
        scene: &Scene,
        cursor: [f32; 2],
        radius: Option<f32>,
        gizmo: Option<(f32, Pick)>,
    ) -> Option<Pick> {
        let light = radius.and_then(|radius| self.pick_light(scene, cursor, radius));
        light
            .into_iter()
            .chain(gizmo)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, pick)| pick)
            .or_else(|| self.pick_object(scene, cursor))
    }

    fn pick_light(&self, scene: &Scene, cursor: [f32; 2], radius: f32) -> Option<(f32, Pick)> {
        let near = (0u32..).zip(&scene.lights).filter_map(|(id, light)| {
            let point = anchor(&light.light)?;
            let [x, y] = project(self.camera, point, self.width, self.height)?;
            let distance = (x - cursor[0]).hypot(y - cursor[1]);
            let pick = Pick { target: Target::Light(LightId(id)), point };
            (distance <= radius).then_some((distance, pick))
        });
        near.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    fn pick_object(&self, scene: &Scene, cursor: [f32; 2]) -> Option<Pick> {
        let origin = self.camera.position;
        let direction = self.direction(cursor);
        let hit = scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY })?;
        let object = *scene.geometry.object_of.get(hit.triangle as usize)?;
        Some(Pick { target: Target::Object(object), point: origin + direction * hit.t })
    }
}

/// Where a light is taken hold of: where it stands, or the middle of its surface; `None` for light from
/// infinitely far away.
pub(crate) fn anchor(light: &Light) -> Option<Vec3> {
    match light.shape {
        LightShape::Point { position } | LightShape::Spot { position, .. } => Some(position),
        LightShape::Directional { .. } | LightShape::Sky { .. } => None,
        LightShape::Parallelogram { corner, edge_u, edge_v } => Some(corner + 0.5 * (edge_u + edge_v)),
        LightShape::Triangle { corner, edge_u, edge_v } => Some(corner + (edge_u + edge_v) / 3.0),
        LightShape::Mesh { ref mesh } => Some(mesh.place([0.5; 2]).point),
    }
}

/// Whether an object is so large that dragging on it means the scene as a whole.
pub(crate) fn is_wall(scene: &Scene, object: ObjectId) -> bool {
    let Some(object) = scene.objects.get(object.0 as usize) else { return true };
    let triangles = object.triangles.start as usize..object.triangles.end as usize;
    let vertices = scene.geometry.triangles[triangles].iter().flatten();
    let (low, high) = vertices.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &i| {
        let vertex = scene.geometry.vertices[i as usize];
        (low.min(vertex), high.max(vertex))
    });
    0.5 * (high - low).length() >= WALL_SHARE * scene.bounds.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cornell() -> Scene {
        Scene::load(std::path::Path::new(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../configs/cornell-box.toml"
        )))
        .unwrap()
    }

    fn name(scene: &Scene, pick: Option<Pick>) -> String {
        match pick.unwrap().target {
            Target::Light(id) => format!("light {}", scene.lights[id.0 as usize].name),
            Target::Object(id) => scene.objects[id.0 as usize].name.clone(),
            Target::Gizmo(gizmo) => gizmo.to_string(),
        }
    }

    #[test]
    fn what_is_seen_is_what_is_picked() {
        let scene = cornell();
        let eye = Eye { camera: &scene.camera, width: 600, height: 600 };
        let sphere = scene.objects[scene.object("sphere").unwrap().0 as usize].world_from_rest.translation;
        let at = project(eye.camera, sphere.as_vec3(), 600, 600).unwrap();
        assert_eq!(name(&scene, eye.pick(&scene, at, None, None)), "sphere");
        let lamp = anchor(&scene.lights[0].light).unwrap();
        let [x, y] = project(eye.camera, lamp, 600, 600).unwrap();
        assert_eq!(name(&scene, eye.pick(&scene, [x + 5.0, y - 5.0], Some(ICON_POINTS), None)), "light lamp");
        let beside = name(&scene, eye.pick(&scene, [x + 5.0, y - 5.0], None, None));
        assert!(beside == "ceiling" || beside == "back-wall", "{beside}");
        assert_eq!(name(&scene, eye.pick(&scene, [40.0, 300.0], Some(ICON_POINTS), None)), "left-wall");
        // Beside the room there is nothing.
        assert_eq!(eye.pick(&scene, [-2000.0, 300.0], Some(ICON_POINTS), None), None);
        let pick = eye.pick(&scene, [300.0, 300.0], None, None).unwrap();
        assert!((project(eye.camera, pick.point, 600, 600).unwrap()[0] - 300.0).abs() < 0.01);
    }

    #[test]
    fn walls_are_told_from_things() {
        let scene = cornell();
        let walls: Vec<_> = (0u32..)
            .zip(&scene.objects)
            .filter(|(id, _)| is_wall(&scene, ObjectId(*id)))
            .map(|(_, object)| object.name.as_str())
            .collect();
        assert_eq!(walls, ["back-wall", "ceiling", "floor", "left-wall", "right-wall"]);
    }
}
