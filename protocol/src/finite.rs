//! Turns the words of records into a verdict, every float in them is finite, on their way from or into a segment.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::ProtocolError;
use crate::record::{ArrayKind, Field, FieldType};

/// Longest record, in words.
const MAX_RECORD_WORDS: usize = 32;

/// For each word of a record: exponent bits to look at, and what lifts a full exponent into the sign bit.
///
/// A float is non-finite when its exponent bits are all ones; adding one unit of the exponent then carries into
/// the (cleared) sign bit and no further, so two floats of one word are tested by one addition.
struct ExponentMasks {
    mask: [u64; MAX_RECORD_WORDS],
    unit: [u64; MAX_RECORD_WORDS],
}

const F32_MASK: u64 = 0x7f80_0000;
const F32_UNIT: u64 = 0x0080_0000;
const F64_MASK: u64 = 0x7ff0_0000_0000_0000;
const F64_UNIT: u64 = 0x0010_0000_0000_0000;
const SIGNS: u64 = 0x8000_0000_8000_0000;

const fn masks(fields: &[Field]) -> ExponentMasks {
    let mut masks = ExponentMasks { mask: [0; MAX_RECORD_WORDS], unit: [0; MAX_RECORD_WORDS] };
    let mut f = 0;
    while f < fields.len() {
        let field = &fields[f];
        let mut at = field.offset;
        while at < field.offset + field.size {
            match field.kind {
                FieldType::F32 => {
                    let high = (at % 8 == 4) == cfg!(target_endian = "little");
                    let shift = if high { 32 } else { 0 };
                    masks.mask[at / 8] |= F32_MASK << shift;
                    masks.unit[at / 8] |= F32_UNIT << shift;
                    at += 4;
                }
                FieldType::F64 => {
                    masks.mask[at / 8] = F64_MASK;
                    masks.unit[at / 8] = F64_UNIT;
                    at += 8;
                }
                FieldType::U32 => at += 4,
                FieldType::U64 => at += 8,
            }
        }
        f += 1;
    }
    masks
}

static VSL: ExponentMasks = masks(ArrayKind::Vsl.fields());
static OBJECT: ExponentMasks = masks(ArrayKind::Object.fields());
static LIGHT: ExponentMasks = masks(ArrayKind::Light.fields());
static STATISTICS: ExponentMasks = masks(ArrayKind::Statistics.fields());
static PATCH: ExponentMasks = masks(ArrayKind::Patch.fields());
static TEXT: ExponentMasks = masks(ArrayKind::SceneText.fields());

impl ExponentMasks {
    /// A value with a bit of `SIGNS` where a float of the record is not finite.
    #[inline(always)]
    fn carries<const WORDS: usize>(&self, record: &[u64; WORDS]) -> u64 {
        let mut carries = 0;
        for ((word, mask), unit) in record.iter().zip(&self.mask).zip(&self.unit) {
            // Words without floats vanish here: masks are constants.
            if *mask != 0 {
                carries |= (word & mask).wrapping_add(*unit);
            }
        }
        carries
    }

    fn all_finite<const WORDS: usize>(&self, words: &[u64]) -> bool {
        let carries = words.as_chunks::<WORDS>().0.iter().fold(0, |all, record| all | self.carries(record));
        carries & SIGNS == 0
    }

    #[inline(always)]
    fn load<const WORDS: usize>(&self, from: &[AtomicU64], into: &mut [u64]) -> bool {
        let mut carries = 0;
        for (to, from) in into.as_chunks_mut::<WORDS>().0.iter_mut().zip(from.as_chunks::<WORDS>().0) {
            *to = from.each_ref().map(|word| word.load(Ordering::Relaxed));
            carries |= self.carries(to);
        }
        carries & SIGNS == 0
    }
}

/// Whether every float of the records is finite.
pub(crate) fn all_finite(kind: ArrayKind, words: &[u64]) -> bool {
    match kind {
        ArrayKind::Vsl => VSL.all_finite::<8>(words),
        ArrayKind::Object => OBJECT.all_finite::<16>(words),
        ArrayKind::Light => LIGHT.all_finite::<16>(words),
        ArrayKind::Statistics => STATISTICS.all_finite::<32>(words),
        ArrayKind::SceneText | ArrayKind::Notice | ArrayKind::Distance => true,
        ArrayKind::Patch => PATCH.all_finite::<13>(words),
    }
}

/// Copies whole records of one array by relaxed loads, and says whether every float of the copy is finite.
///
/// One pass: while a check of its own runs over the copy, no further load from the segment is under way, which costs
/// more than the check.
pub(crate) fn load(kind: ArrayKind, from: &[AtomicU64], into: &mut [u64]) -> bool {
    match kind {
        ArrayKind::Vsl => VSL.load::<8>(from, into),
        ArrayKind::Object => OBJECT.load::<16>(from, into),
        ArrayKind::Light => LIGHT.load::<16>(from, into),
        ArrayKind::Statistics => STATISTICS.load::<32>(from, into),
        ArrayKind::SceneText | ArrayKind::Notice | ArrayKind::Distance => TEXT.load::<8>(from, into),
        ArrayKind::Patch => PATCH.load::<13>(from, into),
    }
}

/// Copies whole lights by relaxed stores with another first word in each, and says whether every float is finite.
pub(crate) fn store_lights(from: &[u64], to: &[AtomicU64], stamp: u64) -> bool {
    let mut carries = 0;
    for (from, to) in from.as_chunks::<8>().0.iter().zip(to.as_chunks::<8>().0) {
        to[0].store(stamp, Ordering::Relaxed);
        for k in 1..8 {
            to[k].store(from[k], Ordering::Relaxed);
        }
        carries |= VSL.carries(from);
    }
    carries & SIGNS == 0
}

/// The first float that is not finite; `first` is the index of the first record in its array.
#[cold]
pub(crate) fn find(kind: ArrayKind, first: usize, words: &[u64]) -> ProtocolError {
    let bytes: &[u8] = bytemuck::cast_slice(words);
    for (i, record) in bytes.chunks_exact(kind.record_bytes()).enumerate() {
        for field in kind.fields() {
            let data = &record[field.offset..field.offset + field.size];
            let bad = match field.kind {
                FieldType::F32 => data
                    .chunks_exact(4)
                    .map(|b| f64::from(f32::from_ne_bytes([b[0], b[1], b[2], b[3]])))
                    .find(|v| !v.is_finite()),
                FieldType::F64 => data
                    .chunks_exact(8)
                    .map(|b| f64::from_ne_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]))
                    .find(|v| !v.is_finite()),
                FieldType::U32 | FieldType::U64 => None,
            };
            if let Some(value) = bad {
                return ProtocolError::NonFinite {
                    record: kind.name(),
                    index: first + i,
                    field: field.name,
                    value,
                };
            }
        }
    }
    ProtocolError::corrupt(format!("{} records from {first}", kind.name()), "non-finite", "finite floats")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{LightRecord, ObjectRecord, StatisticsRecord, VslRecord};

    fn atomic(words: &[u64]) -> Vec<AtomicU64> {
        words.iter().map(|word| AtomicU64::new(*word)).collect()
    }

    /// The verdict of `load`, whose copy must be exact.
    fn load_of(kind: ArrayKind, words: &[u64]) -> bool {
        let mut copy = vec![0; words.len()];
        let finite = load(kind, &atomic(words), &mut copy);
        assert_eq!(copy, words);
        finite
    }

    /// The verdict of `store_lights`, whose copy must be exact but for the stamps; of `load` for other records.
    fn store_of(kind: ArrayKind, words: &[u64]) -> bool {
        if kind != ArrayKind::Vsl {
            return load_of(kind, words);
        }
        let to = atomic(&vec![0; words.len()]);
        let finite = store_lights(words, &to, 9);
        for (i, (word, to)) in words.iter().zip(&to).enumerate() {
            assert_eq!(to.load(Ordering::Relaxed), if i % 8 == 0 { 9 } else { *word });
        }
        finite
    }

    /// Every float field of every record, each of its values, against NaN, both infinities, and the greatest
    /// and least finite values, which must pass.
    #[test]
    fn finds_each_non_finite_field_and_no_other() {
        for kind in ArrayKind::ALL {
            for field in kind.fields() {
                let (step, values): (usize, Vec<(Vec<u8>, bool)>) = match field.kind {
                    FieldType::F32 => (
                        4,
                        [
                            f32::NAN,
                            f32::INFINITY,
                            f32::NEG_INFINITY,
                            f32::MAX,
                            f32::MIN,
                            -0.0,
                            f32::from_bits(1),
                        ]
                        .iter()
                        .map(|v| (v.to_ne_bytes().to_vec(), v.is_finite()))
                        .collect(),
                    ),
                    FieldType::F64 => (
                        8,
                        [
                            f64::NAN,
                            f64::INFINITY,
                            f64::NEG_INFINITY,
                            f64::MAX,
                            f64::MIN,
                            -0.0,
                            f64::from_bits(1),
                        ]
                        .iter()
                        .map(|v| (v.to_ne_bytes().to_vec(), v.is_finite()))
                        .collect(),
                    ),
                    FieldType::U32 => (4, vec![(vec![0xff; 4], true)]),
                    FieldType::U64 => (8, vec![(vec![0xff; 8], true)]),
                };
                for at in (field.offset..field.offset + field.size).step_by(step) {
                    for (value, ok) in &values {
                        let mut words = vec![0u64; 3 * kind.record_bytes() / 8];
                        let start = kind.record_bytes() + at;
                        bytemuck::cast_slice_mut::<u64, u8>(&mut words)[start..start + step]
                            .copy_from_slice(value);
                        let verdicts =
                            [all_finite(kind, &words), load_of(kind, &words), store_of(kind, &words)];
                        assert_eq!(verdicts, [*ok; 3], "{}.{}", kind.name(), field.name);
                        if !ok {
                            let error = find(kind, 70, &words);
                            let ProtocolError::NonFinite { index, field: found, .. } = error else {
                                panic!("{error}")
                            };
                            assert_eq!((index, found), (71, field.name));
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn accepts_zeroed_records() {
        assert!(all_finite(ArrayKind::Vsl, bytemuck::cast_slice(&[VslRecord::default(); 65])));
        assert!(all_finite(ArrayKind::Object, bytemuck::cast_slice(&[ObjectRecord::default(); 2])));
        assert!(all_finite(ArrayKind::Light, bytemuck::cast_slice(&[LightRecord::default(); 2])));
        assert!(all_finite(ArrayKind::Statistics, bytemuck::cast_slice(&[StatisticsRecord::default()])));
    }
}
