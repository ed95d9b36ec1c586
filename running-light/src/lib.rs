//! Turns a light that moves into the strengths of a few virtual point lights that do not: indirect light in microseconds.
//!
//! The virtual point lights (VPLs) are placed beforehand; only their flux changes. No photon is traced, nothing is
//! allocated, and the standard library is not needed, so that an engine for phones, headsets or the web can embed this
//! crate as it is: `examples/embed.rs` is a whole use.
//!
//! - [`update`]: all static VPLs for all lights, with [`Visibility`] by spherical blockers or by the engine's own rays.
//! - [`Phantom`]: one VPL that follows the axis of a spot light instead of them.
//! - [`SecondBounce`]: one more VPL for the light that either of them sends on.
//! - [`automatic_weights`] and [`AmortisedWeights`]: the areas VPLs stand for, from their distances.
//!
//! ```
//! use photonstream_running_light::{Light, UpdateSettings, Vec3, Visibility, Vpl, VplId, update};
//!
//! // One VPL on the floor, which stands for 2 m², and a lamp of 100 W a metre above it.
//! let vpls = [Vpl { position: Vec3::ZERO, normal: Vec3::Y, albedo: Vec3::splat(0.5), weight: 2.0 }];
//! let lamp = Light::point(Vec3::Y, Vec3::splat(100.0));
//! let (mut flux, mut active) = ([Vec3::ZERO; 1], [VplId(0); 1]);
//! let settings = UpdateSettings::default();
//! let shining = update(&vpls, &[lamp], &mut Visibility::None, &settings, &mut flux, &mut active)?;
//! assert_eq!(active[..shining], [VplId(0)]);
//! // Φ = ρ A · P/4π / d² = 0.5 · 2 · 7.96 W.
//! assert!((flux[0].x - 7.957747).abs() < 1e-5);
//! # Ok::<(), photonstream_running_light::LengthError>(())
//! ```
//!
//! Units are those of every crate here: lengths in metres, areas in m², `flux` in W, `intensity` in W sr⁻¹,
//! `irradiance` in W m⁻², all linear RGB. Finite input gives finite output: what is too large for an `f32` becomes
//! the largest one, what has no value (light at distance 0) becomes 0.
//!
//! Source: G. Papaioannou, "Approximate dynamic global illumination for VR", Virtual Reality 29, 54 (2025); paper B in
//! METHODS §6, which says where this crate leaves it, and where the authors' script does.
#![no_std]
#![forbid(unsafe_code)]

mod blocker;
mod error;
mod finite;
mod light;
mod phantom;
mod second_bounce;
mod update;
mod visibility;
mod vpl;
mod weights;

pub use blocker::Blocker;
pub use error::LengthError;
pub use glam::Vec3;
pub use light::{Light, Spot};
pub use phantom::{Phantom, PhantomSettings};
pub use second_bounce::SecondBounce;
pub use update::{CULL_INTENSITY, UpdateSettings, update};
pub use visibility::{ShadowRay, Visibility};
pub use vpl::{VirtualLight, Vpl, VplId};
pub use weights::{AmortisedWeights, automatic_weights};
