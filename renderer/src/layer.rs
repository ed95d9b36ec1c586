//! Turns the name of a layer into what a pixel of it holds.

use photonstream_film::Display;
use photonstream_scene::RenderSettings;

/// What a layer of a picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum LayerKind {
    /// All light: emitted, direct and indirect; radiance in W m⁻² sr⁻¹.
    #[default]
    Full,
    /// Emitted light and the first reflection of the lights; radiance in W m⁻² sr⁻¹.
    Direct,
    /// All later reflections; radiance in W m⁻² sr⁻¹. Full is the sum of direct and indirect.
    Indirect,
    /// Reflectance of the surface in [0, 1]; black where the visible side reflects nothing.
    Albedo,
    /// Unit normal n of the visible side in the scene's space as (n + 1)/2; black where nothing was hit.
    Normal,
    /// Who owns what: a colour of its own for each virtual surface light.
    Vsl,
    /// Radiosity in W m⁻² of the owning virtual surface light, flux/area: the light as it is stored.
    Flux,
    /// Distance from the camera in metres, in all channels; 0 where nothing was hit.
    Depth,
}

impl LayerKind {
    /// All kinds, in the order of their discriminants.
    pub const ALL: [Self; 8] = [
        Self::Full,
        Self::Direct,
        Self::Indirect,
        Self::Albedo,
        Self::Normal,
        Self::Vsl,
        Self::Flux,
        Self::Depth,
    ];

    /// The name used on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Vsl => "vsl",
            Self::Flux => "flux",
            Self::Depth => "depth",
        }
    }

    /// How the layer becomes display colours: light is exposed and tone mapped, distances are scaled, the rest is
    /// shown as it is.
    pub fn display(self, settings: &RenderSettings) -> Display {
        match self {
            Self::Full | Self::Direct | Self::Indirect => {
                Display::Radiance { exposure_ev: settings.exposure_ev, tone_map: settings.tone_map }
            }
            // As bright as the radiance it stands for: radiosity/π.
            Self::Flux => {
                let exposure_ev = settings.exposure_ev - core::f32::consts::PI.log2();
                Display::Radiance { exposure_ev, tone_map: settings.tone_map }
            }
            Self::Depth => Display::Scaled,
            Self::Albedo | Self::Normal | Self::Vsl => Display::Data,
        }
    }

    /// Whether the layer shows direct light.
    pub fn needs_direct(self) -> bool {
        matches!(self, Self::Full | Self::Direct)
    }

    /// Whether the layer shows indirect light.
    pub fn needs_indirect(self) -> bool {
        matches!(self, Self::Full | Self::Indirect)
    }

    /// Whether the layer shows which light owns a point.
    pub fn needs_owner(self) -> bool {
        matches!(self, Self::Vsl | Self::Flux)
    }
}

impl std::str::FromStr for LayerKind {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown layer \"{name}\"; expected one of: {names}")
        })
    }
}

impl std::fmt::Display for LayerKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}
