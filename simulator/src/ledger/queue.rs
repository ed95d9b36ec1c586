//! Turns slots that have to be traced into the order in which they are: stale ones first, the brightest before all.

use crate::emitters::Emitters;

/// Slots of one light that have to be traced; the last is next.
#[derive(Clone, Debug, Default)]
struct LightQueue {
    waiting: Vec<Entry>,
    /// Slots of the light, to let all lights advance alike.
    slots: u32,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    /// 0 for an empty slot; else the larger the brighter the path that has to be replaced.
    rank: u8,
    /// Counted down, so that of equals the first slot is the greatest.
    order: u32,
}

impl Entry {
    /// By rank, then by order.
    fn key(&self) -> u64 {
        u64::from(self.rank) << 32 | u64::from(self.order)
    }
}

/// The slots that have to be traced, by light.
#[derive(Clone, Debug)]
pub(super) struct Queue {
    lights: Vec<LightQueue>,
}

impl Queue {
    pub(super) fn new(emitters: &Emitters) -> Self {
        let lights = emitters.lights.iter();
        Self {
            lights: lights
                .map(|l| LightQueue { waiting: Vec::new(), slots: l.slots.end - l.slots.start })
                .collect(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.lights.iter_mut().for_each(|light| light.waiting.clear());
    }

    /// Lets a slot wait; `weight` is how bright the stale path in it is, `None` where it is empty.
    pub(super) fn push(&mut self, light: usize, slot: u32, weight: Option<f32>) {
        // The exponent: paths that are alike but for a factor of two keep the order of their samples.
        let rank = weight.map_or(0, |weight| ((weight.to_bits() >> 23) as u8).max(1));
        self.lights[light].waiting.push(Entry { rank, order: u32::MAX - slot });
    }

    /// Sorts all that has been pushed.
    pub(super) fn sort(&mut self) {
        for light in &mut self.lights {
            // Most slots come in order, and of one rank.
            if !light.waiting.is_sorted_by_key(Entry::key) {
                light.waiting.sort_unstable_by_key(Entry::key);
            }
        }
    }

    /// Takes up to `most` slots of the light whose next one is the most important; of equals that light which has the
    /// largest share of its slots waiting.
    pub(super) fn take(&mut self, most: u32, only_stale: bool, mut taken: impl FnMut(u32)) -> Option<usize> {
        let key = |light: &LightQueue| {
            let rank = light.waiting.last().map_or(0, |entry| entry.rank);
            (rank, light.waiting.len() as f64 / f64::from(light.slots.max(1)))
        };
        let index = (0..self.lights.len())
            .filter(|&i| self.lights[i].waiting.last().is_some_and(|entry| !only_stale || entry.rank > 0))
            .reduce(|best, i| if key(&self.lights[i]) > key(&self.lights[best]) { i } else { best })?;
        let waiting = &mut self.lights[index].waiting;
        for _ in 0..most {
            match waiting.pop_if(|entry| !only_stale || entry.rank > 0) {
                Some(entry) => taken(u32::MAX - entry.order),
                None => break,
            }
        }
        Some(index)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lights.iter().all(|light| light.waiting.is_empty())
    }
}

/// The ring of a light whose samples are always fresh: the oldest path is replaced first.
#[derive(Clone, Debug, Default)]
pub(super) struct Ring {
    /// The next slot, from the light's first, and how often the ring went round.
    next: u32,
    rounds: u64,
}

impl Ring {
    /// Share of the light's slots that were given out by the ring.
    pub(super) fn progress(&self, slots: u32) -> f64 {
        self.rounds as f64 + f64::from(self.next) / f64::from(slots.max(1))
    }

    /// The next slots of a light, as many as are wanted and not under way.
    pub(super) fn take(
        &mut self,
        slots: std::ops::Range<u32>,
        most: u32,
        is_free: impl Fn(u32) -> bool,
    ) -> Vec<u32> {
        let count = slots.end - slots.start;
        // The light may have fewer slots in use than before.
        if self.next >= count {
            self.next = 0;
        }
        let mut taken = Vec::new();
        while (taken.len() as u32) < most.min(count) && is_free(slots.start + self.next) {
            taken.push(slots.start + self.next);
            self.next += 1;
            if self.next >= count {
                self.next = 0;
                self.rounds += 1;
                break;
            }
        }
        taken
    }
}
