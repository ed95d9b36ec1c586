//! Turns the axis of a spot into where it meets the scene or its proxies.

use glam::Vec3;
use photonstream_running_light::Spot;
use photonstream_scene::{PhantomSurfaces, Scene, bvh::Ray};

/// Where the axis of `spot` ends, scene space, m; `None` for a miss. One ray against the scene, or one against each proxy.
///
/// Source: paper B §4.3.
pub(super) fn hit(scene: &Scene, spot: &Spot) -> Option<Vec3> {
    let Spot { position: origin, direction, .. } = *spot;
    let distance = match scene.vpls.settings.phantom_surfaces {
        PhantomSurfaces::Scene => {
            scene.bvh.closest(&Ray { origin, direction, t_max: f32::INFINITY }).map(|hit| hit.t)
        }
        PhantomSurfaces::Proxies => {
            let hits = scene.vpls.proxies.iter().filter_map(|proxy| {
                let own_from_world = scene.world_from_proxy(proxy).inverse();
                let origin = own_from_world.transform_point3(origin.as_dvec3());
                let direction = own_from_world.transform_vector3(direction.as_dvec3());
                proxy.shape.intersect(origin, direction)
            });
            hits.min_by(f64::total_cmp).map(|t| t as f32)
        }
    };
    distance.map(|t| origin + direction * t)
}
