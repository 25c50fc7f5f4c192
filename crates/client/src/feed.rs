use apprentice_core::ids::RequestId;
use serde::{Deserialize, Serialize};

use crate::protocol::{PlainView, SealedView};
use crate::wire;

/// A message of the feed: the frame after its topic.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FeedMessage {
    /// The version of the wire, [`wire::VERSION`].
    pub v: u64,
    /// Names this run of the feed.
    pub start: RequestId,
    /// The number of the record among all records of the tenant in this run, from 1. For a beat:
    /// how many records there were.
    pub number: u64,
    /// A record of the sealed feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sealed: Option<SealedView>,
    /// A record of the plain feed; none for a beat.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub plain: Option<PlainView>,
}

impl FeedMessage {
    /// One MessagePack map.
    pub fn encode(&self) -> Vec<u8> {
        wire::pack(self)
    }

    /// Reads one MessagePack map.
    ///
    /// - errors: a sentence. No bytes make it panic.
    pub fn decode(bytes: &[u8]) -> Result<FeedMessage, String> {
        let message: FeedMessage = wire::unpack(bytes)?;
        match message.v == wire::VERSION {
            true => Ok(message),
            false => Err(format!("wire version {} is not supported", message.v)),
        }
    }
}

/// The topic of messages without a record, which say how many records there were. The topic of a
/// record is its stream, in hexadecimal digits.
pub const BEAT: &str = "beat";
