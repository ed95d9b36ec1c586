//! Writes small glTF files, and loads them.

use base64::{Engine, prelude::BASE64_STANDARD};
use glam::Vec3;
use photonstream_scene::{AssetRoots, Scene, SceneConfig, SceneError};
use serde_json::{Value, json};
use std::{fs, path::Path};

/// The corners of a square of 2 × 2 that looks along +z, and a fifth that is not used.
pub(crate) const CORNERS: [[f32; 3]; 5] =
    [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [9.0, 9.0, 9.0]];
pub(crate) const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

/// Positions (60 bytes) and indices (12 bytes).
pub(crate) fn bytes() -> Vec<u8> {
    let positions = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes());
    positions.chain(INDICES.iter().flat_map(|i| i.to_le_bytes())).collect()
}

pub(crate) fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes))
}

/// A square of material `paint` on the node `square`.
pub(crate) fn square() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "square", "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{
            "name": "paint",
            "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.125, 1.0], "metallicFactor": 0.0 },
        }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": 60 },
            { "buffer": 0, "byteOffset": 60, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": 72, "uri": data_uri(&bytes()) }],
    })
}

/// The square with some of its JSON replaced.
pub(crate) fn with(changes: &[(&str, Value)]) -> Value {
    let mut file = square();
    for (pointer, value) in changes {
        match file.pointer_mut(pointer) {
            Some(place) => *place = value.clone(),
            None => {
                let (parent, key) = pointer.rsplit_once('/').unwrap();
                file.pointer_mut(parent).unwrap()[key] = value.clone();
            }
        }
    }
    file
}

pub(crate) struct Files(pub(crate) tempfile::TempDir);

impl Files {
    pub(crate) fn new(file: &Value) -> Self {
        Self::of_bytes(file.to_string().as_bytes())
    }

    pub(crate) fn of_bytes(bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.gltf"), bytes).unwrap();
        Self(folder)
    }

    pub(crate) fn build(&self, object: &str, keys: &str) -> Result<Scene, SceneError> {
        let text = format!(
            "origin_m = [0, 0, 0]\ncamera = {{ position_m = [0, 1, 4], target_m = [0, 1, 0], vertical_fov_deg = 40 }}\n\
             material.grey.albedo = 0.3\n[object.it]\n{object}\ngltf = {{ path = \"a.gltf\" {keys} }}\n"
        );
        let roots = AssetRoots { folders: vec![self.0.path().to_owned()] };
        SceneConfig::from_text(&text, Path::new("x.toml"))?.build_with(&roots)
    }

    pub(crate) fn scene(&self) -> Scene {
        self.build("", "").unwrap_or_else(|e| panic!("{e}"))
    }

    pub(crate) fn error(&self) -> String {
        self.build("", "").unwrap_err().to_string()
    }
}

pub(crate) fn scene(changes: &[(&str, Value)]) -> Scene {
    Files::new(&with(changes)).scene()
}

pub(crate) fn names(scene: &Scene) -> Vec<&str> {
    scene.objects.iter().map(|o| o.name.as_str()).collect()
}

/// The corners of an object's triangles, in order.
pub(crate) fn corners(scene: &Scene, object: &str) -> Vec<Vec3> {
    let object = &scene.objects[scene.object(object).unwrap().0 as usize];
    object.triangles.clone().flat_map(|t| scene.geometry.triangle(t)).collect()
}

pub(crate) fn light<'s>(scene: &'s Scene, name: &str) -> &'s photonstream_shading::Light {
    &scene.lights[scene.light(name).unwrap().0 as usize].light
}

pub(crate) fn glb(file: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = file.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    let length = 12 + 8 + text.len() + 8 + bin.len();
    [2, length as u32, text.len() as u32].iter().for_each(|n| out.extend(n.to_le_bytes()));
    out.extend(b"JSON");
    out.extend(text);
    out.extend((bin.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}
