//! Turns the parameters of a shape into a mesh around the shape's own origin, normals outwards.

mod cuboid;
mod quad;
mod sphere;
mod torus_knot;

pub(crate) use cuboid::cuboid;
pub(crate) use quad::quad;
pub(crate) use sphere::sphere;
pub(crate) use torus_knot::{TorusKnot, torus_knot};

use glam::{DVec3, Vec2, Vec3};
use std::ops::Range;

/// A triangle mesh in an object's own coordinates, m; counter-clockwise seen from the front.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the vertices, rows counted from the top; none at all for most meshes.
    pub(crate) uvs: Vec<Vec2>,
    /// Unit shading normals of the vertices, zero where one has none; none at all for flat meshes.
    pub(crate) normals: Vec<Vec3>,
}

impl Mesh {
    /// Adds vertices, each with its texture coordinates and its shading normal where `uvs` and `normals` have them; the mesh's
    /// others get zeros.
    pub(crate) fn append(&mut self, vertices: Vec<DVec3>, uvs: &[Vec2], normals: &[Vec3]) {
        let first = self.vertices.len();
        self.vertices.extend(vertices);
        extend(&mut self.uvs, uvs, first..self.vertices.len());
        extend(&mut self.normals, normals, first..self.vertices.len());
    }
}

/// Gives the vertices of a part of a mesh their attributes, if it has any; those of other parts have zeros.
pub(crate) fn extend<T: Clone + Default>(all: &mut Vec<T>, own: &[T], vertices: Range<usize>) {
    if !own.is_empty() || !all.is_empty() {
        all.resize(vertices.start, T::default());
        all.extend_from_slice(own);
        all.resize(vertices.end, T::default());
    }
}

/// Sine and cosine of `turn` full turns; exact at multiples of a quarter, so that right angles stay right.
pub(crate) fn sin_cos_turn(turn: f64) -> (f64, f64) {
    let quarters = turn * 4.0;
    let nearest = quarters.round();
    let (s, c) = ((quarters - nearest) * std::f64::consts::FRAC_PI_2).sin_cos();
    match nearest.rem_euclid(4.0) as u8 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{collections::HashMap, f64::consts::PI};

    /// Surface area, and volume by Gauss's theorem: positive where normals point outwards.
    fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
        mesh.triangles.iter().fold((0.0, 0.0), |(area, volume), t| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            (area + (b - a).cross(c - a).length() / 2.0, volume + a.dot(b.cross(c)) / 6.0)
        })
    }

    /// Every directed edge occurs once, and its reverse too: closed, and wound alike everywhere.
    fn assert_closed(mesh: &Mesh) {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        for t in &mesh.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a, b)).or_default() += 1;
            }
        }
        for (&(a, b), &count) in &edges {
            assert_eq!((count, edges.get(&(b, a)).copied()), (1, Some(1)), "edge {a}-{b}");
        }
    }

    fn assert_triangles_have_area(mesh: &Mesh) {
        for t in &mesh.triangles {
            let v = t.map(|i| mesh.vertices[i as usize].as_vec3());
            assert!(photonstream_shading::surface::normal(v).is_some());
        }
    }

    #[test]
    fn quarter_turns_are_exact() {
        for k in -8i32..=8 {
            let expected = match k.rem_euclid(4) {
                0 => (0.0, 1.0),
                1 => (1.0, 0.0),
                2 => (0.0, -1.0),
                _ => (-1.0, 0.0),
            };
            assert_eq!(sin_cos_turn(f64::from(k) / 4.0), expected);
        }
        for i in 0..1000 {
            let turn = f64::from(i) / 1000.0;
            let (s, c) = (turn * 2.0 * PI).sin_cos();
            let (s2, c2) = sin_cos_turn(turn);
            // Both arguments are rounded once at a magnitude below 8: 2⁻⁵⁰.
            assert!((s - s2).abs() < 2f64.powi(-49) && (c - c2).abs() < 2f64.powi(-49));
        }
    }

    #[test]
    fn quad_spans_its_edges_and_looks_along_u_cross_v() {
        let mesh = quad(DVec3::new(1.0, 2.0, 3.0), DVec3::X * 2.0, DVec3::new(1.0, 3.0, 0.0));
        assert_eq!(area_and_volume(&mesh).0, 6.0);
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize]);
            assert_eq!((b - a).cross(c - a).normalize(), DVec3::Z);
        }
    }

    #[test]
    fn cuboid_is_closed_with_its_area_and_volume() {
        for centre in [DVec3::ZERO, DVec3::new(4.0, -2.0, 8.0)] {
            let mesh = cuboid(DVec3::new(1.0, 2.0, 3.0), centre);
            assert_closed(&mesh);
            assert_eq!(mesh.triangles.len(), 12);
            assert_eq!(area_and_volume(&mesh), (22.0, 6.0));
            assert_eq!(mesh.vertices.iter().sum::<DVec3>() / 8.0, centre);
        }
    }

    /// Inscribed: area and volume grow towards the sphere's with an error of order 1/n².
    #[test]
    fn sphere_is_closed_and_approaches_its_area_and_volume() {
        for segments in [3u32, 4, 8, 32, 128] {
            let mesh = sphere(2.0, segments);
            assert_closed(&mesh);
            assert_triangles_have_area(&mesh);
            assert_eq!(mesh.triangles.len() as u32, 2 * segments * (segments - 1));
            assert!(mesh.vertices.iter().all(|v| (v.length() - 2.0).abs() < 1e-14));
            let (area, volume) = area_and_volume(&mesh);
            let missing = 20.0 / f64::from(segments).powi(2);
            let (full_area, full_volume) = (16.0 * PI, 32.0 * PI / 3.0);
            assert!(area < full_area && area > full_area * (1.0 - missing), "{segments}: {area}");
            assert!(volume < full_volume && volume > full_volume * (1.0 - missing), "{segments}: {volume}");
        }
    }

    /// The tube's volume is π r² times the knot's length (Pappus), its area 2 π r times it; tessellated with 256 × 64
    /// sides both miss about (2π/64)²/6 = 0.2 % and less than that along the tube; 1 %.
    #[test]
    fn torus_knot_is_closed_and_has_the_volume_of_its_tube() {
        for (p, q) in [(2, 3), (3, 2), (1, 1), (1, 4), (3, 7)] {
            let shape = TorusKnot { p, q, radius: 1.5, tube_radius: 0.08, segments: 1024, tube_segments: 64 };
            let mesh = torus_knot(shape);
            assert_closed(&mesh);
            assert_triangles_have_area(&mesh);
            assert_eq!(mesh.triangles.len(), 2 * 1024 * 64);
            let n = 100_000;
            let point = |i: u32| {
                let t = 2.0 * PI * f64::from(i) / f64::from(n);
                let (pt, qt) = (t * f64::from(p), t * f64::from(q));
                let ring = 1.5 + 0.75 * qt.cos();
                DVec3::new(ring * pt.cos(), 0.75 * qt.sin(), ring * pt.sin())
            };
            let length: f64 = (0..n).map(|i| (point(i + 1) - point(i)).length()).sum();
            let (area, volume) = area_and_volume(&mesh);
            assert!((area / (2.0 * PI * 0.08 * length) - 1.0).abs() < 0.01, "{p} {q}: {area}");
            assert!((volume / (PI * 0.08 * 0.08 * length) - 1.0).abs() < 0.01, "{p} {q}: {volume}");
        }
    }
}
