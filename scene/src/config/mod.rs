//! Gathers what a user writes in a scene file, before it is validated: one struct per table, one field per key.

mod animation;
mod decode;
mod document;
mod domain;
mod imports;
#[cfg(test)]
mod keys;
mod sky;
mod values;
mod vpls;

pub use animation::{AnimatedProperty, AnimatedValue, AnimationConfig, Interpolation, OrbitConfig, Repeat};
pub(crate) use document::{Document, Field};
pub use domain::{MAX_LENGTH_M, MAX_POWER};
pub use imports::{AnimationChoice, GltfConfig, LightOverride, ObjConfig, PartOverride, PlyConfig, UpAxis};
pub use sky::SkyConfig;
pub use values::{OneOrThree, Vector};
pub use vpls::{
    BlockerConfig, HullConfig, PlacedConfig, ProxyConfig, ProxySphereConfig, VplConfig, VplsConfig,
};

use crate::{
    scene::Sides,
    settings::{Method, RangeCulling, Sampling, Visibility},
};
use photonstream_shading::{Kernel, tone::ToneMap};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A scene file as written. Fields may be changed before [`SceneConfig::build`]; `None` stands for the default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneConfig {
    /// What to call the scene; default: the file's stem.
    pub name: Option<String>,
    /// Where the scene's own origin lies; default: near the middle of its geometry.
    pub origin_m: Option<Vector>,
    /// From where pictures are taken.
    pub camera: CameraConfig,
    /// Reflectances by name.
    #[serde(default)]
    pub material: BTreeMap<String, MaterialConfig>,
    /// Meshes by name.
    #[serde(default)]
    pub object: BTreeMap<String, ObjectConfig>,
    /// Light sources by name.
    #[serde(default)]
    pub light: BTreeMap<String, LightConfig>,
    /// What moves and dims lights and objects, in any order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub animation: Vec<AnimationConfig>,
    /// Settings of the simulation.
    #[serde(default)]
    pub streaming: StreamingConfig,
    /// Default settings of the renderers.
    #[serde(default)]
    pub render: RenderConfig,
    /// Settings of the methods of few lights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vpls: Option<VplsConfig>,
    /// Places that may reflect light, for the methods of few lights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vpl: Vec<VplConfig>,
    /// Spheres that keep light from them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub blocker: Vec<BlockerConfig>,
    /// Bodies in the place of the scene, for the axes of spots.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub proxy: Vec<ProxyConfig>,
    #[serde(skip)]
    pub(crate) document: Document,
    /// What was chosen for a model that has no scene file, one sentence each.
    #[serde(skip)]
    pub(crate) chosen: Vec<String>,
}

/// `[camera]`: a pinhole camera; where it is, or the node of an import that is one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// The camera of a file that an object imports: `OBJECT/node`.
    pub node: Option<String>,
    /// Where the eye is, m.
    pub position_m: Option<Vector>,
    /// A point in the middle of the picture, m.
    pub target_m: Option<Vector>,
    /// Which way is up in the picture; default +Y.
    pub up: Option<Vector>,
    /// Field of view from bottom to top; default that of the node.
    pub vertical_fov_deg: Option<f64>,
}

/// `[material.NAME]`: a diffuse reflectance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialConfig {
    /// Share of the arriving light that leaves again, linear RGB.
    pub albedo: OneOrThree,
}

/// `[object.NAME]`: a mesh, its place and its material. Exactly one shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectConfig {
    /// Name of its material; an import may go without and keep its own.
    pub material: Option<String>,
    /// Which sides reflect; default front, for glTF as the file says.
    #[serde(default, with = "values::by_name")]
    pub sides: Option<Sides>,
    /// Where the shape's own origin is put, m.
    pub position_m: Option<Vector>,
    /// Turns about the object's own x, then its turned y, then its turned z axis.
    pub rotation_deg: Option<Vector>,
    /// Stretches the shape along its own axes, before it is turned; negative factors mirror.
    pub scale: Option<OneOrThree>,
    /// A parallelogram.
    pub quad: Option<QuadConfig>,
    /// A cuboid.
    #[serde(rename = "box")]
    pub cuboid: Option<BoxConfig>,
    /// A sphere centred at its origin.
    pub sphere: Option<SphereConfig>,
    /// A tube along a torus knot.
    #[serde(rename = "torus-knot")]
    pub torus_knot: Option<TorusKnotConfig>,
    /// Meshes of a Wavefront OBJ file.
    pub obj: Option<ObjConfig>,
    /// The mesh of a PLY file.
    pub ply: Option<PlyConfig>,
    /// Meshes and lights of a glTF file.
    pub gltf: Option<GltfConfig>,
}

/// `quad`: a parallelogram; its front looks along `edge_u_m × edge_v_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuadConfig {
    /// The corner from which both edges start, m.
    pub corner_m: Vector,
    /// First edge, m.
    pub edge_u_m: Vector,
    /// Second edge, m.
    pub edge_v_m: Vector,
}

/// `box`: a cuboid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxConfig {
    /// Lengths of its edges along x, y and z, m.
    pub size_m: Vector,
    /// Where its middle is in the object's own coordinates, m; default their origin. The object turns about that origin.
    pub centre_m: Option<Vector>,
}

/// `sphere`: a tessellated sphere centred at its origin, its corners on the radius.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphereConfig {
    /// Radius, m.
    pub radius_m: f64,
    /// Divisions around and from pole to pole: n give 2 n (n - 1) triangles.
    pub segments: Option<u32>,
}

/// `torus-knot`: a tube along a knot that winds on a torus around the y axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TorusKnotConfig {
    /// Windings around the y axis.
    pub p: Option<u32>,
    /// Windings around the ring of the torus.
    pub q: Option<u32>,
    /// Radius of the ring, m; the knot keeps half of it from the ring.
    pub radius_m: f64,
    /// Radius of the tube, m.
    pub tube_radius_m: f64,
    /// Divisions along the tube.
    pub segments: Option<u32>,
    /// Divisions around the tube.
    pub tube_segments: Option<u32>,
}

/// `[light.NAME]`: a light source. Exactly one shape.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightConfig {
    /// Emitted power, W, linear RGB.
    pub power_w: Option<OneOrThree>,
    /// Irradiance of a surface that faces a directional light, W m⁻², linear RGB.
    pub irradiance_w_m2: Option<OneOrThree>,
    /// A cone of light.
    pub spot: Option<SpotConfig>,
    /// The same intensity in all directions.
    pub point: Option<PointConfig>,
    /// Parallel light.
    pub directional: Option<DirectionalConfig>,
    /// A diffuse parallelogram; an object of the same name shows it.
    pub rectangle: Option<RectangleConfig>,
    /// Light from infinitely far away in all directions; at most one in a scene.
    pub sky: Option<SkyConfig>,
}

/// `spot`: a cone of light with a smooth edge. Exactly one of target and direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpotConfig {
    /// Where it stands, m.
    pub position_m: Vector,
    /// A point on its axis, m.
    pub target_m: Option<Vector>,
    /// Its axis, the way the light travels; of any length.
    pub direction: Option<Vector>,
    /// Half the opening angle beyond which there is no light.
    pub outer_half_angle_deg: f64,
    /// Half the opening angle within which the intensity is full; default 0.9 of the outer.
    pub inner_half_angle_deg: Option<f64>,
}

/// `point`: the same intensity in all directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointConfig {
    /// Where it stands, m.
    pub position_m: Vector,
}

/// `directional`: parallel light from infinitely far away.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionalConfig {
    /// The way the light travels; of any length.
    pub direction: Vector,
}

/// `rectangle`: a diffuse parallelogram; it emits towards `edge_u_m × edge_v_m`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleConfig {
    /// The corner from which both edges start, m.
    pub corner_m: Vector,
    /// First edge, m.
    pub edge_u_m: Vector,
    /// Second edge, m.
    pub edge_v_m: Vector,
    /// Share of the arriving light that its front reflects; default 0.
    pub albedo: Option<OneOrThree>,
    /// Where the origin of corner and edges is put, m.
    pub position_m: Option<Vector>,
    /// Turns about that origin, as that of an object.
    pub rotation_deg: Option<Vector>,
    /// Stretches it before it is turned; its power stays.
    pub scale: Option<OneOrThree>,
}

/// `[streaming]`: settings of the simulation; see [`crate::StreamingSettings`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StreamingConfig {
    /// How light is simulated.
    #[serde(default, with = "values::by_name")]
    pub method: Option<Method>,
    /// For method `auto`: time that an update of the light may take.
    pub update_budget_us: Option<f64>,
    /// Number of virtual surface lights in the scene.
    pub vsls: Option<u32>,
    /// Number of paths in the pool.
    pub pool_paths: Option<u32>,
    /// Which sample a slot uses when it is traced again.
    #[serde(default, with = "values::by_name")]
    pub sampling: Option<Sampling>,
    /// Seed of placement and streaming.
    pub seed: Option<u64>,
    /// Shrinks triangles about their centroid before virtual surface lights are placed.
    pub placement_scale: Option<f64>,
    /// Time between published frames.
    pub publish_period_ms: Option<f64>,
    /// Tracer threads; default: one per core.
    pub threads: Option<u32>,
    /// Lights beyond this number share one column of flux.
    pub light_columns: Option<u32>,
    /// Simulated time from one published frame to the next; default: as much as passes on the clock.
    pub fixed_step_ms: Option<f64>,
    /// Edge of the distance maps of virtual surface lights in texels: 0, 8, 16, 32 or 64.
    pub distance_map_px: Option<u32>,
    /// Relative standard error of the flux at which refinement beyond the pool stops.
    pub target_error: Option<f64>,
    /// Time within which a change shall be traced.
    pub latency_ms: Option<f64>,
    /// Whether virtual surface lights go where the light is.
    pub adaptive: Option<bool>,
}

/// `[render]`: default settings of the renderers; see [`crate::RenderSettings`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderConfig {
    /// Picture width.
    pub width_px: Option<u32>,
    /// Picture height.
    pub height_px: Option<u32>,
    /// How the flux of a virtual surface light falls off.
    #[serde(default, with = "values::by_name")]
    pub kernel: Option<Kernel>,
    /// Whether virtual surface lights are shadowed.
    #[serde(default, with = "values::by_name")]
    pub visibility: Option<Visibility>,
    /// Edge of the shadow maps of virtual surface lights in texels.
    pub shadow_map_px: Option<u32>,
    /// Smallest radiance worth adding, W m⁻² sr⁻¹.
    pub epsilon: Option<f64>,
    /// Whether lights beyond their range are skipped or drawn by lot.
    #[serde(default, with = "values::by_name")]
    pub culling: Option<RangeCulling>,
    /// Shadow rays per pixel and area light.
    pub light_samples: Option<u32>,
    /// Exposure of tone-mapped pictures, in stops.
    pub exposure_ev: Option<f64>,
    /// Tone map of PNG pictures.
    #[serde(default, with = "values::by_name")]
    pub tone_map: Option<ToneMap>,
}
