//! Turns gizmos into what is drawn of them and can be taken hold of, in pixels.

use super::{
    Gizmo, Places,
    outline::{body, great_circles, rim, segments},
};
use crate::{following::Published, navigation::project, picking::Eye};
use glam::{DAffine3, Vec3};
use photonstream_scene::{VplSet, bvh::Ray};

/// Radius of the discs of VPLs, in points, where they are not larger than [`DISC_SHARE`].
const DISC_POINTS: f32 = 8.0;
/// No disc is larger than this share of the scene's radius, but for its least size.
const DISC_SHARE: f32 = 0.03;
/// Least radius of a disc, in points.
const DISC_LEAST: f32 = 3.5;
/// Corners of a disc.
const DISC_CORNERS: usize = 14;
/// Within so many points a gizmo is taken hold of by its middle.
const HANDLE_POINTS: f32 = 10.0;
/// Within so many points a gizmo is taken hold of by a line.
const LINE_POINTS: f32 = 4.0;
/// Lines begin at this share of the scene's radius from the camera.
const NEAR_SHARE: f32 = 1e-3;

/// From where gizmos are seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'a> {
    /// The camera and its picture.
    pub(crate) eye: Eye<'a>,
    /// Pixels per point.
    pub(crate) scale: f32,
    /// The frame that is seen.
    pub(crate) published: &'a Published,
}

impl Sight<'_> {
    /// Where a point is seen, in pixels; `None` behind the camera.
    pub(crate) fn place(&self, point: Vec3) -> Option<[f32; 2]> {
        project(self.eye.camera, point, self.eye.width, self.eye.height)
    }

    /// The depth from which on lines are drawn, m.
    pub(crate) fn near(&self) -> f32 {
        NEAR_SHARE * self.published.scene.bounds.radius
    }

    /// Whether something stands before a point. What lies on a surface is not hidden by it.
    pub(crate) fn is_hidden(&self, point: Vec3) -> bool {
        let origin = self.eye.camera.position;
        let way = Ray { origin, direction: point - origin, t_max: 0.99 };
        self.published.scene.bvh.occluded(&way)
    }

    /// The length at `point` that is as long as a point of the interface, m.
    fn point_size(&self, point: Vec3) -> f32 {
        let camera = self.eye.camera;
        let depth = (point - camera.position).dot(camera.forward);
        2.0 * camera.tan_half_fov * depth.max(0.0) * self.scale / self.eye.height as f32
    }
}

/// A gizmo in the picture.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    /// What it is.
    pub(crate) gizmo: Gizmo,
    /// Its middle, in metres from the scene's origin.
    pub(crate) point: Vec3,
    /// Where its middle is seen.
    pub(crate) handle: Option<[f32; 2]>,
    /// Whether something stands before its middle.
    pub(crate) is_hidden: bool,
    /// The corners of the disc of a VPL.
    pub(crate) disc: Vec<[f32; 2]>,
    /// Its lines: the normal of a VPL, the outlines of the others.
    pub(crate) lines: Vec<[[f32; 2]; 2]>,
}

/// All gizmos that are seen; of the blocker `whole` more than its rim.
pub(crate) fn shapes(sight: &Sight<'_>, set: &VplSet, whole: Option<Gizmo>) -> Vec<Shape> {
    let places = Places::of(sight.published);
    let camera = sight.eye.camera.position;
    let lines = |lines: &[_]| segments(&sight.eye, lines, sight.near());
    let shape = |gizmo, point: Vec3| Shape {
        gizmo,
        point,
        handle: sight.place(point),
        is_hidden: sight.is_hidden(point),
        disc: Vec::new(),
        lines: Vec::new(),
    };
    let vpls = set.vpls.iter().enumerate().map(|(i, vpl)| {
        let (point, normal) = places.vpl(vpl);
        let (disc, lines) = disc(sight, point.as_vec3(), normal.as_vec3());
        Shape { disc, lines, ..shape(Gizmo::Vpl(i), point.as_vec3()) }
    });
    let blockers = set.blockers.iter().enumerate().map(|(i, blocker)| {
        let point = places.blocker(blocker).as_vec3();
        let map = DAffine3::from_translation(point.as_dvec3());
        let mut of_sphere = rim(camera, point, blocker.radius);
        if whole == Some(Gizmo::Blocker(i)) || of_sphere.is_empty() {
            of_sphere.extend(great_circles(&map, f64::from(blocker.radius)));
        }
        Shape { lines: lines(&of_sphere), ..shape(Gizmo::Blocker(i), point) }
    });
    let proxies = set.proxies.iter().enumerate().map(|(i, proxy)| {
        let map = places.proxy(proxy);
        let mut of_body = body(&map, &proxy.shape);
        if let photonstream_scene::vpls::ProxyShape::Sphere { radius } = proxy.shape {
            of_body.extend(rim(camera, map.translation.as_vec3(), radius as f32));
        }
        Shape { lines: lines(&of_body), ..shape(Gizmo::Proxy(i), map.translation.as_vec3()) }
    });
    let is_seen = |shape: &Shape| shape.handle.is_some() || !shape.lines.is_empty();
    vpls.chain(blockers).chain(proxies).filter(is_seen).collect()
}

/// A disc about `point` that looks along `normal`, and the line of its normal.
pub(crate) fn disc(sight: &Sight<'_>, point: Vec3, normal: Vec3) -> (Vec<[f32; 2]>, Vec<[[f32; 2]; 2]>) {
    let size = sight.point_size(point);
    let largest = (DISC_SHARE * sight.published.scene.bounds.radius).max(DISC_LEAST * size);
    let radius = (DISC_POINTS * size).min(largest);
    let Some(normal) = normal.try_normalize().filter(|_| radius > 0.0) else { return Default::default() };
    let (u, v) = normal.any_orthonormal_pair();
    let corner = |i: usize| {
        let (sin, cos) = (i as f32 * (core::f32::consts::TAU / DISC_CORNERS as f32)).sin_cos();
        sight.place(point + (u * cos + v * sin) * radius)
    };
    let Some(corners) = (0..DISC_CORNERS).map(corner).collect() else { return Default::default() };
    (corners, segments(&sight.eye, &[[point, point + normal * (2.0 * radius)]], sight.near()))
}

/// A square on its corner about a place of the picture, `radius` points wide to each side.
pub(crate) fn rhombus(sight: &Sight<'_>, [x, y]: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
    let r = radius * sight.scale;
    vec![[x, y - r], [x + r, y], [x, y + r], [x - r, y]]
}

/// A triangle about a place of the picture, `radius` points to each corner.
pub(crate) fn triangle(sight: &Sight<'_>, [x, y]: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
    let r = radius * sight.scale;
    vec![[x, y - r], [x + 0.866 * r, y + 0.5 * r], [x - 0.866 * r, y + 0.5 * r]]
}

/// The gizmo at `cursor`, with its distance in pixels: by its middle, else by a line; hidden ones only from half as far.
pub(crate) fn nearest<'a>(
    sight: &Sight<'_>,
    shapes: &'a [Shape],
    cursor: [f32; 2],
) -> Option<(f32, &'a Shape)> {
    let handle = |shape: &Shape| {
        let [x, y] = shape.handle?;
        let distance = (x - cursor[0]).hypot(y - cursor[1]);
        let distance = if shape.is_hidden { 2.0 * distance } else { distance };
        (distance <= HANDLE_POINTS * sight.scale).then_some(distance)
    };
    // The normals of VPLs are short; the lines of the others are all there is of them.
    let line = |shape: &Shape| {
        let distances = shape.lines.iter().map(|line| distance_to(*line, cursor));
        let distance = distances.fold(f32::INFINITY, f32::min);
        (distance <= LINE_POINTS * sight.scale).then_some(HANDLE_POINTS * sight.scale + distance)
    };
    let found = shapes.iter().filter_map(|shape| Some((handle(shape).or_else(|| line(shape))?, shape)));
    found.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The distance of a point of the picture to a line of it.
fn distance_to([a, b]: [[f32; 2]; 2], p: [f32; 2]) -> f32 {
    let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length_sq = ab[0] * ab[0] + ab[1] * ab[1];
    let t = if length_sq > 0.0 { ((ap[0] * ab[0] + ap[1] * ab[1]) / length_sq).clamp(0.0, 1.0) } else { 0.0 };
    (ap[0] - t * ab[0]).hypot(ap[1] - t * ab[1])
}
