//! Turns scene files into meshes, materials, lights, a camera and a ray-tracing structure.
//!
//! [`SceneConfig`] is what a user wrote, [`Scene`] what is valid: [`SceneConfig::from_file`] parses,
//! [`SceneConfig::build`] validates and bakes, [`Scene::load`] does both; [`Scene::edit`] changes a loaded scene. `configs/README.md` lists every key.
#![forbid(unsafe_code)]

mod animation;
mod bake;
mod build;
pub mod bvh;
pub mod config;
mod edit;
mod error;
pub mod features;
mod import;
pub mod kept;
mod model;
mod picture;
mod placement;
mod pose;
mod primitives;
mod scene;
mod settings;
mod texturing;
pub mod vpl_placement;
pub mod vpls;

pub use animation::Animation;
pub use config::SceneConfig;
pub use edit::SceneEdit;
pub use error::{Place, SceneError};
pub use features::Features;
pub use import::AssetRoots;
pub use model::{ModelOptions, ModelScene, is_model};
pub use picture::{Picture, Texture};
pub use scene::{Geometry, LightId, Material, MaterialId, Object, ObjectId, Scene, SceneLight, Side, Sides};
pub use settings::{
    Method, PhantomSurfaces, RangeCulling, RenderSettings, SHADOW_MAP_EDGES, Sampling, StreamingSettings,
    Visibility, VplSettings, VplVisibility, Weights,
};
pub use texturing::Detail;
pub use vpls::VplSet;
