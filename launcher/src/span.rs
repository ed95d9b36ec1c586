//! Turns `3..7` into the first and the last frame of a recording that are played.

use std::str::FromStr;

/// Frames of a recording, counted from 1; both ends belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) first: u64,
    /// `None` for the last one that there is.
    pub(crate) last: Option<u64>,
}

impl FromStr for Span {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("expected frames such as 3..7, 3.., ..7 or 5, counted from 1, found \"{text}\"");
        let number = |text: &str| text.parse::<u64>().ok().filter(|n| *n > 0).ok_or_else(wrong);
        let (first, last) = match text.split_once("..") {
            None => (number(text)?, Some(number(text)?)),
            Some(("", "")) => (1, None),
            Some(("", last)) => (1, Some(number(last)?)),
            Some((first, "")) => (number(first)?, None),
            Some((first, last)) => (number(first)?, Some(number(last)?)),
        };
        if last.is_some_and(|last| last < first) { Err(wrong()) } else { Ok(Self { first, last }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_may_be_left_out() {
        let span = |text: &str| text.parse::<Span>().map(|s| (s.first, s.last)).ok();
        assert_eq!(span("3..7"), Some((3, Some(7))));
        assert_eq!(span("3.."), Some((3, None)));
        assert_eq!(span("..7"), Some((1, Some(7))));
        assert_eq!(span(".."), Some((1, None)));
        assert_eq!(span("5"), Some((5, Some(5))));
        for wrong in ["", "0..3", "7..3", "a", "1-3", "..0", "1...3"] {
            assert_eq!(span(wrong), None, "{wrong}");
        }
    }
}
