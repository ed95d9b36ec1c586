//! Turns a [`SceneConfig`] into a [`Scene`]: validates every value, imports, bakes, names and hashes.

mod camera;
mod imported;
mod imported_cameras;
mod imported_lights;
mod imported_motion;
mod imported_names;
mod imported_parts;
pub(crate) mod lights;
mod materials;
mod objects;
mod settings;
pub(crate) mod sky;
mod steady_state;
mod vpl_flaws;
pub(crate) mod vpls;

use crate::{
    animation::{self, Rig},
    bake::{self, Baked, BakedEmitter, Part, Strength},
    bvh::{Holes, SceneBvh, TreeCache},
    config::{Document, Field, LightConfig, SceneConfig},
    error::SceneError,
    features::Features,
    import::AssetRoots,
    placement::Placement,
    scene::{LightId, ObjectId, Scene, SceneLight, StillLight},
    settings::Method,
    texturing,
    vpls::VplTables,
};
use glam::DVec3;
pub(crate) use lights::not_one_of;
use materials::Materials;
use photonstream_shading::{Light, LightShape};
use std::{collections::BTreeMap, f64::consts::PI, path::Path, sync::Arc};

impl Scene {
    /// Loads a scene file.
    ///
    /// # Errors
    /// If the file or an asset cannot be read, or anything in it is not valid.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        SceneConfig::from_file(path)?.build()
    }

    /// Loads [`Scene::resolved_text`]: gives the same scene bit for bit, as long as its assets stay as they are.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn from_resolved(text: &str) -> Result<Self, SceneError> {
        SceneConfig::from_text(text, Path::new("resolved scene"))?.build()
    }
}

impl SceneConfig {
    /// Validates the config, loads its assets and bakes its geometry.
    ///
    /// # Errors
    /// If an asset cannot be read, or any value is not valid.
    pub fn build(self) -> Result<Scene, SceneError> {
        let roots = AssetRoots::from_environment(&self.document.file);
        self.build_with(&roots)
    }

    /// As [`SceneConfig::build`], with assets of relative path looked for in `roots`.
    ///
    /// # Errors
    /// As for [`SceneConfig::build`].
    pub fn build_with(mut self, roots: &AssetRoots) -> Result<Scene, SceneError> {
        let document = std::mem::take(&mut self.document);
        let root = Field::root(&document);
        let name = self.name.get_or_insert_with(|| stem(&document)).clone();
        let mut animation = animation::read(&mut self, &root)?;
        // A scene is loaded as it is at its beginning.
        animation.write(0.0, &mut self);
        let streaming = settings::streaming(
            &mut self.streaming,
            self.render.visibility.unwrap_or_default(),
            &root.key("streaming"),
        )?;
        let render = settings::render(&mut self.render, &root.key("render"))?;
        let mut materials = Materials::read(&self.material, &root.key("material"))?;

        let mut inputs = Inputs {
            parts: BTreeMap::new(),
            lights: BTreeMap::new(),
            written: BTreeMap::new(),
            contents: BTreeMap::new(),
            sky_content: None,
            files: Vec::new(),
            rigs: Vec::new(),
            imports: BTreeMap::new(),
            still_lights: Vec::new(),
            cameras: BTreeMap::new(),
        };
        let mut notices = Vec::new();
        objects::read(
            &mut self.object,
            &root.key("object"),
            roots,
            &mut materials,
            &mut inputs,
            &mut notices,
        )?;
        lights::read(&mut self.light, &root.key("light"), roots, &mut materials, &mut inputs)?;
        let parts: Vec<Part<'_>> = inputs.parts.into_values().collect();
        if parts.is_empty() {
            return Err(root.invalid("no object", "at least one", "add an [object.NAME] with a shape"));
        }

        let origin_m = match self.origin_m {
            Some(origin) => root.key("origin_m").metres(origin)?,
            None => bake::snapped_centre(bake::bounding_box(&parts)),
        };
        self.origin_m = Some(origin_m.into());
        imported_cameras::resolve(&mut self.camera, &inputs.cameras, &root.key("camera"))?;
        let camera = camera::camera(&mut self.camera, &root.key("camera"), origin_m)?;
        let materials = materials.into_list();
        let baked = bake::bake(parts, origin_m, &materials)?;
        notices.extend(baked.notices.iter().cloned());
        let (baked, lights) = join_lights(baked, inputs.lights, inputs.written, origin_m);
        let Baked { geometry, objects, rest_meshes, poses, bounds, .. } = baked;

        let ranges: Vec<_> = objects.iter().map(|o| o.triangles.clone()).collect();
        let cache = TreeCache::of_this_process();
        let mut bvh = SceneBvh::build_cached(&geometry.vertices, &geometry.triangles, &ranges, cache);
        bvh.set_holes(Holes::find(&geometry, &objects, &materials));
        let sky = lights.iter().position(|l| l.light.shape.sky().is_some()).map(|i| LightId(i as u32));
        let mut features = Features::scan(&objects, &lights, &geometry, streaming.light_columns);
        animation.carry(inputs.rigs, &objects);
        (features.moving_objects, features.moving_lights) = animation.moving(&objects, &lights);
        let lights_vpls = matches!(streaming.method, Method::StaticVpl | Method::PhantomVpl);
        if sky.is_some() && lights_vpls {
            let method = streaming.method.name();
            notices.push(format!(
                "method {method}: the sky lights no VPL; instant-radiosity and photon-streaming have it"
            ));
        }
        notices.extend(steady_state::notice(&features, &objects, &materials));
        let anchors = vpls::Anchors { objects: &objects, rest_meshes: &rest_meshes, origin: origin_m };
        let vpls = vpls::read(VplTables::of(&self), &root, streaming.method, &anchors)?;
        vpls.tables.clone().write(&mut self);
        // For those who edit the file: the scene is the same without.
        self.vpl.iter_mut().for_each(|vpl| vpl.placed = None);
        self.vpls.iter_mut().for_each(|vpls| vpls.placed = None);
        let (resolved_text, hash) = resolve(&mut self, &inputs.contents, inputs.sky_content.as_ref());
        let mut scene = Scene {
            name,
            hash,
            resolved_text,
            origin_m,
            materials,
            objects,
            lights,
            sky,
            camera,
            streaming,
            render,
            vpls: Arc::new(vpls),
            geometry: Arc::new(geometry),
            bvh,
            bounds,
            features,
            notices,
            choices: std::mem::take(&mut self.chosen),
            animation: Arc::new(animation),
            files: inputs.files.into(),
            rest_meshes: rest_meshes.into(),
            imports: inputs.imports,
            imported_lights: inputs.still_lights.into(),
            poses,
        };
        let vsl_area_m2 = scene.reflecting_area_m2() / scene.streaming.vsls.max(1) as f64;
        texturing::choose_levels(&mut scene, vsl_area_m2 as f32);
        let flaws = vpl_flaws::notices(&scene);
        scene.notices.extend(flaws);
        Ok(scene)
    }
}

/// What the tables of a config contribute to a scene, by name.
struct Inputs<'a> {
    /// Files that were read.
    files: Vec<std::path::PathBuf>,
    /// What moves the parts of imports.
    rigs: Vec<Rig>,
    /// How each import stands.
    imports: BTreeMap<String, Placement>,
    still_lights: Vec<StillLight>,
    /// Cameras of imported files, by the names of object and node.
    cameras: BTreeMap<String, imported_cameras::PlacedCamera>,
    parts: BTreeMap<String, Part<'a>>,
    /// Lights without a surface, in the config's coordinates.
    lights: BTreeMap<String, lights::PlainLight>,
    /// What the config says of them, or would say of those of an imported file.
    written: BTreeMap<String, LightConfig>,
    /// Absolute path and hash of the asset of each importing object.
    contents: BTreeMap<String, (String, blake3::Hash)>,
    /// The same of the map of the sky.
    sky_content: Option<(String, blake3::Hash)>,
}

fn stem(document: &Document) -> String {
    document.file.file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}

/// Brings all lights into one list, ordered by name, and links emitters with the objects that show them.
fn join_lights(
    mut baked: Baked,
    plain: BTreeMap<String, lights::PlainLight>,
    mut written: BTreeMap<String, LightConfig>,
    origin: DVec3,
) -> (Baked, Vec<SceneLight>) {
    let mut lights: Vec<SceneLight> = plain
        .into_iter()
        .map(|(name, light)| SceneLight {
            written: written.remove(&name),
            name,
            light: light.around(origin),
            enabled: true,
            object: None,
            face: None,
        })
        .collect();
    for BakedEmitter { object, strength, lights: shapes } in std::mem::take(&mut baked.emitters) {
        let name = &baked.objects[object.0 as usize].name;
        let digits = shapes.len().saturating_sub(1).to_string().len();
        let single = shapes.len() == 1;
        lights.extend(shapes.into_iter().enumerate().map(|(i, (face, shape))| SceneLight {
            name: if single { name.clone() } else { format!("{name}/{i:0digits$}") },
            light: area_light(shape, strength),
            enabled: true,
            object: Some(object),
            written: None,
            face: Some((face, strength)),
        }));
    }
    lights.sort_by(|a, b| a.name.cmp(&b.name));
    for (index, light) in lights.iter().enumerate() {
        if let Some(ObjectId(object)) = light.object {
            baked.objects[object as usize].emitter.get_or_insert(LightId(index as u32));
        }
    }
    (baked, lights)
}

/// The light of an emitting face.
pub(crate) fn area_light(shape: LightShape, strength: Strength) -> Light {
    let power = match strength {
        Strength::Power(power) => power,
        Strength::Radiance(radiance) => radiance * (PI * f64::from(shape.area())),
    };
    Light { shape, power: power.as_vec3() }
}

/// The resolved text with absolute asset paths, and the hash of the same text with the assets' content in their place:
/// equal wherever the assets lie, different as soon as they differ.
fn resolve(
    config: &mut SceneConfig,
    contents: &BTreeMap<String, (String, blake3::Hash)>,
    sky_content: Option<&(String, blake3::Hash)>,
) -> (Arc<str>, u64) {
    let mut text_with = |path_of: &dyn Fn(&(String, blake3::Hash)) -> String| {
        for (name, object) in &mut config.object {
            if let (Some(path), Some(content)) = (object.asset_path(), contents.get(name)) {
                *path = path_of(content);
            }
        }
        let skies = config.light.values_mut().filter_map(|light| light.sky.as_mut()?.map.as_mut());
        if let Some(content) = sky_content {
            skies.for_each(|path| *path = path_of(content));
        }
        toml::to_string(config).expect("invariant: a validated config has only values that TOML can hold")
    };
    let hashed = text_with(&|(_, hash)| format!("blake3:{}", hash.to_hex()));
    let resolved = text_with(&|(path, _)| path.clone());
    let hash = blake3::hash(hashed.as_bytes());
    let [a, b, c, d, e, f, g, h, ..] = *hash.as_bytes();
    (resolved.into(), u64::from_le_bytes([a, b, c, d, e, f, g, h]))
}

/// Refuses names that cannot be told from the names of imported and generated things.
fn check_name(name: &str, field: &Field<'_>) -> Result<(), SceneError> {
    if name.is_empty() || name.contains('/') || name.contains(char::is_control) {
        let expected = "a name of at least one character, without \"/\" and control characters";
        return Err(field.invalid(format!("{name:?}"), expected, "rename it"));
    }
    Ok(())
}
