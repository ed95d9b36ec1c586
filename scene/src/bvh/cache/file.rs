//! Turns a tree into a file, and a file into lists that may be one.
//!
//! | bytes | |
//! |---|---|
//! | 16 | `photonstreamtree` |
//! | 4 | version of the format |
//! | 4 | reference of the root |
//! | 8, 8 | number of nodes, number of packets |
//! | 32 | key: hash of what the tree was built from |
//! | 32 | BLAKE3 of all above, and of the BLAKE3 of each piece of 1 MiB of nodes, then of packets |
//! | 256 each | nodes |
//! | 320 each | packets, triangle numbers counted from the part's first |
//!
//! Numbers are the machine's own, which the key knows: little-endian nearly everywhere.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::super::node::Node;
use super::super::pages::Pages;
use super::super::part::Bvh;
use super::super::triangle::Packet;
use super::key::VERSION;

const MAGIC: [u8; 16] = *b"photonstreamtree";

/// Bytes hashed at a time.
const PIECE: usize = 1 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 16],
    version: u32,
    root: u32,
    nodes: u64,
    packets: u64,
    key: [u8; 32],
    checksum: [u8; 32],
}

/// What a file holds: not yet known to be a tree.
pub(super) struct Found {
    pub(super) nodes: Pages<Node>,
    pub(super) packets: Pages<Packet>,
    pub(super) root: u32,
}

/// Bytes of a file.
pub(super) fn length(nodes: usize, packets: usize) -> u64 {
    (size_of::<Header>() + nodes * size_of::<Node>() + packets * size_of::<Packet>()) as u64
}

/// Writes `tree`, whose triangle numbers begin with `first`.
pub(super) fn write(out: &mut impl Write, key: &[u8; 32], tree: &Bvh, first: u32) -> io::Result<()> {
    let mut packets = Cow::Borrowed(&*tree.packets);
    if first != 0 {
        renumber(packets.to_mut(), first.wrapping_neg());
    }
    let mut header = Header {
        magic: MAGIC,
        version: VERSION,
        root: tree.root,
        nodes: tree.nodes.len() as u64,
        packets: packets.len() as u64,
        key: *key,
        checksum: [0; 32],
    };
    header.checksum = checksum(&header, &tree.nodes, &packets);
    out.write_all(bytemuck::bytes_of(&header))?;
    out.write_all(bytemuck::cast_slice(&tree.nodes))?;
    out.write_all(bytemuck::cast_slice(&packets))
}

/// The lists of the file at `path`, triangle numbers from the part's first, if it is whole and was written for `key`.
///
/// No tree of `triangles` triangles has more nodes or packets than these, so no file asks for more memory.
pub(super) fn read(path: &Path, key: &[u8; 32], triangles: usize) -> Option<Found> {
    // Opening a pipe would wait for a writer.
    let bytes = std::fs::metadata(path).ok().filter(|file| file.is_file())?.len();
    let mut file = File::open(path).ok()?;
    let mut header = Header::zeroed();
    file.read_exact(bytemuck::bytes_of_mut(&mut header)).ok()?;
    let (nodes, packets) = (usize::try_from(header.nodes).ok()?, usize::try_from(header.packets).ok()?);
    let is_it = header.magic == MAGIC && header.version == VERSION && header.key == *key;
    if !is_it || nodes > triangles || packets > triangles || bytes != length(nodes, packets) {
        return None;
    }
    let nodes = Pages::filled(nodes, |list| file.read_exact(bytemuck::cast_slice_mut(list))).ok()?;
    let packets = Pages::filled(packets, |list| file.read_exact(bytemuck::cast_slice_mut(list))).ok()?;
    (checksum(&header, &nodes, &packets) == header.checksum).then_some(Found {
        nodes,
        packets,
        root: header.root,
    })
}

/// Adds `offset` to the number of every triangle.
pub(super) fn renumber(packets: &mut [Packet], offset: u32) {
    for packet in packets {
        for id in packet.ids.0.iter_mut().filter(|id| **id != u32::MAX) {
            *id = id.wrapping_add(offset);
        }
    }
}

fn checksum(header: &Header, nodes: &[Node], packets: &[Packet]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytemuck::bytes_of(&Header { checksum: [0; 32], ..*header }));
    for bytes in [bytemuck::cast_slice::<_, u8>(nodes), bytemuck::cast_slice(packets)] {
        let pieces: Vec<[u8; 32]> =
            bytes.par_chunks(PIECE).map(|piece| *blake3::hash(piece).as_bytes()).collect();
        hasher.update(pieces.as_flattened());
    }
    *hasher.finalize().as_bytes()
}
