use serde::{Deserialize, Serialize};

use apprentice_core::tenants::{PersonErased, Quotas, Role};

use super::EventKind;
use crate::ids::{Digest, PublicKey, Seq, StreamKey, Timestamp};

/// A fact of a tenant's own stream: what operators did, who was erased, and which parts of people's
/// streams are sealed for evidence.
#[derive(Debug, Clone, PartialEq)]
pub enum TenantEvent {
    Opened(TenantOpened),
    KeyAdmitted(KeyAdmitted),
    KeyRetired(KeyRetired),
    Disabled(TenantDisabled),
    Enabled(TenantEnabled),
    QuotasSet(QuotasSet),
    PersonErased(PersonErased),
    SegmentClosed(SegmentClosed),
}

/// The tenant's first record.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantOpened {}

/// From now on the holder of `key` is authenticated as this tenant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyAdmitted {
    pub key: PublicKey,
    pub role: Role,
    /// For people: whose machine it is on.
    pub label: String,
}

/// `key` is good for an overlap, which may be none, and never again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyRetired {
    pub key: PublicKey,
    #[serde(flatten)]
    pub overlap: Overlap,
}

/// How long a retired key stays good.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Overlap {
    /// From a reading of the wall clock on. The record's own time may be another, a held one.
    Read {
        /// What the wall clock read when the key was retired.
        wall: Timestamp,
        overlap_seconds: u64,
    },
    /// From the time of the record on: version 1 did not say what the wall clock read.
    Former { valid_until: Timestamp },
}

/// No key is authenticated as this tenant any more.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantDisabled {
    pub reason: String,
}

/// The tenant's keys are good again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantEnabled {}

/// The tenant's quotas, all of them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct QuotasSet {
    pub quotas: Quotas,
}

/// A stretch of a person's stream was sealed for evidence: a leaf of the tenant's tree, which holds
/// its leaves in the order of these events.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SegmentClosed {
    pub stream: StreamKey,
    pub first: Seq,
    pub last: Seq,
    /// The RFC 6962 tree over the digests of the records `first` to `last`.
    pub root: Digest,
    /// The digest of the record `last`.
    pub head: Digest,
}

impl Overlap {
    /// The span within which the key stays good: `[from, until)`; empty when there is no overlap.
    ///
    /// - `recorded_at`: the time of the record.
    pub fn span(&self, recorded_at: Timestamp) -> (Timestamp, Timestamp) {
        match *self {
            Overlap::Read { wall, overlap_seconds } => (wall, wall.plus_seconds(overlap_seconds)),
            Overlap::Former { valid_until } => (recorded_at, valid_until),
        }
    }
}

impl TenantEvent {
    pub fn kind(&self) -> EventKind {
        match self {
            TenantEvent::Opened(_) => EventKind::TenantOpened,
            TenantEvent::KeyAdmitted(_) => EventKind::KeyAdmitted,
            TenantEvent::KeyRetired(_) => EventKind::KeyRetired,
            TenantEvent::Disabled(_) => EventKind::TenantDisabled,
            TenantEvent::Enabled(_) => EventKind::TenantEnabled,
            TenantEvent::QuotasSet(_) => EventKind::QuotasSet,
            TenantEvent::PersonErased(_) => EventKind::PersonErased,
            TenantEvent::SegmentClosed(_) => EventKind::SegmentClosed,
        }
    }
}

// The body alone: which event it is stands in the record's header.
impl Serialize for TenantEvent {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            TenantEvent::Opened(body) => body.serialize(serializer),
            TenantEvent::KeyAdmitted(body) => body.serialize(serializer),
            TenantEvent::KeyRetired(body) => body.serialize(serializer),
            TenantEvent::Disabled(body) => body.serialize(serializer),
            TenantEvent::Enabled(body) => body.serialize(serializer),
            TenantEvent::QuotasSet(body) => body.serialize(serializer),
            TenantEvent::PersonErased(body) => body.serialize(serializer),
            TenantEvent::SegmentClosed(body) => body.serialize(serializer),
        }
    }
}

macro_rules! into_event {
    ($($body:ident => $variant:ident),* $(,)?) => {$(
        impl From<$body> for super::Event {
            fn from(body: $body) -> super::Event {
                super::Event::Tenant(TenantEvent::$variant(body))
            }
        }
    )*};
}

into_event! {
    TenantOpened => Opened,
    KeyAdmitted => KeyAdmitted,
    KeyRetired => KeyRetired,
    TenantDisabled => Disabled,
    TenantEnabled => Enabled,
    QuotasSet => QuotasSet,
    PersonErased => PersonErased,
    SegmentClosed => SegmentClosed,
}
