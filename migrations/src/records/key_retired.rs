//! `key_retired`, kind 14.

use serde::Deserialize;

use super::Digest;

/// Version 1, written by builds of 0.2 before its release. It has only the end of the overlap,
/// counted from the time of the record. If that time was held, it is no reading of the wall clock.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct V1 {
    /// The public half of a CURVE key: 32 bytes, like a digest.
    pub key: Digest,
    /// Microseconds since 1970-01-01T00:00Z.
    pub valid_until: u64,
}
