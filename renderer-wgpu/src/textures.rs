//! Turns a scene's textures into one buffer of texels that shaders look up by themselves, as the CPU does.
//!
//! No sampler and no array of textures: every device can do it, pictures may have any size, and the numbers are those of
//! [`photonstream_shading::texture`].

use crate::{
    Gpu,
    geometry::buffer,
    layout::{TextureCorner, TextureLayoutUniform},
};
use glam::Vec2;
use photonstream_scene::{ObjectId, Scene, Texture};
use photonstream_shading::texture;
use std::sync::Arc;
use wgpu::BufferUsages;

/// The textures of a scene on the device.
#[derive(Debug)]
pub(crate) struct Textures {
    /// Texture coordinates of the corners, and texels in a metre there.
    pub(crate) corners: wgpu::Buffer,
    pub(crate) texels: wgpu::Buffer,
    /// One for each object; without levels for those without a texture.
    pub(crate) layouts: wgpu::Buffer,
    /// Whether any has holes.
    has_holes: bool,
    /// What it was made from.
    source: Arc<Source>,
}

/// What the textures on a device are made from.
#[derive(Debug)]
pub(crate) struct Source {
    uvs: Arc<[Vec2]>,
    triangles: Arc<[[u32; 3]]>,
    object_of: Arc<[ObjectId]>,
    rest_vertices: Arc<[glam::Vec3]>,
    of_object: Vec<Option<Texture>>,
}

impl Source {
    /// That of a scene with texture coordinates.
    pub(crate) fn of(scene: &Scene) -> Self {
        let geometry = &scene.geometry;
        let of_object = scene.objects.iter().map(|o| scene.materials[o.material.0 as usize].texture.clone());
        Self {
            uvs: Arc::clone(&geometry.uvs),
            triangles: Arc::clone(&geometry.triangles),
            object_of: Arc::clone(&geometry.object_of),
            rest_vertices: Arc::clone(&geometry.rest_vertices),
            of_object: of_object.collect(),
        }
    }

    fn is_same(&self, other: &Self) -> bool {
        fn same<T: PartialEq>(a: &Arc<[T]>, b: &Arc<[T]>) -> bool {
            Arc::ptr_eq(a, b) || a == b
        }
        same(&self.uvs, &other.uvs)
            && same(&self.triangles, &other.triangles)
            && same(&self.object_of, &other.object_of)
            && same(&self.rest_vertices, &other.rest_vertices)
            && self.of_object == other.of_object
    }

    /// Number of the scene's triangles.
    pub(crate) fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// The texture of each object that has holes.
    pub(crate) fn holes(&self) -> impl Iterator<Item = Option<&Texture>> {
        let has_holes = |texture: &&Texture| texture.cutoff.is_some();
        self.of_object.iter().map(move |texture| texture.as_ref().filter(has_holes))
    }

    /// The number of a triangle's object.
    pub(crate) fn object_of(&self, triangle: u32) -> usize {
        self.object_of[triangle as usize].0 as usize
    }

    /// The texture coordinates of the corners of a triangle.
    pub(crate) fn uv_triangle(&self, triangle: u32) -> [Vec2; 3] {
        self.triangles[triangle as usize].map(|vertex| self.uvs[vertex as usize])
    }
}

impl Textures {
    /// What the holes of these textures are found in, where there are any.
    pub(crate) fn holes(&self) -> Option<&Arc<Source>> {
        self.has_holes.then_some(&self.source)
    }

    /// The textures of `scene`, or `last` where they are the same; `None` for a scene without, and whether they are new.
    pub(crate) fn update(gpu: &Gpu, scene: &Scene, last: Option<Self>) -> (Option<Self>, bool) {
        if !scene.is_textured() || scene.geometry.uvs.is_empty() {
            let had = last.is_some();
            return (None, had);
        }
        let source = Source::of(scene);
        match last {
            Some(last) if last.source.is_same(&source) => (Some(last), false),
            _ => (Some(Self::new(gpu, scene, source)), true),
        }
    }

    fn new(gpu: &Gpu, scene: &Scene, source: Source) -> Self {
        let limits = gpu.device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 8;
        let (texels, layouts) = table(&source.of_object, most);
        let upload = |label, bytes: &[u8], usage| {
            let buffer = buffer(gpu, label, bytes.len() as u64, usage);
            gpu.queue.write_buffer(&buffer, 0, bytes);
            buffer
        };
        let corners = corners(scene, &layouts);
        Self {
            corners: upload("texture coordinates", bytemuck::cast_slice(&corners), BufferUsages::VERTEX),
            texels: upload("texels", bytemuck::cast_slice(&texels), BufferUsages::STORAGE),
            layouts: upload("layouts of textures", bytemuck::cast_slice(&layouts), BufferUsages::STORAGE),
            has_holes: scene.bvh.has_holes(),
            source: Arc::new(source),
        }
    }
}

/// All texels, each picture once, and where those of each object are; the largest pictures go without their finest levels
/// until all have at most `most` texels together.
fn table(of_object: &[Option<Texture>], most: u64) -> (Vec<[u32; 2]>, Vec<TextureLayoutUniform>) {
    // Each picture, and how many levels of it are left out.
    let mut pictures: Vec<(&Texture, u32)> = Vec::new();
    let same = |a: &Texture, b: &Texture| Arc::ptr_eq(&a.picture, &b.picture);
    for texture in of_object.iter().flatten() {
        if !pictures.iter().any(|(known, _)| same(known, texture)) {
            pictures.push((texture, 0));
        }
    }
    let count = |(texture, skipped): &(&Texture, u32)| {
        let first = texture.layout.level(*skipped).first - texture.layout.first;
        u64::from(texture.layout.texels() - first)
    };
    while pictures.iter().map(count).sum::<u64>() > most {
        let can_shrink = pictures.iter_mut().filter(|(texture, skipped)| skipped + 1 < texture.layout.levels);
        let Some(largest) = can_shrink.max_by_key(|p| count(p)) else { break };
        largest.1 += 1;
    }
    let mut texels = Vec::new();
    let mut firsts = Vec::new();
    for (texture, skipped) in &pictures {
        firsts.push(texels.len() as u32);
        let first = texture.layout.level(*skipped).first as usize;
        texels.extend_from_slice(&texture.picture.texels()[first..]);
    }
    let layout = |texture: &Texture| {
        let index = pictures.iter().position(|(known, _)| same(known, texture));
        let index = index.expect("invariant: every texture's picture was listed above");
        let skipped = pictures[index].1;
        let level = texture.layout.level(skipped);
        TextureLayoutUniform {
            first: firsts[index],
            width: level.width,
            height: level.height,
            levels: texture.layout.levels - skipped,
            wrap_u: texture.layout.wrap_u as u32,
            wrap_v: texture.layout.wrap_v as u32,
            cutoff: texture.cutoff.unwrap_or(-1.0),
            pad_0: 0,
        }
    };
    let layouts = of_object.iter().map(|texture| texture.as_ref().map_or_else(Default::default, layout));
    (texels, layouts.collect())
}

/// The corners of all triangles in their order.
fn corners(scene: &Scene, layouts: &[TextureLayoutUniform]) -> Vec<TextureCorner> {
    let geometry = &scene.geometry;
    let triangles = 0..geometry.triangles.len() as u32;
    let of = |t: u32| {
        let uvs = geometry.uv_triangle(t).unwrap_or_default();
        let layout = layouts[geometry.object_of[t as usize].0 as usize];
        let density = texture::density(geometry.rest_triangle(t), uvs, layout.width, layout.height);
        uvs.map(|uv| TextureCorner { uv: uv.to_array(), density })
    };
    triangles.flat_map(of).collect()
}
