//! Turns text into zero-filled records of 64 bytes, and records back into text.

use std::borrow::Cow;
use std::sync::Arc;

use crate::error::ProtocolError;

/// Bytes of a record of text.
pub(crate) const TEXT_RECORD: usize = 64;
/// What a text that was cut ends with.
const CUT: &str = " …";

/// The text published last, and its records.
#[derive(Default)]
pub(crate) struct PublishedText {
    text: String,
    words: Vec<u64>,
}

impl PublishedText {
    /// Makes it another text; one that is the same costs a comparison.
    pub(crate) fn set(&mut self, text: &str) {
        if self.text == text {
            return;
        }
        text.clone_into(&mut self.text);
        self.words.clear();
        self.words.resize(text.len().div_ceil(TEXT_RECORD) * TEXT_RECORD / 8, 0);
        bytemuck::cast_slice_mut(&mut self.words)[..text.len()].copy_from_slice(text.as_bytes());
    }

    /// The records.
    pub(crate) fn words(&self) -> &[u64] {
        &self.words
    }

    /// Bytes of UTF-8 in the records.
    pub(crate) fn bytes(&self) -> u64 {
        self.text.len() as u64
    }
}

/// As much of a text as `capacity` bytes hold, cut between characters and marked.
pub(crate) fn fitted(text: &str, capacity: usize) -> Cow<'_, str> {
    if text.len() <= capacity {
        return Cow::Borrowed(text);
    }
    match capacity.checked_sub(CUT.len()) {
        Some(room) => Cow::Owned(format!("{}{CUT}", &text[..text.floor_char_boundary(room)])),
        None => Cow::Borrowed(&text[..text.floor_char_boundary(capacity)]),
    }
}

/// The first `bytes` of records, which a reader copied, as text.
pub(crate) fn read(name: &str, records: &[[u64; 8]], bytes: u64) -> Result<Arc<str>, ProtocolError> {
    let copied: &[u8] = bytemuck::cast_slice(records.as_flattened());
    let text = usize::try_from(bytes).ok().and_then(|bytes| copied.get(..bytes)).ok_or_else(|| {
        ProtocolError::corrupt(format!("{name} length"), bytes, format!("at most {}", copied.len()))
    })?;
    let text =
        std::str::from_utf8(text).map_err(|error| ProtocolError::corrupt(name, error, "valid UTF-8"))?;
    Ok(Arc::from(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(fitted("room", 4), "room");
        assert_eq!(fitted("a room", 5), "a …");
        // Two bytes each: seven bytes leave room for three, and one character fits into it.
        assert_eq!(fitted("äöüß", 7), "ä …");
        assert_eq!(fitted("äöüß", 4), " …");
        assert_eq!(fitted("äöüß", 3), "ä");
        assert_eq!(fitted("äöüß", 0), "");
    }

    #[test]
    fn texts_survive_their_records() {
        let mut published = PublishedText::default();
        for text in ["", "a", &"x".repeat(64), &"ä".repeat(33), ""] {
            published.set(text);
            let records = published.words().as_chunks::<8>().0;
            assert_eq!(records.len(), text.len().div_ceil(TEXT_RECORD));
            assert_eq!(&*read("notice", records, published.bytes()).unwrap(), text);
        }
        assert!(read("notice", &[[0; 8]], 65).is_err() && read("notice", &[[u64::MAX; 8]], 8).is_err());
    }
}
