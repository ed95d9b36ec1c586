//! Turns placed meshes into one soup of triangles in the scene's own space, around an origin of its own.

use crate::{
    config::{Field, MAX_LENGTH_M},
    error::SceneError,
    placement::Placement,
    primitives::Mesh,
    scene::{Geometry, Material, MaterialId, Object, ObjectId, Sides},
};
use glam::{DAffine3, DVec3, Vec3};
use photonstream_shading::{LightShape, light::Bounds, surface};

/// Most vertices and most triangles of a scene: their indices are u32.
const MAX_ELEMENTS: usize = 1 << 28;

/// A validated object: its mesh, where it stands, and what its surface does.
pub(crate) struct Part<'a> {
    pub(crate) name: String,
    pub(crate) field: Field<'a>,
    pub(crate) material: String,
    pub(crate) sides: Sides,
    pub(crate) mesh: Mesh,
    pub(crate) placement: Placement,
    pub(crate) emitter: Option<Emitter>,
}

/// The light that a part's front emits.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) strength: Strength,
    pub(crate) faces: Vec<EmitterFace>,
}

/// How much light an emitter's faces emit.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Strength {
    /// W, for the one face.
    Power(DVec3),
    /// W m⁻² sr⁻¹.
    Radiance(DVec3),
}

/// A face of an emitter, as the mesh's vertices [corner, end of edge u, end of edge v].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EmitterFace {
    Parallelogram([u32; 3]),
    Triangle([u32; 3]),
}

/// The geometry of a scene; `lights` holds the shapes of each object's emitters.
pub(crate) struct Baked {
    pub(crate) geometry: Geometry,
    pub(crate) objects: Vec<Object>,
    pub(crate) emitters: Vec<(ObjectId, Strength, Vec<LightShape>)>,
    pub(crate) bounds: Bounds,
    pub(crate) notices: Vec<String>,
}

/// The corner-to-corner box around all placed triangles, in the config's coordinates.
pub(crate) fn bounding_box(parts: &[Part<'_>]) -> (DVec3, DVec3) {
    let points = parts.iter().flat_map(|part| {
        part.mesh.triangles.iter().flatten().map(|&i| part.placement.apply(part.mesh.vertices[i as usize]))
    });
    box_around(points)
}

fn box_around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    points
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)))
}

/// The middle of a box, rounded to a multiple of a 64th of the power of two below its longest side.
///
/// The rounding is coarse so that the local coordinates do not depend on where the scene stands: a scene moved by a
/// multiple of that step (3 000 m, for any scene up to 512 m) gets an origin moved by exactly as much, although the
/// last bits of its corners, and so of its exact middle, differ. The slight bias upwards keeps sides and middles that
/// are exact powers and multiples from falling to either side by those last bits.
pub(crate) fn snapped_centre((low, high): (DVec3, DVec3)) -> DVec3 {
    const BIAS: f64 = 1.0 / (1 << 20) as f64;
    let extent = (high - low).max_element();
    if !(extent > 0.0 && extent.is_finite()) {
        return DVec3::ZERO;
    }
    let step = ((extent * (1.0 + BIAS)).log2().floor() - 6.0).max(-60.0).exp2();
    ((low + (high - low) * 0.5) / step + (0.5 + BIAS)).floor() * step + DVec3::ZERO
}

/// Bakes `parts`, which are ordered by name, around `origin`; `materials` are ordered by name too.
///
/// # Errors
/// If an object has no triangle with an area, or lies beyond what f32 can hold.
pub(crate) fn bake(parts: Vec<Part<'_>>, origin: DVec3, materials: &[Material]) -> Result<Baked, SceneError> {
    let mut geometry = Geometry::default();
    let mut objects = Vec::with_capacity(parts.len());
    let mut emitters = Vec::new();
    let mut notices = Vec::new();
    for (index, part) in parts.into_iter().enumerate() {
        let id = ObjectId(index as u32);
        let first_vertex = geometry.vertices.len();
        let first_triangle = geometry.triangles.len() as u32;
        if first_vertex + part.mesh.vertices.len() > MAX_ELEMENTS
            || first_triangle as usize + part.mesh.triangles.len() > MAX_ELEMENTS
        {
            return Err(part.field.invalid(
                "more than 268 million triangles or vertices",
                "a scene of fewer",
                "use fewer segments or leave objects out",
            ));
        }
        let world_from_rest = push_vertices(&mut geometry, &part, origin)?;
        let dropped = push_triangles(&mut geometry, &part, id, first_vertex as u32);
        let last_triangle = geometry.triangles.len() as u32;
        if last_triangle == first_triangle {
            return Err(part.field.invalid(
                format!("{dropped} triangles, none with an area (object \"{}\")", part.name),
                "a mesh with an area",
                "enlarge the object or remove it",
            ));
        }
        if dropped > 0 {
            let all = last_triangle - first_triangle + dropped;
            notices.push(format!(
                "object \"{}\": {dropped} of {all} triangles have no area and were left out",
                part.name
            ));
        }
        if let Some(emitter) = &part.emitter {
            let world = &geometry.vertices[first_vertex..];
            let shapes = emitter.faces.iter().map(|face| light_shape(*face, world, &part.placement));
            emitters.push((id, emitter.strength, shapes.filter(|s| s.area() > 0.0).collect()));
        }
        objects.push(Object {
            name: part.name,
            material: material_id(materials, &part.material),
            sides: part.sides,
            triangles: first_triangle..last_triangle,
            world_from_rest,
            emitter: None,
        });
    }
    let bounds = sphere_around(&geometry.vertices);
    Ok(Baked { geometry, objects, emitters, bounds, notices })
}

/// The index of `name` in the ordered list of materials.
fn material_id(materials: &[Material], name: &str) -> MaterialId {
    let index = materials.binary_search_by(|m| m.name.as_str().cmp(name));
    MaterialId(index.expect("invariant: parts name materials that were checked or added") as u32)
}

/// World and rest vertices of a part. The world's come from the config's numbers directly, not by way of rest space:
/// equal numbers give equal bits, so that neighbouring quads share their edges without a gap.
fn push_vertices(geometry: &mut Geometry, part: &Part<'_>, origin: DVec3) -> Result<DAffine3, SceneError> {
    let placement = &part.placement;
    // Rest space is centred, so that a mesh given far from its own origin keeps its precision.
    let used =
        part.mesh.triangles.iter().flatten().map(|&i| placement.scale * part.mesh.vertices[i as usize]);
    let rest_centre = snapped_centre(box_around(used));
    for &vertex in &part.mesh.vertices {
        let world = placement.apply(vertex) - origin;
        if !world.is_finite() || world.abs().max_element() > MAX_LENGTH_M {
            return Err(part.field.invalid(
                format!("a vertex {world} m from the scene's origin"),
                "all vertices within 1e9 m of it",
                "move or shrink the object, or check its units",
            ));
        }
        geometry.vertices.push(round(world));
        geometry.rest_vertices.push(round(placement.scale * vertex - rest_centre));
    }
    let translation = placement.position - origin + placement.rotation * rest_centre;
    Ok(DAffine3 { matrix3: placement.rotation, translation })
}

/// To f32, without negative zeros: points that are equal have equal bits.
fn round(point: DVec3) -> Vec3 {
    point.as_vec3() + Vec3::ZERO
}

/// Adds the triangles that have an area, turned where the part is mirrored; returns how many have none.
fn push_triangles(geometry: &mut Geometry, part: &Part<'_>, id: ObjectId, first_vertex: u32) -> u32 {
    let mut dropped = 0;
    for &[a, b, c] in &part.mesh.triangles {
        let turned = if part.placement.is_mirrored() { [a, c, b] } else { [a, b, c] };
        let triangle = turned.map(|i| i + first_vertex);
        match surface::normal(triangle.map(|i| geometry.vertices[i as usize])) {
            Some(normal) => {
                geometry.triangles.push(triangle);
                geometry.normals.push(normal);
                geometry.object_of.push(id);
            }
            None => dropped += 1,
        }
    }
    dropped
}

fn light_shape(face: EmitterFace, world: &[Vec3], placement: &Placement) -> LightShape {
    let (EmitterFace::Parallelogram(corners) | EmitterFace::Triangle(corners)) = face;
    let [corner, u, v] = corners.map(|i| world[i as usize]);
    let (edge_u, edge_v) =
        if placement.is_mirrored() { (v - corner, u - corner) } else { (u - corner, v - corner) };
    match face {
        EmitterFace::Parallelogram(_) => LightShape::Parallelogram { corner, edge_u, edge_v },
        EmitterFace::Triangle(_) => LightShape::Triangle { corner, edge_u, edge_v },
    }
}

fn sphere_around(vertices: &[Vec3]) -> Bounds {
    let (low, high) = box_around(vertices.iter().map(|v| v.as_dvec3()));
    let centre = round((low + high) * 0.5);
    let radius_sq = vertices.iter().map(|v| v.as_dvec3().distance_squared(centre.as_dvec3()));
    // Rounded up, so that no vertex is outside.
    let radius = (radius_sq.fold(0.0, f64::max).sqrt() as f32).next_up();
    Bounds { centre, radius }
}
