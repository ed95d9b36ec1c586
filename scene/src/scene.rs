//! Gathers what a loaded scene is: baked geometry, materials, lights, camera, settings and the ray-tracing structure.

use crate::{
    animation::Animation,
    bake::{Emitting, Strength},
    bvh::SceneBvh,
    config::LightConfig,
    features::Features,
    picture::Texture,
    placement::Placement,
    pose::{Pose, RestMesh},
    settings::{RenderSettings, StreamingSettings},
    vpls::VplSet,
};
use glam::{DAffine3, DVec3, Mat3, Vec2, Vec3};
use photonstream_shading::{Camera, Light, light::Bounds, surface};
use std::{collections::BTreeMap, ops::Range, sync::Arc};

/// Index of an object in [`Scene::objects`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

/// Index of a material in [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct MaterialId(pub u32);

/// Index of a light in [`Scene::lights`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightId(pub u32);

/// A loaded, validated scene. Immutable: a change makes a new one, which shares what it can.
///
/// Positions in f32 are metres relative to [`Scene::origin_m`], so that a scene far from its coordinates' origin has
/// the same precision as one at it.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the config calls it, else its file's stem.
    pub name: String,
    /// Hash of all that determines the scene: resolved text and the content of its assets. Equal on every machine.
    pub hash: u64,
    /// The config with every default filled in and asset paths made absolute: a process that parses it gets this scene
    /// as it was loaded. Edits change neither text nor hash: they are published as records.
    pub resolved_text: Arc<str>,
    /// Where the scene's own origin lies in the coordinates of its config.
    pub origin_m: DVec3,
    /// Surfaces' reflectances, ordered by name.
    pub materials: Vec<Material>,
    /// Everything that can be hit, ordered by name.
    pub objects: Vec<Object>,
    /// Light sources, ordered by name.
    pub lights: Vec<SceneLight>,
    /// The light from all directions, if there is one.
    pub sky: Option<LightId>,
    /// From where pictures are taken.
    pub camera: Camera,
    /// Settings of the simulation.
    pub streaming: StreamingSettings,
    /// Default settings of the renderers.
    pub render: RenderSettings,
    /// What the methods of few lights know of it.
    pub vpls: Arc<VplSet>,
    /// All triangles, in world space.
    pub geometry: Arc<Geometry>,
    /// Answers closest-hit and occlusion queries over `geometry`.
    pub bvh: SceneBvh,
    /// The sphere around all geometry.
    pub bounds: Bounds,
    /// What the scene contained when it was loaded, hence what has to be modelled.
    pub features: Features,
    /// What was repaired or left out while loading, one sentence each.
    pub notices: Vec<String>,
    /// What was chosen for a model without a scene file, one sentence each.
    pub choices: Vec<String>,
    /// What moves and dims lights and objects; as loaded, the scene is what it is at time 0.
    pub animation: Arc<Animation>,
    /// Files that the scene was read from, beside its config.
    pub files: Arc<[std::path::PathBuf]>,
    /// The mesh of each object, to be posed anew.
    pub(crate) rest_meshes: Arc<[RestMesh]>,
    /// How each object stands.
    /// How each import that has several objects stands.
    pub(crate) imports: BTreeMap<String, Placement>,
    /// Lights of imports that stand still in these.
    pub(crate) imported_lights: Arc<[StillLight]>,
    pub(crate) poses: Vec<Pose>,
}

/// The diffuse reflectance of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the config.
    pub name: String,
    /// Share of the arriving light that leaves again, linear RGB in [0, 1]; with a texture, what that is multiplied by.
    pub albedo: Vec3,
    /// What the albedo is multiplied by from place to place.
    pub texture: Option<Texture>,
}

/// Which faces of an object's triangles reflect light. The others absorb it, and look black.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Sides {
    /// The side the normal points to: the outside of a closed body.
    #[default]
    Front,
    /// The other side: the inside of a closed body.
    Back,
    /// Both, each with light of its own.
    Both,
}

/// One side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The side its normal points to.
    Front = 0,
    /// The other side.
    Back = 1,
}

impl Sides {
    /// Whether `side` reflects light.
    #[inline]
    pub fn contains(self, side: Side) -> bool {
        matches!((self, side), (Self::Both, _) | (Self::Front, Side::Front) | (Self::Back, Side::Back))
    }

    /// The reflecting sides.
    pub fn iter(self) -> impl Iterator<Item = Side> {
        [Side::Front, Side::Back].into_iter().filter(move |&side| self.contains(side))
    }
}

impl Side {
    /// +1 for the front, -1 for the back: times the geometric normal, the normal of this side.
    #[inline]
    pub fn sign(self) -> f32 {
        match self {
            Self::Front => 1.0,
            Self::Back => -1.0,
        }
    }
}

/// Something that can be hit, moved as a whole, and owns virtual surface lights.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the config.
    pub name: String,
    /// Its reflectance.
    pub material: MaterialId,
    /// Which faces reflect.
    pub sides: Sides,
    /// The level of its texture that the light transport looks at: [`crate::Detail::Transport`].
    pub transport_level: u32,
    /// Its triangles in [`Geometry::triangles`].
    pub triangles: Range<u32>,
    /// Rigid motion from rest space (the object at its final size, neither turned nor moved) to the scene's space.
    pub world_from_rest: DAffine3,
    /// Leads from normals in the object's own coordinates to such in the scene's space, not of unit length: the inverse
    /// transpose of its scale, rotation and shift.
    pub world_from_own_normal: Mat3,
    /// The light whose radiance its front emits, for emitters; an imported emitter may be several lights of equal
    /// radiance, of which this is the first.
    pub emitter: Option<LightId>,
}

/// A light with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// Name in the config.
    pub name: String,
    /// Shape and power, in the scene's space; no power while it is switched off.
    pub light: Light,
    /// Whether it is switched on.
    pub enabled: bool,
    /// The object that shows the emitter, for area lights.
    pub object: Option<ObjectId>,
    /// What the config says of it, and edits since; `None` for lights with a surface.
    pub(crate) written: Option<LightConfig>,
    /// What of `object` emits, and how much.
    pub(crate) face: Option<(Emitting, Strength)>,
}

/// A light of a file on a node that its animation does not move.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StillLight {
    /// Name of the object that imports the file.
    pub(crate) import: String,
    pub(crate) light: String,
    /// In the import's own coordinates, m; `None` where it has none.
    pub(crate) position: Option<DVec3>,
    /// The same, of any length but 0.
    pub(crate) direction: Option<DVec3>,
}

/// All triangles of a scene; what does not change when objects move at their size is shared by all versions of the scene.
///
/// Triangles without area are left out at load; mirrored objects have their winding turned,
/// so that normals point outwards.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Geometry {
    /// Vertices in the scene's space.
    pub vertices: Vec<Vec3>,
    /// The same vertices in the rest space of their object.
    pub rest_vertices: Arc<[Vec3]>,
    /// Texture coordinates of the vertices, rows counted from the top; none at all where nothing has a texture.
    pub uvs: Arc<[Vec2]>,
    /// Unit shading normals of the vertices in the own coordinates of their object, zero where one has none; none at all in
    /// a scene of flat surfaces. [`Object::world_from_own_normal`] leads to the scene's space.
    pub own_normals: Arc<[Vec3]>,
    /// Vertex indices, counter-clockwise seen from the front; those of one object are contiguous.
    pub triangles: Arc<[[u32; 3]]>,
    /// Unit geometric normal of the front of each triangle, in the scene's space.
    pub normals: Vec<Vec3>,
    /// The object of each triangle.
    pub object_of: Arc<[ObjectId]>,
}

impl Geometry {
    /// The vertices of triangle `id` in the scene's space.
    #[inline]
    pub fn triangle(&self, id: u32) -> [Vec3; 3] {
        self.triangles[id as usize].map(|v| self.vertices[v as usize])
    }

    /// The vertices of triangle `id` in its object's rest space.
    #[inline]
    pub fn rest_triangle(&self, id: u32) -> [Vec3; 3] {
        self.triangles[id as usize].map(|v| self.rest_vertices[v as usize])
    }
}

impl Geometry {
    /// The texture coordinates of the corners of triangle `id`; `None` in a scene without.
    #[inline]
    pub fn uv_triangle(&self, id: u32) -> Option<[Vec2; 3]> {
        if self.uvs.is_empty() {
            return None;
        }
        Some(self.triangles[id as usize].map(|v| self.uvs[v as usize]))
    }
}

impl Scene {
    /// The shading normals of the corners of triangle `id`, front side, unit, in the scene's space; `None` for a flat triangle.
    #[inline]
    pub fn corner_normals(&self, id: u32) -> Option<[Vec3; 3]> {
        let geometry = &self.geometry;
        if geometry.own_normals.is_empty() {
            return None;
        }
        let map = self.objects[geometry.object_of[id as usize].0 as usize].world_from_own_normal;
        let own = geometry.triangles[id as usize].map(|v| geometry.own_normals[v as usize]);
        if own.contains(&Vec3::ZERO) {
            return None;
        }
        Some(own.map(|normal| (map * normal).normalize_or_zero()))
    }

    /// The unit normal by which a picture weighs the light that arrives at (u, v) of a triangle, front side, in the scene's
    /// space. Light that goes on from there bounces off the flat triangle.
    #[inline]
    pub fn shading_normal(&self, id: u32, [u, v]: [f32; 2]) -> Vec3 {
        let flat = self.geometry.normals[id as usize];
        let Some([a, b, c]) = self.corner_normals(id) else { return flat };
        surface::shading_normal(flat, a * (1.0 - u - v) + b * u + c * v)
    }
}

impl Object {
    /// Whether `name` is the object's, or that of the import it comes from.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        self.name.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    }
}

impl Scene {
    /// The object called `name`.
    pub fn object(&self, name: &str) -> Option<ObjectId> {
        self.objects.binary_search_by(|o| o.name.as_str().cmp(name)).ok().map(|i| ObjectId(i as u32))
    }

    /// The map from the rest space of an object as [`Scene::resolved_text`] loads it to the scene's space, m: a scale along
    /// the object's axes (what its size has grown by, negative where an edit has mirrored it), a rotation, a shift.
    ///
    /// Equal to [`Object::world_from_rest`] at the size it was loaded with; [`Scene::with_object_placed`] takes it.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn world_from_loaded(&self, object: ObjectId) -> DAffine3 {
        let index = object.0 as usize;
        self.rest_meshes[index].world_from_loaded(&self.poses[index])
    }

    /// The light called `name`.
    pub fn light(&self, name: &str) -> Option<LightId> {
        self.lights.binary_search_by(|l| l.name.as_str().cmp(name)).ok().map(|i| LightId(i as u32))
    }

    /// The material called `name`.
    pub fn material(&self, name: &str) -> Option<MaterialId> {
        self.materials.binary_search_by(|m| m.name.as_str().cmp(name)).ok().map(|i| MaterialId(i as u32))
    }

    /// The reflectance of an object, linear RGB; what its texture, if it has one, is multiplied by.
    #[inline]
    pub fn albedo(&self, object: ObjectId) -> Vec3 {
        self.materials[self.objects[object.0 as usize].material.0 as usize].albedo
    }

    /// The radiance (W m⁻² sr⁻¹) that comes from infinitely far away in the direction `wi` of unit length: what a ray sees
    /// that hits nothing.
    #[inline]
    pub fn background(&self, wi: Vec3) -> Vec3 {
        self.sky.map_or(Vec3::ZERO, |sky| self.lights[sky.0 as usize].light.background(wi))
    }

    /// The radiance (W m⁻² sr⁻¹) that `side` of an object emits.
    #[inline]
    pub fn emitted_radiance(&self, object: ObjectId, side: Side) -> Vec3 {
        match (self.objects[object.0 as usize].emitter, side) {
            (Some(light), Side::Front) => self.lights[light.0 as usize].light.emitted_radiance(),
            _ => Vec3::ZERO,
        }
    }
}
