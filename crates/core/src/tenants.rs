//! Tenants: what a key may do, what a tenant may take, and what is said of an erased person. The log
//! and the wire write these in the same form.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::ids::{Digest, Seq, Signature, StreamKey};

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

/// What one tenant may take of what all share. None: no more than the machine has for everybody.
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

/// A person's key was destroyed; their records are noise from here on, and stay where they are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PersonErased {
    /// The person's stream.
    pub stream: StreamKey,
    /// Where the stream ended.
    pub last: Seq,
    /// The digest of its last record.
    pub head: Digest,
    /// Ed25519 by the tenant's key, over `tenancy::erasure_statement`.
    pub signature: Signature,
}

impl Role {
    /// Every role.
    pub const ALL: [Role; 3] = [Role::Gateway, Role::Operator, Role::Auditor];

    /// As it is written: `gateway`.
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
