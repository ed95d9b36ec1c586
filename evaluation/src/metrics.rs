//! Turns a picture and its reference into figures of error, all in linear radiance.

use glam::Vec3;
use photonstream_film::{Film, FilmError};
use serde::{Deserialize, Serialize};

/// How far picture `a` is from picture `b`, the reference. Every value of every channel counts the same.
///
/// The keys of the serialised form are the fields' names.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// √mean((a−b)²) / mean(b).
    pub rel_rmse: f64,
    /// mean((a−b)² / (b² + 0.01 mean(b)²)): errors weigh by the brightness of their own place.
    pub rel_mse: f64,
    /// mean(a−b) / mean(b), signed: too bright is positive.
    pub bias: f64,
    /// Mean of the largest 1 % of |a−b| (at least one value) / mean(b).
    pub worst_1pct: f64,
    /// mean(a).
    pub mean_a: f64,
    /// mean(b).
    pub mean_b: f64,
}

/// [`Errors`] over all channels and of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Over all three channels at once; its keys stand beside `red`, `green` and `blue`.
    #[serde(flatten)]
    pub whole: Errors,
    /// Of the red channel.
    pub red: Option<Errors>,
    /// Of the green channel.
    pub green: Option<Errors>,
    /// Of the blue channel.
    pub blue: Option<Errors>,
}

/// Why two pictures cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// The pictures differ in size.
    #[error(
        "size: found {found_width} x {found_height}, expected the reference's {width} x {height}; render again with --size {width}x{height}"
    )]
    SizeMismatch {
        /// Width of the picture.
        found_width: u32,
        /// Height of the picture.
        found_height: u32,
        /// Width of the reference.
        width: u32,
        /// Height of the reference.
        height: u32,
    },
    /// A value is infinite or not a number.
    #[error(
        "{picture}, pixel ({x}, {y}): found {value:?}, expected finite values; no figure would mean anything"
    )]
    NotFinite {
        /// `picture` or `reference`.
        picture: &'static str,
        /// Column, from the left.
        x: u32,
        /// Row, from the top.
        y: u32,
        /// The pixel.
        value: [f32; 3],
    },
    /// The reference is black (or darker), so that relative errors do not exist, and the picture differs from it.
    #[error("reference: found a mean of {mean}, expected more than 0; relative errors do not exist")]
    BlackReference {
        /// Mean of the reference.
        mean: f64,
    },
    /// A layer is missing.
    #[error(transparent)]
    Film(#[from] FilmError),
}

/// Compares the layer called `layer` of picture `a` with that of the reference `b`.
///
/// Source: METHODS §8.
///
/// # Errors
/// [`MetricsError`]: size, values that are not finite, a missing layer, a black reference (unless `a` is equal to it:
/// then all errors are 0).
pub fn compare(a: &Film, b: &Film, layer: &str) -> Result<Comparison, MetricsError> {
    compare_pixels(
        (a.width(), a.height(), &a.layer(layer)?.pixels),
        (b.width(), b.height(), &b.layer(layer)?.pixels),
    )
}

/// Compares two pictures given as (width, height, pixels), the second one the reference.
///
/// # Errors
/// As [`compare`].
pub fn compare_pixels(
    (found_width, found_height, a): (u32, u32, &[Vec3]),
    (width, height, b): (u32, u32, &[Vec3]),
) -> Result<Comparison, MetricsError> {
    if (found_width, found_height, a.len()) != (width, height, b.len()) {
        return Err(MetricsError::SizeMismatch { found_width, found_height, width, height });
    }
    for (picture, pixels) in [("picture", a), ("reference", b)] {
        if let Some(index) = pixels.iter().position(|p| !p.is_finite()) {
            let (x, y) = (index as u32 % width, index as u32 / width);
            return Err(MetricsError::NotFinite { picture, x, y, value: pixels[index].to_array() });
        }
    }
    let values =
        |pixels: &[Vec3]| -> Vec<f64> { pixels.iter().flat_map(|p| p.to_array().map(f64::from)).collect() };
    let whole = errors(&values(a), &values(b))?;
    let channel = |c: usize| {
        let values = |pixels: &[Vec3]| -> Vec<f64> { pixels.iter().map(|p| f64::from(p[c])).collect() };
        // One black channel (a red light) is no fault of the picture.
        errors(&values(a), &values(b)).ok()
    };
    Ok(Comparison { whole, red: channel(0), green: channel(1), blue: channel(2) })
}

fn errors(a: &[f64], b: &[f64]) -> Result<Errors, MetricsError> {
    let n = b.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    if mean_b <= 0.0 {
        return if a == b {
            Ok(Errors { rel_rmse: 0.0, rel_mse: 0.0, bias: 0.0, worst_1pct: 0.0, mean_a, mean_b })
        } else {
            Err(MetricsError::BlackReference { mean: mean_b })
        };
    }
    let pairs = || a.iter().zip(b);
    let mse = pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n;
    let floor = 0.01 * mean_b * mean_b;
    let rel_mse = pairs().map(|(a, b)| (a - b).powi(2) / (b * b + floor)).sum::<f64>() / n;
    let mut differences: Vec<f64> = pairs().map(|(a, b)| (a - b).abs()).collect();
    let worst = (differences.len() / 100).max(1);
    differences.select_nth_unstable_by(worst - 1, |x, y| y.total_cmp(x));
    let worst_1pct = differences[..worst].iter().sum::<f64>() / worst as f64 / mean_b;
    let bias = pairs().map(|(a, b)| a - b).sum::<f64>() / n / mean_b;
    Ok(Errors { rel_rmse: mse.sqrt() / mean_b, rel_mse, bias, worst_1pct, mean_a, mean_b })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        // Sums of a few hundred f64 terms of f32 inputs: 1e-6 is the rounding of the inputs.
        assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1e-6), "{found} against {expected}");
    }

    fn row(pixels: &[Vec3]) -> (u32, u32, &[Vec3]) {
        (pixels.len() as u32, 1, pixels)
    }

    #[test]
    fn a_constant_factor_has_closed_forms() {
        // a = 1.1 b with b = 2 everywhere: every relative error is 0.1.
        let b = vec![Vec3::splat(2.0); 200];
        let a = vec![Vec3::splat(2.2); 200];
        let c = compare_pixels(row(&a), row(&b)).unwrap().whole;
        close(c.rel_rmse, 0.1);
        close(c.bias, 0.1);
        close(c.worst_1pct, 0.1);
        close(c.rel_mse, 0.04 / (4.0 + 0.01 * 4.0));
        close(c.mean_a, 2.2);
        close(c.mean_b, 2.0);
    }

    #[test]
    fn one_wrong_pixel_of_a_hundred_is_the_worst_per_cent() {
        let b = vec![Vec3::ONE; 100];
        let mut a = b.clone();
        a[37] = Vec3::splat(0.0);
        let c = compare_pixels(row(&a), row(&b)).unwrap();
        close(c.whole.rel_rmse, 0.1);
        close(c.whole.bias, -0.01);
        close(c.whole.worst_1pct, 1.0);
        close(c.red.unwrap().worst_1pct, 1.0);
    }

    #[test]
    fn channels_are_told_apart() {
        let b = vec![Vec3::new(1.0, 2.0, 0.0); 50];
        let a = vec![Vec3::new(1.0, 3.0, 0.0); 50];
        let c = compare_pixels(row(&a), row(&b)).unwrap();
        close(c.red.unwrap().rel_rmse, 0.0);
        close(c.green.unwrap().bias, 0.5);
        assert_eq!(c.blue.unwrap().rel_rmse, 0.0);
        close(c.whole.bias, 1.0 / 3.0);
        let tinted = vec![Vec3::new(1.0, 2.0, 0.5); 50];
        assert!(compare_pixels(row(&tinted), row(&b)).unwrap().blue.is_none());
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let b = vec![Vec3::ONE; 6];
        let error = compare_pixels((3, 2, &b), (2, 3, &b)).unwrap_err();
        assert!(
            error.to_string().starts_with("size: found 3 x 2, expected the reference's 2 x 3"),
            "{error}"
        );
        let mut bad = b.clone();
        bad[4].z = f32::NAN;
        let error = compare_pixels((3, 2, &bad), (3, 2, &b)).unwrap_err();
        assert!(matches!(error, MetricsError::NotFinite { picture: "picture", x: 1, y: 1, .. }), "{error}");
        let error = compare_pixels((3, 2, &b), (3, 2, &bad)).unwrap_err();
        assert!(matches!(error, MetricsError::NotFinite { picture: "reference", .. }), "{error}");
        let black = vec![Vec3::ZERO; 6];
        assert!(matches!(
            compare_pixels((3, 2, &b), (3, 2, &black)),
            Err(MetricsError::BlackReference { .. })
        ));
        assert_eq!(compare_pixels((3, 2, &black), (3, 2, &black)).unwrap().whole.rel_rmse, 0.0);
    }

    #[test]
    fn keys_are_the_documented_ones() {
        let b = vec![Vec3::ONE; 4];
        let json = serde_json::to_value(compare_pixels(row(&b), row(&b)).unwrap()).unwrap();
        for key in ["rel_rmse", "rel_mse", "bias", "worst_1pct", "mean_a", "mean_b"] {
            assert!(json[key].is_number() && json["green"][key].is_number(), "{key}: {json}");
        }
    }
}
