//! Turns the lights that were found for the cells of a table of owners into numbers that can be kept, and back.
//!
//! Triangles follow in the order in which the table is built, in tasks; each is one word, its only owner, or a list for each
//! cell that touches it. Lights are numbered within their surface.

/// Marks the last word of a list.
const LAST: u32 = 1 << 31;
/// Marks the owner of a whole triangle.
const ALL: u32 = 1 << 30;

/// The words of one task.
#[derive(Debug, Default)]
pub(super) struct Chosen(Vec<u32>);

impl Chosen {
    pub(super) fn push_list(&mut self, lights: &[u32]) {
        self.0.extend_from_slice(lights);
        if let Some(last) = self.0.last_mut() {
            *last |= LAST;
        }
    }

    pub(super) fn push_owner(&mut self, light: u32) {
        self.0.push(light | ALL);
    }

    pub(super) fn mark(&self) -> usize {
        self.0.len()
    }

    /// The lists since `mark` say no more than that a light owns all.
    pub(super) fn replace_since(&mut self, mark: usize, light: u32) {
        self.0.truncate(mark);
        self.push_owner(light);
    }
}

/// The words of all tasks.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Choices {
    /// Where the words of each task end.
    pub(super) ends: Vec<u64>,
    pub(super) words: Vec<u32>,
}

impl Choices {
    pub(super) fn append(&mut self, Chosen(words): Chosen) {
        self.words.extend(words);
        self.ends.push(self.words.len() as u64);
    }

    pub(super) fn tasks(&self) -> usize {
        self.ends.len()
    }

    /// `None` if there is no such task.
    pub(super) fn of_task(&self, task: usize) -> Option<Reader<'_>> {
        let start = match task.checked_sub(1) {
            Some(before) => usize::try_from(*self.ends.get(before)?).ok()?,
            None => 0,
        };
        let end = usize::try_from(*self.ends.get(task)?).ok()?;
        Some(Reader(self.words.get(start..end)?))
    }
}

/// The words of a task that are not read yet.
pub(super) struct Reader<'c>(&'c [u32]);

impl Reader<'_> {
    /// The owner of all of the next triangle; `Some(None)` where it has lists, `None` where nothing is left, or the owner is
    /// none of `count` lights.
    pub(super) fn owner_of_all(&mut self, count: u32) -> Option<Option<u32>> {
        let (&word, rest) = self.0.split_first()?;
        if word & ALL == 0 {
            return Some(None);
        }
        self.0 = rest;
        let owner = word & !ALL;
        (owner < count).then_some(Some(owner))
    }

    /// The lights of the next cell, in order; `None` where there are none, or none of `count` lights.
    pub(super) fn list(&mut self, count: u32) -> Option<Vec<u32>> {
        let length = self.0.iter().position(|word| word & LAST != 0)? + 1;
        let (list, rest) = self.0.split_at(length);
        self.0 = rest;
        let lights: Vec<u32> = list.iter().map(|word| word & !LAST).collect();
        let is_ordered = lights.array_windows().all(|[a, b]| a < b);
        (is_ordered && lights.iter().all(|&light| light < count)).then_some(lights)
    }

    pub(super) fn is_at_its_end(&self) -> bool {
        self.0.is_empty()
    }
}
