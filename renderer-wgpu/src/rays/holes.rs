//! Turns the textures of a scene that have holes into one buffer, in which rays ask whether there is a surface where they hit.
//!
//! One buffer, because shaders of eight storage buffers run everywhere and rays need seven without. Its words: a link for
//! each triangle of the tree to its record, or [`NO_HOLES`]; a [`Record`] for each triangle with holes; a [`Mask`] for each
//! use of a picture; the alphas of the pictures' finest levels, all 16 bits, two in a word. So the rule is that of
//! `scene.bvh`: alpha, bilinear at the finest level, below the cutoff is a hole. What moves changes the links alone.

use super::bindings::{buffer, limit};
use crate::{Gpu, GpuError, textures::Source};
use bytemuck::{Pod, Zeroable};
use photonstream_scene::Texture;
use std::mem::offset_of;
use std::sync::Arc;
use wgpu::BufferUsages;

/// Means: a triangle without holes.
const NO_HOLES: u32 = u32::MAX;

/// What to do on a device that cannot do it.
const REMEDY: &str = "choose --shadows maps and --visibility octahedral, or --renderer cpu";

/// Storage buffers of the shaders that ask for holes.
const STORAGE_BUFFERS: u32 = 8;

/// A triangle with holes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Record {
    /// First word of its mask.
    mask: u32,
    /// Texture coordinates of its corners.
    uvs: [[f32; 2]; 3],
}

/// A picture with holes, and how it goes on beyond its edges.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Mask {
    /// First word of its alphas.
    first: u32,
    width: u32,
    height: u32,
    wrap_u: u32,
    wrap_v: u32,
    /// Alpha below it is a hole.
    cutoff: f32,
}

const RECORD_WORDS: u32 = size_of::<Record>() as u32 / 4;
const MASK_WORDS: u32 = size_of::<Mask>() as u32 / 4;

/// Where words lie, as WGSL.
pub(super) fn constants() -> String {
    let offsets = [
        ("RECORD_MASK", offset_of!(Record, mask)),
        ("RECORD_UVS", offset_of!(Record, uvs)),
        ("MASK_FIRST", offset_of!(Mask, first)),
        ("MASK_WIDTH", offset_of!(Mask, width)),
        ("MASK_HEIGHT", offset_of!(Mask, height)),
        ("MASK_WRAP_U", offset_of!(Mask, wrap_u)),
        ("MASK_WRAP_V", offset_of!(Mask, wrap_v)),
        ("MASK_CUTOFF", offset_of!(Mask, cutoff)),
    ];
    let lines = offsets.map(|(name, bytes)| format!("const HOLE_{name}: u32 = {}u;\n", bytes / 4));
    format!("const NO_HOLES: u32 = {NO_HOLES}u;\n{}", lines.concat())
}

/// The holes of a scene on the device.
#[derive(Debug)]
pub(super) struct HolesOnDevice {
    pub(super) words: wgpu::Buffer,
    source: Arc<Source>,
    /// Number of triangles of the tree.
    links: usize,
}

impl HolesOnDevice {
    /// The holes of `source` in a tree whose triangles are `ids`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] for more than a binding holds.
    pub(super) fn new(gpu: &Gpu, source: &Arc<Source>, ids: &[u32]) -> Result<Self, GpuError> {
        let table = Table::new(source, ids.len());
        let (found, limit) = (table.bytes(), limit(gpu));
        if found > limit {
            let what = "masks of textures with holes in bytes";
            return Err(GpuError::TooLarge { what, found, limit, adapter: gpu.name(), remedy: REMEDY });
        }
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let words = buffer(gpu, "masks of holes", found.max(4), usage);
        gpu.queue.write_buffer(&words, ids.len() as u64 * 4, bytemuck::cast_slice(&table.words()));
        let holes = Self { words, source: Arc::clone(source), links: ids.len() };
        holes.link(gpu, ids);
        Ok(holes)
    }

    /// Whether it holds those of `source`.
    pub(super) fn are_of(&self, source: &Arc<Source>) -> bool {
        Arc::ptr_eq(&self.source, source)
    }

    /// Takes over another tree of the same triangles; `false` if it has more or fewer of them.
    pub(super) fn relink(&self, gpu: &Gpu, ids: &[u32]) -> bool {
        if ids.len() != self.links {
            return false;
        }
        self.link(gpu, ids);
        true
    }

    fn link(&self, gpu: &Gpu, ids: &[u32]) {
        gpu.queue.write_buffer(&self.words, 0, bytemuck::cast_slice(&links(&self.source, ids)));
    }
}

/// Whether shaders may have as many buffers as rays that ask for holes need.
pub(super) fn check_buffers(found: u32, adapter: &str) -> Result<(), GpuError> {
    if found >= STORAGE_BUFFERS {
        return Ok(());
    }
    Err(GpuError::Unsupported {
        option: "shadow rays in a scene whose textures have holes".into(),
        adapter: adapter.into(),
        lacks: format!("storage buffers: it has {found} for a shader, expected {STORAGE_BUFFERS}"),
        remedy: REMEDY,
    })
}

/// The links of the triangles `ids`: records lie behind them, in the order of the scene's triangles.
fn links(source: &Source, ids: &[u32]) -> Vec<u32> {
    let has_holes: Vec<bool> = source.holes().map(|texture| texture.is_some()).collect();
    let mut next = ids.len() as u32;
    let places: Vec<u32> = (0..source.triangle_count())
        .map(|triangle| {
            if !has_holes[source.object_of(triangle)] {
                return NO_HOLES;
            }
            next += RECORD_WORDS;
            next - RECORD_WORDS
        })
        .collect();
    ids.iter().map(|&id| places[id as usize]).collect()
}

/// What lies behind the links.
struct Table<'a> {
    source: &'a Source,
    links: usize,
    records: u32,
    /// The mask of each object.
    of_object: Vec<Option<u32>>,
    /// Each use of a picture, and the number of its picture.
    masks: Vec<(&'a Texture, usize)>,
    pictures: Vec<&'a Texture>,
}

impl<'a> Table<'a> {
    fn new(source: &'a Source, links: usize) -> Self {
        let (mut masks, mut pictures) = (Vec::new(), Vec::<&Texture>::new());
        let mut mask_of = |texture: &'a Texture| {
            let same = |(known, _): &(&Texture, usize)| {
                Arc::ptr_eq(&known.picture, &texture.picture)
                    && (known.layout, known.cutoff) == (texture.layout, texture.cutoff)
            };
            let known = masks.iter().position(same).unwrap_or_else(|| {
                let picture = pictures.iter().position(|p| Arc::ptr_eq(&p.picture, &texture.picture));
                masks.push((texture, picture.unwrap_or(pictures.len())));
                if picture.is_none() {
                    pictures.push(texture);
                }
                masks.len() - 1
            });
            known as u32
        };
        let of_object: Vec<_> = source.holes().map(|texture| texture.map(&mut mask_of)).collect();
        let has_holes = |&triangle: &u32| of_object[source.object_of(triangle)].is_some();
        let records = (0..source.triangle_count()).filter(has_holes).count() as u32;
        Self { source, links, records, of_object, masks, pictures }
    }

    /// Bytes of all words, links included.
    fn bytes(&self) -> u64 {
        let alphas: u64 = self.pictures.iter().map(|p| alpha_words(p)).sum();
        let masks = self.masks.len() as u64 * u64::from(MASK_WORDS);
        (self.links as u64 + u64::from(self.records) * u64::from(RECORD_WORDS) + masks + alphas) * 4
    }

    /// Records, masks and alphas. Numbers of words are those of a buffer that fits a binding.
    fn words(&self) -> Vec<u32> {
        let first_mask = self.links as u32 + self.records * RECORD_WORDS;
        let mut first_alpha = first_mask + self.masks.len() as u32 * MASK_WORDS;
        let firsts: Vec<u32> = self
            .pictures
            .iter()
            .map(|picture| {
                first_alpha += alpha_words(picture) as u32;
                first_alpha - alpha_words(picture) as u32
            })
            .collect();
        let mut words = Vec::with_capacity(self.bytes() as usize / 4 - self.links);
        for triangle in 0..self.source.triangle_count() {
            let Some(mask) = self.of_object[self.source.object_of(triangle)] else { continue };
            let uvs = self.source.uv_triangle(triangle).map(|uv| uv.to_array());
            let record = Record { mask: first_mask + mask * MASK_WORDS, uvs };
            words.extend_from_slice(bytemuck::cast_slice(&[record]));
        }
        for &(texture, picture) in &self.masks {
            let layout = &texture.layout;
            let mask = Mask {
                first: firsts[picture],
                width: layout.width,
                height: layout.height,
                wrap_u: layout.wrap_u as u32,
                wrap_v: layout.wrap_v as u32,
                cutoff: texture.cutoff.unwrap_or(0.0),
            };
            words.extend_from_slice(bytemuck::cast_slice(&[mask]));
        }
        for texture in &self.pictures {
            let finest = texture.layout.level(0);
            let texels = &texture.picture.texels()[finest.first as usize..];
            let texels = &texels[..finest.width as usize * finest.height as usize];
            let alpha = |texel: &[u32; 2]| texel[1] >> 16;
            words.extend(texels.chunks(2).map(|pair| alpha(&pair[0]) | pair.get(1).map_or(0, alpha) << 16));
        }
        words
    }
}

/// Words of the alphas of a picture's finest level.
fn alpha_words(texture: &Texture) -> u64 {
    (u64::from(texture.layout.width) * u64::from(texture.layout.height)).div_ceil(2)
}
