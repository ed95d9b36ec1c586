//! Turns how a command ended into the exit code of the process.

/// All went well.
pub(crate) const OK: u8 = 0;
/// Something failed while it was done: a file, shared memory, a picture.
pub(crate) const FAILED: u8 = 1;
/// The command line makes no sense.
pub(crate) const USAGE: u8 = 2;
/// The scene is not valid, or cannot be read.
pub(crate) const CONFIG: u8 = 3;
/// The channel is in use, or does not exist.
pub(crate) const CHANNEL: u8 = 4;
/// A process that was started failed for good.
pub(crate) const CHILD: u8 = 5;
/// No graphics device can draw it.
pub(crate) const DEVICE: u8 = 6;
/// A signal ended it before its time.
pub(crate) const INTERRUPTED: u8 = 130;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_lists_every_code() {
        for code in [OK, FAILED, USAGE, CONFIG, CHANNEL, CHILD, DEVICE, INTERRUPTED] {
            assert!(
                crate::cli::AFTER_HELP
                    .lines()
                    .any(|l| l.split_whitespace().next() == Some(&code.to_string())),
                "{code}"
            );
        }
    }
}
