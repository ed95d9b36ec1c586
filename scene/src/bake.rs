//! Turns placed meshes into one soup of triangles in the scene's own space, around an origin of its own.

use crate::{
    config::{Field, MAX_LENGTH_M},
    error::SceneError,
    placement::Placement,
    pose::{self, Pose, RestMesh},
    primitives::{Mesh, extend},
    scene::{Geometry, Material, MaterialId, Object, ObjectId, Sides},
};
use glam::{DVec3, Vec2, Vec3};
use photonstream_shading::{
    LightShape,
    light::{Bounds, EmissiveMesh},
    surface,
};

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
    /// Whether it is one of several of a file, and may be left out.
    pub(crate) is_imported: bool,
    /// Whether its file moves it: triangles that have an area at rest are kept however small they are now.
    pub(crate) moves: bool,
    pub(crate) emitter: Option<Emitter>,
}

/// The light that a part's front emits.
#[derive(Clone, Debug)]
pub(crate) struct Emitter {
    pub(crate) strength: Strength,
    pub(crate) faces: Vec<EmitterFace>,
}

impl Emitter {
    /// How many lights it makes at most.
    pub(crate) fn lights(&self) -> usize {
        if self.faces.len() > MOST_FACES { 1 } else { self.faces.len() }
    }
}

/// How much light an emitter's faces emit.
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// What of an object a light shines from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Emitting {
    /// One of several faces, each a light of its own.
    Face(EmitterFace),
    /// All its triangles.
    Mesh,
}

/// Most faces of an object that are lights of their own; those of more are one light.
const MOST_FACES: usize = 16;

/// An object that emits: what of it has an area, and the lights that makes.
pub(crate) struct BakedEmitter {
    pub(crate) object: ObjectId,
    pub(crate) strength: Strength,
    pub(crate) lights: Vec<(Emitting, LightShape)>,
}

/// The geometry of a scene.
pub(crate) struct Baked {
    pub(crate) geometry: Geometry,
    pub(crate) objects: Vec<Object>,
    pub(crate) rest_meshes: Vec<RestMesh>,
    pub(crate) poses: Vec<Pose>,
    pub(crate) emitters: Vec<BakedEmitter>,
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

pub(crate) fn box_around(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
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
    let mut soup = Soup::default();
    let mut objects = Vec::with_capacity(parts.len());
    let mut rest_meshes = Vec::with_capacity(parts.len());
    let mut poses = Vec::with_capacity(parts.len());
    let mut emitters = Vec::new();
    let mut notices = Vec::new();
    let number = parts.len();
    for (index, part) in parts.into_iter().enumerate() {
        let id = ObjectId(objects.len() as u32);
        let first_triangle = soup.triangles.len() as u32;
        if soup.vertices.len() + part.mesh.vertices.len() > MAX_ELEMENTS
            || first_triangle as usize + part.mesh.triangles.len() > MAX_ELEMENTS
        {
            return Err(part.field.invalid(
                "more than 268 million triangles or vertices",
                "a scene of fewer",
                "use fewer segments or leave objects out",
            ));
        }
        let pose = Pose::new(&part.placement, origin);
        let first_vertex = soup.vertices.len();
        let rest = soup.push_vertices(&part, &pose)?;
        let dropped = soup.push_triangles(&part, &rest, id);
        let last_triangle = soup.triangles.len() as u32;
        if last_triangle == first_triangle {
            let is_all = objects.is_empty() && index + 1 == number;
            if part.is_imported && !is_all {
                soup.vertices.truncate(first_vertex);
                soup.rest_vertices.truncate(first_vertex);
                soup.uvs.truncate(first_vertex);
                soup.own_normals.truncate(first_vertex);
                notices.push(format!("object \"{}\": no triangle has an area; it was left out", part.name));
                continue;
            }
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
            let lights: Vec<(Emitting, LightShape)> = if emitter.lights() < emitter.faces.len() {
                let triangles = soup.triangles[first_triangle as usize..].iter();
                let shape = mesh_shape(triangles.map(|t| t.map(|v| soup.vertices[v as usize])));
                shape.map(|shape| (Emitting::Mesh, shape)).into_iter().collect()
            } else {
                let shape = |face| (Emitting::Face(face), rest.light_shape(face, &pose, &soup.vertices));
                let shapes = emitter.faces.iter().copied().map(shape);
                shapes.filter(|(_, shape)| shape.area() > 0.0).collect()
            };
            emitters.push(BakedEmitter { object: id, strength: emitter.strength, lights });
        }
        objects.push(Object {
            name: part.name,
            material: material_id(materials, &part.material),
            sides: part.sides,
            triangles: first_triangle..last_triangle,
            world_from_rest: pose.world_from_rest(rest.centre(pose.scale)),
            world_from_own_normal: pose.world_from_own_normal(),
            transport_level: 0,
            emitter: None,
        });
        rest_meshes.push(rest);
        poses.push(pose);
    }
    let bounds = sphere_around(&soup.vertices);
    Ok(Baked { geometry: soup.into_geometry(), objects, rest_meshes, poses, emitters, bounds, notices })
}

/// The shape of the light that triangles make together; `None` if none has an area.
pub(crate) fn mesh_shape(triangles: impl Iterator<Item = [Vec3; 3]>) -> Option<LightShape> {
    EmissiveMesh::new(triangles).map(|mesh| LightShape::Mesh { mesh: mesh.into() })
}

/// The index of `name` in the ordered list of materials.
fn material_id(materials: &[Material], name: &str) -> MaterialId {
    let index = materials.binary_search_by(|m| m.name.as_str().cmp(name));
    MaterialId(index.expect("invariant: parts name materials that were checked or added") as u32)
}

/// The triangles of a scene while it is baked.
#[derive(Default)]
struct Soup {
    vertices: Vec<Vec3>,
    rest_vertices: Vec<Vec3>,
    uvs: Vec<Vec2>,
    own_normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    object_of: Vec<ObjectId>,
}

impl Soup {
    /// World and rest vertices of a part.
    fn push_vertices(&mut self, part: &Part<'_>, pose: &Pose) -> Result<RestMesh, SceneError> {
        let own = part.mesh.vertices.clone();
        let first = self.vertices.len() as u32;
        let used = box_around(part.mesh.triangles.iter().flatten().map(|&i| own[i as usize]));
        let vertices = first..first + own.len() as u32;
        let mesh = RestMesh { own, vertices, used, loaded: *pose };
        let centre = mesh.centre(pose.scale);
        for &point in &mesh.own {
            let world = pose.apply(point);
            if !world.is_finite() || world.abs().max_element() > MAX_LENGTH_M {
                return Err(part.field.invalid(
                    format!("a vertex {world} m from the scene's origin"),
                    "all vertices within 1e9 m of it",
                    "move or shrink the object, or check its units",
                ));
            }
            self.vertices.push(pose::round(world));
            self.rest_vertices.push(RestMesh::rest_vertex(point, pose.scale, centre));
        }
        extend(&mut self.uvs, &part.mesh.uvs, first as usize..self.vertices.len());
        extend(&mut self.own_normals, &part.mesh.normals, first as usize..self.vertices.len());
        Ok(mesh)
    }

    /// Adds the triangles that have an area, turned where the part is mirrored; returns how many have none.
    fn push_triangles(&mut self, part: &Part<'_>, rest: &RestMesh, id: ObjectId) -> u32 {
        let mut dropped = 0;
        for &[a, b, c] in &part.mesh.triangles {
            let turned = if rest.loaded.is_mirrored() { [a, c, b] } else { [a, b, c] };
            let triangle = turned.map(|i| i + rest.vertices.start);
            let normal = surface::normal(triangle.map(|i| self.vertices[i as usize])).or_else(|| {
                let at_rest = || triangle.map(|i| self.rest_vertices[i as usize]);
                part.moves.then(|| rest.loaded.turned_normal(at_rest())).flatten()
            });
            match normal {
                Some(normal) => {
                    self.triangles.push(triangle);
                    self.normals.push(normal);
                    self.object_of.push(id);
                }
                None => dropped += 1,
            }
        }
        dropped
    }

    fn into_geometry(self) -> Geometry {
        Geometry {
            vertices: self.vertices,
            rest_vertices: self.rest_vertices.into(),
            uvs: self.uvs.into(),
            own_normals: self.own_normals.into(),
            triangles: self.triangles.into(),
            normals: self.normals,
            object_of: self.object_of.into(),
        }
    }
}

/// The sphere around `vertices`: no vertex is outside.
pub(crate) fn sphere_around(vertices: &[Vec3]) -> Bounds {
    let (low, high) = box_around(vertices.iter().map(|v| v.as_dvec3()));
    let centre = pose::round((low + high) * 0.5);
    let radius_sq = vertices.iter().map(|v| v.as_dvec3().distance_squared(centre.as_dvec3()));
    // Rounded up, so that no vertex is outside.
    let radius = (radius_sq.fold(0.0, f64::max).sqrt() as f32).next_up();
    Bounds { centre, radius }
}
