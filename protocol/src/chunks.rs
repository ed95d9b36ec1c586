//! Turns record indices into a set of chunks: which groups of 64 records changed.

/// Records of a chunk, the unit in which changes are tracked and copied.
pub const CHUNK_RECORDS: usize = 64;

/// A set of chunk indices.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChunkSet {
    bits: Vec<u64>,
    chunks: usize,
}

impl ChunkSet {
    /// The empty set over the chunks of `records` records.
    pub fn for_records(records: usize) -> Self {
        let mut set = Self::default();
        set.reset(records.div_ceil(CHUNK_RECORDS));
        set
    }

    /// The set of all chunks of `records` records.
    pub fn all(records: usize) -> Self {
        let mut set = Self::for_records(records);
        for chunk in 0..set.chunks {
            set.insert(chunk);
        }
        set
    }

    /// Empties the set and makes it range over `chunks` chunks.
    pub fn reset(&mut self, chunks: usize) {
        self.chunks = chunks;
        self.bits.clear();
        self.bits.resize(chunks.div_ceil(64), 0);
    }

    /// Empties the set.
    pub fn clear(&mut self) {
        self.bits.fill(0);
    }

    /// Adds a chunk; one beyond the range widens it.
    pub fn insert(&mut self, chunk: usize) {
        if chunk >= self.chunks {
            self.chunks = chunk + 1;
            self.bits.resize(self.chunks.div_ceil(64), 0);
        }
        self.bits[chunk / 64] |= 1 << (chunk % 64);
    }

    /// Adds the chunk that holds a record.
    pub fn insert_record(&mut self, record: usize) {
        self.insert(record / CHUNK_RECORDS);
    }

    /// Whether the chunk is in the set.
    pub fn contains(&self, chunk: usize) -> bool {
        self.bits.get(chunk / 64).is_some_and(|word| word >> (chunk % 64) & 1 == 1)
    }

    /// Number of chunks in the set.
    pub fn len(&self) -> usize {
        self.bits.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// Whether no chunk is in the set.
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|word| *word == 0)
    }

    /// Number of chunks the set ranges over.
    pub fn range(&self) -> usize {
        self.chunks
    }

    /// The chunks in the set, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.chunks).filter(|chunk| self.contains(*chunk))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_what_was_inserted() {
        let mut set = ChunkSet::for_records(10_000);
        assert!(set.is_empty() && set.range() == 157);
        for record in [0, 63, 64, 9_999] {
            set.insert_record(record);
        }
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 1, 156]);
        assert_eq!(set.len(), 3);
        set.insert(400);
        assert!(set.contains(400) && !set.contains(399) && !set.contains(100_000));
        assert_eq!(ChunkSet::all(65).iter().collect::<Vec<_>>(), [0, 1]);
        assert!(ChunkSet::all(0).is_empty());
    }
}
