//! Turns edits of lights, objects and materials into a new version of a scene, which shares all that they leave alone.

mod light;
mod material;
mod object;
mod place;
mod values;
mod vpls;

use crate::{
    bake::{self, Emitting, mesh_shape},
    build::area_light,
    bvh::Holes,
    config::{Document, Field, MAX_LENGTH_M},
    error::{SceneError, nearest},
    placement::Placement,
    pose::{self, Pose, RestMesh},
    scene::{Geometry, LightId, MaterialId, Object, ObjectId, Scene},
};
use glam::{DAffine3, DVec3, Vec3};
use photonstream_shading::{Light, surface};
use std::{collections::BTreeMap, sync::Arc};

pub(crate) use values::Values;

/// Edits of a scene: each is validated when it is made, and all are applied at once.
///
/// Of several edits of one object only the last costs anything.
#[derive(Clone, Debug)]
pub struct SceneEdit {
    scene: Scene,
    poses: BTreeMap<ObjectId, Pose>,
}

impl Scene {
    /// Begins to edit this version of the scene.
    pub fn edit(&self) -> SceneEdit {
        SceneEdit { scene: self.clone(), poses: BTreeMap::new() }
    }

    /// The scene with another light in the place of `id`: of the same kind, in the scene's space.
    ///
    /// # Errors
    /// If there is no such light, or a value is not finite or outside its domain.
    pub fn with_light(&self, id: LightId, light: Light) -> Result<Self, SceneError> {
        let mut edit = self.edit();
        edit.replace_light(id, light)?;
        Ok(edit.finish())
    }

    /// The scene with an object moved and scaled to where `world_from_loaded` puts it; its emitting faces move along.
    ///
    /// The map is that of [`Scene::world_from_loaded`]: from rest space as loaded to the scene's space, m, with orthogonal
    /// axes. An object put back where it was gives the scene as it was, bit for bit.
    ///
    /// # Errors
    /// If there is no such object, the axes are not orthogonal, a scale is beyond what a config may say, or the map leads
    /// beyond what f32 can hold.
    pub fn with_object_placed(&self, id: ObjectId, world_from_loaded: DAffine3) -> Result<Self, SceneError> {
        let mut edit = self.edit();
        edit.place_object(id, world_from_loaded)?;
        Ok(edit.finish())
    }
}

impl SceneEdit {
    /// Puts another light in the place of `id`; see [`Scene::with_light`].
    ///
    /// # Errors
    /// As [`Scene::with_light`].
    pub fn replace_light(&mut self, id: LightId, light: Light) -> Result<(), SceneError> {
        light::replace(&mut self.scene, id, light)
    }

    /// Changes the light called `name` by the keys of its table in a config, and `enabled`. Positions are in the
    /// config's coordinates.
    ///
    /// # Errors
    /// If there is no such light or key, or a value is not valid; nothing is changed then.
    pub fn set_light(&mut self, name: &str, values: &Values) -> Result<LightId, SceneError> {
        light::set(&mut self.scene, name, values)
    }

    /// Changes the material called `name` by the key `albedo` of its table in a config. Materials that imports and
    /// rectangles have brought along, `NAME/material` and `NAME/emitter`, may be changed too.
    ///
    /// # Errors
    /// If there is no such material or key, or the albedo is not within [0, 1]; nothing is changed then.
    pub fn set_material(&mut self, name: &str, values: &Values) -> Result<MaterialId, SceneError> {
        material::set(&mut self.scene, name, values)
    }

    /// Replaces the tables `vpl`, `blocker` and `proxy` of a config that are given, each as a whole, and those settings of `vpls`;
    /// what is not given stays. Positions are those of the scene as it is loaded, in the config's coordinates.
    ///
    /// # Errors
    /// If a key or value is not valid, or the method has nothing left that it needs; nothing is changed then.
    pub fn set_vpls(&mut self, values: &Values) -> Result<(), SceneError> {
        vpls::set(&mut self.scene, values)
    }

    /// Moves and scales an object; see [`Scene::with_object_placed`].
    ///
    /// # Errors
    /// As [`Scene::with_object_placed`].
    pub fn place_object(&mut self, id: ObjectId, world_from_loaded: DAffine3) -> Result<(), SceneError> {
        let document = Document::default();
        let field = Field::root(&document).key("object");
        let Some(object) = self.scene.objects.get(id.0 as usize) else {
            let count = self.scene.objects.len();
            return Err(field.invalid(
                format!("object {}", id.0),
                format!("a number below {count}"),
                "choose another object",
            ));
        };
        let field = field.key(&object.name).key("world_from_loaded");
        let mesh = &self.scene.rest_meshes[id.0 as usize];
        // Poses that give this very map are taken as they are: a map alone gives a pose to the rounding of f64.
        let pose = [self.scene.poses[id.0 as usize], mesh.loaded]
            .into_iter()
            .find(|pose| mesh.world_from_loaded(pose) == world_from_loaded)
            .map_or_else(|| place::pose(mesh, &self.pose(id), &world_from_loaded, &field), Ok)?;
        self.pose_object(id, pose, &field)
    }

    /// Moves the object called `name`, or all objects that the import `name` has made, by the keys `position_m`,
    /// `rotation_deg` and `scale` of a config; what is not given stays. Positions are in the config's coordinates. With an
    /// import go its lights: to where its file has them.
    ///
    /// A scale changes the object at rest: [`crate::Geometry::rest_vertices`], and [`crate::Geometry::triangles`] where
    /// it turns a mesh inside out, are others then.
    ///
    /// # Errors
    /// If there is no such object or key, or a value is not valid; nothing is changed then.
    pub fn move_object(&mut self, name: &str, values: &Values) -> Result<Vec<ObjectId>, SceneError> {
        object::set(self, name, values)
    }

    /// How an import stands, edits included.
    pub(crate) fn import(&self, name: &str) -> Option<Placement> {
        self.scene.imports.get(name).copied()
    }

    /// Puts the object called `name` where `placement` says, in the config's coordinates.
    ///
    /// # Errors
    /// If there is no such object, or it comes to lie beyond what f32 can hold.
    pub(crate) fn set_placement(&mut self, name: &str, placement: &Placement) -> Result<(), SceneError> {
        let document = Document::default();
        let table = Field::root(&document).key("object");
        let Some(id) = self.scene.object(name) else {
            let known = self.scene.objects.iter().map(|o| o.name.as_str());
            return Err(unknown_name(&table, "object", name, known));
        };
        self.pose_object(id, Pose::new(placement, self.scene.origin_m), &table.key(name))
    }

    /// The edited scene.
    ///
    /// It keeps the triangles that it was loaded with: those without an area at load stay left out, and those that lose
    /// theirs to rounding are kept and never hit. Features, text and hash stay those of the loaded scene.
    pub fn finish(self) -> Scene {
        let Self { mut scene, poses } = self;
        let moves: Vec<(ObjectId, Pose)> =
            poses.into_iter().filter(|(id, pose)| scene.poses[id.0 as usize] != *pose).collect();
        if moves.is_empty() {
            return scene;
        }
        let geometry = Arc::make_mut(&mut scene.geometry);
        resize(geometry, &scene.rest_meshes, &scene.poses, &scene.objects, &moves);
        for (id, pose) in &moves {
            let mesh = &scene.rest_meshes[id.0 as usize];
            let object = &mut scene.objects[id.0 as usize];
            object.world_from_rest = pose.world_from_rest(mesh.centre(pose.scale));
            object.world_from_own_normal = pose.world_from_own_normal();
            scene.poses[id.0 as usize] = *pose;
            let range = mesh.vertices.start as usize..mesh.vertices.end as usize;
            for (vertex, &own) in geometry.vertices[range].iter_mut().zip(&mesh.own) {
                *vertex = pose::round(pose.apply(own));
            }
            for triangle in object.triangles.clone() {
                geometry.normals[triangle as usize] = surface::normal(geometry.triangle(triangle))
                    .or_else(|| pose.turned_normal(geometry.rest_triangle(triangle)))
                    .unwrap_or(geometry.normals[triangle as usize]);
            }
        }
        let parts = moves.iter().map(|(id, _)| id.0 as usize);
        scene.bvh.rebuild_parts(parts, &geometry.vertices, &geometry.triangles);
        if scene.bvh.has_holes() {
            // A mesh turned inside out counts its corners the other way round.
            scene.bvh.set_holes(Holes::find(geometry, &scene.objects, &scene.materials));
        }
        scene.bounds = bake::sphere_around(&geometry.vertices);
        for light in &mut scene.lights {
            let (Some(object), Some((emitting, strength))) = (light.object, light.face) else { continue };
            if moves.iter().any(|(id, _)| *id == object) {
                let (mesh, pose) = (&scene.rest_meshes[object.0 as usize], &scene.poses[object.0 as usize]);
                let geometry = &scene.geometry;
                let shape = match emitting {
                    Emitting::Face(face) => mesh.light_shape(face, pose, &geometry.vertices),
                    Emitting::Mesh => {
                        let triangles = scene.objects[object.0 as usize].triangles.clone();
                        let shape = mesh_shape(triangles.map(|t| geometry.triangle(t)));
                        // Crushed to nothing it stays where it was, and its triangles are never hit.
                        shape.unwrap_or_else(|| light.light.shape.clone())
                    }
                };
                light.light = area_light(shape, strength);
                if !light.enabled {
                    light.light.power = Vec3::ZERO;
                }
            }
        }
        scene
    }

    /// Edits lights and objects all together, or not at all where one of them fails.
    pub(crate) fn all_or_nothing(
        &mut self,
        edits: impl FnOnce(&mut Self) -> Result<(), SceneError>,
    ) -> Result<(), SceneError> {
        let before = (self.scene.lights.clone(), self.scene.imports.clone(), self.poses.clone());
        let result = edits(self);
        if result.is_err() {
            (self.scene.lights, self.scene.imports, self.poses) = before;
        }
        result
    }

    /// The pose of an object, edits included.
    fn pose(&self, id: ObjectId) -> Pose {
        *self.poses.get(&id).unwrap_or(&self.scene.poses[id.0 as usize])
    }

    fn pose_object(&mut self, id: ObjectId, pose: Pose, field: &Field<'_>) -> Result<(), SceneError> {
        let mesh = &self.scene.rest_meshes[id.0 as usize];
        let farthest = mesh.own.iter().map(|&p| pose.apply(p)).find(|p| is_far(*p));
        if let Some(world) = farthest {
            return Err(field.invalid(
                format!("a vertex {world} m from the scene's origin"),
                "all vertices within 1e9 m of it",
                "move it nearer",
            ));
        }
        self.poses.insert(id, pose);
        Ok(())
    }
}

/// Gives objects of another size their vertices at rest, and those newly mirrored, or no longer, their other winding;
/// what no object needs to change stays shared.
fn resize(
    geometry: &mut Geometry,
    meshes: &[RestMesh],
    poses: &[Pose],
    objects: &[Object],
    moves: &[(ObjectId, Pose)],
) {
    let (mut rest, mut triangles) = (None, None);
    for (ObjectId(id), pose) in moves {
        let (id, before) = (*id as usize, &poses[*id as usize]);
        if pose.scale == before.scale {
            continue;
        }
        let (mesh, centre) = (&meshes[id], meshes[id].centre(pose.scale));
        let range = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let rest = rest.get_or_insert_with(|| geometry.rest_vertices.to_vec());
        for (vertex, &own) in rest[range].iter_mut().zip(&mesh.own) {
            *vertex = RestMesh::rest_vertex(own, pose.scale, centre);
        }
        if pose.is_mirrored() != before.is_mirrored() {
            let triangles = triangles.get_or_insert_with(|| geometry.triangles.to_vec());
            let range = objects[id].triangles.start as usize..objects[id].triangles.end as usize;
            triangles[range].iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }
    if let Some(rest) = rest {
        geometry.rest_vertices = rest.into();
    }
    if let Some(triangles) = triangles {
        geometry.triangles = triangles.into();
    }
}

/// Whether a point is beyond what f32 can hold well, or not finite.
fn is_far(point: DVec3) -> bool {
    !point.is_finite() || point.abs().max_element() > MAX_LENGTH_M
}

/// The error of a name that nothing has.
fn unknown_name<'a>(
    field: &Field<'_>,
    kind: &'static str,
    found: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> SceneError {
    SceneError::UnknownName {
        place: field.place(),
        kind,
        found: found.to_owned(),
        nearest: nearest(found, known.clone()),
        known: known.map(str::to_owned).collect(),
    }
}
