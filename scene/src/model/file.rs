//! Turns the path of a model into what is known of the file: format, axes, unit, camera.

use super::{
    ModelOptions, frame,
    survey::Survey,
    view::{self, View},
};
use crate::{
    config::{
        CameraConfig, GltfConfig, MaterialConfig, ObjConfig, ObjectConfig, OneOrThree, PlyConfig,
        SceneConfig, UpAxis, Vector,
    },
    error::SceneError,
    import::{FileCamera, Frame, gltf_cameras},
    scene::{Scene, Sides},
};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Format of a model file, by its suffix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Gltf,
    Obj,
    Ply,
}

impl Kind {
    pub(super) fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "glb" | "gltf" => Some(Self::Gltf),
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}

/// Name of the object that imports the model.
pub(super) const OBJECT: &str = "model";
/// Name and albedo of the material of what has none.
pub(super) const GREY: (&str, f64) = ("grey", 0.5);

/// A model file and what has been found out about it.
#[derive(Clone, Debug)]
pub(super) struct ModelFile {
    /// As it was given.
    given: PathBuf,
    pub(super) kind: Kind,
    /// Absolute, as text.
    pub(super) path: String,
    pub(super) up_axis: UpAxis,
    pub(super) unit_m: f64,
    pub(super) two_sided: bool,
}

impl ModelFile {
    /// # Errors
    /// If there is no such file, or its path is not UTF-8.
    pub(super) fn open(path: &Path, options: &ModelOptions) -> Result<Self, SceneError> {
        let read = |source| SceneError::Read { file: path.to_owned(), source };
        let absolute = std::path::absolute(path).map_err(read)?;
        std::fs::File::open(&absolute).map_err(read)?;
        let text = absolute.to_str().ok_or_else(|| {
            read(std::io::Error::new(std::io::ErrorKind::InvalidFilename, "its path is not valid UTF-8"))
        })?;
        Ok(Self {
            given: path.to_owned(),
            kind: Kind::of(path).expect("invariant: called for models only"),
            path: text.to_owned(),
            up_axis: options.up_axis.unwrap_or_default(),
            unit_m: options.unit_m.unwrap_or(1.0),
            two_sided: false,
        })
    }

    /// The table that imports the file.
    fn object(&self) -> ObjectConfig {
        let (path, up_axis, unit_m) = (self.path.clone(), Some(self.up_axis), Some(self.unit_m));
        let mut object = ObjectConfig::default();
        match self.kind {
            Kind::Gltf => object.gltf = Some(GltfConfig { path, up_axis, unit_m, ..Default::default() }),
            Kind::Obj => object.obj = Some(ObjConfig { path, up_axis, unit_m, ..Default::default() }),
            Kind::Ply => {
                object.ply = Some(PlyConfig { path, up_axis, unit_m, smooth: None });
                object.material = Some(GREY.0.into());
            }
        }
        if self.kind != Kind::Gltf {
            object.sides = Some(if self.two_sided { Sides::Both } else { Sides::Front });
        }
        object
    }

    /// The model alone, seen from anywhere.
    ///
    /// # Errors
    /// If it is no valid model.
    pub(super) fn scene(&self) -> Result<Scene, SceneError> {
        let camera = CameraConfig {
            position_m: Some(Vector([0.0, 0.0, 1.0])),
            target_m: Some(Vector::default()),
            vertical_fov_deg: Some(40.0),
            ..Default::default()
        };
        let text = toml::to_string(&camera).expect("invariant: numbers are TOML");
        let mut config =
            SceneConfig::from_text(&format!("[camera]\n{text}"), &self.given)?.without_text(Vec::new());
        config.material.insert(GREY.0.into(), MaterialConfig { albedo: OneOrThree([GREY.1; 3]) });
        config.object.insert(OBJECT.into(), self.object());
        config.build().map_err(without_table)
    }

    /// Up axis and unit of a file that has none; true where they are others than the file was read with.
    pub(super) fn choose_frame(
        &mut self,
        options: &ModelOptions,
        scene: &Scene,
        survey: &Survey,
        is_interior: bool,
        choices: &mut Vec<String>,
    ) -> bool {
        let before = (self.up_axis, self.unit_m);
        if self.kind != Kind::Gltf && options.up_axis.is_none() {
            let (axis, why) = frame::up_axis(scene, survey, is_interior);
            self.up_axis = axis;
            choices.push(format!("up: the file's {} axis, {why}", axis.name()));
        }
        if self.kind != Kind::Gltf && options.unit_m.is_none() {
            let (low, high) = scene.bvh.bounds();
            let longest = f64::from((high - low).max_element());
            self.unit_m = frame::unit_m(longest);
            choices.push(format!(
                "unit: {} m, which makes its longest side of {longest:.4} units {:.4} m",
                self.unit_m,
                longest * self.unit_m
            ));
        }
        before != (self.up_axis, self.unit_m)
    }

    /// The first perspective camera of the file, and its view in a scene around `origin`.
    pub(super) fn view(&self, origin: DVec3) -> Option<(FileCamera, View)> {
        if self.kind != Kind::Gltf {
            return None;
        }
        // What is wrong with the file has been told.
        let cameras = gltf_cameras(Path::new(&self.path), Frame::new(self.up_axis, self.unit_m)).ok()?;
        let camera = cameras.into_iter().next()?;
        let position = (camera.position - origin).as_vec3();
        let (width, height) = view::SIZE;
        let shape = |aspect: f64| ((f64::from(height) * aspect).round() as u32).clamp(64, 4096);
        let view = View {
            position,
            target: (camera.position + camera.forward - origin).as_vec3(),
            up: camera.up.as_vec3(),
            vertical_fov_deg: camera.vertical_fov_deg as f32,
            size: (camera.aspect_ratio.map_or(width, shape), height),
        };
        view.camera().is_some().then_some((camera, view))
    }
}

/// The error of a scene that was made from a model, without the names of tables that nobody wrote.
pub(super) fn without_table(error: SceneError) -> SceneError {
    match error {
        SceneError::Asset { mut place, asset, problem, .. } => {
            (place.line_column, place.field) = (None, String::new());
            SceneError::Asset { place, asset, problem, remedy: "export it anew".into() }
        }
        other => other,
    }
}
