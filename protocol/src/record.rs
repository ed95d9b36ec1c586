//! Turns lights, objects and counters into plain records of fixed bytes, and describes every byte of them.

use bytemuck::{Pod, Zeroable};

use crate::text::TEXT_RECORD;

/// Machine type of a record's field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldType {
    /// Unsigned, 32 bits.
    U32,
    /// Unsigned, 64 bits.
    U64,
    /// IEEE 754 single.
    F32,
    /// IEEE 754 double.
    F64,
}

/// One field of a record: `count` values of one type from byte `offset`.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    /// Name, as in the Rust structure.
    pub name: &'static str,
    /// First byte within the record.
    pub offset: usize,
    /// Bytes of the whole field.
    pub size: usize,
    /// Type of one value.
    pub kind: FieldType,
}

/// Type of one value of a field type, so that the table below is made from the structure itself.
trait Scalar {
    const KIND: FieldType;
}
impl Scalar for u32 {
    const KIND: FieldType = FieldType::U32;
}
impl Scalar for u64 {
    const KIND: FieldType = FieldType::U64;
}
impl Scalar for f32 {
    const KIND: FieldType = FieldType::F32;
}
impl Scalar for f64 {
    const KIND: FieldType = FieldType::F64;
}
impl<T: Scalar, const N: usize> Scalar for [T; N] {
    const KIND: FieldType = T::KIND;
}

macro_rules! record {
    ($(#[$meta:meta])* $name:ident, $bytes:literal { $($(#[$field_meta:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$meta])*
        #[repr(C, align(8))]
        #[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
        pub struct $name { $($(#[$field_meta])* pub $field: $type,)* }

        impl $name {
            /// Every field with its place, in order.
            pub const FIELDS: &'static [Field] = &[$(Field {
                name: stringify!($field),
                offset: std::mem::offset_of!($name, $field),
                size: size_of::<$type>(),
                kind: <$type as Scalar>::KIND,
            },)*];
        }

        impl Default for $name {
            fn default() -> Self {
                Self::zeroed()
            }
        }

        const _: () = assert!(size_of::<$name>() == $bytes && align_of::<$name>() == 8);
    };
}

record! {
    /// A virtual surface light: the light that leaves one patch of a surface.
    VslRecord, 64 {
        /// Frame in which the record's chunk last changed; set by the publisher, whatever the caller left here.
        changed_frame: u64,
        /// Counts the re-placements of this light: another value means another patch.
        generation: u32,
        /// Index of the object that carries the patch.
        object: u32,
        /// Position in metres, relative to the scene origin (`StatisticsRecord::origin_m`).
        position: [f32; 3],
        /// Area of the patch in m².
        area: f32,
        /// Unit normal on the lit side.
        normal: [f32; 3],
        /// Standard error of the flux's mean over RGB, in W.
        standard_error: f32,
        /// Flux that leaves the patch, linear RGB (Rec. 709), in W.
        flux: [f32; 3],
        /// Mean age of the photon paths behind the flux, in s.
        mean_age_s: f32,
    }
}

/// Most corners of a patch.
pub const PATCH_CORNERS: usize = 8;

record! {
    /// The polygon of a virtual surface light: where on its surface the light leaves from.
    PatchRecord, 104 {
        /// From the light's position to each corner, x, y, z in metres, counter-clockwise as the lit side sees them.
        corners: [f32; 3 * PATCH_CORNERS],
        /// Number of corners in use: 3 to 8, or 0 where the light has no polygon; those beyond are zero.
        count: u32,
        /// Area of the polygon in m², as far as it is not inside other bodies: what the flux leaves from.
        area: f32,
    }
}

/// Texels of a [`DistanceRecord`].
pub const DISTANCE_TEXELS: usize = 32;

record! {
    /// A piece of the distance map of a virtual surface light: what it sees around itself, 32 texels of it.
    DistanceRecord, 64 {
        /// Two texels a word, the first in its lower half, row by row; see `photonstream_shading::distance_map`.
        texels: [u32; DISTANCE_TEXELS / 2],
    }
}

record! {
    /// What an object is now: its place and size in the world, and what it reflects.
    ObjectRecord, 128 {
        /// Index that `VslRecord::object` and `LightRecord::object` refer to.
        id: u32,
        /// Counts the changes of this record.
        generation: u32,
        /// Affine map from the object's rest space as the scene text loads it to the scene's space, in metres: three axes
        /// and the origin, column by column. The axes are orthogonal, as long as the object has grown since it was loaded,
        /// and left-handed where it has been mirrored.
        world_from_object: [f64; 12],
        /// Bits, none assigned in ABI 4: zero.
        flags: u32,
        /// Reflectance, linear RGB in [0, 1]; that of all objects of a material.
        albedo: [f32; 3],
        /// Zero.
        reserved: [u32; 2],
    }
}

record! {
    /// A light source, for direct light in the renderer.
    LightRecord, 128 {
        /// 0 point, 1 spot, 2 directional, 3 parallelogram, 4 triangle, 5 sky, 6 all triangles of `object`.
        kind: u32,
        /// 1 while switched on, else 0.
        enabled: u32,
        /// Linear RGB power in W; irradiance in W/m² for a directional light, mean radiance in W/(m² sr) for a sky.
        power: [f32; 3],
        /// Position in metres (a corner for area lights), relative to the scene origin.
        position: [f32; 3],
        /// Unit vector the light travels along (normal of area lights).
        direction: [f32; 3],
        /// First edge of an area light, in metres.
        edge_u: [f32; 3],
        /// Second edge of an area light, in metres.
        edge_v: [f32; 3],
        /// 1 - cos of the half angle within which a spot is full; in f32 a cosine cannot tell narrow cones apart.
        versine_inner: f32,
        /// 1 - cos of the half angle beyond which a spot is dark.
        versine_outer: f32,
        /// Object that carries the light, `u32::MAX` for none.
        object: u32,
        /// Counts the changes of this record.
        generation: u32,
        /// Zero.
        reserved: [u32; 11],
    }
}

record! {
    /// Counters and rates of the simulator at the time of a frame.
    StatisticsRecord, 256 {
        /// World position of the scene origin, in metres: positions of lights are relative to it.
        origin_m: [f64; 3],
        /// Photon paths traced since the start.
        paths_total: u64,
        /// Rays traced since the start.
        rays_total: u64,
        /// Deposits on virtual surface lights since the start.
        deposits_total: u64,
        /// Rays that left the scene.
        escaped: u64,
        /// Samples refused because a value was not finite.
        rejected: u64,
        /// Paths cut at the greatest depth.
        truncated: u64,
        /// Hits on a side of a surface that carries no virtual lights.
        absorbed_back: u64,
        /// Photon paths per second, recent mean.
        paths_per_s: f64,
        /// Rays per second, recent mean.
        rays_per_s: f64,
        /// Deposits per second, recent mean.
        deposits_per_s: f64,
        /// Share of the pool that still stands for the scene before the last edit, in [0, 1].
        stale_share: f64,
        /// Slots of the path pool.
        pool_paths: u64,
        /// Slots that hold a valid path.
        pool_valid: u64,
        /// 1 once the light has converged, else 0.
        converged: u64,
        /// Time of the simulated scene, in s.
        simulation_time_s: f64,
        /// Tracer threads.
        threads: u64,
        /// When the last edit arrived, monotonic ns.
        edit_received_ns: u64,
        /// When the light of that edit was traced, monotonic ns.
        traced_ns: u64,
        /// When it was published, monotonic ns; set by the publisher.
        published_ns: u64,
        /// Samples of the present light beyond those that the pool holds.
        refined_paths: u64,
        /// Standard error of the flux relative to it, mean over all lights weighted by flux; 0 while it is unknown.
        relative_error: f64,
        /// The relative error at which the simulator rests; 0 for none.
        target_error: f64,
        /// Rays of paths that edits left valid, since the start: what tracing everything again would have cost.
        rays_saved: u64,
        /// Slots that the pool may have at most; `pool_paths` are in use.
        pool_capacity: u64,
        /// Measured time from the arrival of the last change until all its light was traced, in ms.
        latency_ms: f64,
        /// The latency that the simulator aims at, in ms; 0 for none.
        latency_target_ms: f64,
        /// Paths traced again because of edits, since the start.
        retraced_paths: u64,
        /// Zero.
        reserved: [u64; 2],
    }
}

/// What the eight arrays of a slot hold; the number is the array's kind in the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u64)]
pub enum ArrayKind {
    /// `VslRecord`s.
    Vsl = 1,
    /// `ObjectRecord`s.
    Object = 2,
    /// `LightRecord`s.
    Light = 3,
    /// One `StatisticsRecord`.
    Statistics = 4,
    /// UTF-8 text of the resolved scene, 64 bytes a record, zero-filled.
    SceneText = 5,
    /// UTF-8 text of what is wrong with the simulation, 64 bytes a record, zero-filled; empty while nothing is.
    Notice = 6,
    /// `PatchRecord`s: one for each virtual surface light, or none at all.
    Patch = 7,
    /// `DistanceRecord`s: edge²/32 for each virtual surface light, one light's after the other's, or none at all.
    Distance = 8,
}

impl ArrayKind {
    /// All arrays, in the order in which they lie in a slot.
    pub const ALL: [Self; 8] = [
        Self::Vsl,
        Self::Object,
        Self::Light,
        Self::Statistics,
        Self::SceneText,
        Self::Notice,
        Self::Patch,
        Self::Distance,
    ];

    /// Name in messages and in the documentation.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Vsl => "vsl",
            Self::Object => "object",
            Self::Light => "light",
            Self::Statistics => "statistics",
            Self::SceneText => "scene_text",
            Self::Notice => "notice",
            Self::Patch => "patch",
            Self::Distance => "distance",
        }
    }

    /// Bytes of one record.
    pub const fn record_bytes(self) -> usize {
        match self {
            Self::Vsl => size_of::<VslRecord>(),
            Self::Object => size_of::<ObjectRecord>(),
            Self::Light => size_of::<LightRecord>(),
            Self::Statistics => size_of::<StatisticsRecord>(),
            Self::SceneText | Self::Notice => TEXT_RECORD,
            Self::Patch => size_of::<PatchRecord>(),
            Self::Distance => size_of::<DistanceRecord>(),
        }
    }

    /// Fields of one record; none for text.
    pub const fn fields(self) -> &'static [Field] {
        match self {
            Self::Vsl => VslRecord::FIELDS,
            Self::Object => ObjectRecord::FIELDS,
            Self::Light => LightRecord::FIELDS,
            Self::Statistics => StatisticsRecord::FIELDS,
            Self::SceneText | Self::Notice => &[],
            Self::Patch => PatchRecord::FIELDS,
            Self::Distance => DistanceRecord::FIELDS,
        }
    }
}

const fn fnv1a(mut hash: u64, byte: u8) -> u64 {
    hash ^= byte as u64;
    hash.wrapping_mul(0x0000_0100_0000_01b3)
}

const fn fnv1a_word(mut hash: u64, word: u64) -> u64 {
    let bytes = word.to_le_bytes();
    let mut i = 0;
    while i < 8 {
        hash = fnv1a(hash, bytes[i]);
        i += 1;
    }
    hash
}

/// FNV-1a over kind and size of each record and over name, offset, size and type of each of its fields.
pub const LAYOUT_HASH: u64 = {
    let mut hash = 0xcbf2_9ce4_8422_2325;
    let mut a = 0;
    while a < ArrayKind::ALL.len() {
        let kind = ArrayKind::ALL[a];
        hash = fnv1a_word(hash, kind as u64);
        hash = fnv1a_word(hash, kind.record_bytes() as u64);
        let fields = kind.fields();
        let mut f = 0;
        while f < fields.len() {
            let name = fields[f].name.as_bytes();
            let mut i = 0;
            while i < name.len() {
                hash = fnv1a(hash, name[i]);
                i += 1;
            }
            hash = fnv1a_word(hash, fields[f].offset as u64);
            hash = fnv1a_word(hash, fields[f].size as u64);
            hash = fnv1a_word(hash, fields[f].kind as u64);
            f += 1;
        }
        a += 1;
    }
    hash
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_tile_each_record_without_padding() {
        for kind in ArrayKind::ALL {
            let mut next = 0;
            for field in kind.fields() {
                assert_eq!(field.offset, next, "{}.{}", kind.name(), field.name);
                next += field.size;
            }
            assert!(next == kind.record_bytes() || kind.fields().is_empty());
        }
    }

    /// A changed value here is a changed ABI: renderers of another release refuse it.
    #[test]
    fn layout_hash_is_the_one_of_abi_4() {
        assert_eq!(LAYOUT_HASH, 0xd3ab_f08f_03b1_0ab2, "{LAYOUT_HASH:#018x}");
    }
}
