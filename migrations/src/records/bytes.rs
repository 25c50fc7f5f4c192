use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};

/// 32 bytes, stored as MessagePack `bin`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(
    /// The bytes.
    pub [u8; 32],
);

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Digest, D::Error> {
        struct Bytes;
        impl Visitor<'_> for Bytes {
            type Value = Digest;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("32 bytes")
            }
            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Digest, E> {
                let found = bytes.len();
                bytes.try_into().map(Digest).map_err(|_| E::invalid_length(found, &self))
            }
        }
        deserializer.deserialize_bytes(Bytes)
    }
}
