//! Bytes between processes: virtual surface lights over shared memory, and a control socket.
//!
//! One [`Publisher`] per channel writes frames; any number of [`Subscriber`]s read them, come and go and crash at any
//! moment, as may the publisher. Neither ever waits for the other. The format is described byte by byte in this
//! crate's `README.md`; this crate knows bytes and no light transport.

#[cfg(not(unix))]
compile_error!("photonstream-protocol needs a Unix system: POSIX shared memory and local sockets");

mod channels;
mod chunks;
mod claim;
mod control;
mod error;
mod finite;
mod frame;
mod heartbeat;
mod layout;
mod local_socket;
mod mapped_segment;
mod mapping;
mod process;
mod publisher;
mod reader_segment;
#[cfg(test)]
mod readme;
mod record;
#[cfg(test)]
mod ring_heap;
#[cfg(test)]
mod ring_loom;
mod ring_read;
mod ring_write;
mod runtime;
mod shape;
mod staging;
mod subscriber;
mod text;
mod words;
mod writer_segment;

pub use channels::{ChannelStatus, Cleaned, channels, channels_in, clean, clean_in, clean_one};
pub use chunks::{CHUNK_RECORDS, ChunkSet};
pub use control::{ControlClient, ControlServer, Incoming, Replier, Reply, Request};
pub use error::ProtocolError;
pub use frame::VslFrame;
pub use layout::{ABI_MAJOR, ABI_MINOR, ENDIAN_TAG, MAGIC, NOTICE_CAPACITY, SegmentSpec};
pub use mapped_segment::{MappedFrame, MappedSegment};
pub use process::monotonic_ns;
pub use publisher::{FrameSource, Publisher};
pub use reader_segment::AccessMode;
pub use record::{
    ArrayKind, DISTANCE_TEXELS, DistanceRecord, Field, FieldType, LAYOUT_HASH, LightRecord, ObjectRecord,
    PATCH_CORNERS, PatchRecord, StatisticsRecord, VslRecord,
};
pub use runtime::{ChannelName, Runtime};
pub use subscriber::{Liveness, Reading, Subscriber, Wake};
