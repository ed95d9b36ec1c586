//! Turns copied chunks into the next frame: in the other of two whole arrays, or as a patch to the last one.

use std::ops::Range;

/// A patch is kept as long as it is at most this part of an array's chunks; swapping whole arrays is cheaper beyond.
const PATCH_SHARE: usize = 4;

/// Where a reader puts a frame together.
pub(crate) trait Staging {
    /// Array `a`, of `records` records whose chunks have the versions of `table`; what was verified before stays.
    fn array(&mut self, a: usize, records: usize, table: &[u64]) -> ArrayView<'_>;
}

/// One array of the frame being put together, and of the last complete one.
pub(crate) struct ArrayView<'a> {
    pub(crate) words: &'a mut [u64],
    /// Version of each chunk in `words`, 0 where it is not verified.
    pub(crate) versions: &'a mut [u64],
    pub(crate) front_words: &'a [u64],
    pub(crate) front_versions: &'a [u64],
    /// Takes the chunks instead of `words`, if there is one.
    pub(crate) patch: Option<&'a mut Patch>,
}

impl ArrayView<'_> {
    /// Whether the array has chunk `c` in this version, after taking it from the last frame if that helps.
    #[inline]
    pub(crate) fn holds(&mut self, c: usize, range: &Range<usize>, version: u64) -> bool {
        let in_front = self.front_versions.get(c) == Some(&version);
        if let Some(patch) = &self.patch {
            return in_front || patch.version(c) == version;
        }
        if self.versions[c] == version {
            return true;
        }
        if let (true, Some(known)) = (in_front, self.front_words.get(range.clone())) {
            self.words[range.clone()].copy_from_slice(known);
            self.versions[c] = version;
            return true;
        }
        false
    }

    /// The place for chunk `c`, which counts as not verified from here on.
    #[inline]
    pub(crate) fn place(&mut self, c: usize, range: &Range<usize>) -> &mut [u64] {
        match &mut self.patch {
            Some(patch) => patch.place(c, range),
            None => {
                self.versions[c] = 0;
                &mut self.words[range.clone()]
            }
        }
    }

    /// Notes that the copy of chunk `c` is whole, and which version it is.
    #[inline]
    pub(crate) fn verified(&mut self, c: usize, version: u64) {
        match &mut self.patch {
            Some(patch) => patch.verified(c, version),
            None => self.versions[c] = version,
        }
    }
}

struct Piece {
    chunk: usize,
    range: Range<usize>,
    /// 0 where it is not verified.
    version: u64,
}

/// Chunks of one array that differ from the last frame, side by side.
///
/// A frame of which little changed would otherwise touch most memory twice: the other array lacks the changes of two
/// frames, none of which lies in a cache. These pieces do.
#[derive(Default)]
pub(crate) struct Patch {
    pieces: Vec<Piece>,
    /// For each chunk its place in `pieces`, counted from 1; 0 for none.
    index: Vec<u32>,
    words: Vec<u64>,
    /// Words from one piece to the next.
    step: usize,
}

impl Patch {
    /// Prepares for chunks of at most `step` words, where few enough of them lack in `front`; whether that is so.
    pub(crate) fn begin(&mut self, step: usize, table: &[u64], front: &[u64]) -> bool {
        let lacking = table.iter().zip(front).filter(|(new, old)| new != old).count();
        if table.len() != front.len() || lacking * PATCH_SHARE > table.len() {
            return false;
        }
        if self.step != step || self.index.len() != table.len() {
            self.clear();
            self.index.resize(table.len(), 0);
            self.step = step;
        }
        for piece in &mut self.pieces {
            if table[piece.chunk] == front[piece.chunk] {
                piece.version = 0;
            }
        }
        true
    }

    fn version(&self, c: usize) -> u64 {
        match self.index[c] {
            0 => 0,
            at => self.pieces[at as usize - 1].version,
        }
    }

    fn place(&mut self, c: usize, range: &Range<usize>) -> &mut [u64] {
        if self.index[c] == 0 {
            self.pieces.push(Piece { chunk: c, range: range.clone(), version: 0 });
            self.index[c] = self.pieces.len() as u32;
            if self.words.len() < self.pieces.len() * self.step {
                self.words.resize(self.pieces.len() * self.step, 0);
            }
        }
        let at = self.index[c] as usize - 1;
        let piece = &mut self.pieces[at];
        (piece.range, piece.version) = (range.clone(), 0);
        &mut self.words[at * self.step..][..range.len()]
    }

    fn verified(&mut self, c: usize, version: u64) {
        if let Some(piece) = (self.index[c] as usize).checked_sub(1).and_then(|at| self.pieces.get_mut(at)) {
            piece.version = version;
        }
    }

    /// Puts the verified chunks into an array, names each of them, and is empty then.
    pub(crate) fn apply(&mut self, words: &mut [u64], versions: &mut [u64], mut name: impl FnMut(usize)) {
        for (at, piece) in self.pieces.iter().enumerate().filter(|(_, piece)| piece.version != 0) {
            words[piece.range.clone()].copy_from_slice(&self.words[at * self.step..][..piece.range.len()]);
            versions[piece.chunk] = piece.version;
            name(piece.chunk);
        }
        self.clear();
    }

    /// Forgets all chunks.
    pub(crate) fn clear(&mut self) {
        for piece in self.pieces.drain(..) {
            self.index[piece.chunk] = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: usize = 4;

    fn range(c: usize) -> Range<usize> {
        c * STEP..(c + 1) * STEP
    }

    fn put(patch: &mut Patch, c: usize, version: u64) {
        patch.place(c, &range(c)).fill(version);
        patch.verified(c, version);
    }

    /// 8 chunks: a quarter of them may lack, and not one more, nor another number of chunks.
    #[test]
    fn begins_only_where_little_changed() {
        let mut patch = Patch::default();
        let front = [1; 8];
        assert!(patch.begin(STEP, &front, &front));
        assert!(patch.begin(STEP, &[1, 2, 1, 1, 1, 2, 1, 1], &front));
        assert!(!patch.begin(STEP, &[1, 2, 1, 1, 1, 2, 1, 3], &front));
        assert!(!patch.begin(STEP, &[1; 9], &front));
    }

    /// Chunks verified for an overwritten frame stay; those under way, and those that turn out not to lack, do not.
    #[test]
    fn applies_what_was_verified_and_nothing_else() {
        let mut patch = Patch::default();
        let mut front = [1; 12];
        let mut words = [1; 12 * STEP];
        assert!(patch.begin(STEP, &[1, 5, 1, 5, 1, 1, 1, 1, 1, 1, 1, 5], &front));
        put(&mut patch, 1, 5);
        put(&mut patch, 3, 5);
        put(&mut patch, 11, 5);
        // The next frame: chunk 1 as before, 3 changed again, and 11 as in the front (which only a hostile writer does).
        assert!(patch.begin(STEP, &[1, 5, 1, 6, 1, 1, 1, 1, 1, 1, 1, 1], &front));
        assert_eq!([1, 2, 3, 11].map(|c| patch.version(c)), [5, 0, 5, 0]);
        put(&mut patch, 3, 6);
        patch.place(2, &range(2)).fill(9);
        let mut named = Vec::new();
        patch.apply(&mut words, &mut front, |c| named.push(c));
        assert_eq!(named, [1, 3]);
        let expected = [1, 5, 1, 6, 1, 1, 1, 1, 1, 1, 1, 1];
        assert_eq!(front, expected);
        assert!(words.chunks(STEP).zip(expected).all(|(chunk, version)| chunk == [version; STEP]));
        assert_eq!([1, 3].map(|c| patch.version(c)), [0, 0]);
    }
}
