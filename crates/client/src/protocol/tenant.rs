use apprentice_core::ids::{PublicKey, TenantId, Timestamp};
use apprentice_core::tenants::{PersonErased, Quotas, Role};
use serde::{Deserialize, Serialize};

/// The answer to [`TenantVerb::Erase`](super::TenantVerb::Erase): the person is erased.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErasedView {
    /// The person's tenant.
    pub tenant: TenantId,
    /// The event in the tenant's own stream, signed.
    pub erased: PersonErased,
}

/// The answer to an [`Order`](super::Order): it was carried out, and is durable.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ordered {
    /// The tenant that it was about.
    pub tenant: TenantId,
    /// New records; 0 if nothing had to change.
    pub recorded: u32,
}

/// A tenant, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TenantView {
    /// Its name.
    pub tenant: TenantId,
    /// Why it is disabled; none if it is not.
    pub disabled: Option<String>,
    /// Its quotas.
    pub quotas: Quotas,
    /// Every key that was ever admitted.
    pub keys: Vec<KeyView>,
}

/// A key, for operators.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyView {
    /// The public half.
    pub key: PublicKey,
    /// What its owner may ask.
    pub role: Role,
    /// For people, such as the machine that has the key.
    pub label: String,
    /// When it was admitted.
    pub admitted_at: Timestamp,
    /// When its overlap ends; none if it was never retired.
    pub valid_until: Option<Timestamp>,
    /// It is never admitted again: it had no overlap, or the clock has once shown a later time.
    #[serde(default)]
    pub retired: bool,
}
