//! Bodies of events as released, by kind and version: MessagePack maps with field names.

mod bytes;
pub mod interpreted;
pub mod key_retired;
pub mod retrain_completed;

pub use bytes::Digest;

/// The frozen formats: number of the kind, version of the body.
pub const FROZEN: &[(u16, u16)] = &[(3, 1), (9, 1), (14, 1)];
