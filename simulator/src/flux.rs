//! Turns deposits into the flux of virtual surface lights, exactly: sums of integers, in any order, always reversible.
//!
//! A path carries a dimensionless throughput per channel, 1 at birth for a mean sample; watts come in when flux is
//! read. A deposit is the throughput in quanta of 2⁻²⁴. The sums cannot overflow an i64: a deposit is at most
//! [`MAX_THROUGHPUT`] = 4 = 2²⁶ quanta, a path makes at most [`MAX_DEPOSITS`] = 2¹³ of them, a pool holds at most 2²³
//! paths, and 26 + 13 + 23 = 62 < 63. Sums of squares, in quanta of (2⁻¹¹)², stay below 2 · 13 + 13 + 23 = 62 bits, too.

use glam::{DVec3, Vec3};

/// Largest throughput a path may reach; beyond it is cut and counted as truncated.
pub const MAX_THROUGHPUT: f32 = 4.0;

/// Most deposits of a path; beyond it is cut and counted as truncated.
pub const MAX_DEPOSITS: usize = 1 << 13;

/// One deposit's quantum of throughput.
pub const QUANTUM: f64 = 1.0 / (1u32 << 24) as f64;

/// What a path left on one virtual surface light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Deposit {
    /// The light.
    pub vsl: u32,
    /// Throughput per channel, in quanta of 2⁻²⁴; not negative.
    pub rgb: [i32; 3],
}

impl Deposit {
    /// The deposit of `throughput` (each channel finite, in [0, [`MAX_THROUGHPUT`]]); `None` where it rounds to nothing.
    #[inline]
    pub fn new(vsl: u32, throughput: Vec3) -> Option<Self> {
        let quanta = throughput * (1u32 << 24) as f32 + Vec3::splat(0.5);
        let rgb = [quanta.x as i32, quanta.y as i32, quanta.z as i32];
        (rgb != [0; 3]).then_some(Self { vsl, rgb })
    }

    /// The deposit times `factor`, at most [`MAX_THROUGHPUT`].
    pub(crate) fn scaled(&self, factor: Vec3) -> Self {
        let [r, g, b] = self.rgb.map(f64::from);
        let most = f64::from(MAX_THROUGHPUT) / QUANTUM;
        let quanta = (DVec3::new(r, g, b) * factor.as_dvec3()).round().min(DVec3::splat(most));
        Self { vsl: self.vsl, rgb: quanta.to_array().map(|q| q as i32) }
    }

    /// Square of the mean channel, in quanta of (2⁻¹¹)².
    #[inline]
    fn square(&self) -> i64 {
        let mean = (i64::from(self.rgb[0]) + i64::from(self.rgb[1]) + i64::from(self.rgb[2])) / 3;
        let coarse = mean >> 13;
        coarse * coarse
    }
}

/// Sums over the deposits on one virtual surface light within one column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct Cell {
    /// Throughput per channel, in quanta of 2⁻²⁴.
    pub rgb: [i64; 3],
    /// Squares of the deposits' mean channel, in quanta of (2⁻¹¹)².
    pub squares: i64,
    /// Number of deposits.
    pub count: i64,
    /// Births of the deposits' paths, in ms since the simulation started; 32 + 36 bits, hence wider.
    pub births_ms: i128,
}

/// The flux of all virtual surface lights, a column for each light or group of lights.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VslFlux {
    vsls: usize,
    /// Column-major: all lights of the first column, then of the second.
    cells: Vec<Cell>,
}

/// Flux, its uncertainty and its age, of one virtual surface light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FluxReading {
    /// Flux that leaves the light's patch, in W.
    pub flux: Vec3,
    /// Standard error of the flux's mean channel in W, as if paths were independent; stratified samples have less.
    pub standard_error: f32,
    /// Mean birth of the paths behind it, in ms since the simulation started; `None` where there are none.
    pub mean_birth_ms: Option<f64>,
}

/// What one unit of a column's mean path stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnScale {
    /// Watts per unit, linear RGB.
    pub watts: Vec3,
    /// Number of paths the column's deposits come from.
    pub paths: u32,
}

impl VslFlux {
    /// No flux, for `vsls` lights and `columns` columns.
    pub fn new(vsls: usize, columns: usize) -> Self {
        Self { vsls, cells: vec![Cell::default(); vsls * columns] }
    }

    /// Number of virtual surface lights.
    pub fn vsls(&self) -> usize {
        self.vsls
    }

    /// The sums of one column.
    pub fn column(&self, column: u32) -> &[Cell] {
        let start = column as usize * self.vsls;
        &self.cells[start..start + self.vsls]
    }

    /// Adds the deposits of a path born at `birth_ms`.
    #[inline]
    pub fn add(&mut self, column: u32, deposits: &[Deposit], birth_ms: u32) {
        self.apply(column, deposits, birth_ms, |sum, x| sum + x, |sum, x| sum + x);
    }

    /// Takes back what [`VslFlux::add`] added with the same arguments: exactly.
    #[inline]
    pub fn subtract(&mut self, column: u32, deposits: &[Deposit], birth_ms: u32) {
        self.apply(column, deposits, birth_ms, |sum, x| sum - x, |sum, x| sum - x);
    }

    #[inline]
    fn apply(
        &mut self,
        column: u32,
        deposits: &[Deposit],
        birth_ms: u32,
        op: impl Fn(i64, i64) -> i64,
        wide: impl Fn(i128, i128) -> i128,
    ) {
        let start = column as usize * self.vsls;
        let cells = &mut self.cells[start..start + self.vsls];
        for deposit in deposits {
            let cell = &mut cells[deposit.vsl as usize];
            for channel in 0..3 {
                cell.rgb[channel] = op(cell.rgb[channel], i64::from(deposit.rgb[channel]));
            }
            cell.squares = op(cell.squares, deposit.square());
            cell.count = op(cell.count, 1);
            cell.births_ms = wide(cell.births_ms, i128::from(birth_ms));
        }
    }

    /// Adds the first column of `other` to one of these.
    pub(crate) fn merge(&mut self, column: u32, other: &Self) {
        let start = column as usize * self.vsls;
        for (cell, more) in self.cells[start..start + self.vsls].iter_mut().zip(other.column(0)) {
            *cell = *cell + *more;
        }
    }

    /// Makes a column empty.
    pub(crate) fn clear(&mut self, column: u32) {
        let start = column as usize * self.vsls;
        self.cells[start..start + self.vsls].fill(Cell::default());
    }

    /// Flux of light `vsl` over all columns. A column without paths or without power adds exactly nothing.
    pub fn read(&self, vsl: u32, scales: &[ColumnScale]) -> FluxReading {
        self.read_with(None, vsl, scales)
    }

    /// [`VslFlux::read`] of this and `more` together; `scales` count the paths of both.
    pub(crate) fn read_with(&self, more: Option<&Self>, vsl: u32, scales: &[ColumnScale]) -> FluxReading {
        let mut flux = DVec3::ZERO;
        let mut variance = 0.0;
        let (mut count, mut births) = (0i64, 0i128);
        for (column, scale) in scales.iter().enumerate().filter(|(_, s)| s.paths > 0) {
            let cell = self.cell(more, column, vsl);
            let paths = f64::from(scale.paths);
            let watts = scale.watts.as_dvec3();
            let [r, g, b] = cell.rgb.map(|sum| sum as f64 * QUANTUM / paths);
            let mean = DVec3::new(r, g, b);
            flux += watts * mean;
            variance += cell.variance(scale);
            count += cell.count;
            births += cell.births_ms;
        }
        let mean_birth_ms = (count > 0).then(|| births as f64 / count as f64);
        FluxReading { flux: flux.as_vec3(), standard_error: variance.sqrt() as f32, mean_birth_ms }
    }

    fn cell(&self, more: Option<&Self>, column: usize, vsl: u32) -> Cell {
        let index = column * self.vsls + vsl as usize;
        more.map_or(self.cells[index], |more| self.cells[index] + more.cells[index])
    }

    /// How uncertain this and `more` together are; `scales` count the paths of both.
    pub(crate) fn errors(&self, more: Option<&Self>, scales: &[ColumnScale]) -> FluxErrors {
        let mut sums = FluxErrors { variances: vec![0.0; scales.len()], errors: 0.0, flux: 0.0 };
        for vsl in 0..self.vsls as u32 {
            let mut variance = 0.0;
            for (column, scale) in scales.iter().enumerate().filter(|(_, s)| s.paths > 0) {
                let cell = self.cell(more, column, vsl);
                let own = cell.variance(scale);
                sums.variances[column] += own;
                variance += own;
                sums.flux += cell.mean_watts(scale);
            }
            sums.errors += variance.sqrt();
        }
        sums
    }
}

/// Sums over all virtual surface lights.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FluxErrors {
    /// Variance of the flux in W², by column.
    pub(crate) variances: Vec<f64>,
    /// Standard errors, W.
    errors: f64,
    /// Mean channels of the flux, W.
    flux: f64,
}

impl FluxErrors {
    /// The relative standard error of a light's flux, in the mean over lights weighted by flux; 0 where there is no flux.
    pub(crate) fn relative(&self) -> f64 {
        if self.flux > 0.0 { self.errors / self.flux } else { 0.0 }
    }
}

impl Cell {
    /// Mean channel of its flux in W.
    fn mean_watts(&self, scale: &ColumnScale) -> f64 {
        let watts = scale.watts.as_dvec3();
        let [r, g, b] = self.rgb.map(|sum| sum as f64 * QUANTUM / f64::from(scale.paths));
        (watts * DVec3::new(r, g, b)).element_sum() / 3.0
    }

    /// Variance of the mean channel of its flux in W².
    fn variance(&self, scale: &ColumnScale) -> f64 {
        let paths = f64::from(scale.paths);
        let [r, g, b] = self.rgb.map(|sum| sum as f64 * QUANTUM / paths);
        let mean_channel = (r + g + b) / 3.0;
        let mean_square = self.squares as f64 * (QUANTUM * QUANTUM * (1u64 << 26) as f64) / paths;
        let mean_watts = scale.watts.as_dvec3().element_sum() / 3.0;
        mean_watts * mean_watts * (mean_square - mean_channel * mean_channel).max(0.0) / paths
    }
}

impl std::ops::Add for Cell {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            rgb: [0, 1, 2].map(|i| self.rgb[i] + other.rgb[i]),
            squares: self.squares + other.squares,
            count: self.count + other.count,
            births_ms: self.births_ms + other.births_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deposits_are_exact_to_a_quantum_and_vanish_below_half_of_one() {
        assert_eq!(
            Deposit::new(3, Vec3::new(1.0, 0.5, 0.0)),
            Some(Deposit { vsl: 3, rgb: [1 << 24, 1 << 23, 0] })
        );
        assert_eq!(Deposit::new(0, Vec3::splat(0.49 * QUANTUM as f32)), None);
        assert_eq!(Deposit::new(0, Vec3::splat(MAX_THROUGHPUT)).unwrap().rgb, [1 << 26; 3]);
    }

    /// The stated bound: a full pool of the longest paths of the largest deposits stays within i64.
    #[test]
    fn the_largest_sums_fit() {
        let largest = Deposit { vsl: 0, rgb: [1 << 26; 3] };
        let paths = i128::from(photonstream_scene::StreamingSettings::MAX_POOL_PATHS);
        let times = paths * MAX_DEPOSITS as i128;
        assert!(i128::from(largest.rgb[0]) * times <= i128::from(i64::MAX));
        assert!(i128::from(largest.square()) * times <= i128::from(i64::MAX));
    }

    #[test]
    fn subtraction_is_exact_and_no_power_is_no_flux() {
        let mut flux = VslFlux::new(2, 2);
        let empty = flux.clone();
        let path = [Deposit { vsl: 1, rgb: [5, 7, 11] }, Deposit { vsl: 0, rgb: [1, 0, 3] }];
        flux.add(1, &path, 40);
        let scale = |watts| ColumnScale { watts, paths: 2 };
        let read = flux.read(1, &[scale(Vec3::ZERO), scale(Vec3::ONE)]);
        assert_eq!(read.flux, Vec3::new(2.5, 3.5, 5.5) * QUANTUM as f32);
        assert_eq!(read.mean_birth_ms, Some(40.0));
        assert_eq!(flux.read(1, &[scale(Vec3::ONE), scale(Vec3::ZERO)]).flux, Vec3::ZERO);
        flux.subtract(1, &path, 40);
        assert_eq!(flux, empty);
    }

    /// Of N = 4096 paths a quarter deposit 1: mean 1/4, variance 3/16 by hand.
    #[test]
    fn standard_error_is_that_of_independent_paths() {
        let mut flux = VslFlux::new(1, 1);
        for _ in 0..1024 {
            flux.add(0, &[Deposit::new(0, Vec3::ONE).unwrap()], 0);
        }
        let read = flux.read(0, &[ColumnScale { watts: Vec3::splat(2.0), paths: 4096 }]);
        assert!((read.flux.x - 0.5).abs() < 1e-6);
        let exact = 2.0 * (3.0f32 / 16.0 / 4096.0).sqrt();
        assert!((read.standard_error / exact - 1.0).abs() < 1e-5);
    }
}
