//! Keeps the paths behind the present flux, whole, so that replacing one takes back exactly what it gave.
//!
//! Source: paper A, Algorithm 2; deviates: a slot holds a whole path, not one impact, and the slot to refill is chosen by
//! whoever traces: in a ring it is paper A's queue, the oldest path first.

use crate::{
    flux::{Deposit, VslFlux},
    tracer::PathBatch,
};
use glam::Vec3;

/// Paths in fixed slots, and the flux that they sum to.
#[derive(Clone, Debug)]
pub struct PathPool {
    slots: Vec<Slot>,
    deposits: Arena,
    /// The column of each run of slots, by the end of the run.
    columns: Vec<(u32, u32)>,
    /// Slots that hold a path, per column.
    valid: Vec<u32>,
    flux: VslFlux,
}

/// One path: where its deposits are, and when it was traced.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    start: usize,
    length: u16,
    valid: bool,
    birth_ms: u32,
}

impl PathPool {
    /// An empty pool. `columns` gives for each run of slots its end and its column, in order; `vsls` is the number of
    /// virtual surface lights.
    pub fn new(columns: Vec<(u32, u32)>, vsls: usize) -> Self {
        let slots = columns.last().map_or(0, |&(end, _)| end) as usize;
        let count = columns.iter().map(|&(_, column)| column + 1).max().unwrap_or(0) as usize;
        Self {
            slots: vec![Slot::default(); slots],
            deposits: Arena::default(),
            columns,
            valid: vec![0; count],
            flux: VslFlux::new(vsls, count),
        }
    }

    /// Replaces the paths of the batch's slots: takes back what the old ones deposited and adds what the new ones did.
    pub fn replace(&mut self, batch: &PathBatch, birth_ms: u32) {
        let mut run = self.columns.partition_point(|&(end, _)| end <= batch.first_slot);
        for (slot, deposits) in batch.paths() {
            while self.columns[run].0 <= slot {
                run += 1;
            }
            self.replace_path(slot, self.columns[run].1, deposits, birth_ms);
        }
    }

    /// Takes back everything that the path in `slot` deposited and leaves the slot empty.
    pub fn remove(&mut self, slot: u32) {
        let run = self.columns.partition_point(|&(end, _)| end <= slot);
        self.take_back(slot, self.columns[run].1);
    }

    /// Multiplies what the paths in `slots` deposited by `factor`, not negative: they then stand for as much more light.
    /// Rounded to quanta, and cut at the largest deposit.
    pub fn scale(&mut self, slots: std::ops::Range<u32>, factor: Vec3) {
        let mut scaled = Vec::new();
        for slot in slots {
            let Slot { start, length, valid, birth_ms } = self.slots[slot as usize];
            if !valid {
                continue;
            }
            scaled.clear();
            scaled.extend(self.deposits.get(start, length).iter().filter_map(|d| d.scaled(factor)));
            let run = self.columns.partition_point(|&(end, _)| end <= slot);
            self.replace_path(slot, self.columns[run].1, &scaled, birth_ms);
        }
    }

    fn replace_path(&mut self, slot: u32, column: u32, deposits: &[Deposit], birth_ms: u32) {
        self.take_back(slot, column);
        let start = self.deposits.insert(deposits);
        self.slots[slot as usize] = Slot { start, length: deposits.len() as u16, valid: true, birth_ms };
        self.valid[column as usize] += 1;
        self.flux.add(column, deposits, birth_ms);
    }

    fn take_back(&mut self, slot: u32, column: u32) {
        let old = std::mem::take(&mut self.slots[slot as usize]);
        if old.valid {
            self.flux.subtract(column, self.deposits.get(old.start, old.length), old.birth_ms);
            self.deposits.remove(old.start, old.length);
            self.valid[column as usize] -= 1;
        }
    }

    /// The flux that the pool's paths sum to.
    pub fn flux(&self) -> &VslFlux {
        &self.flux
    }

    /// Paths in the pool, per column.
    pub fn valid(&self) -> &[u32] {
        &self.valid
    }

    /// Slots of the pool.
    pub fn slots(&self) -> u32 {
        self.slots.len() as u32
    }

    /// The deposits of the path in `slot`; `None` where there is no path.
    pub fn path(&self, slot: u32) -> Option<&[Deposit]> {
        let slot = self.slots.get(slot as usize)?;
        slot.valid.then(|| self.deposits.get(slot.start, slot.length))
    }

    /// The flux summed anew from the pool's paths: always equal to [`PathPool::flux`], bit for bit.
    pub fn rebuilt_flux(&self) -> VslFlux {
        let mut flux = VslFlux::new(self.flux.vsls(), self.valid.len());
        for (index, slot) in self.slots.iter().enumerate().filter(|(_, slot)| slot.valid) {
            let run = self.columns.partition_point(|&(end, _)| end <= index as u32);
            flux.add(self.columns[run].1, self.deposits.get(slot.start, slot.length), slot.birth_ms);
        }
        flux
    }

    /// Bytes the pool takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.slots) + self.deposits.storage.capacity() * size_of::<Deposit>()
    }
}

/// Runs of deposits in blocks of a power of two, each size with a list of free blocks: replacing never moves others.
#[derive(Clone, Debug, Default)]
struct Arena {
    storage: Vec<Deposit>,
    free: [Vec<usize>; 14],
}

impl Arena {
    fn insert(&mut self, deposits: &[Deposit]) -> usize {
        if deposits.is_empty() {
            return 0;
        }
        let class = Self::class(deposits.len());
        let start = self.free[class].pop().unwrap_or_else(|| {
            let start = self.storage.len();
            self.storage.resize(start + (1 << class), Deposit { vsl: 0, rgb: [0; 3] });
            start
        });
        self.storage[start..start + deposits.len()].copy_from_slice(deposits);
        start
    }

    fn remove(&mut self, start: usize, length: u16) {
        if length > 0 {
            self.free[Self::class(usize::from(length))].push(start);
        }
    }

    fn get(&self, start: usize, length: u16) -> &[Deposit] {
        &self.storage[start..start + usize::from(length)]
    }

    /// The block size for `length` deposits, as a power of two.
    fn class(length: usize) -> usize {
        length.next_power_of_two().trailing_zeros() as usize
    }
}
