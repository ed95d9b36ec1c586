//! Turns verified words into an owned frame, staged beside the last one so that a reader always holds a whole one.

use std::sync::Arc;

use crate::chunks::{CHUNK_RECORDS, ChunkSet};
use crate::error::ProtocolError;
use crate::record::{
    ArrayKind, DistanceRecord, LightRecord, ObjectRecord, PatchRecord, StatisticsRecord, VslRecord,
};
use crate::ring_read::Head;
use crate::shape::head;
use crate::staging::{ArrayView, Patch, Staging};
use crate::text;

/// A complete, coherent frame in private memory.
#[derive(Debug, Clone, Default)]
pub struct VslFrame {
    /// Number of the segment it came from.
    pub epoch: u64,
    /// Number of the frame.
    pub frame: u64,
    /// When it was published, monotonic ns.
    pub publish_time_ns: u64,
    /// Time of the simulated scene, in s.
    pub simulation_time_s: f64,
    /// Configuration it belongs to.
    pub config_generation: u64,
    /// Identifies the scene.
    pub scene_hash: u64,
    /// Virtual surface lights.
    pub vsls: Vec<VslRecord>,
    /// Frame in which each chunk of [`CHUNK_RECORDS`] lights last changed: `VslRecord::changed_frame` of its records.
    pub chunk_frames: Vec<u64>,
    /// Objects.
    pub objects: Vec<ObjectRecord>,
    /// Lights.
    pub lights: Vec<LightRecord>,
    /// Counters.
    pub statistics: StatisticsRecord,
    /// The resolved scene; the same allocation for as long as the text stays the same.
    pub scene_text: Arc<str>,
    /// Patches of the virtual surface lights: one for each, or none at all.
    pub patches: Vec<PatchRecord>,
    /// Frame in which each chunk of [`CHUNK_RECORDS`] patches last changed.
    pub patch_chunk_frames: Vec<u64>,
    /// Pieces of the distance maps of the virtual surface lights: as many for each light, or none at all.
    pub distances: Vec<DistanceRecord>,
    /// Frame in which each chunk of [`CHUNK_RECORDS`] pieces last changed.
    pub distance_chunk_frames: Vec<u64>,
    /// What is wrong with the simulation, empty while nothing is; the same allocation for as long as it stays the same.
    pub notice: Arc<str>,
}

const ARRAYS: usize = ArrayKind::ALL.len();
const VSL: usize = 0;
const TEXT: usize = 4;
const NOTICE: usize = 5;
const PATCH: usize = 6;
const DISTANCE: usize = 7;
/// Words of a chunk of lights.
const CHUNK_WORDS: usize = CHUNK_RECORDS * size_of::<VslRecord>() / 8;

#[derive(Default)]
struct Buffer {
    frame: VslFrame,
    /// Records of the scene text and of the notice.
    texts: [Vec<[u64; 8]>; 2],
    versions: [Vec<u64>; ARRAYS],
}

impl Buffer {
    fn resize(&mut self, a: usize, records: usize) {
        match a {
            0 => self.frame.vsls.resize_with(records, VslRecord::default),
            1 => self.frame.objects.resize_with(records, ObjectRecord::default),
            2 => self.frame.lights.resize_with(records, LightRecord::default),
            TEXT | NOTICE => self.texts[a - TEXT].resize(records, [0; 8]),
            PATCH => self.frame.patches.resize_with(records, PatchRecord::default),
            DISTANCE => self.frame.distances.resize_with(records, DistanceRecord::default),
            _ => {}
        }
        self.versions[a].resize(records.div_ceil(CHUNK_RECORDS), 0);
    }

    fn words(&self, a: usize) -> &[u64] {
        match a {
            0 => bytemuck::cast_slice(&self.frame.vsls),
            1 => bytemuck::cast_slice(&self.frame.objects),
            2 => bytemuck::cast_slice(&self.frame.lights),
            3 => {
                bytemuck::cast_slice(&std::slice::from_ref(&self.frame.statistics)[..self.versions[a].len()])
            }
            PATCH => bytemuck::cast_slice(&self.frame.patches),
            DISTANCE => bytemuck::cast_slice(&self.frame.distances),
            _ => self.texts[a - TEXT].as_flattened(),
        }
    }

    fn words_mut(&mut self, a: usize) -> (&mut [u64], &mut [u64]) {
        let versions = &mut self.versions[a];
        let words = match a {
            0 => bytemuck::cast_slice_mut(&mut self.frame.vsls),
            1 => bytemuck::cast_slice_mut(&mut self.frame.objects),
            2 => bytemuck::cast_slice_mut(&mut self.frame.lights),
            3 => {
                let records = versions.len();
                bytemuck::cast_slice_mut(&mut std::slice::from_mut(&mut self.frame.statistics)[..records])
            }
            PATCH => bytemuck::cast_slice_mut(&mut self.frame.patches),
            DISTANCE => bytemuck::cast_slice_mut(&mut self.frame.distances),
            _ => self.texts[a - TEXT].as_flattened_mut(),
        };
        (words, versions)
    }
}

/// The last complete frame, and the next one as far as it has been copied.
#[derive(Default)]
pub(crate) struct FramePair {
    front: Buffer,
    back: Buffer,
    /// Changed lights, where they are few: they are put into `front` once the frame is complete.
    patch: Patch,
    patched: bool,
    complete: bool,
}

impl Staging for FramePair {
    fn array(&mut self, a: usize, records: usize, table: &[u64]) -> ArrayView<'_> {
        let front_versions = &self.front.versions[a];
        if a == VSL {
            let same_extent = self.complete && self.front.frame.vsls.len() == records;
            self.patched = same_extent && self.patch.begin(CHUNK_WORDS, table, front_versions);
            if self.patched {
                let patch = Some(&mut self.patch);
                return ArrayView {
                    words: &mut [],
                    versions: &mut [],
                    front_words: &[],
                    front_versions,
                    patch,
                };
            }
        }
        self.back.resize(a, records);
        let (words, versions) = self.back.words_mut(a);
        ArrayView { words, versions, front_words: self.front.words(a), front_versions, patch: None }
    }
}

impl FramePair {
    /// The last complete frame.
    pub(crate) fn frame(&self) -> Option<&VslFrame> {
        self.complete.then_some(&self.front.frame)
    }

    /// Forgets what is known about chunks, because another segment follows; the last complete frame stays.
    pub(crate) fn forget_versions(&mut self) {
        for versions in self.front.versions.iter_mut().chain(&mut self.back.versions) {
            versions.fill(0);
        }
        self.patch.clear();
    }

    /// Makes the staged frame the last complete one, and notes which chunks of lights changed.
    pub(crate) fn finish(
        &mut self,
        words: &Head,
        epoch: u64,
        scene_hash: u64,
        changed: &mut ChunkSet,
    ) -> Result<(), ProtocolError> {
        let text = self.text(TEXT, &self.front.frame.scene_text, words[head::TEXT_BYTES])?;
        let notice = self.text(NOTICE, &self.front.frame.notice, words[head::NOTICE_BYTES])?;
        let simulation_time_s = f64::from_bits(words[head::SIMULATION_TIME_S]);
        if !simulation_time_s.is_finite() {
            return Err(ProtocolError::corrupt("simulation time", simulation_time_s, "a finite number"));
        }
        let (front, back) = (&mut self.front, &mut self.back);
        if self.patched {
            changed.reset(front.versions[VSL].len());
            let (words, versions) = front.words_mut(VSL);
            self.patch.apply(words, versions, |c| changed.insert(c));
            // The patched lights are those of the new frame, which becomes the front below.
            std::mem::swap(&mut front.frame.vsls, &mut back.frame.vsls);
            std::mem::swap(&mut front.versions[VSL], &mut back.versions[VSL]);
        } else {
            changed.reset(back.versions[VSL].len());
            for (c, version) in back.versions[VSL].iter().enumerate() {
                if front.versions[VSL].get(c) != Some(version) {
                    changed.insert(c);
                }
            }
            self.patch.clear();
        }
        back.frame.chunk_frames.clone_from(&back.versions[VSL]);
        back.frame.patch_chunk_frames.clone_from(&back.versions[PATCH]);
        back.frame.distance_chunk_frames.clone_from(&back.versions[DISTANCE]);
        let frame = &mut back.frame;
        frame.scene_text = text;
        frame.notice = notice;
        frame.epoch = epoch;
        frame.scene_hash = scene_hash;
        frame.frame = words[head::FRAME];
        frame.publish_time_ns = words[head::PUBLISH_TIME_NS];
        frame.simulation_time_s = simulation_time_s;
        frame.config_generation = words[head::CONFIG_GENERATION];
        std::mem::swap(&mut self.front, &mut self.back);
        self.complete = true;
        Ok(())
    }

    /// The staged text of array `a`: the last frame's own where no chunk of it changed.
    fn text(&self, a: usize, last: &Arc<str>, bytes: u64) -> Result<Arc<str>, ProtocolError> {
        if self.complete && bytes == last.len() as u64 && self.front.versions[a] == self.back.versions[a] {
            return Ok(Arc::clone(last));
        }
        let name = if a == TEXT { "scene text" } else { "notice" };
        text::read(name, &self.back.texts[a - TEXT], bytes)
    }
}
