//! Turns virtual surface lights into slots, each with one light's shadow map: which lights have one, and which have to be drawn.

use crate::layout::{MAX_COORDINATE, MAX_FLUX, NO_LAYER};
use glam::Vec3;
use photonstream_protocol::VslRecord;

/// Which light has which slot.
#[derive(Debug, Default)]
pub(super) struct Slots {
    slots: Vec<Slot>,
    /// The slot of each light, or [`NO_LAYER`].
    pub(super) of_light: Vec<u32>,
    /// Lights that shine, and for which there was no slot left.
    pub(super) without: u32,
}

/// A shadow map's light. One that does not shine any more keeps its map until the slot is needed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slot {
    light: u32,
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    is_needed: bool,
    is_drawn: bool,
}

impl Slots {
    /// Gives each light that shines a slot, of more than `most` the brightest.
    pub(super) fn assign(&mut self, records: &[VslRecord], most: usize) {
        let mut shining: Vec<u32> =
            (0..records.len() as u32).filter(|&i| shines(&records[i as usize])).collect();
        self.without = shining.len().saturating_sub(most) as u32;
        if shining.len() > most {
            let flux = |i: u32| records[i as usize].flux.iter().sum::<f32>();
            shining.sort_by(|&a, &b| flux(b).total_cmp(&flux(a)).then(a.cmp(&b)));
            shining.truncate(most);
            shining.sort_unstable();
        }
        self.of_light.clear();
        self.of_light.resize(records.len(), NO_LAYER);
        for (index, slot) in self.slots.iter_mut().enumerate() {
            slot.is_needed = shining.binary_search(&slot.light).is_ok();
            if slot.is_needed {
                self.of_light[slot.light as usize] = index as u32;
            }
        }
        let mut next = 0;
        for light in shining {
            let record = &records[light as usize];
            let (position, normal) = (Vec3::from(record.position), Vec3::from(record.normal));
            let new = Slot { light, position, normal, is_needed: true, is_drawn: false };
            let own = self.of_light[light as usize];
            if own != NO_LAYER {
                let slot = &mut self.slots[own as usize];
                if (slot.position, slot.normal) != (position, normal) {
                    *slot = new;
                }
                continue;
            }
            while self.slots.get(next).is_some_and(|slot| slot.is_needed) {
                next += 1;
            }
            match self.slots.get_mut(next) {
                Some(slot) => *slot = new,
                None => self.slots.push(new),
            }
            self.of_light[light as usize] = next as u32;
        }
    }

    /// Number of slots there have ever been.
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }

    /// The slots that have to be drawn, with their numbers.
    pub(super) fn due(&self) -> impl Iterator<Item = (u32, &Slot)> {
        (0..).zip(&self.slots).filter(|(_, slot)| slot.is_needed && !slot.is_drawn)
    }

    /// These slots' maps are on the device.
    pub(super) fn drawn(&mut self, numbers: &[u32]) {
        for &number in numbers {
            self.slots[number as usize].is_drawn = true;
        }
    }

    /// All maps are lost.
    pub(super) fn forget(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.is_drawn = false);
    }
}

/// Whether shaders show anything of a record: its flux is not 0, and its values are possible.
fn shines(record: &VslRecord) -> bool {
    let within = |values: &[f32], most: f32| values.iter().all(|v| v.abs() <= most);
    let normal = Vec3::from(record.normal);
    record.flux.iter().any(|&f| f > 0.0)
        && record.flux.iter().all(|&f| f >= 0.0)
        && within(&record.flux, MAX_FLUX)
        && within(&record.position, MAX_COORDINATE)
        && (normal.length_squared() - 1.0).abs() < 1e-4
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(x: f32, flux: f32) -> VslRecord {
        VslRecord {
            position: [x, 0.0, 0.0],
            normal: [0.0, 1.0, 0.0],
            flux: [flux, 0.0, 0.0],
            ..VslRecord::default()
        }
    }

    fn due(slots: &Slots) -> Vec<u32> {
        slots.due().map(|(number, _)| number).collect()
    }

    fn draw(slots: &mut Slots) -> Vec<u32> {
        let numbers = due(slots);
        slots.drawn(&numbers);
        numbers
    }

    #[test]
    fn only_what_shines_anew_or_elsewhere_is_drawn() {
        let mut slots = Slots::default();
        let mut records = [record(0.0, 1.0), record(1.0, 0.0), record(2.0, 3.0)];
        slots.assign(&records, 8);
        assert_eq!((&slots.of_light[..], slots.without), (&[0, NO_LAYER, 1][..], 0));
        assert_eq!(draw(&mut slots), [0, 1]);
        // Dimmed, not moved.
        records[0].flux[0] = 0.1;
        slots.assign(&records, 8);
        assert_eq!(due(&slots).len(), 0);
        records[2].position[0] = 2.5;
        slots.assign(&records, 8);
        assert_eq!((due(&slots), slots.of_light[2]), (vec![1], 1));
        // Not before the map is on the device.
        slots.assign(&records, 8);
        assert_eq!(draw(&mut slots), [1]);
        records[2].normal = [1.0, 0.0, 0.0];
        slots.assign(&records, 8);
        assert_eq!(draw(&mut slots), [1]);
        slots.forget();
        assert_eq!(due(&slots), [0, 1]);
    }

    #[test]
    fn slots_of_dark_lights_are_taken_by_others_and_until_then_keep_their_maps() {
        let mut slots = Slots::default();
        let mut records = [record(0.0, 1.0), record(1.0, 1.0), record(2.0, 0.0)];
        slots.assign(&records, 8);
        draw(&mut slots);
        records[0].flux = [0.0; 3];
        slots.assign(&records, 8);
        assert_eq!((due(&slots), &slots.of_light[..2]), (vec![], &[NO_LAYER, 1][..]));
        records[0].flux = [2.0; 3];
        slots.assign(&records, 8);
        assert_eq!((due(&slots), slots.of_light[0]), (vec![], 0));
        records[0].flux = [0.0; 3];
        records[2].flux = [1.0; 3];
        slots.assign(&records, 8);
        assert_eq!((draw(&mut slots), slots.of_light[2], slots.len()), (vec![0], 0, 2));
        records[0].flux = [1.0; 3];
        slots.assign(&records, 8);
        assert_eq!((draw(&mut slots), slots.of_light[0], slots.len()), (vec![2], 2, 3));
        // Fewer lights than there were.
        slots.assign(&records[..1], 8);
        assert_eq!((due(&slots), &slots.of_light[..]), (vec![], &[2][..]));
    }

    #[test]
    fn of_too_many_the_brightest_have_maps() {
        let mut slots = Slots::default();
        let records: Vec<_> = [1.0, 5.0, 5.0, 2.0, 7.0].map(|flux| record(flux, flux)).to_vec();
        slots.assign(&records, 3);
        assert_eq!((&slots.of_light[..], slots.without), (&[NO_LAYER, 0, 1, NO_LAYER, 2][..], 2));
        assert_eq!(slots.len(), 3);
        slots.assign(&records, 5);
        assert_eq!((slots.without, slots.of_light.contains(&NO_LAYER)), (0, false));
    }

    #[test]
    fn impossible_records_have_no_map() {
        let good = record(0.0, 1.0);
        let bad = [
            VslRecord { flux: [1.0, -1.0, 1.0], ..good },
            VslRecord { flux: [f32::NAN, 1.0, 1.0], ..good },
            VslRecord { flux: [f32::INFINITY; 3], ..good },
            VslRecord { position: [f32::NAN; 3], ..good },
            VslRecord { position: [1e12, 0.0, 0.0], ..good },
            VslRecord { normal: [0.0; 3], ..good },
            VslRecord { normal: [f32::NAN; 3], ..good },
        ];
        let mut slots = Slots::default();
        for record in bad {
            slots.assign(&[record, good], 8);
            assert_eq!((&slots.of_light[..], slots.without), (&[NO_LAYER, 0][..], 0), "{record:?}");
        }
    }
}
