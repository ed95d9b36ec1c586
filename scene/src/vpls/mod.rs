//! Gathers what the methods of few lights know of a scene: predefined virtual point lights, blockers and proxies.

mod align;
mod buried;
mod carry;
mod hull;
mod proxy;
mod save;
mod tables;

pub use proxy::{Proxy, ProxyShape};
pub use tables::VplTables;

use crate::{
    scene::{ObjectId, Scene},
    settings::VplSettings,
};
use glam::{DAffine3, DMat3, DVec3, Vec3};

pub(crate) use hull::{MOST_POINTS, hull};

/// What the methods of few lights know of a scene.
///
/// Source: paper B §4.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VplSet {
    /// Their settings.
    pub settings: VplSettings,
    /// Places that may reflect light, in the order of the config.
    pub vpls: Vec<Vpl>,
    /// Spheres that keep light from them.
    pub blockers: Vec<Blocker>,
    /// Bodies in the place of the scene, for the axes of spots.
    pub proxies: Vec<Proxy>,
    /// What all of it was read from, with all defaults.
    pub tables: VplTables,
}

/// A predefined virtual point light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vpl {
    /// Where it is in the space that [`Scene::world_from_anchor`] leads from, m.
    pub position: DVec3,
    /// Unit normal in the same space.
    pub normal: DVec3,
    /// Diffuse reflectance, linear RGB in [0, 1].
    pub albedo: Vec3,
    /// How much surface it stands for, in units of [`VplSettings::area_per_weight`]; `None`: by its distances.
    pub weight: Option<f32>,
    /// The object with which it moves.
    pub object: Option<ObjectId>,
}

/// A sphere that keeps light from virtual point lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blocker {
    /// Its centre in the space that [`Scene::world_from_anchor`] leads from, m.
    pub centre: DVec3,
    /// Its radius, m, whatever the size of its object.
    pub radius: f32,
    /// The object with which it moves.
    pub object: Option<ObjectId>,
}

impl Scene {
    /// The map from where what is attached to `object` is given (its rest space as loaded, m) to the scene's space; the
    /// identity for what is attached to nothing.
    pub fn world_from_anchor(&self, object: Option<ObjectId>) -> DAffine3 {
        object.map_or(DAffine3::IDENTITY, |object| self.world_from_loaded(object))
    }
}

/// The unit normal that `matrix` (of axes that are orthogonal, of any length) makes of one.
pub fn moved_normal(matrix: &DMat3, normal: DVec3) -> DVec3 {
    let turned = |axis: DVec3| axis / axis.length_squared().max(f64::MIN_POSITIVE);
    let inverse_transpose =
        DMat3::from_cols(turned(matrix.x_axis), turned(matrix.y_axis), turned(matrix.z_axis));
    (inverse_transpose * normal).normalize_or(normal)
}
