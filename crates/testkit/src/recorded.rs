//! An event as a log returns it, without a log.

use apprentice::events::{Event, Head, Record, decode, encode};
use apprentice::ids::{Digest, RequestId, Timestamp};

/// The record that follows `head`, with the event encoded and decoded as on the disk.
pub fn recorded(head: Head, event: &Event, request: RequestId, at: Timestamp) -> Record {
    let body = encode(event);
    let kind = event.kind();
    let event = decode(kind as u16, kind.version(), &body).expect("it was just encoded");
    Record { seq: head.next(), at, request, prev: head.digest, digest: Digest::of(&body), event }
}
