//! Turns the picture files that an import names into pictures, each once, within a bound on all of them together.

use crate::picture::Picture;
use std::{collections::BTreeMap, sync::Arc};

/// Most pixels of all pictures of an import together, 2²⁷: 1.4 GB of texels. Further ones count by their mean colour.
const MAX_PIXELS: u64 = 1 << 27;

/// The pictures that an import has read, by their name and whether their alpha counts.
#[derive(Debug)]
pub(super) struct Pictures<K> {
    read: BTreeMap<(K, bool), Result<Arc<Picture>, String>>,
    pixels: u64,
    full: u64,
    notices: Vec<String>,
}

impl<K: Ord + Clone> Pictures<K> {
    pub(super) fn new() -> Self {
        Self { read: BTreeMap::new(), pixels: 0, full: 0, notices: Vec::new() }
    }

    /// The picture `key`, called `name` in messages, as `read` gives it; with `holes`, its alpha counts.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub(super) fn get(
        &mut self,
        key: K,
        holes: bool,
        name: &str,
        read: impl FnOnce() -> Result<Picture, String>,
    ) -> Result<Arc<Picture>, String> {
        let key = (key, holes);
        if !self.read.contains_key(&key) {
            let picture = read().map(|picture| self.keep(picture, name));
            self.read.insert(key.clone(), picture);
        }
        self.read[&key].clone()
    }

    /// What was found, one sentence each.
    pub(super) fn notices(&self) -> Vec<String> {
        let mut notices = self.notices.clone();
        if self.full > 0 {
            let (full, all) = (self.full, self.pixels);
            notices.push(format!(
                "{full} of {all} pixels of its pictures are white: paths end there by a cap, 1 in 1 000"
            ));
        }
        notices
    }

    fn keep(&mut self, picture: Picture, name: &str) -> Arc<Picture> {
        self.full += u64::from(picture.full());
        self.pixels += u64::from(picture.pixels());
        if self.pixels <= MAX_PIXELS {
            return Arc::new(picture);
        }
        self.pixels -= u64::from(picture.pixels());
        self.notices.push(format!(
            "picture {name} counts by its mean colour: with it, pictures would have more than {MAX_PIXELS} pixels"
        ));
        let mean = picture.mean().truncate().extend(1.0);
        Arc::new(Picture::new(1, 1, vec![mean], false))
    }
}
