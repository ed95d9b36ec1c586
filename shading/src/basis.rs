//! Turns a unit normal into an orthonormal basis.

use glam::Vec3;

/// Two unit tangents which with `n` form a right-handed basis (`t × b = n`).
///
/// `n` must have unit length. Continuous except across `n.z = 0`; well defined at both poles.
///
/// Source: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
#[inline(always)]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// A vector given in the basis of `n` (`local.z` along `n`) in the space of `n`.
#[inline(always)]
pub fn from_local(n: Vec3, local: Vec3) -> Vec3 {
    let (t, b) = tangents(n);
    t * local.x + b * local.y + n * local.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling;

    fn check(n: Vec3) {
        let (t, b) = tangents(n);
        // 4 ulps of 1: each component is a product of at most three rounded numbers of magnitude ≤ 1.
        let tolerance = 4.0 * f32::EPSILON;
        for value in [t.length() - 1.0, b.length() - 1.0, t.dot(b), t.dot(n), b.dot(n)] {
            assert!(value.abs() <= tolerance, "n = {n}: {value:e}");
        }
        assert!((t.cross(b) - n).length() <= 2.0 * tolerance, "n = {n}: left-handed");
    }

    #[test]
    fn is_orthonormal_at_the_poles_and_beside_them() {
        for z in [1.0f32, -1.0] {
            check(Vec3::new(0.0, 0.0, z));
            check(Vec3::new(-0.0, 0.0, z));
            for exponent in 1..12 {
                let x = 10f32.powi(-exponent);
                check(Vec3::new(x, -x, z).normalize());
                check(Vec3::new(1.0, x, z * x).normalize());
            }
        }
        check(Vec3::X);
        check(Vec3::NEG_Y);
        check(Vec3::new(1.0, 0.0, -0.0));
    }

    #[test]
    fn is_orthonormal_over_the_sphere() {
        for i in 0..100_000u32 {
            let u = [crate::sobol::van_der_corput(i), (i as f32 * 0.618_034).fract()];
            check(sampling::sphere(u).normalize());
        }
    }
}
