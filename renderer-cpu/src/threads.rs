//! Turns work for all threads into work on as many as asked for.

use photonstream_renderer::RenderError;

/// Runs `work` on a pool of `threads` threads, or on rayon's own.
pub(crate) fn on_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T, RenderError> + Send,
) -> Result<T, RenderError> {
    let Some(threads) = threads else { return work() };
    if threads == 0 {
        let expected = "1 or more";
        return Err(RenderError::Option { option: "threads", found: "0".into(), expected });
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| RenderError::Threads { threads, reason: e.to_string() })?
        .install(work)
}
