//! Turns the triangles of a part into the hash under which their tree is kept.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::super::lanes::WIDTH;
use super::super::node::Node;
use super::super::part;
use super::super::triangle::Packet;
use super::super::walk::MAX_DEPTH;

/// To be raised with every change of how trees are built or written; a test notices when they are built differently.
pub(super) const VERSION: u32 = 1;

/// Triangles hashed at a time.
const PIECE: usize = 1 << 16;

/// Hash of the corners of the triangles `range` in their order, of how trees are built and of their layout.
///
/// Numbers count from the first of the part: where it stands in the scene changes nothing.
pub(super) fn key(vertices: &[Vec3], triangles: &[[u32; 3]], range: &Range<u32>) -> [u8; 32] {
    let pieces: Vec<[u8; 32]> = (range.start as usize..range.end as usize)
        .into_par_iter()
        .step_by(PIECE)
        .map(|start| {
            let mut bytes = Vec::with_capacity(PIECE * 36);
            for id in start..(start + PIECE).min(range.end as usize) {
                let corners = triangles.get(id).copied().unwrap_or([u32::MAX; 3]);
                for corner in corners {
                    // A corner that is missing and one that is not a number are left out alike.
                    let corner = vertices.get(corner as usize).copied().unwrap_or(Vec3::NAN);
                    bytes.extend(corner.to_array().into_iter().flat_map(f32::to_le_bytes));
                }
            }
            *blake3::hash(&bytes).as_bytes()
        })
        .collect();
    let layout = [
        u64::from(VERSION),
        size_of::<Node>() as u64,
        size_of::<Packet>() as u64,
        WIDTH as u64,
        MAX_DEPTH as u64,
        u64::from(cfg!(target_endian = "big")),
        range.len() as u64,
    ];
    let mut hasher = blake3::Hasher::new_derive_key("photonstream tree of a part");
    for number in layout.into_iter().chain(part::PARAMETERS) {
        hasher.update(&number.to_le_bytes());
    }
    hasher.update(pieces.as_flattened());
    *hasher.finalize().as_bytes()
}
