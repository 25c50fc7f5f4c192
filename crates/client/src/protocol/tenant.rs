use apprentice_core::ids::{PublicKey, TenantId, Timestamp};
use apprentice_core::tenants::{PersonErased, Quotas, Role};
use serde::{Deserialize, Serialize};

/// A person is erased.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErasedView {
    pub tenant: TenantId,
    /// As it stands in the tenant's stream.
    pub erased: PersonErased,
}

/// An order was carried out, and is durable.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ordered {
    pub tenant: TenantId,
    /// Records that it led to; 0 when it was so already.
    pub recorded: u32,
}

/// A tenant, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantView {
    pub tenant: TenantId,
    /// Why nobody comes in, if so.
    pub disabled: Option<String>,
    pub quotas: Quotas,
    /// Every key that was ever admitted.
    pub keys: Vec<KeyView>,
}

/// A key, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyView {
    pub key: PublicKey,
    pub role: Role,
    pub label: String,
    pub admitted_at: Timestamp,
    /// When its overlap was to end, once it was retired; none before.
    pub valid_until: Option<Timestamp>,
    /// It never comes in again: there was no overlap, or a reading of the clock has ended it.
    #[serde(default)]
    pub retired: bool,
}
