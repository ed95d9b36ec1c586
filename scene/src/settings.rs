//! Gathers the validated settings of simulation and rendering, with their defaults.

use crate::{
    config::{AnimatedProperty, Interpolation, Repeat, UpAxis},
    scene::Sides,
};
use photonstream_shading::{Kernel, tone::ToneMap};

/// Which sample a slot of the path pool uses when it is traced again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Sampling {
    /// Slot i always replays sample i: an unchanged scene gives unchanged light.
    #[default]
    Replay,
    /// Each refill takes the next sample of the sequence, the oldest path first: paper A's stream.
    Fresh,
}

/// How light is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Method {
    /// Photons are traced and kept: paper A.
    #[default]
    PhotonStreaming,
    /// Predefined virtual point lights, whose flux alone changes: paper B §4.1.
    StaticVpl,
    /// One virtual point light where the axis of each spot meets the scene, in their place: paper B §4.3.
    PhantomVpl,
    /// One virtual point light for each of a few photons from fixed directions: Keller 1997, paper B §5.3.4.
    InstantRadiosity,
    /// The most exact of them that the time for an update allows.
    Auto,
}

/// How the weights of virtual point lights that have none of their own are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Weights {
    /// All at once, whenever something has moved.
    #[default]
    Whole,
    /// One comparison for each update.
    Amortised,
}

/// What stands between lights and virtual point lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum VplVisibility {
    /// The scene's blockers.
    #[default]
    Blockers,
    /// The scene: a ray from each to each.
    Rays,
    /// Nothing.
    None,
}

/// What the axis of a spot is intersected with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum PhantomSurfaces {
    /// The scene.
    #[default]
    Scene,
    /// The scene's proxies.
    Proxies,
}

/// Settings of the methods of few lights.
#[derive(Clone, Debug, PartialEq)]
pub struct VplSettings {
    /// The area in m² of a VPL of weight 1; larger makes all indirect light brighter.
    pub area_per_weight: f32,
    /// VPLs whose brightest channel has less intensity, in W sr⁻¹, are switched off.
    pub cull_intensity: f32,
    /// How weights that are not given are computed.
    pub weights: Weights,
    /// What stands between lights and VPLs.
    pub visibility: VplVisibility,
    /// What the axis of a spot is intersected with.
    pub phantom_surfaces: PhantomSurfaces,
    /// VPLs closer than its root count as if they were there, m².
    pub softening: f32,
    /// Time in s after which a phantom has followed 63 % of a jump.
    pub smoothing_s: f32,
    /// Mean reflectance of what the second bounce comes from, 0 to 1.
    pub second_bounce_albedo: f32,
    /// How far from the first the second bounce comes from, m; 0: there is none.
    pub second_bounce_distance: f32,
    /// Photons of instant radiosity.
    pub photons: u32,
}

impl Default for VplSettings {
    /// Paper B's values; where it has none, those of its script.
    fn default() -> Self {
        Self {
            area_per_weight: 1.0,
            cull_intensity: 0.01,
            weights: Weights::Whole,
            visibility: VplVisibility::Blockers,
            phantom_surfaces: PhantomSurfaces::Scene,
            softening: 0.005,
            smoothing_s: 0.024,
            second_bounce_albedo: 0.4,
            second_bounce_distance: 0.0,
            photons: 64,
        }
    }
}

/// Whether virtual surface lights are shadowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Visibility {
    /// V = 1: paper A.
    None,
    /// V = 1, and screen-space ambient occlusion over the sum: the shadows near contacts, without a ray. Paper A names
    /// it as what to do without shadows of virtual surface lights. Only renderers with a G-buffer have it.
    Ao,
    /// A shadow ray to every virtual surface light.
    #[default]
    Rays,
    /// The octahedral distance maps of the virtual surface lights, which the simulator traces and publishes: shadows without
    /// a ray in the renderer ([`photonstream_shading::distance_map`]).
    Octahedral,
    /// One small shadow map for each virtual surface light that shines, drawn by the renderer when the light has moved: for
    /// methods with few lights. Renderers without a rasteriser send the rays of [`Visibility::Rays`], which the maps stand for.
    ShadowMaps,
}

/// What becomes of a virtual surface light beyond its range, where it cannot add `epsilon` to any radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum RangeCulling {
    /// It is skipped, and what it would have added is lost: paper A.
    Cut,
    /// It is kept by lot, more rarely the farther away, and adds the more: nothing is lost on average.
    #[default]
    Stochastic,
}

/// Settings of the simulation.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamingSettings {
    /// How light is simulated.
    pub method: Method,
    /// For [`Method::Auto`]: time that an update of the light may take, µs; `None`: any.
    pub update_budget_us: Option<f64>,
    /// Number of virtual surface lights in the scene.
    pub vsls: u32,
    /// Number of paths in the pool, over all lights; at most [`StreamingSettings::MAX_POOL_PATHS`].
    pub pool_paths: u32,
    /// Which sample a slot uses when it is traced again.
    pub sampling: Sampling,
    /// Seed of placement and streaming.
    pub seed: u64,
    /// Triangles are shrunk about their centroid by this factor before virtual surface lights are placed.
    pub placement_scale: f32,
    /// Time between published frames, in ms.
    pub publish_period_ms: f32,
    /// Tracer threads; `None`: one per core.
    pub threads: Option<u32>,
    /// Lights beyond this number share one column of flux.
    pub light_columns: u32,
    /// Simulated time from one published frame to the next, ms: runs repeat exactly. `None`: as much as passes on the
    /// clock.
    pub fixed_step_ms: Option<f64>,
    /// Edge of the distance maps of virtual surface lights in texels, for visibility `octahedral`; 0: none are traced.
    pub distance_map_px: u32,
    /// Relative standard error of the flux, in [0, 1], down to which samples beyond the pool are added while nothing
    /// changes; 0: none are.
    pub target_error: f64,
    /// Time within which a change shall be traced, ms, by a pool of fitting size; 0: the pool keeps its size.
    pub latency_ms: f64,
    /// Whether virtual surface lights move to the objects from which most light reaches others; else they lie equally
    /// dense everywhere.
    pub adaptive: bool,
}

impl StreamingSettings {
    /// Most paths a pool may hold: the flux sums of so many paths cannot overflow.
    pub const MAX_POOL_PATHS: u32 = 1 << 23;

    /// Most virtual surface lights a scene may have.
    pub const MAX_VSLS: u32 = 4_000_000;

    /// Most texels that all distance maps together may have.
    pub const MAX_DISTANCE_TEXELS: u64 = 1 << 30;

    /// The edge of the distance maps of `vsls` lights where none is asked for: 32 texels, fewer where they would have more
    /// than 2²⁵ texels (64 MiB) in all.
    pub fn default_distance_map_px(vsls: u32) -> u32 {
        let fits = |px: u32| u64::from(vsls) * u64::from(px * px) <= 1 << 25;
        [32, 16].into_iter().find(|&px| fits(px)).unwrap_or(8)
    }
}

impl Default for StreamingSettings {
    fn default() -> Self {
        Self {
            method: Method::PhotonStreaming,
            update_budget_us: None,
            vsls: 1000,
            pool_paths: 1 << 17,
            sampling: Sampling::Replay,
            seed: 1,
            placement_scale: 0.9,
            publish_period_ms: 10.0,
            threads: None,
            light_columns: 8,
            fixed_step_ms: None,
            distance_map_px: 0,
            target_error: 0.0,
            latency_ms: 0.0,
            adaptive: false,
        }
    }
}

/// Edges that shadow maps of virtual surface lights may have, in texels.
pub const SHADOW_MAP_EDGES: [u32; 4] = [32, 64, 128, 256];

/// Default settings of the renderers.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Picture width in pixels.
    pub width: u32,
    /// Picture height in pixels.
    pub height: u32,
    /// How the flux of a virtual surface light falls off.
    pub kernel: Kernel,
    /// Whether virtual surface lights are shadowed.
    pub visibility: Visibility,
    /// Edge of the shadow maps of virtual surface lights in texels, for visibility `shadow-maps`; one of [`SHADOW_MAP_EDGES`].
    pub shadow_map_px: u32,
    /// A virtual surface light ends at the range where it cannot add this radiance (W m⁻² sr⁻¹) any more; 0: it has none.
    pub epsilon: f32,
    /// Whether lights beyond their range are skipped or drawn by lot.
    pub culling: RangeCulling,
    /// Shadow rays per pixel and area light.
    pub light_samples: u32,
    /// Exposure of tone-mapped pictures, in stops.
    pub exposure_ev: f32,
    /// Tone map of PNG pictures.
    pub tone_map: ToneMap,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            width: 800,
            height: 600,
            kernel: Kernel::Patch,
            visibility: Visibility::Rays,
            shadow_map_px: 128,
            epsilon: 1e-6,
            culling: RangeCulling::default(),
            light_samples: 16,
            exposure_ev: 0.0,
            tone_map: ToneMap::Aces,
        }
    }
}

macro_rules! named {
    ($type:ident, $what:literal, $($variant:ident = $name:literal),+) => {
        impl $type {
            /// All values, in the order of their discriminants.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The name used in configs and on the command line.
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
    };
}

named!(UpAxis, "axis", Y = "y", Z = "z");
named!(Sides, "sides", Front = "front", Back = "back", Both = "both");
named!(
    AnimatedProperty,
    "property",
    Position = "position_m",
    Rotation = "rotation_deg",
    Scale = "scale",
    Power = "power_w",
    Irradiance = "irradiance_w_m2",
    Direction = "direction",
    Target = "target_m"
);
named!(Interpolation, "interpolation", Linear = "linear", Smooth = "smooth", Step = "step");
named!(Repeat, "repeat", Loop = "loop", Bounce = "bounce", Once = "once");
named!(
    Method,
    "method",
    PhotonStreaming = "photon-streaming",
    StaticVpl = "static-vpl",
    PhantomVpl = "phantom-vpl",
    InstantRadiosity = "instant-radiosity",
    Auto = "auto"
);
named!(Weights, "weights", Whole = "whole", Amortised = "amortised");
named!(VplVisibility, "visibility", Blockers = "blockers", Rays = "rays", None = "none");
named!(PhantomSurfaces, "phantom_surfaces", Scene = "scene", Proxies = "proxies");
named!(Sampling, "sampling", Replay = "replay", Fresh = "fresh");
named!(RangeCulling, "culling", Cut = "cut", Stochastic = "stochastic");
named!(
    Visibility,
    "visibility",
    None = "none",
    Ao = "ao",
    Rays = "rays",
    Octahedral = "octahedral",
    ShadowMaps = "shadow-maps"
);
