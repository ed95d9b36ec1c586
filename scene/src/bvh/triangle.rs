//! Turns a ray and triangles into hits: a filter on eight triangles at once, then one exact resolution.

use glam::{DVec3, Vec3};

use super::holes::Holes;
use super::lanes::{F32x8, Lanes, U32x8, WIDTH};
use super::ray_frame::{MAX_COORDINATE, RayFrame, TRIANGLE_PAD};

/// Up to eight triangles; unused lanes are NaN and never hit.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(super) struct Packet {
    /// Coordinates by vertex and axis.
    pub(super) vertices: [[F32x8; 3]; 3],
    /// Triangle numbers, `u32::MAX` in unused lanes.
    pub(super) ids: U32x8,
}

impl Packet {
    pub(super) const EMPTY: Self =
        Self { vertices: [[F32x8([f32::NAN; WIDTH]); 3]; 3], ids: U32x8([u32::MAX; WIDTH]) };

    pub(super) fn set(&mut self, lane: usize, id: u32, triangle: &[Vec3; 3]) {
        for (rows, vertex) in self.vertices.iter_mut().zip(triangle) {
            for (row, coordinate) in rows.iter_mut().zip(vertex.to_array()) {
                row.0[lane] = coordinate;
            }
        }
        self.ids.0[lane] = id;
    }

    /// As [`Self::triangle`], with the axes in the order of `axis`, and no way through memory.
    #[inline(always)]
    fn turned(&self, lane: usize, [x, y, z]: [usize; 3]) -> [[f32; 3]; 3] {
        let [a, b, c] = &self.vertices;
        [
            [a[x].0[lane], a[y].0[lane], a[z].0[lane]],
            [b[x].0[lane], b[y].0[lane], b[z].0[lane]],
            [c[x].0[lane], c[y].0[lane], c[z].0[lane]],
        ]
    }

    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        let [a, b, c] = &self.vertices;
        [
            [a[0].0[lane], a[1].0[lane], a[2].0[lane]],
            [b[0].0[lane], b[1].0[lane], b[2].0[lane]],
            [c[0].0[lane], c[1].0[lane], c[2].0[lane]],
        ]
    }
}

/// Whether a triangle can be hit at all: finite, within [`MAX_COORDINATE`], area not zero.
pub(super) fn is_solid(triangle: &[Vec3; 3]) -> bool {
    let [a, b, c] = triangle.map(DVec3::from);
    triangle.iter().all(|v| v.is_finite() && v.abs().max_element() <= MAX_COORDINATE)
        && (b - a).cross(c - a) != DVec3::ZERO
}

/// The nearest hit so far; distances in units of the scaled direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) t: f32,
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) id: u32,
    pub(super) found: bool,
}

impl Nearest {
    #[inline(always)]
    pub(super) fn none(t_max: f32) -> Self {
        // Identifier 0 admits no tie, so that the end of the ray itself is excluded.
        Self { t: t_max, u: 0.0, v: 0.0, id: 0, found: false }
    }

    #[inline(always)]
    pub(super) fn offer(&mut self, id: u32, hit: [f32; 3]) {
        let [t, u, v] = hit;
        if t < self.t || (t == self.t && id < self.id) {
            *self = Self { t, u, v, id, found: true };
        }
    }
}

/// The ray's shear in registers.
#[derive(Clone, Copy)]
pub(super) struct ShearLanes<L: Lanes> {
    origin: [L::F; 3],
    shear: [L::F; 2],
    zero: L::F,
}

impl<L: Lanes> ShearLanes<L> {
    #[inline(always)]
    pub(super) fn new(l: L, frame: &RayFrame) -> Self {
        Self {
            origin: frame.origin_turned.map(|coordinate| l.splat(coordinate)),
            shear: [l.splat(frame.shear[0]), l.splat(frame.shear[1])],
            zero: l.splat(0.0),
        }
    }

    /// A vertex of each lane, translated and sheared.
    #[inline(always)]
    fn sheared(&self, l: L, rows: &[F32x8; 3], axis: [usize; 3]) -> [L::F; 2] {
        let z = l.sub(l.load(&rows[axis[2]]), self.origin[2]);
        let x = l.sub(l.load(&rows[axis[0]]), self.origin[0]);
        let y = l.sub(l.load(&rows[axis[1]]), self.origin[1]);
        [l.sub(x, l.mul(self.shear[0], z)), l.sub(y, l.mul(self.shear[1], z))]
    }

    /// Lanes whose edge functions do not differ in sign: every hit, and those where rounding to zero hides the sign.
    #[inline(always)]
    fn candidates(&self, l: L, frame: &RayFrame, packet: &Packet) -> u32 {
        let a = self.sheared(l, &packet.vertices[0], frame.axis);
        let b = self.sheared(l, &packet.vertices[1], frame.axis);
        let c = self.sheared(l, &packet.vertices[2], frame.axis);
        let u = edge(l, c, b);
        let v = edge(l, a, c);
        let w = edge(l, b, a);
        let smallest = l.min(l.min(u, v), w);
        let largest = l.max(l.max(u, v), w);
        l.bits(l.or(l.le(self.zero, smallest), l.le(largest, self.zero)))
    }

    /// Offers every hit among the packet's triangles to `nearest`.
    #[inline(always)]
    pub(super) fn intersect(
        &self,
        l: L,
        (frame, holes): (&RayFrame, Option<&Holes>),
        packet: &Packet,
        nearest: &mut Nearest,
    ) {
        let mut candidates = self.candidates(l, frame, packet);
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize % WIDTH;
            candidates &= candidates - 1;
            if let Some(hit) = resolve_turned(frame, &packet.turned(lane, frame.axis)) {
                let id = packet.ids.0[lane];
                if holes.is_none_or(|holes| !holes.contain(id, hit[1], hit[2])) {
                    nearest.offer(id, hit);
                }
            }
        }
    }
}

#[inline(always)]
fn edge<L: Lanes>(l: L, p: [L::F; 2], q: [L::F; 2]) -> L::F {
    l.sub(l.mul(p[0], q[1]), l.mul(p[1], q[0]))
}

/// Scaled distance (positive) and barycentric u, v of one triangle: the only arithmetic that makes a hit.
///
/// Vertices are translated and sheared in `f32` exactly as in the filter; the edge functions are products of 24-bit
/// numbers, exact in `f64`, so their signs are exact and agree between triangles that share an edge. The distance is
/// clamped to the triangle's own padded box, which makes culling by any enclosing box exact (see the module's notes).
#[cfg(test)]
pub(super) fn resolve(frame: &RayFrame, triangle: &[[f32; 3]; 3]) -> Option<[f32; 3]> {
    let [kx, ky, kz] = frame.axis;
    resolve_turned(frame, &triangle.map(|vertex| [vertex[kx], vertex[ky], vertex[kz]]))
}

/// As `resolve`, with the axes in the order of `frame.axis`.
#[inline(always)]
fn resolve_turned(frame: &RayFrame, triangle: &[[f32; 3]; 3]) -> Option<[f32; 3]> {
    let (a, b, c) = (
        Sheared::new(frame, &triangle[0]),
        Sheared::new(frame, &triangle[1]),
        Sheared::new(frame, &triangle[2]),
    );
    let (u, v, w) = (exact_edge(&c, &b), exact_edge(&a, &c), exact_edge(&b, &a));
    let smallest = if u < v { u } else { v };
    let smallest = if w < smallest { w } else { smallest };
    let largest = if u > v { u } else { v };
    let largest = if w > largest { w } else { largest };
    let determinant = u + v + w;
    // One branch, nearly always taken: which side the ray comes from is not to be predicted.
    if !((smallest >= 0.0) | (largest <= 0.0)) | (determinant == 0.0) {
        return None;
    }
    let inverse = 1.0 / determinant;
    let z = u * f64::from(a.moved[2]) + v * f64::from(b.moved[2]) + w * f64::from(c.moved[2]);
    let t = (z * frame.inverse_z * inverse) as f32;

    let (low_x, high_x) = extent(a.moved[0], b.moved[0], c.moved[0]);
    let (low_y, high_y) = extent(a.moved[1], b.moved[1], c.moved[1]);
    let (low_z, high_z) = extent(a.moved[2], b.moved[2], c.moved[2]);
    let reach = larger(larger(larger(-low_x, high_x), larger(-low_y, high_y)), larger(-low_z, high_z));
    let pad = reach * TRIANGLE_PAD;
    let inverse_turned = &frame.inverse_turned;
    let (near_x, far_x) = interval(low_x - pad, high_x + pad, inverse_turned[0]);
    let (near_y, far_y) = interval(low_y - pad, high_y + pad, inverse_turned[1]);
    let (near_z, far_z) = interval(low_z - pad, high_z + pad, inverse_turned[2]);
    let near = larger(larger(near_x, near_y), near_z);
    let far = smaller(smaller(far_x, far_y), far_z);
    let t = smaller(larger(t, near), far);
    (near <= far && t > 0.0).then_some([t, (v * inverse) as f32, (w * inverse) as f32])
}

/// A vertex translated to the ray's origin (axes permuted), and sheared as in the filter.
struct Sheared {
    moved: [f32; 3],
    x: f64,
    y: f64,
}

impl Sheared {
    #[inline(always)]
    fn new(frame: &RayFrame, vertex: &[f32; 3]) -> Self {
        let origin = &frame.origin_turned;
        let (x, y, z) = (vertex[0] - origin[0], vertex[1] - origin[1], vertex[2] - origin[2]);
        Self { moved: [x, y, z], x: f64::from(x - frame.shear[0] * z), y: f64::from(y - frame.shear[1] * z) }
    }
}

#[inline(always)]
fn exact_edge(p: &Sheared, q: &Sheared) -> f64 {
    p.x * q.y - p.y * q.x
}

#[inline(always)]
fn extent(a: f32, b: f32, c: f32) -> (f32, f32) {
    (smaller(smaller(a, b), c), larger(larger(a, b), c))
}

/// Distances to two planes, near one first.
#[inline(always)]
fn interval(low: f32, high: f32, inverse: f32) -> (f32, f32) {
    let (p, q) = (low * inverse, high * inverse);
    (smaller(p, q), larger(p, q))
}

/// The smaller of two numbers that are not NaN, in one instruction.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger of two numbers that are not NaN, in one instruction.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
