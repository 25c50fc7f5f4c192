use apprentice_core::ids::PublicKey;
use apprentice_core::tenants::{Quotas, Role};
use serde::{Deserialize, Serialize};

/// What an operator may do to a tenant. Doing a thing twice is doing it once: the second time
/// nothing is recorded, so an operator who lost the answer may ask again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Order {
    /// The tenant is to exist.
    Add,
    Admit {
        key: PublicKey,
        role: Role,
        /// For people: which machine the key is on.
        #[serde(default)]
        label: String,
    },
    /// The key stays good for so many seconds; 0: it is refused at once.
    Retire {
        key: PublicKey,
        #[serde(default)]
        overlap_seconds: u64,
    },
    /// A new key in the old one's role; the old one stays good for so many seconds.
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
}
