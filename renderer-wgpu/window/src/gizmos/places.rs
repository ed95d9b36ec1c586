//! Turns places in the scene as it is now into those of a config, as the scene is loaded, and back.

use crate::{following::Published, standing::Standing};
use glam::{DAffine3, DVec3};
use photonstream_scene::{
    ObjectId, Scene,
    config::Vector,
    vpls::{Blocker, Proxy, Vpl, moved_normal},
};

/// How things stand in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places<'a> {
    scene: &'a Scene,
    standing: &'a Standing,
}

impl<'a> Places<'a> {
    /// As `published` has it.
    pub(crate) fn of(published: &'a Published) -> Self {
        Self { scene: &published.scene, standing: &published.standing }
    }

    /// Where a VPL is, in metres from the scene's origin, and its unit normal.
    pub(crate) fn vpl(&self, vpl: &Vpl) -> (DVec3, DVec3) {
        let map = self.scene.world_from_anchor(vpl.object);
        (map.transform_point3(vpl.position), moved_normal(&map.matrix3, vpl.normal))
    }

    /// Where the middle of a blocker is, in metres from the scene's origin.
    pub(crate) fn blocker(&self, blocker: &Blocker) -> DVec3 {
        self.scene.world_from_anchor(blocker.object).transform_point3(blocker.centre)
    }

    /// The map from a proxy's own space to the scene's.
    pub(crate) fn proxy(&self, proxy: &Proxy) -> DAffine3 {
        self.scene.world_from_proxy(proxy)
    }

    /// The `position_m` that puts what moves with `object` at `place`, in metres from the scene's origin.
    pub(crate) fn written_place(&self, object: Option<ObjectId>, place: DVec3) -> Vector {
        let written = self.loaded_from_now(object).transform_point3(place) + self.scene.origin_m;
        self.rounded(written).into()
    }

    /// The `normal` that turns what moves with `object` towards `normal`.
    pub(crate) fn written_normal(&self, object: Option<ObjectId>, normal: DVec3) -> Vector {
        let written = moved_normal(&self.loaded_from_now(object).matrix3, normal);
        // Nobody sees a ten-thousandth of a radian; a zero is written without a sign.
        ((written * 1e4).round() / 1e4 + DVec3::ZERO).into()
    }

    /// A place in a config to about a hundred-thousandth of the scene's radius, in decimal digits.
    fn rounded(&self, place: DVec3) -> DVec3 {
        let finest = f64::from(self.scene.bounds.radius).max(1e-6) * 1e-5;
        let digits = (-finest.log10()).ceil().clamp(0.0, 9.0) as i32;
        let scale = 10f64.powi(digits);
        (place * scale).round() / scale + DVec3::ZERO
    }

    /// From the scene as it was loaded to the scene as it is, both from its origin.
    pub(crate) fn now_from_loaded(&self, object: Option<ObjectId>) -> DAffine3 {
        self.loaded_from_now(object).inverse()
    }

    /// From the scene as it is to the scene as it was loaded, both from its origin.
    fn loaded_from_now(&self, object: Option<ObjectId>) -> DAffine3 {
        let loaded = object.and_then(|object| self.standing.loaded(object)).unwrap_or(DAffine3::IDENTITY);
        match object {
            Some(_) => loaded * self.scene.world_from_anchor(object).inverse(),
            None => DAffine3::IDENTITY,
        }
    }
}
