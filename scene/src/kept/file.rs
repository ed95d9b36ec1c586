//! Turns a number and two lists into a file, and a file that is whole into these.
//!
//! | bytes | |
//! |---|---|
//! | 16 | what kind of file it is |
//! | 4 | version of the kind |
//! | 4 | the number |
//! | 8, 8 | items of the first and of the second list |
//! | 32 | key: hash of what the content was computed from |
//! | 32 | BLAKE3 of all above, and of the BLAKE3 of each piece of 1 MiB of the first list, then of the second |
//! | | items of the first list, then of the second |
//!
//! Numbers are the machine's own, which keys know: little-endian nearly everywhere.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::Path;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::{Key, Kind, Pages};

/// Bytes hashed at a time.
const PIECE: usize = 1 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
struct Header {
    magic: [u8; 16],
    version: u32,
    number: u32,
    items: [u64; 2],
    key: Key,
    checksum: [u8; 32],
}

/// What a file holds: whole, but not yet known to be what it should be.
#[derive(Debug)]
pub struct Found<A, B> {
    /// The number.
    pub number: u32,
    /// The first list.
    pub first: Pages<A>,
    /// The second.
    pub second: Pages<B>,
}

/// Bytes of a file.
pub(super) fn length<A, B>([first, second]: [usize; 2]) -> u64 {
    let list = |items: usize, size: usize| (items as u64).saturating_mul(size as u64);
    let lists = list(first, size_of::<A>()).saturating_add(list(second, size_of::<B>()));
    lists.saturating_add(size_of::<Header>() as u64)
}

pub(super) fn write<A: Pod + Sync, B: Pod + Sync>(
    out: &mut impl Write,
    kind: &Kind,
    key: &Key,
    number: u32,
    (first, second): (&[A], &[B]),
) -> io::Result<()> {
    let items = [first.len() as u64, second.len() as u64];
    let mut header =
        Header { magic: kind.magic, version: kind.version, number, items, key: *key, checksum: [0; 32] };
    let (first, second) = (bytemuck::cast_slice(first), bytemuck::cast_slice(second));
    header.checksum = checksum(&header, [first, second]);
    out.write_all(bytemuck::bytes_of(&header))?;
    out.write_all(first)?;
    out.write_all(second)
}

/// The content of the file at `path`, if it is whole and was written for `key`, with lists of at most `most` items.
pub(super) fn read<A: Pod + Sync, B: Pod + Sync>(
    path: &Path,
    kind: &Kind,
    key: &Key,
    most: [usize; 2],
) -> Option<Found<A, B>> {
    // Opening a pipe would wait for a writer.
    let bytes = std::fs::metadata(path).ok().filter(|file| file.is_file())?.len();
    let mut file = File::open(path).ok()?;
    let mut header = Header::zeroed();
    file.read_exact(bytemuck::bytes_of_mut(&mut header)).ok()?;
    let is_it = header.magic == kind.magic && header.version == kind.version && header.key == *key;
    let [first, second] = header.items.map(|items| usize::try_from(items).unwrap_or(usize::MAX));
    if !is_it || first > most[0] || second > most[1] || bytes != length::<A, B>([first, second]) {
        return None;
    }
    let first: Pages<A> =
        Pages::filled(first, |list| file.read_exact(bytemuck::cast_slice_mut(list))).ok()?;
    let second: Pages<B> =
        Pages::filled(second, |list| file.read_exact(bytemuck::cast_slice_mut(list))).ok()?;
    let sum = checksum(&header, [bytemuck::cast_slice(&first), bytemuck::cast_slice(&second)]);
    (sum == header.checksum).then_some(Found { number: header.number, first, second })
}

fn checksum(header: &Header, lists: [&[u8]; 2]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(bytemuck::bytes_of(&Header { checksum: [0; 32], ..*header }));
    for bytes in lists {
        let pieces: Vec<[u8; 32]> =
            bytes.par_chunks(PIECE).map(|piece| *blake3::hash(piece).as_bytes()).collect();
        hasher.update(pieces.as_flattened());
    }
    *hasher.finalize().as_bytes()
}
