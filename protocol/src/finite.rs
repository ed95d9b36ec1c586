//! Turns the words of records into a verdict: every float in them is finite.

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

fn all_finite<const WORDS: usize>(words: &[u64], masks: &ExponentMasks) -> bool {
    let mut lanes = [0u64; WORDS];
    for record in words.as_chunks::<WORDS>().0 {
        for k in 0..WORDS {
            lanes[k] |= (record[k] & masks.mask[k]).wrapping_add(masks.unit[k]);
        }
    }
    lanes.iter().fold(0, |all, lane| all | lane) & SIGNS == 0
}

/// Checks that every float of the records is finite; `first` is the index of the first one in its array.
pub(crate) fn check(kind: ArrayKind, first: usize, words: &[u64]) -> Result<(), ProtocolError> {
    let finite = match kind {
        ArrayKind::Vsl => all_finite::<8>(words, &VSL),
        ArrayKind::Object => all_finite::<16>(words, &OBJECT),
        ArrayKind::Light => all_finite::<16>(words, &LIGHT),
        ArrayKind::Statistics => all_finite::<32>(words, &STATISTICS),
        ArrayKind::SceneText => true,
    };
    if finite { Ok(()) } else { Err(find(kind, first, words)) }
}

#[cold]
fn find(kind: ArrayKind, first: usize, words: &[u64]) -> ProtocolError {
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
                        match check(kind, 70, &words) {
                            Ok(()) => assert!(*ok, "{}.{} accepted", kind.name(), field.name),
                            Err(ProtocolError::NonFinite { index, field: found, .. }) => {
                                assert!(!ok && index == 71 && found == field.name);
                            }
                            Err(other) => panic!("{other}"),
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn accepts_zeroed_records() {
        assert!(check(ArrayKind::Vsl, 0, bytemuck::cast_slice(&[VslRecord::default(); 65])).is_ok());
        assert!(check(ArrayKind::Object, 0, bytemuck::cast_slice(&[ObjectRecord::default(); 2])).is_ok());
        assert!(check(ArrayKind::Light, 0, bytemuck::cast_slice(&[LightRecord::default(); 2])).is_ok());
        assert!(
            check(ArrayKind::Statistics, 0, bytemuck::cast_slice(&[StatisticsRecord::default()])).is_ok()
        );
    }
}
