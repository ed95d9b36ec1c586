//! Turns the distance maps that have changed since the last frame into the records of the next one.

use crate::{
    distance_maps::{Map, Schedule},
    few_lights::MapsChanged,
};
use photonstream_protocol::{ChunkSet, DISTANCE_TEXELS, DistanceRecord};

/// Distance maps that have changed.
pub(super) struct MapUpdate {
    /// Counts the placements of virtual surface lights.
    placement: u64,
    lights: usize,
    /// Records of each light.
    each: usize,
    changed: Vec<(u32, Map)>,
}

impl MapUpdate {
    /// What has changed since the last one.
    pub(super) fn of(maps: &mut Schedule, placement: u64) -> Self {
        let each = (maps.edge() * maps.edge()) as usize / DISTANCE_TEXELS;
        Self { placement, lights: maps.len(), each, changed: maps.take_changed() }
    }

    /// What has changed of the maps of few lights.
    pub(super) fn of_few(maps: MapsChanged, placement: u64) -> Self {
        let MapsChanged { edge, lights, changed } = maps;
        Self { placement, lights, each: (edge * edge) as usize / DISTANCE_TEXELS, changed }
    }

    /// Records of so many lights.
    pub(super) fn records_of(&self, lights: usize) -> usize {
        lights * self.each
    }

    /// Records of all lights.
    pub(super) fn records(&self) -> usize {
        self.lights * self.each
    }
}

/// The records of one placement's maps, and which of them differ from the frame before.
#[derive(Default)]
pub(super) struct PublishedMaps {
    placement: Option<u64>,
    each: usize,
    records: Vec<DistanceRecord>,
    changed: ChunkSet,
}

impl PublishedMaps {
    /// Takes in what has changed; those of another placement replace all, and where there are none any more all are dropped.
    pub(super) fn update(&mut self, update: Option<&MapUpdate>) {
        let Some(update) = update else {
            *self = Self::default();
            return;
        };
        // Few lights may become more or fewer where they are.
        if self.placement != Some(update.placement) || self.records.len() != update.records() {
            let records = vec![DistanceRecord::default(); update.records()];
            let changed = ChunkSet::all(records.len());
            *self = Self { placement: Some(update.placement), each: update.each, records, changed };
        }
        for (vsl, map) in &update.changed {
            let first = *vsl as usize * self.each;
            for (at, texels) in (first..).zip(map.as_chunks().0) {
                self.records[at].texels = *texels;
                self.changed.insert_record(at);
            }
        }
    }

    /// All records, and the chunks of them that differ from the frame published last.
    pub(super) fn records(&self) -> (&[DistanceRecord], &ChunkSet) {
        (&self.records, &self.changed)
    }

    /// Whether they are those of the `lights` lights of `placement`.
    pub(super) fn are_of(&self, placement: u64, lights: usize) -> bool {
        self.placement == Some(placement) && self.records.len() == lights * self.each
    }

    /// Notes that the frame was published.
    pub(super) fn published(&mut self) {
        self.changed = ChunkSet::for_records(self.records.len());
    }

    /// Notes that a frame was not published, or without them: all count as changed.
    pub(super) fn not_published(&mut self) {
        self.changed = ChunkSet::all(self.records.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn update(placement: u64, lights: usize, changed: Vec<(u32, Map)>) -> MapUpdate {
        MapUpdate { placement, lights, each: 2, changed }
    }

    /// Maps of 8² texels: each light's lie side by side, only what changed is named, and a new placement starts anew.
    #[test]
    fn changed_maps_and_nothing_else_are_named() {
        let map = |value: u32| -> Map { vec![value; 32].into() };
        let mut maps = PublishedMaps::default();
        maps.update(Some(&update(3, 100, vec![(1, map(7))])));
        let (records, changed) = maps.records();
        assert_eq!((records.len(), changed.contains(0), changed.contains(3)), (200, true, true));
        let filled: Vec<usize> = (0..200).filter(|&i| records[i].texels != [0; 16]).collect();
        assert_eq!(filled, [2, 3]);
        maps.published();
        maps.update(Some(&update(3, 100, vec![(40, map(9))])));
        let (records, changed) = maps.records();
        assert_eq!([0, 1, 2, 3].map(|c| changed.contains(c)), [false, true, false, false]);
        assert_eq!((records[80].texels, records[2].texels), ([9; 16], [7; 16]));
        assert!(maps.are_of(3, 100) && !maps.are_of(4, 100) && !maps.are_of(3, 99));
        maps.update(Some(&update(4, 5, vec![])));
        assert!(maps.records().0.iter().all(|r| r.texels == [0; 16]) && maps.records().0.len() == 10);
        maps.update(None);
        assert!(maps.records().0.is_empty());
    }
}
