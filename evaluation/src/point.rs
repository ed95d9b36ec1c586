//! Names one thing to measure: a method and its settings, as text and back.

use photonstream_scene::{RenderSettings, Sampling, Scene, Visibility};
use photonstream_shading::Kernel;
use std::{fmt, str::FromStr};

/// How light is transported.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Method {
    /// This project: photons streamed onto virtual surface lights.
    PhotonStreaming,
    /// The same light, its picture drawn by a graphics device.
    PhotonStreamingGpu,
    /// Paths from the camera, until the time is over; the reference's own code.
    PathTracing,
    /// The same, denoised by Intel Open Image Denoise with the albedo and the normals of the pixels' centres.
    PathTracingDenoised,
    /// Random virtual point lights with shadow rays. Source: Keller, "Instant Radiosity", SIGGRAPH 1997.
    InstantRadiosity,
    /// The same, bounded: 1/(π (r² + c²)), c the radius of the disc that is a light's share of the surfaces.
    InstantRadiosityBounded,
    /// Predefined virtual point lights: paper B §4.1.
    StaticVpl,
    /// One where the axis of each spot ends, instead: paper B §4.3.
    PhantomVpl,
    /// One where each of a few photons of fixed directions ends: paper B §5.3.4.
    FixedPhotons,
    /// Paper A as written: f32, point kernel, no visibility, a stream of fresh impacts, the oldest taken back.
    PaperA,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 10] = [
        Self::PhotonStreaming,
        Self::PhotonStreamingGpu,
        Self::PathTracing,
        Self::PathTracingDenoised,
        Self::InstantRadiosity,
        Self::InstantRadiosityBounded,
        Self::StaticVpl,
        Self::PhantomVpl,
        Self::FixedPhotons,
        Self::PaperA,
    ];

    /// The name in results and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PhotonStreaming => "photon-streaming",
            Self::PhotonStreamingGpu => "photon-streaming-gpu",
            Self::PathTracing => "path-tracing",
            Self::PathTracingDenoised => "path-tracing-denoised",
            Self::InstantRadiosity => "instant-radiosity",
            Self::InstantRadiosityBounded => "instant-radiosity-bounded",
            Self::StaticVpl => "static-vpl",
            Self::PhantomVpl => "phantom-vpl",
            Self::FixedPhotons => "instant-radiosity-fixed",
            Self::PaperA => "paper-a",
        }
    }

    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::PhotonStreaming => {
                &["vsls", "pool", "kernel", "visibility", "sampling", "light_samples", "threads", "seed"]
            }
            Self::PhotonStreamingGpu => &[
                "vsls",
                "pool",
                "kernel",
                "visibility",
                "sampling",
                "light_samples",
                "accumulation",
                "interleave",
                "threads",
                "seed",
            ],
            Self::PathTracing | Self::PathTracingDenoised => &["spp", "threads", "seed"],
            Self::InstantRadiosity | Self::InstantRadiosityBounded => {
                &["vsls", "visibility", "light_samples", "threads", "seed"]
            }
            Self::StaticVpl | Self::PhantomVpl => {
                &["kernel", "visibility", "light_samples", "threads", "seed"]
            }
            Self::FixedPhotons => &["vsls", "kernel", "visibility", "light_samples", "threads", "seed"],
            Self::PaperA => &["vsls", "pool", "light_samples", "threads", "seed"],
        }
    }
}

impl FromStr for Method {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("unknown method \"{name}\"; expected one of: {names}")
        })
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A method and its settings. Settings that the method does not have are left as they are and written nowhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// How light is transported.
    pub method: Method,
    /// Virtual surface lights (virtual point lights of instant radiosity) to place.
    pub vsls: u32,
    /// Slots of the path pool.
    pub pool: u32,
    /// How flux falls off.
    pub kernel: Kernel,
    /// Shadows of indirect light.
    pub visibility: Visibility,
    /// Which sample a slot takes when it is traced again.
    pub sampling: Sampling,
    /// Shadow rays per pixel and area light.
    pub light_samples: u32,
    /// How a graphics device sums lights; its own word for it.
    pub accumulation: String,
    /// Edge of the device's pattern of interleaved sampling.
    pub interleave: u32,
    /// Paths per pixel.
    pub spp: u64,
    /// Threads.
    pub threads: usize,
    /// Seed of all samples.
    pub seed: u64,
}

impl Point {
    /// Photon streaming as `scene` asks for it, on `threads` threads.
    pub fn of_scene(scene: &Scene, threads: usize) -> Self {
        let RenderSettings { kernel, visibility, light_samples, .. } = scene.render;
        Self {
            method: Method::PhotonStreaming,
            vsls: scene.streaming.vsls,
            pool: scene.streaming.pool_paths,
            kernel,
            visibility,
            sampling: scene.streaming.sampling,
            light_samples,
            accumulation: "tiled".into(),
            interleave: 1,
            spp: 64,
            threads,
            seed: scene.streaming.seed,
        }
    }

    /// Whether the method has the setting called `key`.
    pub fn has(&self, key: &str) -> bool {
        self.method.keys().contains(&key)
    }

    /// Reads `METHOD` or `METHOD:KEY=VALUE,…`, as [`fmt::Display`] writes it; what is not given is as in `self`.
    ///
    /// # Errors
    /// A sentence that names what cannot be understood and what was expected.
    pub fn parse(&self, text: &str) -> Result<Self, String> {
        let (method, settings) = text.split_once(':').unwrap_or((text, ""));
        let mut point = Self { method: method.parse()?, ..self.clone() };
        for setting in settings.split(',').filter(|s| !s.is_empty()) {
            let Some((key, value)) = setting.split_once('=') else {
                return Err(format!("\"{setting}\": expected KEY=VALUE"));
            };
            if !point.has(key) {
                return Err(format!(
                    "\"{key}\": {method} has no such setting; it has: {}",
                    point.method.keys().join(", ")
                ));
            }
            point.set(key, value)?;
        }
        Ok(point)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        fn number<T: FromStr + PartialOrd + From<u8>>(
            key: &str,
            value: &str,
            least: u8,
        ) -> Result<T, String> {
            let number = value.parse::<T>().ok().filter(|n| *n >= T::from(least));
            number.ok_or_else(|| format!("{key}={value}: expected a whole number, {least} or more"))
        }
        match key {
            "vsls" => self.vsls = number(key, value, 1)?,
            "pool" => self.pool = number(key, value, 1)?,
            "kernel" => self.kernel = value.parse()?,
            "visibility" => self.visibility = value.parse()?,
            "sampling" => self.sampling = value.parse()?,
            "light_samples" => self.light_samples = number(key, value, 1)?,
            "accumulation" => self.accumulation = value.to_owned(),
            "interleave" => self.interleave = number(key, value, 1)?,
            "spp" => self.spp = number(key, value, 1)?,
            "threads" => self.threads = number::<u32>(key, value, 1)? as usize,
            _ => self.seed = number(key, value, 0)?,
        }
        Ok(())
    }
}

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = ':';
        f.write_str(self.method.name())?;
        for &key in self.method.keys() {
            write!(f, "{separator}{key}=")?;
            match key {
                "vsls" => write!(f, "{}", self.vsls)?,
                "pool" => write!(f, "{}", self.pool)?,
                "kernel" => f.write_str(self.kernel.name())?,
                "visibility" => f.write_str(self.visibility.name())?,
                "sampling" => f.write_str(self.sampling.name())?,
                "light_samples" => write!(f, "{}", self.light_samples)?,
                "accumulation" => f.write_str(&self.accumulation)?,
                "interleave" => write!(f, "{}", self.interleave)?,
                "spp" => write!(f, "{}", self.spp)?,
                "threads" => write!(f, "{}", self.threads)?,
                _ => write!(f, "{}", self.seed)?,
            }
            separator = ',';
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base() -> Point {
        Point {
            method: Method::PhotonStreaming,
            vsls: 1000,
            pool: 4096,
            kernel: Kernel::Disc,
            visibility: Visibility::Rays,
            sampling: Sampling::Replay,
            light_samples: 16,
            accumulation: "splat".into(),
            interleave: 2,
            spp: 64,
            threads: 2,
            seed: 1,
        }
    }

    #[test]
    fn text_and_back() {
        for method in Method::ALL {
            let point = Point { method, ..base() };
            assert_eq!(base().parse(&point.to_string()).unwrap(), point);
        }
        let point = base().parse("photon-streaming:vsls=50,kernel=paper,visibility=none").unwrap();
        assert_eq!((point.vsls, point.pool, point.kernel), (50, 4096, Kernel::Paper));
        assert_eq!(base().parse("path-tracing:spp=8").unwrap().spp, 8);
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        for (text, says) in [
            ("radiosity", "unknown method"),
            ("path-tracing:vsls=3", "path-tracing has no such setting; it has: spp, threads, seed"),
            ("photon-streaming:vsls", "expected KEY=VALUE"),
            ("photon-streaming:vsls=0", "vsls=0: expected a whole number, 1 or more"),
            ("photon-streaming:kernel=x", "unknown kernel"),
        ] {
            let error = base().parse(text).unwrap_err();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
