//! Turns numbers into numbers: the light-transport maths that simulator and renderers share; no state, no I/O.
//!
//! Units are those of every crate here: lengths in metres, `power` and `flux` in W, `irradiance` in W m⁻²,
//! `radiance` in W m⁻² sr⁻¹, all linear RGB with Rec. 709 primaries; `wo` points from a surface to the viewer,
//! `wi` from a surface to the light, both of unit length.
#![forbid(unsafe_code)]

pub mod basis;
pub mod camera;
pub mod culling;
pub mod distance_map;
pub mod kernel;
pub mod light;
pub mod octahedral;
pub mod patch;
pub mod sampling;
pub mod sky;
pub mod sobol;
pub mod surface;
pub mod texture;
pub mod tone;
pub mod wgsl;
mod wrap;

pub use camera::Camera;
pub use kernel::Kernel;
pub use light::{Light, LightShape};
pub use sky::Sky;
