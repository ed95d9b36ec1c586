//! Turns names into numbers of sample streams, so that what is called the same draws the same samples in any scene.

/// FNV-1a of a name and a number: the same everywhere.
pub(crate) fn stream_of(name: &str, number: u32) -> u32 {
    name.bytes()
        .chain(number.to_le_bytes())
        .fold(0x811C_9DC5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
