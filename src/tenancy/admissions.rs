use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use super::{Clock, Standing};
use crate::events::{Quotas, Role};
use crate::ids::{PublicKey, TenantId};

/// Which key comes in as whom, for everybody who opens doors. One writer keeps it up to date with
/// the tenants' streams; each message is held against it, so that a key taken back is refused at
/// its next message and not at its next connection.
///
/// It remembers what the wall clock has read: an overlap that a reading has ended stays ended as
/// long as this lives, also when no record says so.
#[derive(Debug, Clone)]
pub struct Admissions {
    all: Arc<RwLock<BTreeMap<TenantId, Standing>>>,
    clock: Clock,
}

/// Who a connection is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Admitted {
    pub tenant: TenantId,
    pub role: Role,
}

impl Admissions {
    pub fn new(clock: Clock) -> Admissions {
        Admissions { all: Arc::default(), clock }
    }

    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// What is known of a tenant from now on.
    pub fn update(&self, tenant: &TenantId, standing: &Standing) {
        let mut all = self.write();
        let before = all.get(tenant);
        if before != Some(standing) {
            let mut standing = standing.clone();
            if let Some(before) = before {
                standing.keep_ended(before);
            }
            all.insert(tenant.clone(), standing);
        }
    }

    /// - returns: none for a key that is unknown, retired, or of a disabled tenant; and for one
    ///   that two tenants claim, because nobody can say whose it is.
    pub fn admit(&self, key: &PublicKey) -> Option<Admitted> {
        let all = self.read();
        let wall = self.clock.read();
        let mut claims = all.iter().filter_map(|(tenant, standing)| {
            let role = standing.admits(key, wall)?;
            Some(Admitted { tenant: tenant.clone(), role })
        });
        let first = claims.next()?;
        claims.next().is_none().then_some(first)
    }

    /// Whether `key` was retired by this tenant and never comes in again.
    pub fn is_gone(&self, tenant: &TenantId, key: &PublicKey) -> bool {
        let all = self.read();
        all.get(tenant).and_then(|standing| standing.keys().get(key)).is_some_and(|it| it.is_gone())
    }

    /// What a tenant may take; the default for one that no order was about.
    pub fn quotas(&self, tenant: &TenantId) -> Quotas {
        let all = self.read();
        all.get(tenant).map(|standing| *standing.quotas()).unwrap_or_default()
    }

    /// A tenant as it stands.
    pub fn standing(&self, tenant: &TenantId) -> Option<Standing> {
        let all = self.read();
        all.get(tenant).cloned()
    }

    /// All tenants, in the order of their names.
    pub fn tenants(&self) -> Vec<TenantId> {
        let all = self.read();
        all.keys().cloned().collect()
    }

    /// The register after what the wall clock reads now, so it shows no overlap that has ended.
    fn read(&self) -> RwLockReadGuard<'_, BTreeMap<TenantId, Standing>> {
        let held = || self.all.read().unwrap_or_else(PoisonError::into_inner);
        let all = held();
        // The clock is read while the register is held: a reading from before a key was retired
        // would end its overlap, as one of a clock that was set back does.
        let wall = self.clock.read();
        if !all.values().any(|standing| standing.is_news(wall)) {
            return all;
        }
        drop(all);
        let mut all = self.write();
        let wall = self.clock.read();
        all.values_mut().for_each(|standing| standing.observe(wall));
        drop(all);
        held()
    }

    fn write(&self) -> RwLockWriteGuard<'_, BTreeMap<TenantId, Standing>> {
        self.all.write().unwrap_or_else(PoisonError::into_inner)
    }
}
