//! Turns where a picture comes from into named texts inside its files, and back.

/// Where a picture comes from. What is not known is `None` and not written.
///
/// In EXR files each field is a text attribute, in PNG files a `tEXt` chunk, both under the name given here.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Metadata {
    /// `photonstream.frame`: the published frame that was rendered.
    pub frame: Option<u64>,
    /// `photonstream.scene_hash`: hash of the scene, 16 hexadecimal digits.
    pub scene_hash: Option<u64>,
    /// `photonstream.scene`: name of the scene.
    pub scene_name: Option<String>,
    /// `photonstream.method`: how light was transported: `photon-streaming`, `path-tracing` …
    pub method: Option<String>,
    /// `photonstream.kernel`: how the flux of a virtual surface light falls off.
    pub kernel: Option<String>,
    /// `photonstream.visibility`: whether virtual surface lights are shadowed.
    pub visibility: Option<String>,
    /// `photonstream.samples_per_pixel`: camera samples (or paths) per pixel.
    pub samples_per_pixel: Option<u64>,
    /// `photonstream.photon_paths`: photon paths behind the virtual surface lights.
    pub photon_paths: Option<u64>,
    /// `photonstream.vsls`: number of virtual surface lights.
    pub vsls: Option<u64>,
    /// `photonstream.noise_rel_rmse`: the picture's own estimated relative RMSE from sampling noise.
    pub noise_rel_rmse: Option<f64>,
    /// `photonstream.software`: name and version of the program.
    pub software: Option<String>,
}

impl Metadata {
    /// The known fields as (name, text), in a fixed order.
    pub fn to_texts(&self) -> Vec<(&'static str, String)> {
        let number = |n: Option<u64>| n.map(|n| n.to_string());
        [
            ("photonstream.frame", number(self.frame)),
            ("photonstream.scene_hash", self.scene_hash.map(|h| format!("{h:016x}"))),
            ("photonstream.scene", self.scene_name.clone()),
            ("photonstream.method", self.method.clone()),
            ("photonstream.kernel", self.kernel.clone()),
            ("photonstream.visibility", self.visibility.clone()),
            ("photonstream.samples_per_pixel", number(self.samples_per_pixel)),
            ("photonstream.photon_paths", number(self.photon_paths)),
            ("photonstream.vsls", number(self.vsls)),
            ("photonstream.noise_rel_rmse", self.noise_rel_rmse.map(|n| n.to_string())),
            ("photonstream.software", self.software.clone()),
        ]
        .into_iter()
        .filter_map(|(name, text)| text.map(|t| (name, t)))
        .collect()
    }

    /// Sets the field called `name`; other names and unreadable numbers are ignored.
    pub fn set_text(&mut self, name: &str, text: &str) {
        let number = || text.parse().ok();
        let owned = || Some(text.to_owned());
        match name {
            "photonstream.frame" => self.frame = number(),
            "photonstream.scene_hash" => self.scene_hash = u64::from_str_radix(text, 16).ok(),
            "photonstream.scene" => self.scene_name = owned(),
            "photonstream.method" => self.method = owned(),
            "photonstream.kernel" => self.kernel = owned(),
            "photonstream.visibility" => self.visibility = owned(),
            "photonstream.samples_per_pixel" => self.samples_per_pixel = number(),
            "photonstream.photon_paths" => self.photon_paths = number(),
            "photonstream.vsls" => self.vsls = number(),
            "photonstream.noise_rel_rmse" => self.noise_rel_rmse = text.parse().ok(),
            "photonstream.software" => self.software = owned(),
            _ => {}
        }
    }
}
