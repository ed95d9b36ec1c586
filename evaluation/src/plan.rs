//! Turns a scene into the points to measure: sweeps of one setting each, and the methods to compare with.

use crate::{
    device::Way,
    methods::few,
    point::{Method, Point},
};
use photonstream_scene::{Sampling, Visibility};
use photonstream_shading::Kernel;

/// A point, and the sweep that it is for.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Names of the sweeps, separated by spaces.
    pub sweeps: String,
    /// What to measure.
    pub point: Point,
}

/// How thorough it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Few points, small pictures: half a minute a scene.
    Quick,
    /// Some minutes a scene.
    Default,
}

impl Effort {
    /// Pixels of a picture, where no size is asked for.
    pub fn pixels(self) -> u32 {
        match self {
            Self::Quick => 64 * 64,
            Self::Default => 128 * 128,
        }
    }

    /// Paths per pixel of the reference.
    pub fn reference_spp(self) -> u64 {
        match self {
            Self::Quick => 256,
            Self::Default => 4096,
        }
    }

    /// Path tracing gets no more time than this, in ms.
    pub fn longest_ms(self) -> f64 {
        match self {
            Self::Quick => 1e3,
            Self::Default => 1e4,
        }
    }

    fn vsls(self) -> &'static [u32] {
        match self {
            Self::Quick => &[50, 200, 1000],
            Self::Default => &[50, 200, 1000, 4000],
        }
    }

    fn pools(self) -> &'static [u32] {
        match self {
            Self::Quick => &[1 << 10, 1 << 13, 1 << 16],
            Self::Default => &[1 << 10, 1 << 12, 1 << 14, 1 << 16, 1 << 18, 1 << 20],
        }
    }

    /// Lights and pools that grow together: few of both are fast.
    fn pairs(self) -> &'static [(u32, u32)] {
        match self {
            Self::Quick => &[(50, 1 << 10), (200, 1 << 13), (1000, 1 << 16)],
            Self::Default => &[
                (25, 1 << 9),
                (50, 1 << 10),
                (100, 1 << 12),
                (200, 1 << 13),
                (500, 1 << 15),
                (1000, 1 << 16),
                (2000, 1 << 17),
            ],
        }
    }
}

/// The sweep of everything that is compared by time.
pub const TIME: &str = "time";
/// The sweep of the number of virtual surface lights.
pub const VSLS: &str = "vsls";
/// The sweep of the size of the pool.
pub const POOL: &str = "pool";
/// The sweep of kernels and visibilities.
pub const SHADING: &str = "kernel-visibility";
/// The sweep of the ways to sample.
pub const SAMPLING: &str = "sampling";
/// The sweep of threads.
pub const THREADS: &str = "threads";
/// The sweep of the ways in which a graphics device sums lights, and of its shadows.
pub const ACCUMULATION: &str = "accumulation";
/// Lights and pools that grow together, drawn by a graphics device.
pub const GPU: &str = "gpu";
/// The simulator's methods, as the config says.
pub const METHODS: &str = "methods";
/// The scene as its config says.
pub const CONFIG: &str = "config";

/// The ways of shadowing that differ for photon streaming: shadow maps are for methods with fewer lights, and rays on the CPU.
pub fn shadows() -> impl Iterator<Item = Visibility> {
    Visibility::ALL.iter().copied().filter(|&visibility| visibility != Visibility::ShadowMaps)
}

/// All points of a scene but those of path tracing, which go on until the time is over. `base` is the scene as its config
/// says; equal points are measured once. `ways` are those of the graphics device, its default first; none without a device;
/// `few` are the methods of few lights that the scene can have.
pub fn plan(base: &Point, effort: Effort, ways: &[Way], few: &[Point]) -> Vec<Planned> {
    let mut planned: Vec<Planned> = Vec::new();
    let mut add = |sweep: &str, point: Point| {
        let text = point.to_string();
        match planned.iter_mut().find(|p| p.point.to_string() == text) {
            Some(known) if known.sweeps.split(' ').any(|s| s == sweep) => {}
            Some(known) => known.sweeps = format!("{} {sweep}", known.sweeps),
            None => planned.push(Planned { sweeps: sweep.to_owned(), point }),
        }
    };
    add(CONFIG, base.clone());
    for &kernel in Kernel::ALL.iter() {
        for visibility in shadows() {
            add(SHADING, Point { kernel, visibility, ..base.clone() });
        }
    }
    for visibility in shadows() {
        for &(vsls, pool) in effort.pairs() {
            add(TIME, Point { vsls, pool, visibility, ..base.clone() });
        }
    }
    // Discs are the fastest, for the shortest budgets.
    for visibility in [Visibility::None, Visibility::Octahedral] {
        for &(vsls, pool) in effort.pairs() {
            add(TIME, Point { vsls, pool, visibility, kernel: Kernel::Disc, ..base.clone() });
        }
    }
    for &kernel in Kernel::ALL.iter() {
        for &vsls in effort.vsls() {
            add(VSLS, Point { vsls, kernel, ..base.clone() });
        }
    }
    for &pool in effort.pools() {
        add(POOL, Point { pool, ..base.clone() });
    }
    for &sampling in Sampling::ALL {
        add(SAMPLING, Point { sampling, ..base.clone() });
    }
    let threads = std::iter::successors(Some(1), |n| Some(n * 2)).take_while(|&n| n < base.threads);
    for threads in threads.chain([base.threads]) {
        add(THREADS, Point { threads, ..base.clone() });
    }
    for method in [Method::InstantRadiosity, Method::InstantRadiosityBounded] {
        for vsls in effort.vsls().iter().map(|n| n / 4) {
            add(TIME, Point { method, vsls, visibility: Visibility::Rays, ..base.clone() });
        }
    }
    for &vsls in effort.vsls() {
        add(TIME, Point { method: Method::PaperA, vsls, ..base.clone() });
    }
    for point in few {
        add(METHODS, point.clone());
        if few::method_of(point.method).is_none() {
            continue;
        }
        for visibility in [Visibility::None, Visibility::Rays] {
            add(TIME, Point { visibility, ..point.clone() });
        }
        if point.method == Method::FixedPhotons {
            for vsls in effort.vsls().iter().map(|n| n / 4) {
                add(TIME, Point { vsls, visibility: Visibility::Rays, ..point.clone() });
            }
        }
    }
    // Shadow rays go to all lights in one loop: the ways are compared without.
    for way in ways {
        add(ACCUMULATION, on_device(base, way, Visibility::None));
    }
    if let Some(way) = ways.first() {
        for visibility in shadows() {
            add(ACCUMULATION, on_device(base, way, visibility));
        }
        for visibility in [Visibility::None, Visibility::Octahedral, base.visibility] {
            for &(vsls, pool) in effort.pairs() {
                add(GPU, Point { vsls, pool, ..on_device(base, way, visibility) });
            }
        }
    }
    planned
}

fn on_device(base: &Point, way: &Way, visibility: Visibility) -> Point {
    let Way { accumulation, interleave } = way.clone();
    Point { method: Method::PhotonStreamingGpu, accumulation, interleave, visibility, ..base.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base() -> Point {
        Point {
            method: Method::PhotonStreaming,
            vsls: 1000,
            pool: 1 << 16,
            kernel: Kernel::Disc,
            visibility: Visibility::Rays,
            sampling: Sampling::Replay,
            light_samples: 16,
            accumulation: "tiled".into(),
            interleave: 1,
            spp: 64,
            threads: 2,
            seed: 1,
        }
    }

    #[test]
    fn every_kernel_visibility_and_method_is_there_once() {
        let way = |accumulation: &str, interleave| Way { accumulation: accumulation.into(), interleave };
        let ways = [way("tiled", 1), way("tiled", 4), way("splat", 1)];
        let few: Vec<Point> = [Method::StaticVpl, Method::PhantomVpl, Method::FixedPhotons]
            .map(|method| Point { method, ..base() })
            .to_vec();
        let planned = plan(&base(), Effort::Default, &ways, &few);
        let texts: Vec<String> = planned.iter().map(|p| p.point.to_string()).collect();
        for (i, text) in texts.iter().enumerate() {
            assert!(!texts[..i].contains(text), "{text} is measured twice");
        }
        let has = |what: &dyn Fn(&Point) -> bool| planned.iter().any(|p| what(&p.point));
        assert!(Kernel::ALL.iter().all(|&k| has(&|p| p.kernel == k)));
        assert!(shadows().all(|v| has(&|p| p.visibility == v)) && shadows().count() == 4);
        assert!(
            Method::ALL
                .iter()
                .filter(|&&m| !matches!(m, Method::PathTracing | Method::PathTracingDenoised))
                .all(|&m| has(&|p| p.method == m))
        );
        let drawn = |way: &Way| {
            has(&|p| {
                p.method == Method::PhotonStreamingGpu
                    && (p.accumulation.as_str(), p.interleave) == (way.accumulation.as_str(), way.interleave)
            })
        };
        assert!(ways.iter().all(drawn));
        let without = plan(&base(), Effort::Default, &[], &[]);
        assert!(without.iter().all(|p| p.point.method != Method::PhotonStreamingGpu));
        // The config's own point is in every sweep of one setting.
        let own = &planned[0];
        assert_eq!(own.point, base());
        for sweep in [CONFIG, SHADING, TIME, VSLS, POOL, SAMPLING, THREADS] {
            assert!(own.sweeps.split(' ').any(|s| s == sweep), "{sweep}: {}", own.sweeps);
        }
    }
}
