//! Turns a picture into an OpenEXR file of 32-bit floats, and such files back into pictures.
//!
//! One part, ZIP compressed. The first layer has the channels `R`, `G`, `B`, so that every viewer shows it; its name
//! is the attribute `photonstream.layer`. Further layers have `name.R`, `name.G`, `name.B`.

use crate::{Film, FilmError, Layer, Metadata, atomic};
use exr::prelude as exr_rs;
use exr_rs::{ReadChannels, ReadLayers, WritableImage};
use glam::Vec3;
use std::{io::Cursor, path::Path};

const LAYER_ATTRIBUTE: &str = "photonstream.layer";
const CHANNELS: [&str; 3] = ["R", "G", "B"];

impl Film {
    /// Writes all layers and the metadata as linear OpenEXR; `path` is replaced at once or not at all.
    ///
    /// # Errors
    /// [`FilmError::NotFinite`], [`FilmError::Encode`] (also for a picture without layers), [`FilmError::Write`].
    pub fn write_exr(&self, path: &Path) -> Result<(), FilmError> {
        self.check_finite()?;
        let encode_error = |reason: String| FilmError::Encode { path: path.into(), reason };
        let first = self.layers().first().ok_or_else(|| encode_error("it has no layer".into()))?;
        let mut channels = exr_rs::SmallVec::new();
        for (index, layer) in self.layers().iter().enumerate() {
            for (c, channel) in CHANNELS.into_iter().enumerate() {
                let name = if index == 0 { channel.to_owned() } else { format!("{}.{channel}", layer.name) };
                let values = layer.pixels.iter().map(|p| p[c]).collect();
                channels.push(exr_rs::AnyChannel::new(name.as_str(), exr_rs::FlatSamples::F32(values)));
            }
        }
        let software_name = self.metadata.software.as_deref().map(to_text);
        let mut attributes = exr_rs::LayerAttributes { software_name, ..Default::default() };
        for (name, text) in
            self.metadata.to_texts().into_iter().chain([(LAYER_ATTRIBUTE, first.name.clone())])
        {
            let value = exr_rs::AttributeValue::Text(to_text(&text));
            attributes.other.insert(exr_rs::Text::from(name), value);
        }
        let layer = exr_rs::Layer::new(
            (self.width() as usize, self.height() as usize),
            attributes,
            exr_rs::Encoding::SMALL_LOSSLESS,
            exr_rs::AnyChannels::sort(channels),
        );
        let mut bytes = Cursor::new(Vec::new());
        exr_rs::Image::from_layer(layer)
            .write()
            .to_buffered(&mut bytes)
            .map_err(|e| encode_error(e.to_string()))?;
        atomic::write(path, bytes.get_ref())
    }

    /// Reads an OpenEXR file: every set of channels `R`, `G`, `B` becomes a layer, that of the plain names first.
    ///
    /// Files of other programs are read too; their first layer is called `full`.
    ///
    /// # Errors
    /// [`FilmError::Read`], [`FilmError::Decode`], [`FilmError::Channels`], [`FilmError::Size`].
    pub fn read_exr(path: &Path) -> Result<Self, FilmError> {
        let bytes = std::fs::read(path).map_err(|source| FilmError::Read { path: path.into(), source })?;
        let image = exr_rs::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map_err(|e| FilmError::Decode { path: path.into(), reason: e.to_string() })?;
        let part = image.layer_data;
        let mut film = Self::new(part.size.0 as u32, part.size.1 as u32)?;
        let mut first_name = "full".to_owned();
        for (name, value) in part.attributes.other.iter().chain(&image.attributes.other) {
            if let exr_rs::AttributeValue::Text(text) = value {
                match name.to_string().as_str() {
                    LAYER_ATTRIBUTE => first_name = from_text(text),
                    name => film.metadata.set_text(name, &from_text(text)),
                }
            }
        }
        let list = &part.channel_data.list;
        let names: Vec<String> = list.iter().map(|c| c.name.to_string()).collect();
        let find = |name: String| names.iter().position(|n| *n == name).map(|i| &list[i].sample_data);
        let prefixes = names.iter().filter_map(|n| if n == "R" { Some("") } else { n.strip_suffix(".R") });
        let mut layers: Vec<&str> = prefixes.collect();
        layers.sort_by_key(|prefix| !prefix.is_empty());
        for prefix in layers {
            let dot = if prefix.is_empty() { "" } else { "." };
            let Some(samples) =
                CHANNELS.map(|c| find(format!("{prefix}{dot}{c}"))).into_iter().collect::<Option<Vec<_>>>()
            else {
                continue;
            };
            let mut pixels = vec![Vec3::ZERO; film.pixel_count()];
            for (c, samples) in samples.iter().enumerate() {
                for (pixel, value) in pixels.iter_mut().zip(samples.values_as_f32()) {
                    pixel[c] = value;
                }
            }
            let name = if prefix.is_empty() { first_name.as_str() } else { prefix };
            film.push_foreign(Layer { name: name.to_owned(), pixels });
        }
        if film.layers().is_empty() {
            return Err(FilmError::Channels { path: path.into(), found: names.join(", ") });
        }
        Ok(film)
    }
}

impl Metadata {
    /// Reads the metadata of an OpenEXR file without its pixels.
    ///
    /// # Errors
    /// [`FilmError::Decode`].
    pub fn read_exr(path: &Path) -> Result<Self, FilmError> {
        let meta = exr::meta::MetaData::read_from_file(path, false)
            .map_err(|e| FilmError::Decode { path: path.into(), reason: e.to_string() })?;
        let mut metadata = Self::default();
        for (name, value) in meta.headers.iter().flat_map(|h| &h.own_attributes.other) {
            if let exr_rs::AttributeValue::Text(text) = value {
                metadata.set_text(&name.to_string(), &from_text(text));
            }
        }
        Ok(metadata)
    }
}

/// The UTF-8 bytes of `text`, as OpenEXR wants them; the crate's own conversion refuses what is not Latin-1.
fn to_text(text: &str) -> exr_rs::Text {
    exr_rs::Text::from_slice_unchecked(text.replace('\0', " ").as_bytes())
}

fn from_text(text: &exr_rs::Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}
