//! Counts what happened to paths: nothing is dropped in silence.

use serde::Serialize;

/// Events since the start, or within a batch. All counters fit 2⁶⁴ events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Paths traced.
    pub paths: u64,
    /// Rays traced.
    pub rays: u64,
    /// Deposits made.
    pub deposits: u64,
    /// Paths that left the scene.
    pub escaped: u64,
    /// Paths that ended on a side that does not reflect.
    pub absorbed_back: u64,
    /// Paths cut at the greatest length or weight; what they carried is lost.
    pub truncated: u64,
    /// Paths ended by a value that is not finite, or by a hit that nobody owns.
    pub rejected: u64,
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.paths += other.paths;
        self.rays += other.rays;
        self.deposits += other.deposits;
        self.escaped += other.escaped;
        self.absorbed_back += other.absorbed_back;
        self.truncated += other.truncated;
        self.rejected += other.rejected;
    }
}
