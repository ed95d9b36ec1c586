//! Turns what is known to break renderers into a table, and its closed forms into figures measured here and now.
//!
//! [`cases`] reads `tests/hard-cases.md`, which the program carries with it. [`CLOSED_FORMS`] are those of its rows that need
//! no scene and take milliseconds: the test suite runs them with many samples, every evaluation with fewer.

mod kernels;
mod lights;
mod patch;
mod surfaces;
mod table;

pub use table::{HardCase, cases};

use serde::{Deserialize, Serialize};

/// Samples of each closed form in an evaluation.
pub const SAMPLES: u64 = 20_000;

/// A figure that is held to a limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// What it is, with its unit.
    pub what: String,
    /// What was found; infinite where a result was no number, or negative light.
    pub found: f64,
    /// The most that it may be.
    pub limit: f64,
}

impl Figure {
    fn new(what: impl Into<String>, found: Worst, limit: f64) -> Self {
        Self { what: what.into(), found: found.0, limit }
    }

    /// Whether it is within its limit.
    pub fn holds(&self) -> bool {
        self.found <= self.limit
    }
}

/// A hard case that has an exact answer: f32 against f64.
#[derive(Clone, Copy, Debug)]
pub struct ClosedForm {
    /// The test that runs it with more samples, as `tests/hard-cases.md` names it.
    pub test: &'static str,
    /// Its figures, from so many samples.
    pub run: fn(u64) -> Vec<Figure>,
}

/// A closed form and what an evaluation found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checked {
    /// The test that runs it with more samples.
    pub test: String,
    /// Samples that were taken here.
    pub samples: u64,
    /// What was found.
    pub figures: Vec<Figure>,
}

impl Checked {
    /// Whether every figure is within its limit.
    pub fn holds(&self) -> bool {
        !self.figures.is_empty() && self.figures.iter().all(Figure::holds)
    }
}

macro_rules! closed_forms {
    ($($test:ident = $run:path,)+) => {
        &[$(ClosedForm { test: concat!("tests/tests/hard/kernels.rs::", stringify!($test)), run: $run }),+]
    };
}

/// All closed forms.
pub const CLOSED_FORMS: &[ClosedForm] = closed_forms! {
    kernels_are_within_ulps_of_double_precision = kernels::away_from_the_planes,
    grazing_pairs_lose_nothing_but_absolute_ulps = kernels::near_parallel,
    pairs_in_contact_are_as_exact_and_bounded = kernels::near_contact,
    distances_beyond_the_fourth_power_give_numbers = kernels::extreme_distances,
    patches_are_within_ulps_of_double_precision = patch::random_polygons,
    grazing_patches_lose_nothing_but_absolute_ulps = patch::near_parallel,
    patches_in_contact_are_as_exact_as_their_edges_allow = patch::near_contact,
    patches_that_are_slivers_are_within_ulps = patch::slivers,
    patches_across_the_horizon_are_within_ulps = patch::across_the_horizon,
    ranges_are_within_ulps = kernels::ranges,
    lights_are_within_ulps_of_double_precision = lights::irradiance,
    slivers_have_the_normals_of_double_precision = surfaces::slivers,
    directions_are_within_ulps_of_one = surfaces::directions,
};

/// Runs the closed form that the test called `test` runs.
pub fn run(test: &str, samples: u64) -> Option<Checked> {
    let form = CLOSED_FORMS.iter().find(|form| form.test == test)?;
    Some(Checked { test: form.test.into(), samples, figures: (form.run)(samples) })
}

/// 2⁻²³: the distance from 1 to the next f32.
const EPS: f64 = f32::EPSILON as f64;

/// The largest of many errors; one that is no number counts as infinite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Worst(f64);

impl Worst {
    fn take(&mut self, error: f64) {
        self.0 = if error.is_nan() { f64::INFINITY } else { self.0.max(error) };
    }

    /// Takes `error` of `found`; light that is negative or no number is infinitely wrong.
    fn take_light(&mut self, found: f32, error: f64) {
        self.take(if found >= 0.0 && found.is_finite() { error } else { f64::INFINITY });
    }
}

/// Ulps of f32 (2⁻²³, relative) by which `found` differs from `exact`.
fn ulps(found: f32, exact: f64) -> f64 {
    (f64::from(found) - exact).abs() / (exact.abs() * EPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_fails() {
        let mut worst = Worst::default();
        worst.take(2.0);
        worst.take(f64::NAN);
        worst.take(1.0);
        assert!(!Figure::new("x", worst, 1e300).holds());
        let mut worst = Worst::default();
        worst.take_light(-1e-30, 0.0);
        assert!(!Figure::new("x", worst, 1e300).holds());
        assert!(!Checked { test: String::new(), samples: 0, figures: vec![] }.holds());
        assert_eq!(ulps(1.0 + f32::EPSILON, 1.0), 1.0);
    }

    #[test]
    fn every_closed_form_is_a_row_of_the_table() {
        for form in CLOSED_FORMS {
            assert!(cases().iter().any(|case| case.test == form.test), "{}", form.test);
        }
    }
}
