use crate::client;
use crate::events::{Quotas, Role, SegmentClosed};
use crate::ids::{Digest, PublicKey, Seq, Signature, StreamKey, TenantId};

/// What may be done to a tenant. Doing a thing twice is doing it once: the second time nothing is
/// recorded, so that whoever lost the answer may ask again.
#[derive(Debug, Clone, PartialEq)]
pub enum Order {
    /// The tenant is to exist.
    Open,
    Admit {
        key: PublicKey,
        role: Role,
        label: String,
    },
    /// The key is good for so many seconds more; 0: no longer.
    Retire {
        key: PublicKey,
        overlap_seconds: u64,
    },
    /// A new key in the old one's role; the old one is good for so many seconds more.
    Rotate {
        old: PublicKey,
        new: PublicKey,
        overlap_seconds: u64,
    },
    Disable {
        reason: String,
    },
    Enable,
    SetQuotas(Quotas),
    /// Says that a person's key was destroyed. From inside the service alone.
    NoteErasure {
        stream: StreamKey,
        last: Seq,
        head: Digest,
        signature: Signature,
    },
    /// Seals a stretch of a person's stream. From inside the service alone.
    CloseSegment(SegmentClosed),
}

impl From<client::Order> for Order {
    fn from(order: client::Order) -> Order {
        match order {
            client::Order::Add => Order::Open,
            client::Order::Admit { key, role, label } => Order::Admit { key, role, label },
            client::Order::Retire { key, overlap_seconds } => {
                Order::Retire { key, overlap_seconds }
            }
            client::Order::Rotate { old, new, overlap_seconds } => {
                Order::Rotate { old, new, overlap_seconds }
            }
            client::Order::Disable { reason } => Order::Disable { reason },
            client::Order::Enable => Order::Enable,
            client::Order::SetQuotas(quotas) => Order::SetQuotas(quotas),
        }
    }
}

impl Order {
    /// The key that comes in or goes with it.
    pub fn key(&self) -> Option<&PublicKey> {
        match self {
            Order::Admit { key, .. } | Order::Retire { key, .. } => Some(key),
            Order::Rotate { new, .. } => Some(new),
            _ => None,
        }
    }
}

/// What the tenant's key signs when a person is erased.
pub fn erasure_statement(tenant: &TenantId, stream: StreamKey, last: Seq, head: Digest) -> Vec<u8> {
    format!("apprentice erasure 1\n{tenant}\n{stream}\n{last}\n{head}\n").into_bytes()
}
