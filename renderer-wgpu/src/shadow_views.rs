//! Turns lights into the table that shaders read, and into the views from which their shadow maps are drawn.

mod sky;

use crate::{
    Shadows,
    layout::{AREA_FACES, LightUniform, MAP_SEED, NO_LAYER, ShadowView},
};
use glam::{Mat4, Vec3, Vec4};
use photonstream_scene::SceneLight;
use photonstream_shading::{
    LightShape, basis,
    light::{Bounds, EmissiveMesh},
    sobol::Sequence,
    surface::RELATIVE_OFFSET,
    wgsl,
};
use sky::{SKY_POINTS, fitted_view, sky_suns};

/// Most shadow maps of a scene: layers of one texture.
pub(crate) const MAX_MAPS: u32 = 256;

/// What shaders know of a scene's lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LightTable {
    pub(crate) lights: Vec<LightUniform>,
    pub(crate) views: Vec<ShadowView>,
    /// Edge of each map in texels; 0 without maps.
    pub(crate) resolution: u32,
    /// Views whose maps name triangles, in the order of their layers: those of lights without extent.
    pub(crate) named: u32,
    /// Lights for which there was no map left: they shine through everything.
    pub(crate) unshadowed: u32,
}

impl LightTable {
    /// The table of `lights` in a scene within `bounds` and a box of the corners `extent`; area lights have maps around up to `points` of their points, a sky those of up to four times as
    /// many directions, which are others for each `sample`; the maps of others name triangles where `maps_are_named`. For
    /// `shadows` by rays, emitting meshes have all their triangles, else as many points as an area light.
    pub(crate) fn new(
        lights: &[SceneLight],
        (bounds, extent): (Bounds, [Vec3; 2]),
        points: u32,
        shadows: Shadows,
        maps_are_named: bool,
        sample: u32,
    ) -> Self {
        let shapes = || lights.iter().map(|l| &l.light.shape);
        let wanted = |points| shapes().map(|s| maps_of(s, points)).sum::<u32>();
        // Fewer points for each area light until all lights have maps.
        let mut points = points.clamp(1, 16);
        while points > 1 && wanted(points) > MAX_MAPS {
            points /= 2;
        }
        let mut table = Self::default();
        let total = wanted(points).min(MAX_MAPS);
        table.resolution = match total {
            0 => 0,
            1..=12 => 1024,
            13..=48 => 512,
            _ => 256,
        };
        let with_maps = shadows == Shadows::Maps;
        let mut suns = Vec::new();
        for (index, light) in lights.iter().enumerate() {
            let shape = &light.light.shape;
            let maps = maps_of(shape, points);
            let first_map = table.views.len() as u32;
            let fits = with_maps && first_map + maps <= MAX_MAPS;
            if with_maps && !fits {
                table.unshadowed += 1;
            }
            let maps = if fits { maps } else { 0 };
            let mut entry = light_uniform(shape, light.light.power);
            if let LightShape::Sky { sky } = shape {
                suns.push((index, sky_suns(sky, light.light.power, index, points * SKY_POINTS, sample)));
            }
            if let LightShape::Mesh { mesh } = shape {
                let sequence = Sequence::new(MAP_SEED.into(), index as u32);
                let parts = match shadows {
                    Shadows::Rays => mesh_triangles(mesh),
                    _ => (0..points).map(|k| mesh_point(mesh, sequence.sample(k.into()).next_2d())).collect(),
                };
                suns.push((index, parts));
            }
            (entry.first_map, entry.maps, entry.map_points) = (first_map, maps, points);
            if maps > 0 {
                let sample_of =
                    |k: u32| Sequence::new(MAP_SEED.into(), index as u32).sample(k.into()).next_2d();
                views(shape, &entry, bounds, table.resolution, points, sample_of, &mut table.views);
                if let Some((_, parts)) = suns.last_mut().filter(|(of, _)| *of == index) {
                    for part in parts {
                        part.first_map = table.views.len() as u32;
                        if shape.sky().is_some() {
                            let direction = Vec3::from(part.direction);
                            table.views.push(fitted_view(direction, extent, table.resolution));
                        } else {
                            table.views.extend(emitter_views(part, bounds, table.resolution));
                        }
                        part.maps = table.views.len() as u32 - part.first_map;
                    }
                }
                if maps_are_named && shape.is_delta() {
                    for view in &mut table.views[first_map as usize..] {
                        view.layer = table.named;
                        table.named += 1;
                    }
                }
            }
            table.lights.push(entry);
        }
        for (index, suns) in suns {
            table.lights[index].first_direction = table.lights.len() as u32;
            table.lights[index].map_points = suns.len() as u32;
            table.lights.extend(suns);
        }
        if table.views.is_empty() {
            table.resolution = 0;
        }
        table
    }
}

/// Triangles of a mesh that rays choose among; of more, so many that are drawn by their areas stand for all.
const MESH_TRIANGLES: usize = 1 << 16;

/// The triangles of a mesh, each with the running sum of the shares of the area in the place of its outer versine.
fn mesh_triangles(mesh: &EmissiveMesh) -> Vec<LightUniform> {
    let part = |triangle: usize, cumulative: f32| {
        let [corner, b, c] = mesh.triangles()[triangle];
        let shape = LightShape::Triangle { corner, edge_u: b - corner, edge_v: c - corner };
        LightUniform { versine_outer: cumulative, ..light_uniform(&shape, Vec3::ZERO) }
    };
    let count = mesh.triangles().len();
    if count <= MESH_TRIANGLES {
        return mesh.cumulative().iter().enumerate().map(|(i, &sum)| part(i, sum)).collect();
    }
    let share = |k: usize| (k as f32 + 0.5) / MESH_TRIANGLES as f32;
    let end = |k: usize| (k + 1) as f32 / MESH_TRIANGLES as f32;
    (0..MESH_TRIANGLES).map(|k| part(mesh.place([share(k), 0.5]).triangle, end(k))).collect()
}

/// A point of a mesh as an emitter of no extent, turned as its triangle.
fn mesh_point(mesh: &EmissiveMesh, u: [f32; 2]) -> LightUniform {
    let place = mesh.place(u);
    let [a, b, c] = mesh.triangles()[place.triangle];
    let shape = LightShape::Parallelogram { corner: place.point, edge_u: b - a, edge_v: c - a };
    let mut part = light_uniform(&shape, Vec3::ZERO);
    part.edge_v = [0.0; 3];
    // The point is off the surface already.
    part.emitter_offset = 0.0;
    part
}

/// Half angle (as its cosine) up to which a spot has one map; wider ones have a cube.
const SINGLE_MAP_COS: f32 = 0.35;

fn maps_of(shape: &LightShape, points: u32) -> u32 {
    match *shape {
        LightShape::Point { .. } => 6,
        LightShape::Spot { versine_outer, .. } => {
            if 1.0 - versine_outer > SINGLE_MAP_COS {
                1
            } else {
                6
            }
        }
        LightShape::Directional { .. } => 1,
        LightShape::Parallelogram { .. } | LightShape::Triangle { .. } | LightShape::Mesh { .. } => {
            AREA_FACES * points
        }
        LightShape::Sky { .. } => SKY_POINTS * points,
    }
}

/// The light as shaders read it, without maps.
pub(crate) fn light_uniform(shape: &LightShape, power: Vec3) -> LightUniform {
    let mut entry =
        LightUniform { kind: wgsl::light_kind(shape), power: power.to_array(), ..Default::default() };
    match *shape {
        LightShape::Point { position } => entry.position = position.to_array(),
        LightShape::Spot { position, direction, versine_inner, versine_outer } => {
            entry.position = position.to_array();
            entry.direction = direction.to_array();
            (entry.versine_inner, entry.versine_outer) = (versine_inner, versine_outer);
        }
        LightShape::Directional { direction } => entry.direction = direction.to_array(),
        LightShape::Sky { .. } | LightShape::Mesh { .. } => {}
        LightShape::Parallelogram { corner, edge_u, edge_v }
        | LightShape::Triangle { corner, edge_u, edge_v } => {
            entry.position = corner.to_array();
            entry.direction = shape.emitter_normal().to_array();
            entry.edge_u = edge_u.to_array();
            entry.edge_v = edge_v.to_array();
            let corners = [corner, corner + edge_u, corner + edge_v];
            let magnitude = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
            entry.emitter_offset = magnitude * RELATIVE_OFFSET;
        }
    }
    entry
}

/// Where a view stands and how it is turned.
struct Frame {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
}

fn views(
    shape: &LightShape,
    entry: &LightUniform,
    bounds: Bounds,
    resolution: u32,
    points: u32,
    sample: impl Fn(u32) -> [f32; 2],
    out: &mut Vec<ShadowView>,
) {
    let margin = margin(resolution);
    let near = bounds.radius.max(f32::MIN_POSITIVE) * 1e-4;
    match *shape {
        LightShape::Directional { direction } => out.push(beam_view(direction, bounds, resolution)),
        // Their directions and points are lights of their own.
        LightShape::Sky { .. } | LightShape::Mesh { .. } => {}
        LightShape::Spot { position, direction, versine_outer, .. } if entry.maps == 1 => {
            let cos = 1.0 - versine_outer;
            let tan = (versine_outer * (2.0 - versine_outer)).sqrt() / cos;
            let (right, up) = basis::tangents(direction);
            out.push(perspective_view(
                &Frame { position, right, up, forward: direction },
                tan * margin,
                near,
                resolution,
            ));
        }
        LightShape::Point { position } | LightShape::Spot { position, .. } => {
            let frame = Frame { position, right: Vec3::X, up: Vec3::Y, forward: Vec3::Z };
            out.extend(faces(&frame).iter().map(|f| perspective_view(f, margin, near, resolution)));
        }
        LightShape::Parallelogram { corner, edge_u, edge_v }
        | LightShape::Triangle { corner, edge_u, edge_v } => {
            for k in 0..points {
                let u = sample(k);
                let [a, b] = match shape {
                    LightShape::Triangle { .. } => photonstream_shading::sampling::triangle(u),
                    _ => u,
                };
                let normal = shape.emitter_normal();
                let position = corner + edge_u * a + edge_v * b + normal * entry.emitter_offset;
                out.extend(half_cube([position, normal, edge_u], near, resolution));
            }
        }
    }
}

/// The views from a point of an emitter.
fn emitter_views(point: &LightUniform, bounds: Bounds, resolution: u32) -> [ShadowView; AREA_FACES as usize] {
    let near = bounds.radius.max(f32::MIN_POSITIVE) * 1e-4;
    half_cube([point.position, point.direction, point.edge_u].map(Vec3::from), near, resolution)
}

/// All faces of a cube around a point but the one behind its emitter.
fn half_cube(
    [position, normal, edge]: [Vec3; 3],
    near: f32,
    resolution: u32,
) -> [ShadowView; AREA_FACES as usize] {
    let across = edge.normalize_or(Vec3::X);
    let frame = Frame { position, right: across, up: normal.cross(across), forward: normal };
    let [right, left, above, below, ahead, _] = faces(&frame);
    [right, left, above, below, ahead].map(|f| perspective_view(&f, margin(resolution), near, resolution))
}

/// The view of a beam that covers the whole scene.
fn beam_view(direction: Vec3, bounds: Bounds, resolution: u32) -> ShadowView {
    let (right, up) = basis::tangents(direction);
    let frame = Frame { position: bounds.centre, right, up, forward: direction };
    parallel_view(&frame, bounds.radius * margin(resolution), resolution)
}

/// The filter reaches two texels beyond an edge.
fn margin(resolution: u32) -> f32 {
    1.0 + 4.0 / resolution as f32
}

/// The faces of a cube in the directions of a frame: right, left, up, down, forward, back.
fn faces(frame: &Frame) -> [Frame; 6] {
    let (position, r, u, f) = (frame.position, frame.right, frame.up, frame.forward);
    [(r, u, f), (-r, u, f), (u, f, r), (-u, f, r), (f, r, u), (-f, r, u)].map(|(forward, right, up)| Frame {
        position,
        right,
        up,
        forward,
    })
}

fn perspective_view(frame: &Frame, tan: f32, near: f32, resolution: u32) -> ShadowView {
    let row = |v: Vec3| v.extend(-v.dot(frame.position));
    // Reversed depth near/w.
    let rows =
        [row(frame.right) / tan, row(frame.up) / tan, Vec4::new(0.0, 0.0, 0.0, near), row(frame.forward)];
    view(rows, 2.0 * tan / resolution as f32, false)
}

fn parallel_view(frame: &Frame, radius: f32, resolution: u32) -> ShadowView {
    box_view(frame, [radius; 3], resolution)
}

/// A parallel view that reaches so far to each side, up and down, and ahead and back.
fn box_view(frame: &Frame, [x, y, z]: [f32; 3], resolution: u32) -> ShadowView {
    let row = |v: Vec3, reach: f32| v.extend(-v.dot(frame.position)) / reach;
    let depth = Vec4::new(0.0, 0.0, 0.0, 0.5) - row(frame.forward, z) * 0.5;
    let rows = [row(frame.right, x), row(frame.up, y), depth, Vec4::new(0.0, 0.0, 0.0, 1.0)];
    view(rows, 2.0 * x.max(y) / resolution as f32, true)
}

fn view(rows: [Vec4; 4], texel: f32, parallel: bool) -> ShadowView {
    let matrix = Mat4::from_cols(rows[0], rows[1], rows[2], rows[3]).transpose();
    ShadowView {
        clip_from_world: matrix.to_cols_array_2d(),
        texel,
        parallel: parallel.into(),
        layer: NO_LAYER,
        pad_1: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn seen(view: &ShadowView, p: Vec3) -> Vec3 {
        let clip = Mat4::from_cols_array_2d(&view.clip_from_world) * p.extend(1.0);
        clip.truncate() / clip.w
    }

    /// Points around a light are in the middle of the face that shaders choose for them, nearer ones deeper.
    #[test]
    fn faces_look_along_their_axes() {
        let frame =
            Frame { position: Vec3::new(1.0, 2.0, 3.0), right: Vec3::X, up: Vec3::Y, forward: Vec3::Z };
        let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        for (face, axis) in faces(&frame).iter().zip(axes) {
            let view = perspective_view(face, 1.0, 1e-3, 256);
            let near = seen(&view, frame.position + axis * 0.5);
            let far = seen(&view, frame.position + axis * 2.0);
            assert!(near.truncate().length() < 1e-6 && far.truncate().length() < 1e-6, "{axis}");
            assert!(near.z > far.z && far.z > 0.0 && near.z < 1.0);
            let corner = seen(&view, frame.position + axis + face.right + face.up);
            assert!((corner.truncate() - glam::Vec2::ONE).length() < 1e-5);
        }
    }

    #[test]
    fn a_sun_sees_the_whole_scene() {
        let direction = Vec3::new(0.6, -0.8, 0.0);
        let (right, up) = basis::tangents(direction);
        let centre = Vec3::new(3.0, 1.0, -2.0);
        let view = parallel_view(&Frame { position: centre, right, up, forward: direction }, 5.0, 1024);
        for offset in [direction, -direction, right, up, -right] {
            let p = seen(&view, centre + offset * 5.0);
            assert!(p.x.abs() <= 1.0 && p.y.abs() <= 1.0 && (-1e-6..=1.000_001).contains(&p.z), "{p}");
        }
        assert!(seen(&view, centre - direction * 4.0).z > seen(&view, centre + direction * 4.0).z);
    }
}
