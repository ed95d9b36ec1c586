//! Turns a long list into one in large memory pages, which rays reach without walking the page table.
//!
//! Four thousand pages of four kilobytes hold the structure of 200 000 triangles, twice what a processor keeps addresses
//! of. Systems that have large pages only for those who ask (Linux's `madvise`) are asked; others have the list all
//! the same.

use std::ops::Deref;

use bytemuck::Pod;
use memmap2::MmapMut;

/// Lists from this number of bytes are moved: below, more than three quarters of a large page would be empty.
const MOVED_FROM: usize = 512 << 10;
/// Bytes of a large page, of which a list occupies whole ones.
const LARGE_PAGE: usize = 2 << 20;

/// A list that does not grow.
#[derive(Debug)]
pub enum Pages<T> {
    /// In ordinary memory.
    Short(Vec<T>),
    /// In large pages.
    Long {
        /// The pages.
        memory: MmapMut,
        /// Number of items.
        len: usize,
    },
}

impl<T: Pod> From<Vec<T>> for Pages<T> {
    fn from(list: Vec<T>) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(&list);
        let Some(mut memory) = mapped(bytes.len()) else {
            return Self::Short(list);
        };
        memory[..bytes.len()].copy_from_slice(bytes);
        Self::Long { memory, len: list.len() }
    }
}

impl<T: Pod> Pages<T> {
    /// A list of `len` items of zeros, after `fill` wrote it.
    ///
    /// # Errors
    /// Those of `fill`.
    pub(crate) fn filled<E>(len: usize, fill: impl FnOnce(&mut [T]) -> Result<(), E>) -> Result<Self, E> {
        let bytes = len * size_of::<T>();
        if let Some(mut memory) = mapped(bytes) {
            fill(bytemuck::cast_slice_mut(&mut memory[..bytes]))?;
            return Ok(Self::Long { memory, len });
        }
        let mut list = vec![T::zeroed(); len];
        fill(&mut list)?;
        Ok(Self::Short(list))
    }

    /// The list, to be changed in place.
    pub(super) fn items_mut(&mut self) -> &mut [T] {
        match self {
            Self::Short(list) => list,
            Self::Long { memory, len } => bytemuck::cast_slice_mut(&mut memory[..*len * size_of::<T>()]),
        }
    }
}

/// Memory for a long list, as large pages; `None` for a short one, and where the system gives none.
fn mapped(bytes: usize) -> Option<MmapMut> {
    if bytes < MOVED_FROM {
        return None;
    }
    let memory = MmapMut::map_anon(bytes.next_multiple_of(LARGE_PAGE)).ok()?;
    // A wish: what the system makes of it changes nothing but speed.
    #[cfg(target_os = "linux")]
    let _ = memory.advise(memmap2::Advice::HugePage);
    Some(memory)
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match self {
            Self::Short(list) => list,
            Self::Long { memory, len } => bytemuck::cast_slice(&memory[..len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> Clone for Pages<T> {
    fn clone(&self) -> Self {
        Self::from(self.to_vec())
    }
}

#[cfg(test)]
impl<T> Pages<T> {
    /// The short list, to be broken.
    pub(super) fn short(&mut self) -> &mut Vec<T> {
        let Self::Short(list) = self else { panic!("a long list") };
        list
    }
}

#[cfg(test)]
mod tests {
    use super::{LARGE_PAGE, MOVED_FROM, Pages};

    #[test]
    fn long_lists_are_moved_and_all_lists_kept() {
        for len in [0, 1, MOVED_FROM / 4 - 1, MOVED_FROM / 4, LARGE_PAGE + 1] {
            let list: Vec<u32> = (0..len as u32).collect();
            let pages = Pages::from(list.clone());
            assert_eq!(matches!(pages, Pages::Short(_)), len * 4 < MOVED_FROM, "{len}");
            assert_eq!(*pages, *list, "{len}");
            assert_eq!(*pages.clone(), *list, "{len}");
            let fill = |items: &mut [u32]| -> Result<(), ()> {
                items.copy_from_slice(&list);
                Ok(())
            };
            let mut filled = Pages::filled(len, fill).unwrap();
            assert_eq!(matches!(filled, Pages::Short(_)), len * 4 < MOVED_FROM, "{len}");
            assert_eq!(*filled, *list, "{len}");
            filled.items_mut().reverse();
            assert!(filled.iter().eq(list.iter().rev()), "{len}");
            assert_eq!(Pages::<u32>::filled(len, |_| Err(5)).unwrap_err(), 5, "{len}");
        }
    }
}
