//! Turns few lights into the distance maps of what they see, for renderers that shadow by them.

use super::Shown;
use crate::distance_maps::{Map, View, words};
use glam::Vec3;
use photonstream_scene::{Geometry, Scene};
use rayon::prelude::*;
use std::sync::Arc;

/// The map of each light, traced again when it has moved, or anything has.
#[derive(Debug, Default)]
pub(super) struct Maps {
    edge: u32,
    maps: Vec<Traced>,
    changed: Vec<u32>,
    geometry: Option<Arc<Geometry>>,
}

/// Maps that have changed.
pub(crate) struct MapsChanged {
    pub(crate) edge: u32,
    pub(crate) lights: usize,
    pub(crate) changed: Vec<(u32, Map)>,
}

#[derive(Debug, Default)]
struct Traced {
    at: Option<(Vec3, Vec3)>,
    map: Map,
}

impl Maps {
    /// Traces the maps of lights that shine, as far as they are not what they were.
    pub(super) fn follow(&mut self, scene: &Scene, lights: &[Shown]) {
        self.edge = scene.streaming.distance_map_px;
        if self.edge == 0 {
            return;
        }
        let is_still = self.geometry.as_ref().is_some_and(|geometry| Arc::ptr_eq(geometry, &scene.geometry));
        if !is_still {
            self.geometry = Some(Arc::clone(&scene.geometry));
            self.maps.iter_mut().for_each(|map| map.at = None);
        }
        let empty: Map = vec![0; words(self.edge)].into();
        let edge = self.edge;
        if self.maps.len() != lights.len() {
            self.changed.extend(0..lights.len() as u32);
        }
        self.maps.resize_with(lights.len(), || Traced { at: None, map: Arc::clone(&empty) });
        let traced =
            self.maps.par_iter_mut().zip(lights).enumerate().filter_map(|(number, (traced, shown))| {
                let at = Some((shown.light.position, shown.light.normal));
                if shown.light.flux == Vec3::ZERO || traced.at == at {
                    return None;
                }
                traced.at = at;
                let mut map = vec![0; words(edge)];
                View::from(scene, shown.light.position, shown.light.normal).trace(scene, edge, &mut map);
                if map[..] == traced.map[..] {
                    return None;
                }
                traced.map = map.into();
                Some(number as u32)
            });
        let traced: Vec<u32> = traced.collect();
        self.changed.extend(traced);
    }

    pub(super) fn take_changed(&mut self) -> Option<MapsChanged> {
        if self.edge == 0 {
            return None;
        }
        let mut changed = std::mem::take(&mut self.changed);
        changed.sort_unstable();
        changed.dedup();
        changed.retain(|&number| (number as usize) < self.maps.len());
        let changed =
            changed.into_iter().map(|number| (number, Arc::clone(&self.maps[number as usize].map))).collect();
        Some(MapsChanged { edge: self.edge, lights: self.maps.len(), changed })
    }

    pub(super) fn all(&self) -> Vec<u32> {
        self.maps.iter().flat_map(|traced| traced.map.iter().copied()).collect()
    }
}
