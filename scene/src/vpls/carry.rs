//! Turns what is attached to animated objects into what it is at one moment, in the config.

use super::{Proxy, moved_normal};
use crate::{SceneConfig, SceneError, config::Vector, scene::Scene};
use glam::{DAffine3, DMat3, DVec3, EulerRot};

impl SceneConfig {
    /// Whether a VPL, blocker or proxy is attached to an object.
    pub(crate) fn has_attached(&self) -> bool {
        self.vpl.iter().any(|v| v.object.is_some())
            || self.blocker.iter().any(|b| b.object.is_some())
            || self.proxy.iter().any(|p| p.object.is_some())
    }

    /// Puts what is attached to objects where it is at `time_s`.
    ///
    /// # Errors
    /// If the config cannot be built, or its objects cannot be there.
    pub(crate) fn carry_attached(&mut self, time_s: f64) -> Result<(), SceneError> {
        if !self.has_attached() {
            return Ok(());
        }
        let scene = self.clone().build()?;
        let mut edit = scene.edit();
        scene.animation.apply(time_s, &mut edit)?;
        let now = edit.finish();
        for (written, vpl) in self.vpl.iter_mut().zip(&now.vpls.vpls).filter(|(_, vpl)| vpl.object.is_some())
        {
            let map = now.world_from_anchor(vpl.object);
            written.position_m = (map.transform_point3(vpl.position) + now.origin_m).into();
            written.normal = moved_normal(&map.matrix3, vpl.normal).into();
        }
        let blockers = self.blocker.iter_mut().zip(&now.vpls.blockers);
        for (written, blocker) in blockers.filter(|(_, blocker)| blocker.object.is_some()) {
            let map = now.world_from_anchor(blocker.object);
            written.position_m = (map.transform_point3(blocker.centre) + now.origin_m).into();
        }
        for (written, proxy) in self.proxy.iter_mut().zip(&now.vpls.proxies) {
            if proxy.object.is_some() {
                let map = now.world_from_proxy(proxy);
                written.position_m = Some((map.translation + now.origin_m).into());
                let (x, y, z) = map.matrix3.to_euler(EulerRot::XYZ);
                written.rotation_deg = Some(Vector([x, y, z].map(f64::to_degrees)));
            }
        }
        Ok(())
    }
}

impl Scene {
    /// The rigid map from a proxy's own space to the scene's, m: a proxy keeps its size, whatever that of its object.
    pub fn world_from_proxy(&self, proxy: &Proxy) -> DAffine3 {
        let map = self.world_from_anchor(proxy.object);
        let translation = map.transform_point3(proxy.anchor_from_own.translation);
        // The axes are orthogonal: without their lengths, and without a mirroring, they turn.
        let [x, y, z] =
            [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(DVec3::try_normalize);
        let turn = match (x, y, z) {
            (Some(x), Some(y), Some(z)) => DMat3::from_cols(x, y, z * x.cross(y).dot(z).signum()),
            _ => DMat3::IDENTITY,
        };
        DAffine3 { matrix3: turn * proxy.anchor_from_own.matrix3, translation }
    }
}
