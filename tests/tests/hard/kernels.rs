//! Turns closed forms evaluated in f32 and in f64 into error bounds in ulps, near-parallel and near-contact ones included.
//!
//! The closed forms, their seeds, limits and the reasons for these are in `evaluation/src/hard_cases`: every evaluation runs
//! them, too, with fewer samples. Here N = 200 000.

use crate::rooms::figure;
use photonstream_evaluation::hard_cases;

const SAMPLES: u64 = 200_000;

/// Runs the closed form of a test of this file, and holds each of its figures to its limit.
#[track_caller]
fn hold(test: &str) {
    let test = format!("tests/tests/hard/kernels.rs::{test}");
    let checked = hard_cases::run(&test, SAMPLES).unwrap_or_else(|| panic!("{test} has no closed form"));
    assert!(!checked.figures.is_empty());
    for found in &checked.figures {
        figure(&found.what, found.found, found.limit);
    }
}

/// Kernels away from the planes of both sides.
#[test]
fn kernels_are_within_ulps_of_double_precision() {
    hold("kernels_are_within_ulps_of_double_precision");
}

/// Receiver or light at grazing angles down to 10⁻⁷.
#[test]
fn grazing_pairs_lose_nothing_but_absolute_ulps() {
    hold("grazing_pairs_lose_nothing_but_absolute_ulps");
}

/// Receiver and light 10⁻¹ to 10⁻⁵ m apart, and at the same point.
#[test]
fn pairs_in_contact_are_as_exact_and_bounded() {
    hold("pairs_in_contact_are_as_exact_and_bounded");
}

/// 10⁻⁴⁵ to 10⁹ m.
#[test]
fn distances_beyond_the_fourth_power_give_numbers() {
    hold("distances_beyond_the_fourth_power_give_numbers");
}

/// Kernel `patch`: polygons above the horizon.
#[test]
fn patches_are_within_ulps_of_double_precision() {
    hold("patches_are_within_ulps_of_double_precision");
}

/// Polygons edge-on, or standing on the horizon, down to 10⁻⁷.
#[test]
fn grazing_patches_lose_nothing_but_absolute_ulps() {
    hold("grazing_patches_lose_nothing_but_absolute_ulps");
}

/// 10⁻¹ to 10⁻⁵ m before a polygon's middle, edge or corner.
#[test]
fn patches_in_contact_are_as_exact_as_their_edges_allow() {
    hold("patches_in_contact_are_as_exact_as_their_edges_allow");
}

/// Slivers 1 : 10⁶.
#[test]
fn patches_that_are_slivers_are_within_ulps() {
    hold("patches_that_are_slivers_are_within_ulps");
}

/// Polygons that the horizon cuts, and where their shadow rays aim.
#[test]
fn patches_across_the_horizon_are_within_ulps() {
    hold("patches_across_the_horizon_are_within_ulps");
}

/// The range within which a light can add ε.
#[test]
fn ranges_are_within_ulps() {
    hold("ranges_are_within_ulps");
}

/// Irradiance of point lights, spots and area lights.
#[test]
fn lights_are_within_ulps_of_double_precision() {
    hold("lights_are_within_ulps_of_double_precision");
}

/// Normals of slivers (1 : 10⁶) far from the origin.
#[test]
fn slivers_have_the_normals_of_double_precision() {
    hold("slivers_have_the_normals_of_double_precision");
}

/// Octahedral directions and camera rays.
#[test]
fn directions_are_within_ulps_of_one() {
    hold("directions_are_within_ulps_of_one");
}
