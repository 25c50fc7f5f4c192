use std::io::ErrorKind;

use rmp_serde::decode::Error;
use serde::de::{DeserializeOwned, IgnoredAny};
use serde::{Deserialize, Serialize};

use super::{
    Event, EventKind, KeyAdmitted, KeyRetired, PersonErased, QuotasSet, SegmentClosed,
    TenantDisabled, TenantEnabled, TenantOpened, upcast,
};
use crate::invariants::Invariant;

/// Why a record's body is no event this binary can read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    #[error("event kind {kind} is unknown to this version of apprentice; use a newer one")]
    UnknownKind { kind: u16 },
    #[error("{kind:?} version {version} is unknown to this version of apprentice; use a newer one")]
    UnknownVersion { kind: EventKind, version: u16 },
    #[error("the body of a {kind:?} event does not decode: {reason} ({})", Invariant::OldLogsOpen)]
    Body { kind: EventKind, reason: String },
}

/// The body of an event: MessagePack with field names, so that a person with a MessagePack printer
/// can read it. Kind and version stand in the record's header.
pub fn encode(event: &Event) -> Vec<u8> {
    match event {
        Event::SessionOpened(body) => pack(body),
        Event::EpisodeStarted(body) => pack(body),
        Event::Interpreted(body) => pack(body),
        Event::EpisodeEnded(body) => pack(body),
        Event::DecompositionTaught(body) => pack(body),
        Event::DecompositionDeclined(body) => pack(body),
        Event::LessonForgotten(body) => pack(body),
        Event::RetrainScheduled(body) => pack(body),
        Event::RetrainCompleted(body) => pack(body),
        Event::RetrainFailed(body) => pack(body),
        Event::SessionClosed(body) => pack(body),
        Event::MarkedWrong(body) => pack(body),
        Event::Tenant(event) => pack(event),
    }
}

/// Reads every version that was ever released.
///
/// - errors: [`DecodeError`]; never panics, whatever the bytes.
pub fn decode(kind: u16, version: u16, body: &[u8]) -> Result<Event, DecodeError> {
    let kind = EventKind::from_number(kind).ok_or(DecodeError::UnknownKind { kind })?;
    if version != kind.version() {
        return upcast::former(kind, version, body)?
            .ok_or(DecodeError::UnknownVersion { kind, version });
    }
    Ok(match kind {
        EventKind::SessionOpened => Event::SessionOpened(unpack(kind, body)?),
        EventKind::EpisodeStarted => Event::EpisodeStarted(unpack(kind, body)?),
        EventKind::Interpreted => Event::Interpreted(unpack(kind, body)?),
        EventKind::EpisodeEnded => Event::EpisodeEnded(unpack(kind, body)?),
        EventKind::DecompositionTaught => Event::DecompositionTaught(unpack(kind, body)?),
        EventKind::DecompositionDeclined => Event::DecompositionDeclined(unpack(kind, body)?),
        EventKind::LessonForgotten => Event::LessonForgotten(unpack(kind, body)?),
        EventKind::RetrainScheduled => Event::RetrainScheduled(unpack(kind, body)?),
        EventKind::RetrainCompleted => Event::RetrainCompleted(unpack(kind, body)?),
        EventKind::RetrainFailed => Event::RetrainFailed(unpack(kind, body)?),
        EventKind::SessionClosed => Event::SessionClosed(unpack(kind, body)?),
        EventKind::MarkedWrong => Event::MarkedWrong(unpack(kind, body)?),
        EventKind::TenantOpened => unpack::<TenantOpened>(kind, body)?.into(),
        EventKind::KeyAdmitted => unpack::<KeyAdmitted>(kind, body)?.into(),
        EventKind::KeyRetired => unpack::<KeyRetired>(kind, body)?.into(),
        EventKind::TenantDisabled => unpack::<TenantDisabled>(kind, body)?.into(),
        EventKind::TenantEnabled => unpack::<TenantEnabled>(kind, body)?.into(),
        EventKind::QuotasSet => unpack::<QuotasSet>(kind, body)?.into(),
        EventKind::PersonErased => unpack::<PersonErased>(kind, body)?.into(),
        EventKind::SegmentClosed => unpack::<SegmentClosed>(kind, body)?.into(),
    })
}

fn pack<T: Serialize>(body: &T) -> Vec<u8> {
    rmp_serde::to_vec_named(body).expect("events are plain data and encode into memory")
}

pub(super) fn unpack<T: DeserializeOwned>(kind: EventKind, body: &[u8]) -> Result<T, DecodeError> {
    let wrong = |reason: String| DecodeError::Body { kind, reason };
    // Of a slice, not of a reader: that copies every text twice.
    let mut decoder = rmp_serde::Deserializer::from_read_ref(body);
    // A scene file of nested tables must not overflow the stack of its reader.
    decoder.set_max_depth(64);
    let event = T::deserialize(&mut decoder).map_err(|error| wrong(error.to_string()))?;
    // A slice's decoder does not show what is left; at the end there is no next value to read.
    match IgnoredAny::deserialize(&mut decoder) {
        Err(Error::InvalidMarkerRead(error)) if error.kind() == ErrorKind::UnexpectedEof => {
            Ok(event)
        }
        _ => Err(wrong("bytes follow after its end".to_owned())),
    }
}
