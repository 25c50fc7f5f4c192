use std::fmt;

use apprentice_core::header::Header;
use apprentice_core::ids::{Digest, Seq, StreamKey, Timestamp};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

/// Where a stream ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HeadView {
    /// The stream.
    pub stream: StreamKey,
    /// Its last record.
    pub seq: Seq,
    /// The digest of its last record.
    pub digest: Digest,
}

/// The answer to [`ArchiveAsk::Heads`](super::ArchiveAsk::Heads).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heads {
    /// In the order of their keys.
    pub heads: Vec<HeadView>,
    /// There are more streams after the last of these.
    pub more: bool,
}

/// A record as the log keeps it: its body is encrypted with the person's key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SealedView {
    /// The stream that it belongs to.
    pub stream: StreamKey,
    /// Its number in the stream.
    pub seq: Seq,
    /// The digest of `frame`.
    pub digest: Digest,
    /// Its bytes.
    pub frame: Frame,
}

/// The header and the encrypted body of a record: the bytes that its digest is computed from.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame(pub Vec<u8>);

/// The answer to [`ArchiveAsk::Sealed`](super::ArchiveAsk::Sealed).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SealedRecords {
    /// In their order, without a gap.
    pub records: Vec<SealedView>,
    /// There are more records after the last of these.
    pub more: bool,
}

/// A record, decrypted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlainView {
    /// The stream that it belongs to.
    pub stream: StreamKey,
    /// Its number in the stream.
    pub seq: Seq,
    /// When it was recorded.
    pub at: Timestamp,
    /// The digest of the record before it; [`Digest::ZERO`] for the first.
    pub prev: Digest,
    /// The digest of the encrypted record.
    pub digest: Digest,
    /// The kind of its event, as `schema/events.md` names it.
    pub kind: String,
    /// The event, as `schema/events.md` describes it.
    pub event: Value,
}

/// The answer to [`ArchiveAsk::Plain`](super::ArchiveAsk::Plain).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlainRecords {
    /// The person was erased: these records can no longer be decrypted.
    pub erased: bool,
    /// In their order, without a gap. Empty if the person was erased.
    pub records: Vec<PlainView>,
    /// There are more records after the last of these.
    pub more: bool,
}

impl SealedView {
    /// Compares the record with its digest and with the digest of the record before it. Needs no
    /// key.
    ///
    /// - `prev`: the digest of the record before it; [`Digest::ZERO`] for the first.
    /// - errors: a sentence. The bytes were changed, or belong to another place in the log.
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
