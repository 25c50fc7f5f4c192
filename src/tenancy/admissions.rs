use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

use super::Standing;
use crate::events::{Quotas, Role};
use crate::ids::{PublicKey, TenantId, Timestamp};

/// Which key comes in as whom, for everybody who opens doors. One writer keeps it up to date with
/// the tenants' streams; each message is held against it, so that a key taken back is refused at
/// its next message and not at its next connection.
#[derive(Debug, Clone, Default)]
pub struct Admissions(Arc<RwLock<BTreeMap<TenantId, Standing>>>);

/// Who a connection is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Admitted {
    pub tenant: TenantId,
    pub role: Role,
}

impl Admissions {
    /// What is known of a tenant from now on.
    pub fn update(&self, tenant: &TenantId, standing: &Standing) {
        let mut all = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if all.get(tenant) != Some(standing) {
            all.insert(tenant.clone(), standing.clone());
        }
    }

    /// - returns: none for a key that is unknown, retired, or of a disabled tenant; and for one
    ///   that two tenants claim, because nobody can say whose it is.
    pub fn admit(&self, key: &PublicKey, now: Timestamp) -> Option<Admitted> {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let mut claims = all.iter().filter_map(|(tenant, standing)| {
            let role = standing.admits(key, now)?;
            Some(Admitted { tenant: tenant.clone(), role })
        });
        let first = claims.next()?;
        claims.next().is_none().then_some(first)
    }

    /// The other tenant that ever admitted `key`.
    pub fn claimed_by_other(&self, tenant: &TenantId, key: &PublicKey) -> Option<TenantId> {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let mut others = all.iter().filter(|(other, _)| *other != tenant);
        others
            .find(|(_, standing)| standing.keys().contains_key(key))
            .map(|(other, _)| other.clone())
    }

    /// What a tenant may take; the default for one that no order was about.
    pub fn quotas(&self, tenant: &TenantId) -> Quotas {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        all.get(tenant).map(|standing| *standing.quotas()).unwrap_or_default()
    }

    /// A tenant as it stands.
    pub fn standing(&self, tenant: &TenantId) -> Option<Standing> {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        all.get(tenant).cloned()
    }

    /// All tenants, in the order of their names.
    pub fn tenants(&self) -> Vec<TenantId> {
        let all = self.0.read().unwrap_or_else(PoisonError::into_inner);
        all.keys().cloned().collect()
    }
}
