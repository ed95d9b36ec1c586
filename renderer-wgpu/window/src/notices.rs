//! Gathers short messages to the user, each for a while.

use std::time::{Duration, Instant};

/// How long a message is shown.
const SHOWN: Duration = Duration::from_secs(6);
/// Most messages at a time; the oldest give way.
const MOST: usize = 5;

/// A message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Notice {
    /// What it says.
    pub(crate) text: String,
    /// Whether something went wrong.
    pub(crate) is_error: bool,
    until: Instant,
}

/// The messages of the last seconds, the newest last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Notices(Vec<Notice>);

impl Notices {
    /// Says something; said again, it stays longer.
    pub(crate) fn say(&mut self, text: impl Into<String>, now: Instant) {
        self.add(text.into(), false, now);
    }

    /// Says that something went wrong.
    pub(crate) fn warn(&mut self, text: impl Into<String>, now: Instant) {
        self.add(text.into(), true, now);
    }

    fn add(&mut self, text: String, is_error: bool, now: Instant) {
        // Once for as long as it stays.
        let is_shown = self.0.iter().any(|notice| notice.text == text && notice.until > now);
        match is_error {
            _ if is_shown => {}
            true => tracing::warn!("{text}"),
            false => tracing::info!("{text}"),
        }
        self.0.retain(|notice| notice.text != text);
        self.0.push(Notice { text, is_error, until: now + SHOWN });
        let excess = self.0.len().saturating_sub(MOST);
        self.0.drain(..excess);
    }

    /// The messages to be shown, and after which time to look again.
    pub(crate) fn now(&mut self, now: Instant) -> (&[Notice], Option<Duration>) {
        self.0.retain(|notice| notice.until > now);
        let next = self.0.iter().map(|notice| notice.until - now).min();
        (&self.0, next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_pass_and_repeated_ones_stay_once() {
        let start = Instant::now();
        let mut notices = Notices::default();
        notices.say("a", start);
        notices.warn("b", start + Duration::from_secs(3));
        notices.say("a", start + Duration::from_secs(4));
        let (shown, next) = notices.now(start + Duration::from_secs(5));
        assert_eq!(
            shown.iter().map(|n| (n.text.as_str(), n.is_error)).collect::<Vec<_>>(),
            [("b", true), ("a", false)]
        );
        assert_eq!(next, Some(Duration::from_secs(4)));
        assert_eq!(notices.now(start + Duration::from_secs(9)).0.len(), 1);
        assert_eq!(notices.now(start + Duration::from_secs(10)).1, None);
        for i in 0..20 {
            notices.say(i.to_string(), start);
        }
        assert_eq!(notices.now(start).0.first().map(|n| n.text.as_str()), Some("15"));
    }
}
