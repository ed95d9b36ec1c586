//! Turns placed lights into the table of their owners, their areas and their patches by reading these from a folder, where they
//! were found before.
//!
//! A file is found by a hash of all that these are computed from: the triangles at rest, the lights on them, and how. It says
//! which lights can be nearest in each cell, and each light's area and patch; all numbers of the table are computed anew. A
//! file that is damaged, or could be none of this placement, is as if it were not there; whoever writes one by intent can name
//! other lights of the same surface, areas and patches, and nothing beyond.

use super::{
    OwnerTable,
    build::{CELL_PER_SPACING, MOST_CELLS, TRIANGLES_PER_TASK},
    choices::Choices,
};
use crate::{
    cancel::Cancel,
    patch::{self, Patch},
    placement::Placement,
    vsl::COMPATIBLE_COSINE,
};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use photonstream_scene::{
    Geometry, Scene,
    kept::{self, KeptFiles, Key, Kind},
};
use photonstream_shading::patch::MAX_CORNERS;
use rayon::prelude::*;
use std::{path::PathBuf, sync::OnceLock};

/// To be raised with every change of how owners, areas and patches are found or written; a test notices when they are others.
const VERSION: u32 = 1;

/// Scenes with fewer lights and fewer triangles than these are computed.
const FROM_VSLS: usize = 8_000;
const FROM_TRIANGLES: usize = 50_000;
/// Bytes that the files of a folder may have together.
const LIMIT_BYTES: u64 = 1 << 30;
/// Triangles hashed at a time.
const PIECE: usize = 1 << 16;

static OF_THIS_PROCESS: OnceLock<OwnerCache> = OnceLock::new();

/// A folder that keeps who owns what from one start to the next.
#[derive(Debug)]
pub(crate) struct OwnerCache {
    files: KeptFiles,
    from: (usize, usize),
}

/// What a file has of a light.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Cell {
    area: f32,
    patch: Patch,
}

impl OwnerCache {
    /// Owners of scenes from 8 000 lights or 50 000 triangles in `folder`; up to 1 GiB.
    pub(crate) fn new(folder: PathBuf) -> Self {
        let kind = Kind { magic: *b"photonstreamcell", version: VERSION, extension: "cells" };
        Self { files: KeptFiles::new(folder, kind, LIMIT_BYTES), from: (FROM_VSLS, FROM_TRIANGLES) }
    }

    /// That of the folder that this process keeps things in, if it does.
    pub(crate) fn of_this_process() -> Option<&'static Self> {
        let folder = kept::of_this_process()?;
        Some(OF_THIS_PROCESS.get_or_init(|| Self::new(folder.join("cells"))))
    }

    /// The owners of the lights of `placement` on `scene`, the same bits whether they are read or computed, and gives the lights
    /// their areas and patches. `None` soon after it was cancelled.
    pub(crate) fn owners(
        &self,
        scene: &Scene,
        placement: &mut Placement,
        cancel: &Cancel,
    ) -> Option<OwnerTable> {
        let is_small = placement.vsls.len() < self.from.0 && scene.geometry.triangles.len() < self.from.1;
        if is_small {
            return computed(scene, placement, cancel);
        }
        let key = key(scene, placement);
        if let Some(owners) = self.find(&key, scene, placement) {
            self.files.mark_used(&key);
            tracing::debug!("owners of {} lights read", placement.vsls.len());
            return Some(owners);
        }
        let (owners, choices) = OwnerTable::build(scene, placement, cancel);
        if cancel.is_cancelled() {
            return None;
        }
        placement.measure_areas(scene, &owners);
        let tasks = u32::try_from(choices.ends.len()).ok();
        if let Some(tasks) = cancel.or(tasks).flatten() {
            // The ends, halved, before the words.
            let ends = choices.ends.iter().flat_map(|end| [*end as u32, (*end >> 32) as u32]);
            let words: Vec<u32> = ends.chain(choices.words.iter().copied()).collect();
            let cells = placement.vsls.iter().zip(&placement.patches);
            let cells: Vec<Cell> = cells.map(|(vsl, patch)| Cell { area: vsl.area, patch: *patch }).collect();
            self.files.keep(&key, tasks, (&words, &cells));
        }
        Some(owners)
    }

    /// What the file of `key` says, if it can be that of the placement.
    fn find(&self, key: &Key, scene: &Scene, placement: &mut Placement) -> Option<OwnerTable> {
        let most = [(LIMIT_BYTES / 4) as usize, placement.vsls.len()];
        let found = self.files.find::<u32, Cell>(key, most)?;
        let (ends, words) = found.first.split_at_checked((found.number as usize).checked_mul(2)?)?;
        let ends = ends.as_chunks::<2>().0.iter().map(|[low, high]| u64::from(*low) | u64::from(*high) << 32);
        let choices = Choices { ends: ends.collect(), words: words.to_vec() };
        let is_area = |cell: &Cell| cell.area.is_finite() && cell.area >= 0.0 && cell.patch.is_valid();
        if found.second.len() != placement.vsls.len() || !found.second.iter().all(is_area) {
            return None;
        }
        let owners = OwnerTable::of_choices(scene, placement, choices)?;
        for (vsl, cell) in placement.vsls.iter_mut().zip(found.second.iter()) {
            vsl.area = cell.area;
        }
        placement.patches = found.second.iter().map(|cell| cell.patch).collect();
        Some(owners)
    }
}

/// The owners as they are found without a file.
pub(crate) fn computed(scene: &Scene, placement: &mut Placement, cancel: &Cancel) -> Option<OwnerTable> {
    let owners = OwnerTable::new_unless(scene, placement, cancel)?;
    placement.measure_areas(scene, &owners);
    Some(owners)
}

/// Hash of all that owners, areas and patches are computed from: the corners of all triangles at rest and their normals, which
/// of them are an object's, the lights of each surface, and constants.
fn key(scene: &Scene, placement: &Placement) -> Key {
    let geometry: &Geometry = &scene.geometry;
    let triangles = geometry.triangles.len() as u32;
    let pieces: Vec<[u8; 32]> = (0..triangles)
        .into_par_iter()
        .step_by(PIECE)
        .map(|start| {
            let mut bytes = Vec::with_capacity(PIECE * 48);
            for id in start..start.saturating_add(PIECE as u32).min(triangles) {
                let [a, b, c] = geometry.rest_triangle(id);
                let numbers = [a, b, c, geometry.normals[id as usize]].map(|v: Vec3| v.to_array());
                bytes.extend(numbers.into_iter().flatten().flat_map(f32::to_le_bytes));
            }
            *blake3::hash(&bytes).as_bytes()
        })
        .collect();
    let mut hasher = blake3::Hasher::new_derive_key("photonstream owners of a placement");
    let mut number = |number: u64| _ = hasher.update(&number.to_le_bytes());
    let constants = [CELL_PER_SPACING, MOST_CELLS, COMPATIBLE_COSINE].map(|x| u64::from(x.to_bits()));
    let sizes = [u64::from(TRIANGLES_PER_TASK), MAX_CORNERS as u64, patch::MOST_POINTS as u64];
    [u64::from(VERSION), u64::from(cfg!(target_endian = "big")), u64::from(triangles)]
        .into_iter()
        .chain(constants)
        .chain(sizes)
        .for_each(&mut number);
    number(placement.surfaces.len() as u64);
    for (surface, vsls) in &placement.surfaces {
        let triangles = &scene.objects[surface.object.0 as usize].triangles;
        [triangles.start, triangles.end, surface.side as u32, vsls.start, vsls.end]
            .into_iter()
            .for_each(|x| number(u64::from(x)));
    }
    for vsl in &placement.vsls {
        let [u, v] = vsl.barycentric.map(f32::to_bits);
        [vsl.triangle, u, v].into_iter().for_each(|x| number(u64::from(x)));
    }
    hasher.update(pieces.as_flattened());
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests;
