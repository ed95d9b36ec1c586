//! Turns accessors of a glTF file into numbers: strided, sparse, quantised, and checked against their buffers.

use gltf::json::{
    Accessor, Index, Root,
    accessor::{ComponentType, Type},
    buffer::View,
    validation::Checked,
};
use std::{borrow::Cow, collections::HashMap};

/// Most elements of an accessor without data, which are all 0 but for its sparse ones.
const MAX_WITHOUT_DATA: usize = 1 << 20;

/// What accessors are read from.
#[derive(Clone, Copy)]
pub(super) struct Accessors<'a> {
    pub(super) root: &'a Root,
    pub(super) buffers: &'a [Cow<'a, [u8]>],
}

/// The elements of one accessor, of `N` numbers each.
pub(super) struct Elements<'a, const N: usize> {
    pub(super) count: usize,
    component: ComponentType,
    normalized: bool,
    /// Nothing where all are 0.
    base: Option<Strided<'a>>,
    /// The places of those that are given apart, in `values`.
    sparse: HashMap<u32, usize>,
    values: Option<Strided<'a>>,
}

impl<'a> Accessors<'a> {
    /// The bytes of a buffer view.
    pub(super) fn view(&self, index: Index<View>) -> Result<&'a [u8], String> {
        let view = &self.root.buffer_views[index.value()];
        let buffer = &self.buffers[view.buffer.value()];
        let start = view.byte_offset.unwrap_or_default().0;
        let end = start.checked_add(view.byte_length.0).filter(|end| *end <= buffer.len() as u64);
        let end = end.ok_or_else(|| format!("buffer view {} ends beyond its buffer", index.value()))?;
        Ok(&buffer[start as usize..end as usize])
    }

    /// The elements of an accessor that has to be of type `expected`.
    pub(super) fn elements<const N: usize>(
        &self,
        index: Index<Accessor>,
        expected: Type,
    ) -> Result<Elements<'a, N>, String> {
        let accessor = &self.root.accessors[index.value()];
        let at = |problem: String| format!("accessor {}: {problem}", index.value());
        if accessor.type_ != Checked::Valid(expected) {
            return Err(at(format!("found {:?}, expected {expected:?}", accessor.type_.unwrap())));
        }
        let component = accessor.component_type.unwrap().0;
        let size = component.size() * N;
        let count = usize::try_from(accessor.count.0).map_err(|_| at("too many elements".into()))?;
        let base = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                Some(self.strided(view, offset, count, size).map_err(at)?)
            }
            None if count > MAX_WITHOUT_DATA => {
                return Err(at(format!(
                    "{count} elements without data, expected at most {MAX_WITHOUT_DATA}"
                )));
            }
            None => None,
        };
        let mut elements = Elements {
            count,
            component,
            normalized: accessor.normalized,
            base,
            sparse: HashMap::new(),
            values: None,
        };
        if let Some(sparse) = &accessor.sparse {
            let sparse_count = usize::try_from(sparse.count.0).ok().filter(|n| *n <= count);
            let sparse_count = sparse_count.ok_or_else(|| at("more sparse elements than elements".into()))?;
            let places = Elements::<1> {
                count: sparse_count,
                component: sparse.indices.component_type.unwrap().0,
                normalized: false,
                base: None,
                sparse: HashMap::new(),
                values: None,
            };
            let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset.0);
            let from = self.strided(view, offset, sparse_count, places.component.size()).map_err(at)?;
            for i in 0..sparse_count {
                let place = places.decode(&from, i)[0];
                if place >= count as f64 {
                    return Err(at(format!("sparse element {i} is of number {place}, of {count}")));
                }
                elements.sparse.insert(place as u32, i);
            }
            let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset.0);
            elements.values = Some(self.strided(view, offset, sparse_count, size).map_err(at)?);
        }
        Ok(elements)
    }

    /// `count` elements of `size` bytes in a buffer view.
    fn strided(
        &self,
        view: Index<View>,
        offset: u64,
        count: usize,
        size: usize,
    ) -> Result<Strided<'a>, String> {
        let bytes = self.view(view)?;
        let stride = self.root.buffer_views[view.value()].byte_stride.map(|s| s.0).filter(|s| *s > 0);
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!("a stride of {stride} bytes for elements of {size}"));
        }
        let needed = match count {
            0 => Some(0),
            n => (n - 1).checked_mul(stride).and_then(|n| n.checked_add(size)),
        };
        let bytes = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..)).unwrap_or_default();
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(format!("{count} elements end beyond buffer view {}", view.value()));
        }
        Ok(Strided { bytes, stride })
    }
}

/// Elements at equal distances.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<const N: usize> Elements<'_, N> {
    /// Whether they can be indices.
    pub(super) fn are_whole(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
            && !self.normalized
    }

    /// Element `i` of `count`; normalised integers in [-1, 1].
    pub(super) fn get(&self, i: u32) -> [f64; N] {
        if let (Some(place), Some(values)) = (self.sparse.get(&i), &self.values) {
            return self.decode(values, *place);
        }
        self.base.as_ref().map_or([0.0; N], |base| self.decode(base, i as usize))
    }

    fn decode(&self, from: &Strided<'_>, i: usize) -> [f64; N] {
        let size = self.component.size();
        let bytes = &from.bytes[i * from.stride..];
        std::array::from_fn(|n| {
            let bytes = &bytes[n * size..][..size];
            let value = |k: usize| bytes[k];
            let (number, largest) = match self.component {
                ComponentType::I8 => (f64::from(value(0) as i8), f64::from(i8::MAX)),
                ComponentType::U8 => (f64::from(value(0)), f64::from(u8::MAX)),
                ComponentType::I16 => {
                    (f64::from(i16::from_le_bytes([value(0), value(1)])), f64::from(i16::MAX))
                }
                ComponentType::U16 => {
                    (f64::from(u16::from_le_bytes([value(0), value(1)])), f64::from(u16::MAX))
                }
                ComponentType::U32 => (
                    f64::from(u32::from_le_bytes([value(0), value(1), value(2), value(3)])),
                    f64::from(u32::MAX),
                ),
                ComponentType::F32 => {
                    return f64::from(f32::from_le_bytes([value(0), value(1), value(2), value(3)]));
                }
            };
            if self.normalized { (number / largest).max(-1.0) } else { number }
        })
    }
}
