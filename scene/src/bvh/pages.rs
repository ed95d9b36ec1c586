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
pub(super) enum Pages<T> {
    Short(Vec<T>),
    Long { memory: MmapMut, len: usize },
}

impl<T: Pod> From<Vec<T>> for Pages<T> {
    fn from(list: Vec<T>) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(&list);
        if bytes.len() < MOVED_FROM {
            return Self::Short(list);
        }
        // Without memory to be mapped the list stays where it is.
        let Ok(mut memory) = MmapMut::map_anon(bytes.len().next_multiple_of(LARGE_PAGE)) else {
            return Self::Short(list);
        };
        // A wish: what the system makes of it changes nothing but speed.
        #[cfg(target_os = "linux")]
        let _ = memory.advise(memmap2::Advice::HugePage);
        memory[..bytes.len()].copy_from_slice(bytes);
        Self::Long { memory, len: list.len() }
    }
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
        }
    }
}
