//! Keeps the paths behind the present flux, whole, so that replacing one takes back exactly what it gave.
//!
//! Source: paper A, Algorithm 2; deviates: a slot holds a whole path, not one impact, and the slot to refill is chosen by
//! whoever traces: in a ring it is paper A's queue, the oldest path first. A path keeps the points it passed, too, so that
//! a change of the scene is followed by tracing those again that met it.

mod also;

use crate::{
    disturbance::Disturbance,
    encounters::Encounters,
    flux::{Deposit, VslFlux},
    owner::OwnerTable,
    tracer::{Path, PathBatch},
    trail::Vertex,
};
use also::OtherLights;
use glam::Vec3;
use std::sync::Arc;

/// Paths in fixed slots, and the flux that they sum to.
#[derive(Clone, Debug)]
pub struct PathPool {
    slots: Vec<Slot>,
    /// Where the points of each slot's path are: by themselves, as whole pools are looked through.
    trails: Vec<Block>,
    deposits: Arena<Deposit>,
    vertices: Arena<Vertex>,
    /// Barycentric coordinates, where the vertices are.
    uvs: Vec<[f32; 2]>,
    /// The column of each run of slots, by the end of the run.
    columns: Vec<(u32, u32)>,
    /// Slots that hold a path, per column.
    valid: Vec<u32>,
    flux: VslFlux,
    /// The same light, summed in other virtual surface lights as well.
    also: Option<OtherLights>,
}

/// One path: where its deposits are, and when it was traced.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    deposits: Block,
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
            trails: vec![Block::default(); slots],
            deposits: Arena::default(),
            vertices: Arena::default(),
            uvs: Vec::new(),
            columns,
            valid: vec![0; count],
            flux: VslFlux::new(vsls, count),
            also: None,
        }
    }

    /// Replaces the paths of the batch's slots: takes back what the old ones deposited and adds what the new ones did.
    pub fn replace(&mut self, batch: &PathBatch, birth_ms: u32) {
        for path in batch.paths() {
            self.put(&path, birth_ms);
        }
    }

    /// Puts a path into its slot, in the place of the one that is there.
    pub fn put(&mut self, path: &Path<'_>, birth_ms: u32) {
        let column = self.column_of(path.slot);
        self.take_back(path.slot, column);
        let vertices = self.vertices.insert(path.vertices);
        self.uvs.resize(self.vertices.storage.len(), [0.0; 2]);
        self.uvs[vertices.range()].copy_from_slice(path.uvs);
        let deposits = self.deposits.insert(path.deposits);
        self.slots[path.slot as usize] = Slot { deposits, valid: true, birth_ms };
        self.trails[path.slot as usize] = vertices;
        self.valid[column as usize] += 1;
        self.flux.add(column, path.deposits, birth_ms);
        if let Some(also) = &mut self.also {
            also.add(column, path, birth_ms);
        }
    }

    /// Empties the slots of `slots` after the first `kept` of them; all of these are a column of their own.
    pub fn truncate(&mut self, slots: std::ops::Range<u32>, kept: u32) {
        let column = self.column_of(slots.start);
        if kept > slots.len() as u32 / 2 || self.also.is_some() {
            (slots.start + kept..slots.end).for_each(|slot| self.take_back(slot, column));
            return;
        }
        // Adding up few is less work than taking back many.
        self.flux.clear(column);
        self.valid[column as usize] = 0;
        for slot in slots.clone() {
            let Slot { deposits, valid, birth_ms } = self.slots[slot as usize];
            if !valid {
                continue;
            }
            if slot < slots.start + kept {
                self.flux.add(column, self.deposits.get(deposits), birth_ms);
                self.valid[column as usize] += 1;
            } else {
                self.deposits.remove(deposits);
                self.vertices.remove(std::mem::take(&mut self.trails[slot as usize]));
                self.slots[slot as usize] = Slot::default();
            }
        }
    }

    /// Takes back everything that the path in `slot` deposited and leaves the slot empty.
    pub fn remove(&mut self, slot: u32) {
        self.take_back(slot, self.column_of(slot));
    }

    /// Multiplies what the paths in `slots` deposited by `factor`, not negative: they then stand for as much more light.
    /// Rounded to quanta, and cut at the largest deposit.
    pub fn scale(&mut self, slots: std::ops::Range<u32>, factor: Vec3) {
        for slot in slots {
            let Slot { deposits, valid, birth_ms, .. } = self.slots[slot as usize];
            if !valid {
                continue;
            }
            let column = self.column_of(slot);
            let vertices = self.trails[slot as usize];
            let (marks, uvs) = (self.vertices.get(vertices), &self.uvs[vertices.range()]);
            let deposits = self.deposits.get_mut(deposits);
            self.flux.subtract(column, deposits, birth_ms);
            if let Some(also) = &mut self.also {
                also.subtract(column, &Path { slot, deposits, vertices: marks, uvs }, birth_ms);
            }
            deposits.iter_mut().for_each(|deposit| *deposit = deposit.scaled(factor));
            self.flux.add(column, deposits, birth_ms);
            if let Some(also) = &mut self.also {
                also.add(column, &Path { slot, deposits, vertices: marks, uvs }, birth_ms);
            }
        }
    }

    fn column_of(&self, slot: u32) -> u32 {
        self.columns[self.columns.partition_point(|&(end, _)| end <= slot)].1
    }

    fn take_back(&mut self, slot: u32, column: u32) {
        let old = std::mem::take(&mut self.slots[slot as usize]);
        if old.valid {
            self.flux.subtract(column, self.deposits.get(old.deposits), old.birth_ms);
            if let Some(also) = &mut self.also {
                let vertices = self.trails[slot as usize];
                let path = Path {
                    slot,
                    deposits: self.deposits.get(old.deposits),
                    vertices: self.vertices.get(vertices),
                    uvs: &self.uvs[vertices.range()],
                };
                also.subtract(column, &path, old.birth_ms);
            }
            self.deposits.remove(old.deposits);
            self.vertices.remove(std::mem::take(&mut self.trails[slot as usize]));
            self.valid[column as usize] -= 1;
        }
    }

    /// From now on, sums the flux of `vsls` lights of another placement on the same scene, too, whose `owners` these are: of
    /// all paths that are put into the pool.
    ///
    /// # Panics
    /// If there are paths already.
    pub(crate) fn sum_also(&mut self, owners: Arc<OwnerTable>, vsls: usize) {
        assert!(self.valid.iter().all(|&valid| valid == 0), "the pool is empty");
        self.also = Some(OtherLights::new(owners, VslFlux::new(vsls, self.valid.len())));
    }

    /// The flux in the lights of the other placement, if it is summed.
    pub(crate) fn also(&self) -> Option<&VslFlux> {
        self.also.as_ref().map(OtherLights::flux)
    }

    /// Forgets the other placement.
    pub(crate) fn forget_also(&mut self) {
        self.also = None;
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
        slot.valid.then(|| self.deposits.get(slot.deposits))
    }

    /// The points that the path in `slot` passed; `None` where there is no path.
    pub fn trail(&self, slot: u32) -> Option<&[Vertex]> {
        self.slots.get(slot as usize)?.valid.then(|| self.vertices.get(self.trails[slot as usize]))
    }

    /// Where the pool's paths met `disturbance`. Takes time in proportion to the most paths that the pool ever held.
    pub(crate) fn encounters(&self, disturbance: &Disturbance) -> Encounters {
        Encounters::find(disturbance, &self.vertices.storage)
    }

    /// How many first points of the path in `slot` come before what it met: [`Encounters::kept`].
    #[inline]
    pub(crate) fn kept(&self, slot: u32, encounters: &Encounters) -> u8 {
        encounters.kept(self.trails[slot as usize].range())
    }

    /// Rays that the path in `slot` took; 0 where there is no path.
    #[inline]
    pub(crate) fn rays(&self, slot: u32) -> u64 {
        u64::from(self.trails[slot as usize].length.saturating_sub(1))
    }

    /// Points that the pool has room for without growing.
    pub(crate) fn point_room(&self) -> usize {
        self.vertices.storage.len()
    }

    /// The first `points` points of the path in `slot` and their barycentric coordinates; `None` where it has fewer.
    pub(crate) fn beginning(&self, slot: u32, points: u8) -> Option<(&[Vertex], &[[f32; 2]])> {
        let Block { start, length } = self.trails[slot as usize];
        let range = start as usize..start as usize + usize::from(points);
        (u16::from(points) <= length).then(|| (&self.vertices.storage[range.clone()], &self.uvs[range]))
    }

    /// The path in `slot`; `None` where there is none.
    pub fn whole_path(&self, slot: u32) -> Option<Path<'_>> {
        let Slot { deposits, valid, .. } = *self.slots.get(slot as usize)?;
        let vertices = self.trails[slot as usize];
        valid.then(|| Path {
            slot,
            deposits: self.deposits.get(deposits),
            vertices: self.vertices.get(vertices),
            uvs: &self.uvs[vertices.range()],
        })
    }

    /// When the path in `slot` was traced, in ms since the simulation started; `None` where there is no path.
    pub fn birth_ms(&self, slot: u32) -> Option<u32> {
        let slot = self.slots.get(slot as usize)?;
        slot.valid.then_some(slot.birth_ms)
    }

    /// The flux summed anew from the pool's paths: always equal to [`PathPool::flux`], bit for bit.
    pub fn rebuilt_flux(&self) -> VslFlux {
        let mut flux = VslFlux::new(self.flux.vsls(), self.valid.len());
        for (index, slot) in self.slots.iter().enumerate().filter(|(_, slot)| slot.valid) {
            flux.add(self.column_of(index as u32), self.deposits.get(slot.deposits), slot.birth_ms);
        }
        flux
    }

    /// Bytes the pool takes.
    pub fn bytes(&self) -> usize {
        let slots = size_of_val(&*self.slots) + size_of_val(&*self.trails);
        slots + self.deposits.bytes() + self.vertices.bytes() + size_of_val(&*self.uvs)
    }
}

/// Where a run of items lies in an arena.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    start: u32,
    length: u16,
}

impl Block {
    fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.start as usize + usize::from(self.length)
    }
}

/// Sizes of blocks. Those of one page are equal; longer ones take whole pages.
const SIZES: [u16; 22] =
    [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 16, 21, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384];

/// Items to a page, at a multiple of which it lies: whole pools are looked through by pages.
const PAGE: usize = 64;

/// Runs of items in blocks, each size with a list of free blocks: replacing never moves others. A block of up to a page
/// lies within one page.
#[derive(Clone, Debug, Default)]
struct Arena<T> {
    storage: Vec<T>,
    free: [Vec<u32>; SIZES.len()],
}

impl<T: Copy + Default> Arena<T> {
    fn insert(&mut self, items: &[T]) -> Block {
        if items.is_empty() {
            return Block::default();
        }
        let class = Self::class(items.len());
        let start = self.free[class].pop().unwrap_or_else(|| self.append(class));
        let size = usize::from(SIZES[class]);
        let (used, spare) = self.storage[start as usize..start as usize + size].split_at_mut(items.len());
        used.copy_from_slice(items);
        spare.fill(T::default());
        Block { start, length: items.len() as u16 }
    }

    /// The first of new blocks of a size, as many as a page holds; the others are free.
    fn append(&mut self, class: usize) -> u32 {
        let number = |start: usize| {
            u32::try_from(start).expect("invariant: a pool's paths have fewer than 2^32 points")
        };
        let (start, size) = (self.storage.len(), usize::from(SIZES[class]));
        self.storage.resize(start + size.next_multiple_of(PAGE), T::default());
        // The last one is taken first.
        let others = (1..PAGE / size).rev();
        self.free[class].extend(others.map(|i| number(start + i * size)));
        number(start)
    }

    fn remove(&mut self, block: Block) {
        if block.length > 0 {
            self.free[Self::class(usize::from(block.length))].push(block.start);
        }
    }

    fn get(&self, block: Block) -> &[T] {
        &self.storage[block.range()]
    }

    fn get_mut(&mut self, block: Block) -> &mut [T] {
        &mut self.storage[block.range()]
    }

    /// The least size for `length` items.
    fn class(length: usize) -> usize {
        SIZES.partition_point(|&size| usize::from(size) < length)
    }

    fn bytes(&self) -> usize {
        self.storage.capacity() * size_of::<T>()
    }
}
