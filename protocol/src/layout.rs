//! Turns a segment specification into the place of every byte, and an untrusted header back into the same.

use crc::{CRC_64_XZ, Crc};

use crate::chunks::CHUNK_RECORDS;
use crate::error::ProtocolError;
use crate::process::{Identity, boot_id};
use crate::record::{ArrayKind, LAYOUT_HASH};
use crate::shape::{ArrayShape, HEAD_WORDS, Shape, head};
use crate::text::TEXT_RECORD;

/// First eight bytes of every segment.
pub const MAGIC: [u8; 8] = *b"PHOTONS1";
/// Major version: another one cannot be read.
pub const ABI_MAJOR: u64 = 4;
/// Minor version: a greater one adds arrays that older readers skip.
pub const ABI_MINOR: u64 = 0;
/// Bytes of UTF-8 a notice may have, unless there is a reason for another number.
pub const NOTICE_CAPACITY: u32 = 4096;
/// As the writer's machine stores it.
pub const ENDIAN_TAG: u64 = 0x0102_0304_0506_0708;

/// Alignment of slots, in bytes.
const PAGE: usize = 4096;
/// Alignment of tables and arrays, in bytes.
const LINE: usize = 64;
/// Greatest number of arrays of a segment.
pub(crate) const MAX_ARRAYS: usize = 16;
/// Words of one entry of the array table.
pub(crate) const ENTRY_WORDS: usize = 6;
/// Greatest segment, in bytes.
const MAX_BYTES: u64 = 1 << 40;
/// Greatest capacity of an array, in records.
const MAX_RECORDS: u32 = 1 << 26;

/// Places in the header, in words.
pub(crate) mod word {
    pub(crate) const MAGIC: usize = 0;
    pub(crate) const ABI_MAJOR: usize = 1;
    pub(crate) const ABI_MINOR: usize = 2;
    pub(crate) const ENDIAN: usize = 3;
    pub(crate) const LAYOUT_HASH: usize = 4;
    pub(crate) const SEGMENT_BYTES: usize = 5;
    pub(crate) const EPOCH: usize = 6;
    pub(crate) const SCENE_HASH: usize = 7;
    pub(crate) const SLOTS: usize = 8;
    pub(crate) const CHUNK_RECORDS: usize = 9;
    pub(crate) const FIRST_SLOT: usize = 10;
    pub(crate) const SLOT_STRIDE: usize = 11;
    pub(crate) const ARRAYS: usize = 12;
    pub(crate) const PID: usize = 13;
    pub(crate) const START_TIME: usize = 14;
    pub(crate) const BOOT_ID: usize = 15;
    pub(crate) const TABLE: usize = 24;
    pub(crate) const CRC: usize = TABLE + super::MAX_ARRAYS * super::ENTRY_WORDS;
    /// Words the header is copied as.
    pub(crate) const COUNT: usize = CRC + 1;

    /// 1 being prepared, 2 live, 3 replaced by another segment, 4 closed.
    pub(crate) const STATE: usize = 256;
    /// Newest complete frame.
    pub(crate) const LATEST: usize = 272;
    /// Monotonic ns, ten times a second.
    pub(crate) const HEARTBEAT: usize = 288;
    /// 1 while the simulation is paused.
    pub(crate) const PAUSED: usize = 289;
    /// 32 bits, a futex; its other half is unused.
    pub(crate) const WAKE: usize = 304;
}

/// Values of the state word.
pub(crate) mod state {
    pub(crate) const INIT: u64 = 1;
    pub(crate) const LIVE: u64 = 2;
    pub(crate) const RETIRED: u64 = 3;
    pub(crate) const CLOSED: u64 = 4;
}

/// Capacities of a segment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SegmentSpec {
    /// Greatest number of virtual surface lights, and of their patches.
    pub vsl_capacity: u32,
    /// Greatest number of pieces of distance maps; 0 where there are none.
    pub distance_capacity: u32,
    /// Greatest number of objects.
    pub object_capacity: u32,
    /// Greatest number of lights.
    pub light_capacity: u32,
    /// Greatest length of the resolved scene text, in bytes of UTF-8.
    pub scene_text_capacity: u32,
    /// Greatest length of the notice, in bytes of UTF-8: [`NOTICE_CAPACITY`] unless there is a reason.
    pub notice_capacity: u32,
    /// Identifies the scene.
    pub scene_hash: u64,
    /// Complete frames held at once, 2 to 8; 3 unless there is a reason.
    pub slots: u32,
}

/// Everything a header says.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub(crate) shape: Shape,
    pub(crate) bytes: u64,
    pub(crate) epoch: u64,
    pub(crate) scene_hash: u64,
    pub(crate) writer: Identity,
}

/// The header as words, as it lies in the segment.
pub(crate) type HeaderWords = [u64; word::COUNT];

impl Layout {
    /// Places the arrays of a new segment one after another.
    pub(crate) fn new(spec: &SegmentSpec, epoch: u64, writer: Identity) -> Result<Self, ProtocolError> {
        let invalid = |field, found, expected: String| ProtocolError::InvalidSpec {
            field,
            found: u64::from(found),
            expected,
        };
        if !(2..=8).contains(&spec.slots) {
            return Err(invalid("slots", spec.slots, "2 to 8".into()));
        }
        for (field, found) in [
            ("vsl_capacity", spec.vsl_capacity),
            ("distance_capacity", spec.distance_capacity),
            ("object_capacity", spec.object_capacity),
            ("light_capacity", spec.light_capacity),
            ("scene_text_capacity", spec.scene_text_capacity),
            ("notice_capacity", spec.notice_capacity),
        ] {
            if found > MAX_RECORDS {
                return Err(invalid(field, found, format!("at most {MAX_RECORDS}")));
            }
        }
        let mut end = HEAD_WORDS * 8;
        let mut arrays = ArrayKind::ALL.map(|kind| {
            let capacity = match kind {
                ArrayKind::Vsl | ArrayKind::Patch => spec.vsl_capacity as usize,
                ArrayKind::Distance => spec.distance_capacity as usize,
                ArrayKind::Object => spec.object_capacity as usize,
                ArrayKind::Light => spec.light_capacity as usize,
                ArrayKind::Statistics => 1,
                ArrayKind::SceneText => (spec.scene_text_capacity as usize).div_ceil(TEXT_RECORD),
                ArrayKind::Notice => (spec.notice_capacity as usize).div_ceil(TEXT_RECORD),
            };
            let table = end.next_multiple_of(LINE);
            end = table + capacity.div_ceil(CHUNK_RECORDS) * 8;
            ArrayShape { kind, record_words: kind.record_bytes() / 8, capacity, data: 0, table: table / 8 }
        });
        for array in &mut arrays {
            let data = end.next_multiple_of(LINE);
            array.data = data / 8;
            end = data + array.capacity * array.record_words * 8;
        }
        let stride = end.next_multiple_of(PAGE);
        let shape = Shape {
            latest: word::LATEST,
            slots: spec.slots as usize,
            first_slot: PAGE / 8,
            stride: stride / 8,
            chunk_records: CHUNK_RECORDS,
            arrays: arrays.to_vec(),
        };
        let bytes = (PAGE + spec.slots as usize * stride) as u64;
        Ok(Self { shape, bytes, epoch, scene_hash: spec.scene_hash, writer })
    }

    /// The header of this layout, with its checksum.
    pub(crate) fn header(&self) -> HeaderWords {
        let mut header = [0; word::COUNT];
        header[word::MAGIC] = u64::from_ne_bytes(MAGIC);
        header[word::ABI_MAJOR] = ABI_MAJOR;
        header[word::ABI_MINOR] = ABI_MINOR;
        header[word::ENDIAN] = ENDIAN_TAG;
        header[word::LAYOUT_HASH] = LAYOUT_HASH;
        header[word::SEGMENT_BYTES] = self.bytes;
        header[word::EPOCH] = self.epoch;
        header[word::SCENE_HASH] = self.scene_hash;
        header[word::SLOTS] = self.shape.slots as u64;
        header[word::CHUNK_RECORDS] = self.shape.chunk_records as u64;
        header[word::FIRST_SLOT] = self.shape.first_slot as u64 * 8;
        header[word::SLOT_STRIDE] = self.shape.stride as u64 * 8;
        header[word::ARRAYS] = self.shape.arrays.len() as u64;
        header[word::PID] = u64::from(self.writer.pid);
        header[word::START_TIME] = self.writer.start_time;
        let boot = boot_id();
        header[word::BOOT_ID] = boot[0];
        header[word::BOOT_ID + 1] = boot[1];
        for (a, array) in self.shape.arrays.iter().enumerate() {
            let entry = &mut header[word::TABLE + a * ENTRY_WORDS..][..ENTRY_WORDS];
            entry[0] = array.kind as u64;
            entry[1] = array.record_words as u64 * 8;
            entry[2] = array.capacity as u64;
            entry[3] = array.data as u64 * 8;
            entry[4] = array.table as u64 * 8;
        }
        header[word::CRC] = checksum(&header);
        header
    }

    /// Checks a private copy of a header; afterwards every place in it lies within `file_bytes`.
    pub(crate) fn check(header: &HeaderWords, file_bytes: u64) -> Result<Self, ProtocolError> {
        let found = header[word::MAGIC].to_ne_bytes();
        if found != MAGIC {
            return Err(ProtocolError::corrupt("magic", format!("{found:02x?}"), format!("{MAGIC:02x?}")));
        }
        if header[word::ENDIAN] != ENDIAN_TAG {
            return Err(ProtocolError::EndianMismatch { found: header[word::ENDIAN], expected: ENDIAN_TAG });
        }
        if header[word::ABI_MAJOR] != ABI_MAJOR {
            return Err(ProtocolError::VersionMismatch {
                found_major: header[word::ABI_MAJOR],
                found_minor: header[word::ABI_MINOR],
                expected: ABI_MAJOR,
            });
        }
        let expected = checksum(header);
        if header[word::CRC] != expected {
            let hex = |value| format!("{value:#018x}");
            return Err(ProtocolError::corrupt("header checksum", hex(header[word::CRC]), hex(expected)));
        }
        if header[word::LAYOUT_HASH] != LAYOUT_HASH {
            return Err(ProtocolError::LayoutMismatch {
                found: header[word::LAYOUT_HASH],
                expected: LAYOUT_HASH,
            });
        }
        let bytes = header[word::SEGMENT_BYTES];
        if bytes != file_bytes || bytes > MAX_BYTES {
            return Err(ProtocolError::corrupt("segment length", bytes, format!("the file's {file_bytes}")));
        }
        let boot = boot_id();
        let written = [header[word::BOOT_ID], header[word::BOOT_ID + 1]];
        if written != boot && written != [0; 2] && boot != [0; 2] {
            return Err(ProtocolError::corrupt("boot id", "another boot's", "this boot's"));
        }
        let slots = in_range("slot count", header[word::SLOTS], 2, 8)?;
        in_range("chunk size", header[word::CHUNK_RECORDS], CHUNK_RECORDS as u64, CHUNK_RECORDS as u64)?;
        let first_slot = aligned("slot offset", header[word::FIRST_SLOT], PAGE as u64)?;
        let stride = aligned("slot stride", header[word::SLOT_STRIDE], PAGE as u64)?;
        in_range("slot offset", first_slot, PAGE as u64, bytes)?;
        in_range("slot stride", stride, PAGE as u64, (bytes - first_slot) / slots)?;
        let writer = Identity {
            pid: in_range("writer pid", header[word::PID], 1, u64::from(u32::MAX))? as u32,
            start_time: header[word::START_TIME],
        };
        let arrays = check_arrays(header, stride)?;
        let shape = Shape {
            latest: word::LATEST,
            slots: slots as usize,
            first_slot: to_words(first_slot)?,
            stride: to_words(stride)?,
            chunk_records: CHUNK_RECORDS,
            arrays,
        };
        Ok(Self { shape, bytes, epoch: header[word::EPOCH], scene_hash: header[word::SCENE_HASH], writer })
    }
}

/// Checks the array table: each kind once, all in order, sizes and alignment right, in the slot, no overlap.
fn check_arrays(header: &HeaderWords, stride: u64) -> Result<Vec<ArrayShape>, ProtocolError> {
    let count =
        in_range("array count", header[word::ARRAYS], ArrayKind::ALL.len() as u64, MAX_ARRAYS as u64)?;
    let mut arrays = Vec::new();
    let mut ranges = vec![(0, HEAD_WORDS as u64 * 8)];
    for a in 0..count as usize {
        let entry = &header[word::TABLE + a * ENTRY_WORDS..][..ENTRY_WORDS];
        let name = ArrayKind::ALL.get(a).map_or("unknown", |kind| kind.name());
        let field = |what: &str| format!("{name} array's {what}");
        let record = entry[1];
        if let Some(kind) = ArrayKind::ALL.get(a) {
            in_range(&field("kind"), entry[0], *kind as u64, *kind as u64)?;
            in_range(&field("record size"), record, kind.record_bytes() as u64, kind.record_bytes() as u64)?;
        }
        in_range(&field("record size"), record, 1, stride)?;
        let capacity =
            in_range(&field("capacity"), entry[2], 0, (stride / record).min(u64::from(MAX_RECORDS)))?;
        if a == 3 {
            in_range(&field("capacity"), capacity, 1, 1)?;
        }
        let data = aligned(&field("data offset"), entry[3], LINE as u64)?;
        let table = aligned(&field("chunk table offset"), entry[4], LINE as u64)?;
        let table_bytes = capacity.div_ceil(CHUNK_RECORDS as u64) * 8;
        for (what, start, length) in [("data", data, capacity * record), ("chunk table", table, table_bytes)]
        {
            let end = start.checked_add(length).filter(|end| *end <= stride);
            let end = end.ok_or_else(|| {
                ProtocolError::corrupt(
                    field(what),
                    format!("{length} bytes at {start}"),
                    format!("within {stride}"),
                )
            })?;
            ranges.push((start, end));
        }
        if let Some(kind) = ArrayKind::ALL.get(a) {
            arrays.push(ArrayShape {
                kind: *kind,
                record_words: kind.record_bytes() / 8,
                capacity: capacity as usize,
                data: to_words(data)?,
                table: to_words(table)?,
            });
        }
    }
    ranges.retain(|(start, end)| start < end);
    ranges.sort_unstable();
    for pair in ranges.windows(2) {
        if pair[0].1 > pair[1].0 {
            let found = format!("{} to {}", pair[1].0, pair[1].1);
            return Err(ProtocolError::corrupt(
                "array bytes",
                found,
                format!("from {}, without overlap", pair[0].1),
            ));
        }
    }
    Ok(arrays)
}

fn in_range(field: &str, found: u64, least: u64, most: u64) -> Result<u64, ProtocolError> {
    if (least..=most).contains(&found) {
        Ok(found)
    } else {
        Err(ProtocolError::corrupt(field, found, format!("{least} to {most}")))
    }
}

fn aligned(field: &str, found: u64, alignment: u64) -> Result<u64, ProtocolError> {
    if found.is_multiple_of(alignment) {
        Ok(found)
    } else {
        Err(ProtocolError::corrupt(field, found, format!("a multiple of {alignment}")))
    }
}

fn to_words(bytes: u64) -> Result<usize, ProtocolError> {
    usize::try_from(bytes / 8)
        .map_err(|_| ProtocolError::corrupt("offset", bytes, "within the address space"))
}

/// CRC-64/XZ of all header bytes before the checksum itself.
pub(crate) fn checksum(header: &HeaderWords) -> u64 {
    const CRC: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);
    CRC.checksum(bytemuck::cast_slice(&header[..word::CRC]))
}

// The head has room for the counts of all arrays, and live words lie behind the header, 128 bytes apart.
const _: () = assert!(head::COUNTS + MAX_ARRAYS <= HEAD_WORDS);
const _: () = assert!(word::COUNT <= word::STATE && word::WAKE < PAGE / 8);
