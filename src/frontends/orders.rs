//! Orders as they travel. Inside the service there are more of them than operators may give.

use serde::{Deserialize, Serialize};

use crate::actors::TenantVerb;
use crate::ids::{PublicKey, UserId};
use crate::tenancy::{Order, Quotas, Role};

/// The orders that operators may give, as they are spelled on the wire.
pub const ORDERS: [&str; 9] =
    ["list", "add", "admit", "retire", "rotate", "disable", "enable", "set_quotas", "erase"];

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum WireOrder {
    List,
    Add,
    Admit {
        key: PublicKey,
        role: Role,
        #[serde(default)]
        label: String,
    },
    Retire {
        key: PublicKey,
        #[serde(default)]
        overlap_seconds: u64,
    },
    Rotate {
        old: PublicKey,
        new: PublicKey,
        overlap_seconds: u64,
    },
    Disable {
        #[serde(default)]
        reason: String,
    },
    Enable,
    SetQuotas(Quotas),
    Erase {
        user: UserId,
    },
}

impl WireOrder {
    /// - returns: none for an order that comes from inside the service alone.
    pub fn of(verb: &TenantVerb) -> Option<WireOrder> {
        let order = match verb {
            TenantVerb::List => return Some(WireOrder::List),
            TenantVerb::Erase { user } => return Some(WireOrder::Erase { user: user.clone() }),
            TenantVerb::Give(order) => order.clone(),
        };
        match order {
            Order::Open => Some(WireOrder::Add),
            Order::Admit { key, role, label } => Some(WireOrder::Admit { key, role, label }),
            Order::Retire { key, overlap_seconds } => {
                Some(WireOrder::Retire { key, overlap_seconds })
            }
            Order::Rotate { old, new, overlap_seconds } => {
                Some(WireOrder::Rotate { old, new, overlap_seconds })
            }
            Order::Disable { reason } => Some(WireOrder::Disable { reason }),
            Order::Enable => Some(WireOrder::Enable),
            Order::SetQuotas(quotas) => Some(WireOrder::SetQuotas(quotas)),
            Order::NoteErasure { .. } | Order::CloseSegment(_) => None,
        }
    }

    pub fn verb(self) -> TenantVerb {
        TenantVerb::Give(match self {
            WireOrder::List => return TenantVerb::List,
            WireOrder::Erase { user } => return TenantVerb::Erase { user },
            WireOrder::Add => Order::Open,
            WireOrder::Admit { key, role, label } => Order::Admit { key, role, label },
            WireOrder::Retire { key, overlap_seconds } => Order::Retire { key, overlap_seconds },
            WireOrder::Rotate { old, new, overlap_seconds } => {
                Order::Rotate { old, new, overlap_seconds }
            }
            WireOrder::Disable { reason } => Order::Disable { reason },
            WireOrder::Enable => Order::Enable,
            WireOrder::SetQuotas(quotas) => Order::SetQuotas(quotas),
        })
    }
}
