//! Gathers what a picture shall show, and how its light is gathered.

use crate::GpuError;
use photonstream_renderer::LayerKind;
use photonstream_scene::{RangeCulling, RenderSettings, SHADOW_MAP_EDGES, Visibility};
use photonstream_shading::{Camera, Kernel};

macro_rules! named {
    ($(#[$meta:meta])* $type:ident, $what:literal { $($(#[$variant_meta:meta])* $variant:ident = $name:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
        pub enum $type { $($(#[$variant_meta])* $variant,)+ }

        impl $type {
            /// All values, in the order of their discriminants.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The name used on the command line.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),+ }
            }
        }

        impl std::str::FromStr for $type {
            type Err = String;

            fn from_str(name: &str) -> Result<Self, String> {
                Self::ALL.iter().copied().find(|v| v.name() == name).ok_or_else(|| {
                    let names: Vec<_> = Self::ALL.iter().map(|v| v.name()).collect();
                    format!("unknown {} \"{name}\"; expected one of: {}", $what, names.join(", "))
                })
            }
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}

named! {
    /// How virtual surface lights are summed over the picture. All give the same picture.
    Accumulation, "accumulation" {
        /// The geometry is drawn once for each light: paper A without deferred shading.
        Forward = "forward",
        /// Each light is drawn as a sphere of its range, added to the picture: paper A §0.7.3.
        Splat = "splat",
        /// Each 16 × 16 tile has a list of the lights that can reach it.
        #[default]
        Tiled = "tiled",
    }
}

named! {
    /// How lights are shadowed.
    Shadows, "shadows" {
        /// Shadow maps: those of lights without extent name triangles, which each pixel's ray is tested against; those
        /// of area lights hold depths, with percentage-closer filtering.
        #[default]
        Maps = "maps",
        /// A shadow ray for each pixel and light, several to area lights: exact.
        Rays = "rays",
        /// None: light goes through everything.
        None = "none",
    }
}

/// What a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Show {
    /// A layer that every renderer has.
    Layer(LayerKind),
    /// The virtual surface lights as discs over the picture, in the colour of their radiosity.
    Discs,
    /// How long ago the light of the owning virtual surface light was traced: green now, red 1 s and more.
    Age,
    /// The share of all lights in the list of a pixel's tile: blue none, green half, red all.
    Tiles,
}

/// What a picture shall show, and how its light is gathered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// From where.
    pub camera: Camera,
    /// How the flux of a virtual surface light falls off.
    pub kernel: Kernel,
    /// Whether virtual surface lights are shadowed, and how.
    pub visibility: Visibility,
    /// Edge of the shadow maps of virtual surface lights in texels, for [`Visibility::ShadowMaps`]: 32, 64, 128 or 256.
    pub shadow_map_px: u32,
    /// A virtual surface light ends at the range where it cannot add this radiance (W m⁻² sr⁻¹) any more; 0: it has none.
    pub epsilon: f32,
    /// Whether lights beyond their range are skipped or drawn by lot.
    pub culling: RangeCulling,
    /// How virtual surface lights are summed.
    pub accumulation: Accumulation,
    /// Edge of the pattern of interleaved sampling, with `tiled` only: 1 every pixel sums all lights, 2 or 4 it sums
    /// every fourth or sixteenth, and takes the others' from its neighbours.
    pub interleave: u32,
    /// How lights are shadowed.
    pub shadows: Shadows,
    /// Shadow rays to virtual surface lights per pixel, for [`Visibility::Rays`]; 0: one to each.
    pub rays_per_pixel: u32,
    /// Points of an area light per pixel, or with shadow maps per light.
    pub light_samples: u32,
    /// What is shown.
    pub show: Show,
    /// Direct light of this light alone, by index; the full picture then has no indirect light.
    pub only_light: Option<u32>,
    /// Place of the sample within its pixel; (0.5, 0.5) is the centre.
    pub jitter: [f32; 2],
    /// Number of the camera sample, from 0: each has samples of lights of its own.
    pub sample: u32,
    /// Seed of pixel and area-light samples, and of the lots of stochastic culling.
    pub seed: u64,
}

impl View {
    /// What a scene asks for, seen from its camera. Shadow rays are limited to 32 per pixel.
    pub fn from_settings(settings: &RenderSettings, camera: &Camera) -> Self {
        Self {
            width: settings.width,
            height: settings.height,
            camera: *camera,
            kernel: settings.kernel,
            visibility: settings.visibility,
            shadow_map_px: settings.shadow_map_px,
            epsilon: settings.epsilon,
            culling: settings.culling,
            accumulation: Accumulation::default(),
            interleave: 1,
            shadows: Shadows::default(),
            rays_per_pixel: 32,
            light_samples: settings.light_samples,
            show: Show::Layer(LayerKind::Full),
            only_light: None,
            jitter: [0.5; 2],
            sample: 0,
            seed: 1,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), GpuError> {
        let wrong = |option, found: String, expected| Err(GpuError::Option { option, found, expected });
        if self.width == 0 || self.height == 0 {
            return wrong("size", format!("{}x{}", self.width, self.height), "1x1 or more");
        }
        if !(self.epsilon >= 0.0 && self.epsilon.is_finite()) {
            return wrong("epsilon", self.epsilon.to_string(), "0 or more, finite");
        }
        if !SHADOW_MAP_EDGES.contains(&self.shadow_map_px) {
            return wrong("shadow_map_px", self.shadow_map_px.to_string(), "32, 64, 128 or 256");
        }
        if !matches!(self.interleave, 1 | 2 | 4) {
            return wrong("interleave", self.interleave.to_string(), "1, 2 or 4");
        }
        if self.interleave > 1 && self.accumulation != Accumulation::Tiled {
            let found = format!("{} with {}", self.interleave, self.accumulation);
            return wrong("interleave", found, "1, or the accumulation tiled");
        }
        if !(1..=1 << 16).contains(&self.light_samples) {
            return wrong("light_samples", self.light_samples.to_string(), "1 to 65536");
        }
        Ok(())
    }

    /// Whether indirect light is summed by shadow rays; lists of tiles are shown without.
    pub(crate) fn by_rays(&self) -> bool {
        self.visibility == Visibility::Rays && self.show != Show::Tiles
    }

    /// Whether virtual surface lights are shadowed by maps that are drawn; lists of tiles are shown without.
    pub(crate) fn draws_maps(&self) -> bool {
        self.visibility == Visibility::ShadowMaps && self.show != Show::Tiles
    }

    /// Whether lights draw their range by lot.
    pub(crate) fn draws_lots(&self) -> bool {
        self.epsilon > 0.0 && self.culling == RangeCulling::Stochastic
    }

    pub(crate) fn needs_direct(&self) -> bool {
        match self.show {
            Show::Layer(kind) => kind.needs_direct(),
            Show::Discs => true,
            Show::Age | Show::Tiles => false,
        }
    }

    pub(crate) fn needs_indirect(&self) -> bool {
        match self.show {
            Show::Layer(LayerKind::Indirect) => true,
            Show::Layer(kind) => kind.needs_indirect() && self.only_light.is_none(),
            Show::Tiles => true,
            Show::Discs | Show::Age => false,
        }
    }

    pub(crate) fn needs_owner(&self) -> bool {
        match self.show {
            Show::Layer(kind) => kind.needs_owner(),
            Show::Age => true,
            Show::Discs | Show::Tiles => false,
        }
    }
}
