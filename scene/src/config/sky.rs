//! Gathers what a user writes in the `sky` of a light, before it is validated.

use super::OneOrThree;
use serde::{Deserialize, Serialize};

/// `sky`: radiance from infinitely far away in all directions, +Y upwards. Exactly one of `radiance_w_m2_sr`, a gradient
/// (`zenith_w_m2_sr`, `horizon_w_m2_sr`, `ground_w_m2_sr`) and `map`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkyConfig {
    /// The same radiance from everywhere, W m⁻² sr⁻¹.
    pub radiance_w_m2_sr: Option<OneOrThree>,
    /// Radiance from straight above, W m⁻² sr⁻¹; between zenith and horizon linear in the sine of the elevation.
    pub zenith_w_m2_sr: Option<OneOrThree>,
    /// Radiance from the horizon, W m⁻² sr⁻¹.
    pub horizon_w_m2_sr: Option<OneOrThree>,
    /// Radiance from below the horizon, W m⁻² sr⁻¹; default none.
    pub ground_w_m2_sr: Option<OneOrThree>,
    /// An equirectangular picture of radiances in W m⁻² sr⁻¹, OpenEXR or Radiance HDR; its middle lies at −Z.
    pub map: Option<String>,
    /// Turns the map about +Y; default 0.
    pub rotation_deg: Option<f64>,
    /// What all radiances are multiplied by; default 1.
    pub scale: Option<OneOrThree>,
}
