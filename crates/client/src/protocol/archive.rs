use std::fmt;

use apprentice_core::header::Header;
use apprentice_core::ids::{Digest, Seq, StreamKey, Timestamp};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// Where a stream ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeadView {
    pub stream: StreamKey,
    pub seq: Seq,
    pub digest: Digest,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heads {
    pub heads: Vec<HeadView>,
    /// There are more streams after the last of these.
    pub more: bool,
}

/// A record as it is kept.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SealedView {
    pub stream: StreamKey,
    pub seq: Seq,
    pub digest: Digest,
    pub frame: Frame,
}

/// Header and sealed body of a record: what its digest is over.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame(pub Vec<u8>);

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SealedRecords {
    pub records: Vec<SealedView>,
    /// There are more records after the last of these.
    pub more: bool,
}

/// A record in the clear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlainView {
    pub stream: StreamKey,
    pub seq: Seq,
    pub at: Timestamp,
    pub prev: Digest,
    pub digest: Digest,
    pub kind: String,
    pub event: Value,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlainRecords {
    /// The person was erased: nobody can open these records any more.
    pub erased: bool,
    pub records: Vec<PlainView>,
    pub more: bool,
}

impl SealedView {
    /// Holds the record against its digest and its predecessor's, without a key.
    ///
    /// - errors: a sentence; the record is then not what it says it is.
    pub fn check(&self, prev: Digest) -> Result<(), String> {
        let SealedView { stream, seq, digest, frame } = self;
        let wrong = |what: &str| Err(format!("record {seq} of stream {stream}: {what}"));
        let (header, _, found) = match Header::unframe(&frame.0) {
            Ok(read) => read,
            Err(error) => return wrong(&error.to_string()),
        };
        if found != *digest {
            return wrong("its bytes have another digest");
        }
        if header.stream != *stream || header.seq != *seq {
            return wrong("its header is another record's");
        }
        match header.prev == prev {
            true => Ok(()),
            false => wrong("it follows on another record"),
        }
    }
}

impl Serialize for Frame {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for Frame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Frame, D::Error> {
        struct Visitor;
        impl serde::de::Visitor<'_> for Visitor {
            type Value = Frame;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("bytes")
            }
            fn visit_bytes<E: serde::de::Error>(self, bytes: &[u8]) -> Result<Frame, E> {
                Ok(Frame(bytes.to_vec()))
            }
        }
        deserializer.deserialize_bytes(Visitor)
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Frame({} bytes)", self.0.len())
    }
}
