//! Turns a scene into the list of what has to be modelled for it, and why.

use crate::scene::{Geometry, Object, SceneLight, Sides};
use photonstream_shading::LightShape;
use std::collections::HashMap;

/// What a scene contains.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Features {
    /// Number of point lights.
    pub point_lights: u32,
    /// Number of spot lights.
    pub spot_lights: u32,
    /// Number of directional lights.
    pub directional_lights: u32,
    /// Number of area lights: parallelograms and triangles.
    pub area_lights: u32,
    /// Number of skies: 0 or 1.
    pub skies: u32,
    /// Columns of flux, one for each light up to the configured number.
    pub light_columns: u32,
    /// Number of objects.
    pub objects: u32,
    /// Objects of which both sides reflect.
    pub two_sided_objects: u32,
    /// Objects that show an area light.
    pub emitters: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Undirected edges that only one triangle has, with corners at equal positions taken as one.
    ///
    /// 0 means that no surface ends in the open: light within a room cannot leave it. More than 0 may still be a
    /// closed room, where edges lie on the middle of other faces.
    pub open_edges: u32,
    /// Objects that are animated.
    pub moving_objects: u32,
    /// Lights whose place or direction is animated, or that an animated object shows.
    pub moving_lights: u32,
    /// Textures of materials.
    pub textures: u32,
}

/// One question of what to model, with its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decision {
    /// What could be modelled.
    pub what: &'static str,
    /// Whether it is.
    pub modelled: bool,
    /// Why.
    pub reason: String,
}

impl Features {
    /// Looks through a scene.
    pub(crate) fn scan(
        objects: &[Object],
        lights: &[SceneLight],
        geometry: &Geometry,
        light_columns: u32,
    ) -> Self {
        let count =
            |kind: fn(&LightShape) -> bool| lights.iter().filter(|l| kind(&l.light.shape)).count() as u32;
        Self {
            point_lights: count(|s| matches!(s, LightShape::Point { .. })),
            spot_lights: count(|s| matches!(s, LightShape::Spot { .. })),
            directional_lights: count(|s| matches!(s, LightShape::Directional { .. })),
            area_lights: count(|s| {
                matches!(
                    s,
                    LightShape::Parallelogram { .. } | LightShape::Triangle { .. } | LightShape::Mesh { .. }
                )
            }),
            skies: count(|s| s.sky().is_some()),
            light_columns: light_columns.min(lights.len() as u32),
            objects: objects.len() as u32,
            two_sided_objects: objects.iter().filter(|o| o.sides == Sides::Both).count() as u32,
            emitters: objects.iter().filter(|o| o.emitter.is_some()).count() as u32,
            triangles: geometry.triangles.len() as u32,
            open_edges: open_edges(geometry),
            moving_objects: 0,
            moving_lights: 0,
            textures: 0,
        }
    }

    /// Number of lights.
    pub fn lights(&self) -> u32 {
        self.point_lights + self.spot_lights + self.directional_lights + self.area_lights + self.skies
    }

    /// Whether no surface ends in the open; see [`Features::open_edges`].
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0
    }

    /// What is modelled and what is not, each with its reason.
    pub fn decisions(&self) -> Vec<Decision> {
        let lights = |what: &'static str, count: u32| Decision {
            what,
            modelled: count > 0,
            reason: match count {
                0 => "the scene has none".into(),
                1 => "the scene has 1".into(),
                n => format!("the scene has {n}"),
            },
        };
        let of_objects = |count: u32, what: &str| format!("{count} of {} objects {what}", self.objects);
        vec![
            lights("point lights", self.point_lights),
            lights("spot lights", self.spot_lights),
            lights("directional lights", self.directional_lights),
            lights("area lights", self.area_lights),
            lights("sky", self.skies),
            Decision {
                what: "flux per light",
                modelled: self.light_columns > 1,
                reason: match self.lights() {
                    0 => "the scene has no light".into(),
                    1 => "the scene has 1 light: its flux is all flux".into(),
                    n => format!("the scene has {n} lights, in {} columns", self.light_columns),
                },
            },
            Decision {
                what: "back sides",
                modelled: self.two_sided_objects > 0,
                reason: of_objects(self.two_sided_objects, "reflect on both sides"),
            },
            Decision {
                what: "visible emitters",
                modelled: self.emitters > 0,
                reason: of_objects(self.emitters, "emit light"),
            },
            Decision {
                what: "escaping light",
                modelled: !self.is_closed() || self.directional_lights + self.skies > 0,
                reason: match (self.open_edges, self.directional_lights + self.skies) {
                    (0, 0) => "every edge joins triangles: no surface ends in the open".into(),
                    (0, _) if self.skies > 0 => "light of the sky comes from outside".into(),
                    (0, _) => "directional light comes from outside".into(),
                    (1, _) => "1 edge has a triangle on one side only".into(),
                    (n, _) => format!("{n} edges have a triangle on one side only"),
                },
            },
            Decision {
                what: "motion",
                modelled: self.moving_objects + self.moving_lights > 0,
                reason: format!(
                    "{} of {} objects and {} of {} lights move",
                    self.moving_objects,
                    self.objects,
                    self.moving_lights,
                    self.lights()
                ),
            },
            Decision {
                what: "textures",
                modelled: self.textures > 0,
                reason: "all materials have one colour".into(),
            },
        ]
    }
}

/// Counts the edges that one triangle alone has; positions are welded by their bits (the baker leaves no -0).
fn open_edges(geometry: &Geometry) -> u32 {
    let mut ids = HashMap::with_capacity(geometry.vertices.len());
    let welded: Vec<u32> = geometry
        .vertices
        .iter()
        .map(|v| {
            let next = ids.len() as u32;
            *ids.entry(v.to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut edges: Vec<(u32, u32)> = geometry
        .triangles
        .iter()
        .flat_map(|t| {
            let [a, b, c] = t.map(|i| welded[i as usize]);
            [(a.min(b), a.max(b)), (b.min(c), b.max(c)), (c.min(a), c.max(a))]
        })
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).count() as u32
}
