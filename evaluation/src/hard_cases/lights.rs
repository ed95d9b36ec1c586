//! Turns the irradiance of lights, evaluated in f32 and in f64, into error bounds in ulps.

use super::{Figure, Worst, ulps};
use glam::Vec3;
use photonstream_shading::{LightShape, sampling, sobol::Sequence};
use std::f64::consts::PI;

/// Irradiance of point lights, of area lights away from their own plane, and of spots within their inner cone: 1/(4 π r²),
/// cos/(π r²), 1/(π (v_i + v_o) r²). The position's difference is taken in f32, as renderers do: 10 m and farther from
/// the light at coordinates of 10 m, so that it costs an ulp or two. Seed 11; 32 ulps; 160 for area lights, whose samples
/// stand off their surface.
pub(super) fn irradiance(samples: u64) -> Vec<Figure> {
    let mut worst = [Worst::default(); 3];
    let (position, axis) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(2.0, -3.0, 6.0) / 7.0);
    let versine = |degrees: f64| (2.0 * (degrees.to_radians() / 2.0).sin().powi(2)) as f32;
    let (inner, outer) = (versine(60.0), versine(80.0));
    let spot = LightShape::Spot { position, direction: axis, versine_inner: inner, versine_outer: outer };
    let (edge_u, edge_v) = (Vec3::new(0.5, 0.0, 0.25), Vec3::new(0.0, 0.5, 0.125));
    let area = LightShape::Parallelogram { corner: position, edge_u, edge_v };
    let normal = edge_u.as_dvec3().cross(edge_v.as_dvec3()).normalize();
    // A light that says it does not reach the point is infinitely wrong: each is asked where it does.
    let of = |shape: &LightShape, x: Vec3| shape.illuminate(x, [0.5; 2]).map_or(f32::NAN, |i| i.irradiance.x);
    for i in 0..samples {
        let mut sample = Sequence::new(11, 0).sample(i);
        let direction = sampling::sphere(sample.next_2d());
        let x = position + direction * (10.0 + 90.0 * sample.next_1d());
        let d = position.as_dvec3() - x.as_dvec3();
        let r_sq = d.length_squared();
        worst[0].take(ulps(of(&LightShape::Point { position }, x), 1.0 / (4.0 * PI * r_sq)));
        if -d.normalize().dot(axis.as_dvec3()) > 0.51 {
            let exact = 1.0 / (PI * (f64::from(inner) + f64::from(outer)) * r_sq);
            worst[1].take(ulps(of(&spot, x), exact));
        }
        let d = d + (edge_u * 0.5 + edge_v * 0.5).as_dvec3();
        let cos = -d.normalize().dot(normal);
        if cos > 0.1 {
            // The sample stands 2⁻¹⁸ of 3.5 m off its surface, 11 ulps of the distance: twice, and in a cosine of 0.1.
            worst[2].take(ulps(of(&area, x), cos / (PI * d.length_squared())));
        }
    }
    vec![
        Figure::new("point light, ulps", worst[0], 32.0),
        Figure::new("spot, ulps", worst[1], 32.0),
        Figure::new("area light, ulps", worst[2], 160.0),
    ]
}
