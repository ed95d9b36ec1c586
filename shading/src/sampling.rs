//! Turns uniform numbers in [0, 1) into directions and points of a stated density.

use crate::basis;
use core::f32::consts::{PI, TAU};
use glam::{Vec2, Vec3};

/// The largest f32 below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// A direction uniform over the sphere; `pdf_solid_angle` = 1/(4π).
#[inline]
pub fn sphere(u: [f32; 2]) -> Vec3 {
    // The versine 1 - cos θ is uniform; sin θ from it is exact at both poles.
    around_z(2.0 * u[0], u[1])
}

/// A direction uniform in the cone of versine (1 - cos of the half angle) `versine_max` around `axis`;
/// `pdf_solid_angle` = 1/(2π `versine_max`).
///
/// The versine, not the cosine, keeps cones of a hundredth of a degree exact in f32.
#[inline]
pub fn cone(axis: Vec3, versine_max: f32, u: [f32; 2]) -> Vec3 {
    basis::from_local(axis, around_z(u[0] * versine_max, u[1])).normalize()
}

/// A direction of the hemisphere around `n` with `pdf_solid_angle` = cos θ/π.
///
/// Source: Malley's method over the polar disc map; cos θ is taken from the same random number, so that the
/// density is exact and the direction never points below the surface.
#[inline(always)]
pub fn cosine_hemisphere(n: Vec3, u: [f32; 2]) -> Vec3 {
    let r = u[0].sqrt();
    let (sin_phi, cos_phi) = sin_cos_turn(u[1]);
    let cos_theta = (1.0 - u[0]).max(0.0).sqrt();
    basis::from_local(n, Vec3::new(r * cos_phi, r * sin_phi, cos_theta))
}

/// Vectors by component, all of equal length.
#[derive(Clone, Debug, Default)]
pub struct Vectors {
    /// First components.
    pub x: Vec<f32>,
    /// Second components.
    pub y: Vec<f32>,
    /// Third components.
    pub z: Vec<f32>,
}

impl Vectors {
    /// Empties the list.
    pub fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
        self.z.clear();
    }

    /// Adds a vector.
    #[inline]
    pub fn push(&mut self, v: Vec3) {
        self.x.push(v.x);
        self.y.push(v.y);
        self.z.push(v.z);
    }

    /// Vector `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Vec3 {
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }
}

/// Replaces each normal by [`cosine_hemisphere`] of it and its two random numbers, eight at a time where the processor
/// can: the same to the last bit, as every operation is rounded on its own.
///
/// # Panics
/// If the lists are of unequal length.
pub fn cosine_hemispheres(normals: &mut Vectors, u: &[f32], v: &[f32]) {
    let n = u.len();
    let (x, y, z) = (&mut normals.x[..n], &mut normals.y[..n], &mut normals.z[..n]);
    let v = &v[..n];
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for i in 0..n {
                let d = cosine_hemisphere(Vec3::new(x[i], y[i], z[i]), [u[i], v[i]]);
                (x[i], y[i], z[i]) = (d.x, d.y, d.z);
            }
        },
    );
}

/// A point uniform in the unit disc; `pdf_area` = 1/π.
#[inline]
pub fn disc(u: [f32; 2]) -> Vec2 {
    let r = u[0].sqrt();
    let (sin_phi, cos_phi) = sin_cos_turn(u[1]);
    Vec2::new(r * cos_phi, r * sin_phi)
}

/// Barycentric coordinates (u, v) uniform over a triangle; `pdf_area` = 1/area.
///
/// Source: Heitz, "A Low-Distortion Map Between Triangle and Square", 2019: keeps stratification.
#[inline]
pub fn triangle(u: [f32; 2]) -> [f32; 2] {
    if u[1] > u[0] {
        let x = u[0] * 0.5;
        [x, u[1] - x]
    } else {
        let y = u[1] * 0.5;
        [u[0] - y, y]
    }
}

/// `pdf_solid_angle` of [`sphere`].
pub const PDF_SPHERE: f32 = 1.0 / (4.0 * PI);

/// Sine and cosine of `turn` full turns, `turn` in [0, 1); relative to 1, the error is below 2⁻²².
///
/// The same polynomial on every machine (a libm may differ), and vectorisable: photons land on the same triangle
/// everywhere.
#[inline(always)]
pub fn sin_cos_turn(turn: f32) -> (f32, f32) {
    // Quadrant and remainder in [-1/8, 1/8] turns; the product and the difference are exact in f32. Truncation is the
    // floor here, and needs no call where the processor lacks a rounding instruction.
    let quadrant = (turn * 4.0 + 0.5) as i32;
    let x = (turn - quadrant as f32 * 0.25) * TAU;
    let x2 = x * x;
    // Taylor terms to x⁹ and x⁸: the first omitted ones are 1.8e-9 and 2.5e-8 at π/4.
    let s =
        x * (1.0 + x2 * (-1.0 / 6.0 + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5040.0 + x2 * (1.0 / 362_880.0)))));
    let c = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    // Odd quadrants swap the two, and two of four negate each: by bits, as a branch would be mispredicted half the time.
    let quadrant = quadrant as u32;
    let swap = (quadrant & 1).wrapping_neg();
    let (s, c) = (s.to_bits(), c.to_bits());
    let sin = ((c & swap) | (s & !swap)) ^ ((quadrant & 2) << 30);
    let cos = ((s & swap) | (c & !swap)) ^ (((quadrant + 1) & 2) << 30);
    (f32::from_bits(sin), f32::from_bits(cos))
}

#[inline]
fn around_z(versine: f32, turn: f32) -> Vec3 {
    let sin_theta = (versine * (2.0 - versine)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = sin_cos_turn(turn);
    Vec3::new(sin_theta * cos_phi, sin_theta * sin_phi, 1.0 - versine)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counter-based uniform numbers: independent of the Sobol code under test elsewhere.
    fn uniform(i: u64, dimension: u64) -> f32 {
        let mut z =
            (i << 8 | dimension).wrapping_add(0x9E37_79B9_7F4A_7C15).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u32 << 24) as f32
    }

    const SAMPLES: u64 = 400_000;
    const BINS: usize = 16;

    /// χ² of samples in a BINS × BINS table of equal probability, 255 degrees of freedom. The limit is the mean plus
    /// 5 σ (σ = √510): a correct sampler fails with probability below 1e-5.
    fn chi_squared(name: &str, bin: impl Fn([f32; 2]) -> [f32; 2]) {
        let mut counts = vec![0u32; BINS * BINS];
        for i in 0..SAMPLES {
            let [a, b] = bin([uniform(i, 0), uniform(i, 1)]);
            assert!((-1e-5..=1.00001).contains(&a) && (-1e-5..=1.00001).contains(&b), "{name}: {a} {b}");
            let index = |x: f32| ((x * BINS as f32) as usize).min(BINS - 1);
            counts[index(a) * BINS + index(b)] += 1;
        }
        let expected = SAMPLES as f64 / (BINS * BINS) as f64;
        let chi2: f64 = counts.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
        let freedom = (BINS * BINS - 1) as f64;
        assert!(
            chi2 < freedom + 5.0 * (2.0 * freedom).sqrt(),
            "{name}: χ² = {chi2:.1} for {freedom} degrees"
        );
    }

    fn turn(x: f32, y: f32) -> f32 {
        (y.atan2(x) / TAU).rem_euclid(1.0)
    }

    // Each test maps a sample back to two numbers which are uniform and independent if its density is the stated one.
    #[test]
    fn sphere_follows_its_density() {
        chi_squared("sphere", |u| {
            let d = sphere(u);
            assert!((d.length() - 1.0).abs() < 4e-7);
            [(1.0 - d.z) / 2.0, turn(d.x, d.y)]
        });
    }

    #[test]
    fn cosine_hemisphere_follows_its_density() {
        for n in [Vec3::Z, Vec3::NEG_Z, Vec3::new(0.6, -0.48, 0.64)] {
            chi_squared("cosine", |u| {
                let d = cosine_hemisphere(n, u);
                let (t, b) = basis::tangents(n);
                let cos_theta = d.dot(n);
                assert!(cos_theta > -1e-6);
                [(cos_theta * cos_theta).min(1.0), turn(d.dot(t), d.dot(b))]
            });
        }
    }

    #[test]
    fn many_hemispheres_are_what_each_is() {
        let (mut normals, mut u, mut v) = (Vectors::default(), vec![], vec![]);
        for i in 0..10_007 {
            normals.push(sphere([uniform(i, 0), uniform(i, 1)]));
            u.push(uniform(i, 2));
            v.push(uniform(i, 3));
        }
        let one_by_one: Vec<Vec3> =
            (0..u.len()).map(|i| cosine_hemisphere(normals.get(i), [u[i], v[i]])).collect();
        cosine_hemispheres(&mut normals, &u, &v);
        assert!(one_by_one.iter().enumerate().all(|(i, &d)| d == normals.get(i)));
    }

    #[test]
    fn cone_follows_its_density_down_to_a_tenth_of_a_degree() {
        for half_angle in [0.05f64, 1.0, 45.0, 90.0, 180.0] {
            let versine_max = (2.0 * (half_angle.to_radians() / 2.0).sin().powi(2)) as f32;
            let axis = Vec3::new(2.0, 3.0, -6.0) / 7.0;
            chi_squared("cone", |u| {
                let d = cone(axis, versine_max, u);
                let (t, b) = basis::tangents(axis);
                let versine = (d - axis).length_squared() / 2.0;
                // The 0.05° cone spans 7 000 ulps of the axis: the rounding of d moves a sample by 1e-4 of a bin at most.
                [(versine / versine_max).min(1.0), turn(d.dot(t), d.dot(b))]
            });
        }
    }

    #[test]
    fn disc_follows_its_density() {
        chi_squared("disc", |u| {
            let p = disc(u);
            [p.length_squared().min(1.0), turn(p.x, p.y)]
        });
    }

    #[test]
    fn triangle_follows_its_density() {
        chi_squared("triangle", |u| {
            let [a, b] = triangle(u);
            assert!(a >= 0.0 && b >= 0.0 && a + b <= 1.0 + f32::EPSILON);
            // Of a uniform point, 1 - (1-a)² and b/(1-a) are uniform and independent.
            [1.0 - (1.0 - a) * (1.0 - a), (b / (1.0 - a).max(1e-9)).min(1.0)]
        });
    }

    #[test]
    fn sine_and_cosine_are_within_their_bound() {
        for i in 0..(1 << 20) {
            let turn = i as f32 / (1 << 20) as f32;
            let (s, c) = sin_cos_turn(turn);
            let (s64, c64) = (f64::from(turn) * core::f64::consts::TAU).sin_cos();
            let bound = 2f64.powi(-22);
            assert!((f64::from(s) - s64).abs() < bound && (f64::from(c) - c64).abs() < bound, "turn {turn}");
        }
    }
}
