//! Turns a hit on a triangle into a point from which rays can leave without meeting that triangle again.

use glam::Vec3;

/// How far a ray's origin is moved off its surface, relative to the largest coordinate of the triangle.
///
/// The point's own rounding error is below 4 · 2⁻²⁴ of that coordinate in each axis, and that of the watertight test
/// below 8 · 2⁻²⁴; 64 · 2⁻²⁴ leaves both well behind.
pub const RELATIVE_OFFSET: f32 = 1.0 / (1 << 18) as f32;

/// How far a hit is drawn towards the triangle's centre, as a share of the way: a point that rounding has put on or
/// beyond an edge comes back inside, so that no ray starts behind the neighbouring wall.
pub const INWARD_SHARE: f32 = 1.0 / (1 << 18) as f32;

/// The unit geometric normal of a triangle by its winding, or `None` where it has no area.
///
/// Evaluated in f64, so that slivers and triangles far from the origin get the normal of their rounded vertices
/// exactly to f32.
pub fn normal(v: [Vec3; 3]) -> Option<Vec3> {
    let [a, b, c] = v.map(Vec3::as_dvec3);
    let cross = (b - a).cross(c - a);
    let length = cross.length();
    (length > 0.0 && length.is_finite()).then(|| (cross / length).as_vec3())
}

/// Smallest cosine between a shading normal and the geometric one: 60°. Beyond it a surface is as flat as its triangle.
pub const SHADING_COS: f32 = 0.5;

/// The unit normal that light from the eye's side is weighed by, between the vertex normals `bent`, whose weighted sum it
/// follows; `flat`, the geometric normal, where that sum leads farther off than [`SHADING_COS`] or a vertex has none (zero).
///
/// Twin: `shading_normal` in surface.wgsl.
#[inline]
pub fn shading_normal(flat: Vec3, bent: Vec3) -> Vec3 {
    let length_sq = bent.length_squared();
    let cosine = flat.dot(bent);
    // Neither zero nor NaN is larger.
    if cosine > 0.0 && cosine * cosine > SHADING_COS * SHADING_COS * length_sq {
        bent / length_sq.sqrt()
    } else {
        flat
    }
}

/// The area of a triangle in m².
pub fn area(v: [Vec3; 3]) -> f64 {
    let [a, b, c] = v.map(Vec3::as_dvec3);
    (b - a).cross(c - a).length() * 0.5
}

/// The point of the triangle at barycentric (u, v) (weights of its second and third vertex), drawn inwards by
/// [`INWARD_SHARE`].
#[inline]
pub fn point(vertices: [Vec3; 3], u: f32, v: f32) -> Vec3 {
    let u = u + (1.0 / 3.0 - u) * INWARD_SHARE;
    let v = v + (1.0 / 3.0 - v) * INWARD_SHARE;
    let w = 1.0 - u - v;
    vertices[0] * w + vertices[1] * u + vertices[2] * v
}

/// `point` on the triangle moved off its plane along `normal` (unit, towards the side the ray leaves to).
///
/// Source: the bound of Wächter & Binder, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems
/// 2019, ch. 6; deviates: scaled by the triangle's largest coordinate instead of integer ulps of the point with an
/// absolute offset near zero, so that a scene scaled or moved as a whole behaves alike.
#[inline]
pub fn offset(vertices: [Vec3; 3], point: Vec3, normal: Vec3) -> Vec3 {
    let [a, b, c] = vertices;
    let magnitude = a.abs().max(b.abs()).max(c.abs()).max_element();
    point + normal * (magnitude * RELATIVE_OFFSET)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] =
        [Vec3::new(0.1, 0.7, -0.2), Vec3::new(3.0, 0.4, 0.3), Vec3::new(-0.5, 0.9, 2.2)];

    #[test]
    fn leaves_the_plane_on_the_asked_side_at_every_scale_and_place() {
        for scale in [1e-4f32, 1.0, 1e4] {
            for shift in [Vec3::ZERO, Vec3::new(3000.0, -3000.0, 3000.0)] {
                let t = TRIANGLE.map(|v| v * scale + shift * scale);
                let n = normal(t).unwrap();
                for i in 0..10_000u32 {
                    let [u, v] =
                        crate::sampling::triangle([crate::sobol::van_der_corput(i), i as f32 / 10_000.0]);
                    for side in [1.0, -1.0] {
                        let p = offset(t, point(t, u, v), n * side);
                        let height = (p.as_dvec3() - t[0].as_dvec3()).dot(n.as_dvec3()) * f64::from(side);
                        let magnitude = t.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max);
                        let nominal = f64::from(magnitude * RELATIVE_OFFSET);
                        assert!(
                            height > nominal * 0.5 && height < nominal * 1.5,
                            "{height:e} of {nominal:e}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn corners_and_edges_are_drawn_inside() {
        let t = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.0, 0.3), (-1e-7, 0.5)] {
            let p = point(t, u, v);
            assert!(p.x > 0.0 && p.y > 0.0 && p.x + p.y < 1.0, "{u} {v}: {p}");
        }
    }

    #[test]
    fn slivers_have_a_normal_and_flat_triangles_none() {
        let n = normal([Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-6, 0.0)]).unwrap();
        assert!((n - Vec3::Z).length() < 1e-6);
        assert_eq!(normal([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]), None);
        assert_eq!(normal([Vec3::ONE; 3]), None);
        assert_eq!(area([Vec3::ZERO, Vec3::X, Vec3::Y]), 0.5);
    }

    /// Up to 60° the sum of the corners' normals is followed, at unit length; farther off, and without any, the triangle is flat.
    #[test]
    fn shading_normals_stay_near_the_triangles() {
        for degrees in [0.0f32, 1.0, 30.0, 59.9] {
            let (s, c) = degrees.to_radians().sin_cos();
            let bent = Vec3::new(s, 0.0, c);
            for length in [1e-6, 0.3, 1.0] {
                assert!(
                    (shading_normal(Vec3::Z, bent * length) - bent).length() < 2.0 * f32::EPSILON,
                    "{degrees}"
                );
            }
        }
        let (s, c) = 60.1f32.to_radians().sin_cos();
        for bent in [Vec3::ZERO, Vec3::NAN, Vec3::NEG_Z, Vec3::new(s, 0.0, c), Vec3::X] {
            assert_eq!(shading_normal(Vec3::Z, bent), Vec3::Z, "{bent}");
        }
    }
}
