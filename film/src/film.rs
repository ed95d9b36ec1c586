//! Gathers named layers of equal size into one picture.

use crate::{FilmError, Metadata};
use glam::Vec3;

/// A picture: named layers of linear RGB and where they come from.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    layers: Vec<Layer>,
    /// Where the picture comes from; written into each file.
    pub metadata: Metadata,
}

/// One layer of a [`Film`]: `width` × `height` pixels, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// What it shows: `full`, `indirect`, `normal` …
    pub name: String,
    /// Linear RGB.
    pub pixels: Vec<Vec3>,
}

impl Film {
    /// Most pixels of a picture: 2²⁷, 1.6 GB a layer.
    pub const MAX_PIXELS: u64 = 1 << 27;

    /// An empty picture of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`FilmError::Size`] for no pixels or too many.
    pub fn new(width: u32, height: u32) -> Result<Self, FilmError> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > Self::MAX_PIXELS {
            return Err(FilmError::Size { width, height });
        }
        Ok(Self { width, height, layers: Vec::new(), metadata: Metadata::default() })
    }

    /// Adds a layer; the first one is what a viewer shows.
    ///
    /// # Errors
    /// [`FilmError::PixelCount`] or [`FilmError::LayerName`].
    pub fn push(&mut self, name: &str, pixels: Vec<Vec3>) -> Result<(), FilmError> {
        if pixels.len() != self.pixel_count() {
            let expected = self.pixel_count();
            return Err(FilmError::PixelCount { layer: name.into(), found: pixels.len(), expected });
        }
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(is_plain) || self.layers.iter().any(|l| l.name == name) {
            return Err(FilmError::LayerName { name: name.into() });
        }
        self.layers.push(Layer { name: name.into(), pixels });
        Ok(())
    }

    /// Adds a layer read from a file, whatever another program called it.
    pub(crate) fn push_foreign(&mut self, layer: Layer) {
        debug_assert_eq!(layer.pixels.len(), self.pixel_count());
        self.layers.push(layer);
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Number of pixels of each layer.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The layers, in the order in which they were added.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The layer called `name`.
    ///
    /// # Errors
    /// [`FilmError::NoSuchLayer`], with the names that are there.
    pub fn layer(&self, name: &str) -> Result<&Layer, FilmError> {
        self.layers.iter().find(|l| l.name == name).ok_or_else(|| {
            let names: Vec<_> = self.layers.iter().map(|l| l.name.as_str()).collect();
            FilmError::NoSuchLayer { name: name.into(), present: names.join(", ") }
        })
    }

    /// The picture with the layer called `name` alone, and its metadata.
    ///
    /// # Errors
    /// [`FilmError::NoSuchLayer`].
    pub fn only(&self, name: &str) -> Result<Self, FilmError> {
        let layer = self.layer(name)?.clone();
        Ok(Self {
            width: self.width,
            height: self.height,
            layers: vec![layer],
            metadata: self.metadata.clone(),
        })
    }

    /// Checks that every value of every layer is finite.
    ///
    /// # Errors
    /// [`FilmError::NotFinite`], naming the first layer, pixel and channel that is not.
    pub fn check_finite(&self) -> Result<(), FilmError> {
        for layer in &self.layers {
            if let Some(index) = layer.pixels.iter().position(|p| !p.is_finite()) {
                let values = layer.pixels[index].to_array();
                let channel = values.iter().position(|v| !v.is_finite()).unwrap_or(0);
                let (x, y) = (index as u32 % self.width, index as u32 / self.width);
                return Err(FilmError::NotFinite {
                    layer: layer.name.clone(),
                    x,
                    y,
                    channel: ['R', 'G', 'B'][channel],
                    value: values[channel],
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_pictures_are_refused() {
        assert!(matches!(Film::new(0, 5), Err(FilmError::Size { .. })));
        assert!(matches!(Film::new(u32::MAX, u32::MAX), Err(FilmError::Size { .. })));
        let mut film = Film::new(2, 2).unwrap();
        assert!(matches!(film.push("full", vec![Vec3::ONE; 3]), Err(FilmError::PixelCount { .. })));
        film.push("full", vec![Vec3::ONE; 4]).unwrap();
        for name in ["full", "", "a.b", "Full"] {
            assert!(
                matches!(film.push(name, vec![Vec3::ONE; 4]), Err(FilmError::LayerName { .. })),
                "{name}"
            );
        }
        let missing = film.layer("depth").unwrap_err().to_string();
        assert_eq!(missing, "layer \"depth\" is not in the picture; it has: full");
    }

    #[test]
    fn the_first_bad_pixel_is_named() {
        let mut film = Film::new(3, 2).unwrap();
        let mut pixels = vec![Vec3::ONE; 6];
        pixels[4].y = f32::NAN;
        film.push("full", pixels).unwrap();
        let error = film.check_finite().unwrap_err();
        assert!(matches!(error, FilmError::NotFinite { x: 1, y: 1, channel: 'G', .. }), "{error}");
    }
}
