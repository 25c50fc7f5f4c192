use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::EventKind;
use crate::ids::{Digest, PublicKey, Seq, Signature, StreamKey, Timestamp};

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

/// What the holder of a key may do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Speaks for the tenant's people, and vouches for who they are.
    Gateway,
    /// Decides about the tenant's keys, quotas and erasures.
    Operator,
    /// Reads sealed records, checkpoints and proofs; changes nothing.
    Auditor,
}

/// What one tenant may take of what all share. None: only the limits of the machine apply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Quotas {
    /// People awake at once.
    pub awake_users: Option<u32>,
    /// Requests taken and not yet answered.
    pub in_flight: Option<u32>,
    /// Utterances a second, in the long run.
    pub utterances_per_second: Option<u32>,
    /// Utterances at once after a silence.
    pub burst: Option<u32>,
    /// Sealed bytes in the log, all in all.
    pub sealed_bytes: Option<u64>,
    /// Trainings waiting.
    pub trainings_waiting: Option<u32>,
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

/// A person's key was destroyed; their records are noise from here on, and stay where they are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PersonErased {
    pub stream: StreamKey,
    /// Where the stream ended.
    pub last: Seq,
    pub head: Digest,
    /// Ed25519 by the tenant's key, over `tenancy::erasure_statement`.
    pub signature: Signature,
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

impl Role {
    pub const ALL: [Role; 3] = [Role::Gateway, Role::Operator, Role::Auditor];

    pub fn name(self) -> &'static str {
        match self {
            Role::Gateway => "gateway",
            Role::Operator => "operator",
            Role::Auditor => "auditor",
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Role {
    type Err = String;
    fn from_str(text: &str) -> Result<Role, String> {
        Role::ALL.into_iter().find(|role| role.name() == text).ok_or_else(|| {
            let shown: String = text.chars().take(40).collect();
            format!("{shown:?} is not a role; the roles are gateway, operator and auditor")
        })
    }
}

impl fmt::Display for Quotas {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Quotas {
            awake_users,
            in_flight,
            utterances_per_second,
            burst,
            sealed_bytes,
            trainings_waiting,
        } = self;
        let fields = [
            ("people awake", awake_users.map(u64::from)),
            ("requests in flight", in_flight.map(u64::from)),
            ("utterances a second", utterances_per_second.map(u64::from)),
            ("at once", burst.map(u64::from)),
            ("sealed bytes", *sealed_bytes),
            ("trainings waiting", trainings_waiting.map(u64::from)),
        ];
        let mut written = false;
        for (name, limit) in fields {
            if let Some(limit) = limit {
                let comma = if written { ", " } else { "at most " };
                write!(f, "{comma}{limit} {name}")?;
                written = true;
            }
        }
        if written { Ok(()) } else { f.write_str("no limits") }
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
