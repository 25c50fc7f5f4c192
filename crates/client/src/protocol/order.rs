use apprentice_core::ids::PublicKey;
use apprentice_core::tenants::{Quotas, Role};
use serde::{Deserialize, Serialize};

/// What an operator may change about a tenant. The same order again records nothing, so an operator
/// who did not get the answer may send it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// Make the tenant.
    Add,
    /// Admit a key.
    Admit {
        /// The public half of the key.
        key: PublicKey,
        /// What its owner may ask.
        role: Role,
        /// For people, such as the machine that has the key. May be empty.
        #[serde(default)]
        label: String,
    },
    /// Stop admitting a key.
    Retire {
        /// The public half of the key.
        key: PublicKey,
        /// Seconds for which the key still works; 0: it stops at once.
        #[serde(default)]
        overlap_seconds: u64,
    },
    /// Admit a new key in the role of an old one, and retire the old one.
    Rotate {
        /// The key that is retired.
        old: PublicKey,
        /// The key that is admitted.
        new: PublicKey,
        /// Seconds for which the old key still works; 0: it stops at once.
        overlap_seconds: u64,
    },
    /// Admit none of its keys, until it is enabled again.
    Disable {
        /// For operators. May be empty.
        #[serde(default)]
        reason: String,
    },
    /// Undo `Disable`.
    Enable,
    /// Replace all quotas.
    SetQuotas(Quotas),
}
