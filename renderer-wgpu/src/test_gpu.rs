//! Turns the machine into the software device that tests use, or into a loud word that there is none.

use crate::{AdapterChoice, Gpu};

/// The software rasteriser, so that pictures are the same everywhere; `None`, said loudly, where there is none.
///
/// # Panics
/// If there is none and `PHOTONSTREAM_REQUIRE_GPU` is `1`.
pub fn gpu() -> Option<Gpu> {
    match Gpu::headless(&AdapterChoice { name: None, software: true }) {
        Ok(gpu) => Some(gpu),
        Err(error) => {
            skip(&error.to_string());
            None
        }
    }
}

/// Says loudly that a test cannot run here.
///
/// # Panics
/// If `PHOTONSTREAM_REQUIRE_GPU` is `1`.
#[expect(clippy::print_stderr, reason = "a skipped test must be seen")]
pub fn skip(reason: &str) {
    assert!(
        std::env::var_os("PHOTONSTREAM_REQUIRE_GPU").is_none_or(|value| value != "1"),
        "PHOTONSTREAM_REQUIRE_GPU=1, but {reason}"
    );
    eprintln!("SKIP SKIP SKIP: this test needs a Vulkan device: {reason}");
}
