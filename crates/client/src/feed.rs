use apprentice_core::ids::RequestId;
use serde::{Deserialize, Serialize};

use crate::protocol::{PlainView, SealedView};
use crate::wire;

/// A message of the feed, beside its topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeedMessage {
    pub v: u64,
    /// Names this run of the feed.
    pub start: RequestId,
    /// Its place among all records of the tenant since then, from 1 on; of a beat, how many there
    /// were.
    pub number: u64,
    /// Of the sealed feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sealed: Option<SealedView>,
    /// Of the plain feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub plain: Option<PlainView>,
}

impl FeedMessage {
    /// One MessagePack map.
    pub fn encode(&self) -> Vec<u8> {
        wire::pack(self)
    }

    /// - errors: a sentence; never panics, whatever the bytes.
    pub fn decode(bytes: &[u8]) -> Result<FeedMessage, String> {
        let message: FeedMessage = wire::unpack(bytes)?;
        match message.v == wire::VERSION {
            true => Ok(message),
            false => Err(format!("wire version {} is not supported", message.v)),
        }
    }
}

/// The topic of messages that carry no record, and tell how many there were. A record's topic is its
/// stream, in hexadecimal digits.
pub const BEAT: &str = "beat";
