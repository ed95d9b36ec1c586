//! Gathers what a user writes of predefined virtual point lights, before it is validated.

use super::{BoxConfig, OneOrThree, Vector, values};
use crate::settings::{PhantomSurfaces, VplVisibility, Weights};
use serde::{Deserialize, Serialize};

/// `[vpls]`: settings of the methods of few lights; see [`crate::VplSettings`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VplsConfig {
    /// The area of a VPL of weight 1, m².
    pub area_per_weight_m2: Option<f64>,
    /// VPLs of less intensity are switched off, W sr⁻¹.
    pub cull_intensity_w_sr: Option<f64>,
    /// How the weights of VPLs that have none of their own are computed.
    #[serde(default, with = "values::by_name")]
    pub weights: Option<Weights>,
    /// What stands between lights and VPLs.
    #[serde(default, with = "values::by_name")]
    pub visibility: Option<VplVisibility>,
    /// What the axis of a spot is intersected with; default proxies where there are any, else the scene.
    #[serde(default, with = "values::by_name")]
    pub phantom_surfaces: Option<PhantomSurfaces>,
    /// Softens the interpolation between VPLs, m².
    pub softening_m2: Option<f64>,
    /// Time in which a phantom follows 63 % of a jump, s.
    pub smoothing_s: Option<f64>,
    /// Mean reflectance of what the second bounce comes from.
    pub second_bounce_albedo: Option<f64>,
    /// How far from the first the second bounce comes from, m; 0: there is none.
    pub second_bounce_distance_m: Option<f64>,
    /// Photons of instant radiosity.
    pub photons: Option<u32>,
    /// What `photonstream place` has written.
    pub placed: Option<PlacedConfig>,
}

/// `[vpls.placed]`: what [`crate::vpl_placement::VplFile`] reads to tell what people have edited and deleted; without
/// effect on the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlacedConfig {
    /// Hash and name of the file that this one was made from.
    pub from: Option<String>,
    /// Hashes of the entries that were made by hand there.
    #[serde(default)]
    pub given: Vec<String>,
    /// Hash, position and normal of each.
    #[serde(default)]
    pub sites: Vec<String>,
}

/// `[[vpl]]`: a place that may reflect light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VplConfig {
    /// Where it is as the scene is loaded, m.
    pub position_m: Vector,
    /// Where it looks; of any length.
    pub normal: Vector,
    /// Share of the arriving light that leaves again, linear RGB.
    pub albedo: OneOrThree,
    /// How much surface it stands for, in units of `area_per_weight_m2`; default: by the distance to the closest other.
    pub weight: Option<f64>,
    /// Name of the object with which it moves.
    pub object: Option<String>,
    /// Hash of what `photonstream place` has written; without effect on the scene.
    pub placed: Option<String>,
}

/// `[[blocker]]`: a sphere that keeps light from VPLs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlockerConfig {
    /// Its centre as the scene is loaded, m.
    pub position_m: Vector,
    /// Its radius, m.
    pub radius_m: f64,
    /// Name of the object with which it moves.
    pub object: Option<String>,
}

/// `[[proxy]]`: a simple body in the place of the scene, for the axes of spots. Exactly one shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProxyConfig {
    /// Where its origin is as the scene is loaded, m.
    pub position_m: Option<Vector>,
    /// Its turn, as that of an object.
    pub rotation_deg: Option<Vector>,
    /// A cuboid.
    #[serde(rename = "box")]
    pub cuboid: Option<BoxConfig>,
    /// A sphere.
    pub sphere: Option<ProxySphereConfig>,
    /// The convex hull of points.
    pub hull: Option<HullConfig>,
    /// Name of the object with which it moves.
    pub object: Option<String>,
}

/// `sphere` of a proxy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProxySphereConfig {
    /// Its radius, m.
    pub radius_m: f64,
}

/// `hull` of a proxy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HullConfig {
    /// Points, at least four that are not in one plane, in the proxy's own coordinates, m.
    pub points_m: Vec<Vector>,
}
