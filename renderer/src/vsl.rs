//! Turns published records into checked virtual surface lights, one array per field.

use crate::RenderError;
use glam::Vec3;
use photonstream_protocol::{
    DISTANCE_TEXELS, DistanceRecord, PATCH_CORNERS, PatchRecord, VslFrame, VslRecord,
};
use photonstream_scene::config::MAX_LENGTH_M;
use photonstream_shading::distance_map::EDGES;

/// A virtual surface light: the light that leaves one patch of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vsl {
    /// Centre of the patch, in metres from the scene's origin.
    pub position: Vec3,
    /// Unit normal of the lit side.
    pub normal: Vec3,
    /// Power that leaves the patch in W, linear RGB.
    pub flux: Vec3,
    /// Area of the patch in m².
    pub area: f32,
    /// Index of the object that carries it.
    pub object: u32,
}

/// The virtual surface lights of one frame, one array per field, all of equal length.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct VslSet {
    position: Vec<Vec3>,
    normal: Vec<Vec3>,
    flux: Vec<Vec3>,
    area: Vec<f32>,
    object: Vec<u32>,
    /// As many as there are lights, or none.
    patches: Vec<Patch>,
    /// Edge of the distance maps in texels; 0 where there are none.
    map_edge: u32,
    /// Of each light edge² texels.
    maps: Vec<u16>,
}

/// The edge in texels of the distance maps that so many pieces for so many lights are; `None` where they are none.
pub fn distance_map_edge(pieces: usize, lights: usize) -> Option<u32> {
    let each = pieces.checked_div(lights).filter(|each| each * lights == pieces)?;
    EDGES.into_iter().find(|&edge| (edge * edge) as usize == each * DISTANCE_TEXELS)
}

/// The polygon of a virtual surface light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    corners: [Vec3; PATCH_CORNERS],
    count: usize,
    /// Area in m², greater than 0.
    pub area: f32,
}

impl Patch {
    /// From the light to each corner in m, counter-clockwise as the lit side sees them.
    pub fn corners(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }

    /// The polygon of a published record; without corners where it has none, or none that can be used.
    fn of(record: &PatchRecord) -> Self {
        let mut corners = [Vec3::ZERO; PATCH_CORNERS];
        for (corner, values) in corners.iter_mut().zip(record.corners.as_chunks::<3>().0) {
            *corner = Vec3::from_array(*values);
        }
        let count = record.count as usize;
        let is_usable = (3..=PATCH_CORNERS).contains(&count)
            && corners.iter().all(|c| c.is_finite())
            && record.area.is_finite()
            && record.area > 0.0;
        Self { corners, count: if is_usable { count } else { 0 }, area: record.area }
    }
}

impl VslSet {
    /// The lights of a published frame with their patches.
    ///
    /// # Errors
    /// As [`VslSet::from_records`].
    pub fn from_frame(frame: &VslFrame) -> Result<Self, RenderError> {
        Ok(Self::from_records(&frame.vsls)?.with_patches(&frame.patches).with_distances(&frame.distances))
    }

    /// The same lights with the polygons that records say; without any where there are not as many as lights.
    pub fn with_patches(mut self, records: &[PatchRecord]) -> Self {
        self.patches.clear();
        if records.len() == self.len() {
            self.patches.extend(records.iter().map(Patch::of));
        }
        self
    }

    /// The same lights with the distance maps that records say; without any where they are not as many for each light, or no
    /// map has so many texels.
    pub fn with_distances(mut self, records: &[DistanceRecord]) -> Self {
        self.maps.clear();
        self.map_edge = distance_map_edge(records.len(), self.len()).unwrap_or(0);
        if self.map_edge > 0 {
            let texels = |word: u32| [word as u16, (word >> 16) as u16];
            self.maps.extend(records.iter().flat_map(|record| record.texels).flat_map(texels));
        }
        self
    }

    /// Edge of the distance maps in texels; 0 where there are none.
    pub fn map_edge(&self) -> u32 {
        self.map_edge
    }

    /// The distance map of light `index`, row by row; empty where there is none.
    pub fn map(&self, index: usize) -> &[u16] {
        let texels = (self.map_edge * self.map_edge) as usize;
        &self.maps[index * texels..][..texels]
    }

    /// The polygon of light `index`, where it has one.
    pub fn patch(&self, index: usize) -> Option<&Patch> {
        self.patches.get(index).filter(|patch| patch.count > 0)
    }

    /// The lights of a published frame.
    ///
    /// # Errors
    /// [`RenderError::Vsl`] for a value that is not finite, a place beyond 10⁹ m, a negative area or flux, a normal that is not of unit
    /// length.
    pub fn from_records(records: &[VslRecord]) -> Result<Self, RenderError> {
        Self::new(records.iter().map(|r| Vsl {
            position: r.position.into(),
            normal: r.normal.into(),
            flux: r.flux.into(),
            area: r.area,
            object: r.object,
        }))
    }

    /// The given lights, in their order.
    ///
    /// # Errors
    /// As [`VslSet::from_records`].
    pub fn new(vsls: impl IntoIterator<Item = Vsl>) -> Result<Self, RenderError> {
        let mut set = Self::default();
        for (index, vsl) in vsls.into_iter().enumerate() {
            check(index, &vsl)?;
            set.position.push(vsl.position);
            set.normal.push(vsl.normal);
            set.flux.push(vsl.flux);
            set.area.push(vsl.area);
            set.object.push(vsl.object);
        }
        Ok(set)
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Centres in metres from the scene's origin.
    pub fn position(&self) -> &[Vec3] {
        &self.position
    }

    /// Unit normals of the lit side.
    pub fn normal(&self) -> &[Vec3] {
        &self.normal
    }

    /// Fluxes in W, linear RGB.
    pub fn flux(&self) -> &[Vec3] {
        &self.flux
    }

    /// Areas in m².
    pub fn area(&self) -> &[f32] {
        &self.area
    }

    /// Indices of the objects that carry them.
    pub fn object(&self) -> &[u32] {
        &self.object
    }

    /// The light number `index`.
    pub fn get(&self, index: usize) -> Option<Vsl> {
        (index < self.len()).then(|| Vsl {
            position: self.position[index],
            normal: self.normal[index],
            flux: self.flux[index],
            area: self.area[index],
            object: self.object[index],
        })
    }
}

impl VslSet {
    /// Radiosity in W m⁻² of light `index`, flux over area; zero for a light without area.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn radiosity(&self, index: usize) -> Vec3 {
        let area = self.area[index];
        if area > 0.0 { self.flux[index] / area } else { Vec3::ZERO }
    }
}

/// Largest coordinate of a scene, m, and a little for rounding.
const MAX_COORDINATE_M: f32 = MAX_LENGTH_M as f32 * 1.000_01;

fn check(index: usize, vsl: &Vsl) -> Result<(), RenderError> {
    let wrong = |field, found: String, expected| Err(RenderError::Vsl { index, field, found, expected });
    // Beyond it the fourth power of a distance would leave f32, and the kernels with it.
    let is_near = vsl.position.is_finite() && vsl.position.abs().max_element() <= MAX_COORDINATE_M;
    if !is_near {
        return wrong("position", vsl.position.to_string(), "numbers within ±1e9 m");
    }
    // The rounding of three components stays far below this.
    let is_unit = (vsl.normal.length_squared() - 1.0).abs() < 1e-4;
    if !is_unit {
        return wrong("normal", vsl.normal.to_string(), "unit length");
    }
    if !(vsl.flux.is_finite() && vsl.flux.min_element() >= 0.0) {
        return wrong("flux", vsl.flux.to_string(), "finite W, 0 or more");
    }
    if !(vsl.area.is_finite() && vsl.area >= 0.0) {
        return wrong("area", vsl.area.to_string(), "finite m², 0 or more");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unusable_lights_are_named() {
        let good = Vsl { position: Vec3::ONE, normal: Vec3::Y, flux: Vec3::ONE, area: 0.1, object: 3 };
        let set = VslSet::new([good, good]).unwrap();
        assert_eq!((set.len(), set.get(1), set.get(2)), (2, Some(good), None));
        for (bad, field) in [
            (Vsl { position: Vec3::NAN, ..good }, "position"),
            (Vsl { position: Vec3::X * 1e20, ..good }, "position"),
            (Vsl { normal: Vec3::splat(1.0), ..good }, "normal"),
            (Vsl { normal: Vec3::NAN, ..good }, "normal"),
            (Vsl { flux: Vec3::new(0.0, -1.0, 0.0), ..good }, "flux"),
            (Vsl { area: f32::INFINITY, ..good }, "area"),
        ] {
            let error = VslSet::new([good, bad]).unwrap_err().to_string();
            assert!(error.starts_with(&format!("virtual surface light 1: {field}: found ")), "{error}");
        }
    }

    #[test]
    fn records_keep_their_values() {
        let record = VslRecord {
            position: [1.0, 2.0, 3.0],
            normal: [0.0, 0.0, -1.0],
            flux: [0.1, 0.2, 0.3],
            area: 0.5,
            object: 7,
            ..VslRecord::default()
        };
        let vsl = VslSet::from_records(&[record]).unwrap().get(0).unwrap();
        assert_eq!(vsl.position, Vec3::new(1.0, 2.0, 3.0));
        assert_eq!((vsl.normal, vsl.area, vsl.object), (Vec3::NEG_Z, 0.5, 7));
        assert_eq!(vsl.flux, Vec3::new(0.1, 0.2, 0.3));
    }
}
