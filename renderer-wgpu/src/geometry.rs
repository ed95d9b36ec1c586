//! Turns a scene's triangles and materials into buffers, object by object, and draws those that a camera can see.

use crate::{
    Gpu, GpuError,
    layout::{Corner, NO_BEND, ObjectUniform},
};
use glam::Vec3;
use photonstream_scene::{ObjectId, Scene, Side};
use photonstream_shading::octahedral;
use std::{ops::Range, sync::Arc};
use wgpu::BufferUsages;

/// The triangles of a scene on the device, and what is known of its objects.
#[derive(Debug)]
pub(crate) struct Geometry {
    pub(crate) corners: wgpu::Buffer,
    /// Albedo, sides and emission of each object.
    pub(crate) objects: wgpu::Buffer,
    object_table: Vec<ObjectUniform>,
    parts: Vec<Part>,
    pub(crate) source: Arc<photonstream_scene::Geometry>,
    /// Number of corners that the buffer holds.
    count: u32,
}

/// One object: its corners, and a sphere around them.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    corners: Range<u32>,
    centre: Vec3,
    radius: f32,
}

/// What [`Geometry::update`] found changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Changed {
    /// Triangles have moved, come or gone.
    pub(crate) shape: bool,
    /// Reflectances, sides or emissions differ.
    pub(crate) materials: bool,
}

impl Geometry {
    pub(crate) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self, GpuError> {
        let count = scene.geometry.triangles.len() as u32 * 3;
        let bytes = u64::from(count.max(3)) * size_of::<Corner>() as u64;
        let limit = gpu.device.limits().max_buffer_size;
        if bytes > limit {
            let remedy = "choose a scene with fewer triangles, or --renderer cpu";
            return Err(GpuError::TooLarge {
                what: "geometry in bytes",
                found: bytes,
                limit,
                adapter: gpu.name(),
                remedy,
            });
        }
        let object_table = object_table(scene);
        let objects = buffer(
            gpu,
            "objects",
            (object_table.len().max(1) * size_of::<ObjectUniform>()) as u64,
            BufferUsages::STORAGE,
        );
        gpu.queue.write_buffer(&objects, 0, bytemuck::cast_slice(&object_table));
        let corners = buffer(gpu, "corners", bytes, BufferUsages::VERTEX | BufferUsages::STORAGE);
        let geometry = Self {
            corners,
            objects,
            object_table,
            parts: (0..scene.objects.len()).map(|i| part(scene, i)).collect(),
            source: Arc::clone(&scene.geometry),
            count,
        };
        gpu.queue.write_buffer(&geometry.corners, 0, bytemuck::cast_slice(&corners_of(scene, 0..count / 3)));
        Ok(geometry)
    }

    /// Takes over `scene`: uploads the objects that differ from the last one's.
    pub(crate) fn update(&mut self, gpu: &Gpu, scene: &Scene) -> Result<Changed, GpuError> {
        let mut changed = Changed::default();
        let table = object_table(scene);
        if table != self.object_table {
            changed.materials = true;
        }
        if !Arc::ptr_eq(&self.source, &scene.geometry) && *self.source != *scene.geometry {
            changed.shape = true;
            let same_layout = self.source.own_normals == scene.geometry.own_normals
                && self.count as usize == scene.geometry.triangles.len() * 3
                && self.parts.len() == scene.objects.len()
                && self
                    .parts
                    .iter()
                    .zip(&scene.objects)
                    .all(|(p, o)| p.corners == corner_range(&o.triangles));
            if !same_layout {
                *self = Self::new(gpu, scene)?;
                return Ok(Changed { shape: true, materials: true });
            }
            for (index, object) in scene.objects.iter().enumerate() {
                if moved(&self.source, &scene.geometry, &object.triangles) {
                    let offset = u64::from(self.parts[index].corners.start) * size_of::<Corner>() as u64;
                    let corners = corners_of(scene, object.triangles.clone());
                    gpu.queue.write_buffer(&self.corners, offset, bytemuck::cast_slice(&corners));
                    self.parts[index] = part(scene, index);
                }
            }
        }
        if changed.materials {
            if table.len() != self.object_table.len() {
                *self = Self::new(gpu, scene)?;
                return Ok(changed);
            }
            gpu.queue.write_buffer(&self.objects, 0, bytemuck::cast_slice(&table));
            self.object_table = table;
        }
        self.source = Arc::clone(&scene.geometry);
        Ok(changed)
    }

    /// Whether shaders can look triangles up by number.
    pub(crate) fn is_readable(&self, gpu: &Gpu) -> bool {
        self.corners.size() <= gpu.device.limits().max_storage_buffer_binding_size
    }

    /// Draws the objects that `sees` keeps (by centre and radius of their spheres), each `instances` times.
    pub(crate) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        instances: Range<u32>,
        sees: impl Fn(Vec3, f32) -> bool,
    ) -> u32 {
        pass.set_vertex_buffer(0, self.corners.slice(..));
        let mut drawn = 0;
        // Neighbours in the buffer are drawn together.
        let mut run: Range<u32> = 0..0;
        for part in self.parts.iter().filter(|p| !p.corners.is_empty() && sees(p.centre, p.radius)) {
            drawn += 1;
            if part.corners.start == run.end && !run.is_empty() {
                run.end = part.corners.end;
            } else {
                if !run.is_empty() {
                    pass.draw(run.clone(), instances.clone());
                }
                run = part.corners.clone();
            }
        }
        if !run.is_empty() {
            pass.draw(run, instances);
        }
        drawn
    }
}

/// A buffer that can be written by the queue.
pub(crate) fn buffer(gpu: &Gpu, label: &str, bytes: u64, usage: BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.next_multiple_of(16).max(16),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn corner_range(triangles: &Range<u32>) -> Range<u32> {
    triangles.start * 3..triangles.end * 3
}

fn part(scene: &Scene, index: usize) -> Part {
    let triangles = scene.objects[index].triangles.clone();
    let corners = || triangles.clone().flat_map(|t| scene.geometry.triangle(t));
    let (lo, hi) = corners().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
    let centre = (lo + hi) * 0.5;
    // Rounding of the distances is far below this.
    let radius = corners().map(|v| v.distance(centre)).fold(0.0, f32::max) * (1.0 + 1e-5);
    Part { corners: corner_range(&triangles), centre, radius }
}

fn corners_of(scene: &Scene, triangles: Range<u32>) -> Vec<Corner> {
    let geometry = &scene.geometry;
    let corners = triangles.flat_map(|t| {
        let normal = geometry.normals[t as usize].to_array();
        let object = geometry.object_of[t as usize].0;
        let bent = scene.corner_normals(t).map_or([NO_BEND; 3], |normals| normals.map(folded));
        let [a, b, c] = geometry.triangle(t).map(|v| v.to_array());
        [(a, bent[0]), (b, bent[1]), (c, bent[2])].map(|(position, bent)| Corner {
            position,
            normal,
            object,
            bent,
        })
    });
    corners.collect()
}

/// A unit vector as two 16-bit numbers; what `unpack2x16snorm` reads.
fn folded(normal: Vec3) -> u32 {
    if normal == Vec3::ZERO {
        return NO_BEND;
    }
    let [x, y] =
        (octahedral::encode(normal) * f32::from(i16::MAX)).round().to_array().map(|n| n as i16 as u16);
    u32::from(x) | u32::from(y) << 16
}

fn moved(
    old: &photonstream_scene::Geometry,
    new: &photonstream_scene::Geometry,
    triangles: &Range<u32>,
) -> bool {
    triangles.clone().any(|t| {
        let t_index = t as usize;
        old.triangle(t) != new.triangle(t)
            || old.normals[t_index] != new.normals[t_index]
            || old.object_of[t_index] != new.object_of[t_index]
    })
}

fn object_table(scene: &Scene) -> Vec<ObjectUniform> {
    let entries = scene.objects.iter().enumerate().map(|(i, object)| {
        let id = ObjectId(i as u32);
        let side = |side, bit| if object.sides.contains(side) { bit } else { 0 };
        ObjectUniform {
            albedo: scene.albedo(id).to_array(),
            sides: side(Side::Front, 1) | side(Side::Back, 2),
            emitted: scene.emitted_radiance(id, Side::Front).to_array(),
            pad_0: 0,
        }
    });
    entries.collect()
}
