use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

use super::life::fresh_request;
use crate::events::{Batch, Event};
use crate::ids::{Seq, StreamId, TenantId, Timestamp};
use crate::store::{AppendError, KeyError, ReadError, Store};
use crate::tenancy::{self, Admissions, Disagreement, Order, Refusal, Registry};

/// The tenants of a store and their own streams, of which this is the only writer. A running
/// service has one, behind its registrar; so has a command about a closed directory.
pub struct Book {
    store: Store,
    registries: BTreeMap<TenantId, Registry>,
    admissions: Admissions,
}

/// Why an order was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrderError {
    #[error("tenant {tenant}: {refusal}")]
    Refused { tenant: TenantId, refusal: Refusal },
    /// One key is one lab's: else nobody could say whose a message is.
    #[error("the key belongs to another tenant already; make a new one with `apprentice keys new`")]
    KeyOfOther,
    #[error("tenant {tenant}: {error}")]
    Append { tenant: TenantId, error: AppendError },
    #[error("tenant {tenant}: {error}")]
    Key { tenant: TenantId, error: KeyError },
    #[error("tenant {tenant}: {error}")]
    Read { tenant: TenantId, error: ReadError },
    #[error("tenant {tenant}: {error}; was it recorded by another version of apprentice?")]
    Disagreement { tenant: TenantId, error: Disagreement },
    /// The service is ending.
    #[error("the registrar is gone; ask again when the service is back")]
    Gone,
    #[error("the registrar has too many orders in hand; ask again in a moment")]
    Busy,
}

impl Book {
    /// Folds every tenant's own stream.
    pub fn open(store: Store) -> Result<Book, OrderError> {
        let mut book =
            Book { store, registries: BTreeMap::new(), admissions: Admissions::default() };
        let local = TenantId::local();
        let tenants = book.store.log.tenants();
        let tenants = tenants.map_err(|error| OrderError::Read { tenant: local, error })?;
        for tenant in tenants {
            let registry = fold(&book.store, &tenant)?;
            count_bytes(&book.store, &tenant, &registry);
            book.admissions.update(&tenant, registry.standing());
            book.registries.insert(tenant, registry);
        }
        Ok(book)
    }

    pub fn admissions(&self) -> &Admissions {
        &self.admissions
    }

    /// A tenant's stream, folded; the default for one without records.
    pub fn registry(&self, tenant: &TenantId) -> Registry {
        self.registries.get(tenant).cloned().unwrap_or_default()
    }

    /// Decides, appends durably, applies, and lets the doors know. Blocks.
    ///
    /// - returns: what was recorded; nothing when it was so already.
    pub fn obey(&mut self, tenant: &TenantId, order: &Order) -> Result<Vec<Event>, OrderError> {
        if let Order::Admit { key, .. } | Order::Rotate { new: key, .. } = order
            && self.admissions.claimed_by_other(tenant, key).is_some()
        {
            return Err(OrderError::KeyOfOther);
        }
        let key_error = |error| OrderError::Key { tenant: tenant.clone(), error };
        // The only order that may make a secret: records behind a lost one would be lost too.
        if *order == Order::Open && !self.registries.contains_key(tenant) {
            self.store.keys.make_tenant(tenant).map_err(key_error)?;
        }
        let registry = self.registries.entry(tenant.clone()).or_default();
        let at = registry.next_at(now());
        let events = tenancy::decide(registry, order, at)
            .map_err(|refusal| OrderError::Refused { tenant: tenant.clone(), refusal })?;
        if events.is_empty() {
            return Ok(events);
        }
        let batch = Batch { request: fresh_request(), at, events: events.clone() };
        let stream = StreamId::of_tenant(tenant);
        let appended = self.store.log.append(&stream, registry.head(), batch).wait();
        let durable = match appended {
            Ok(durable) => durable,
            Err(error) => {
                // Whether it was appended may be unknown: what there is, is read again.
                if let Ok(found) = fold(&self.store, tenant) {
                    self.admissions.update(tenant, found.standing());
                    self.registries.insert(tenant.clone(), found);
                }
                return Err(OrderError::Append { tenant: tenant.clone(), error });
            }
        };
        for record in durable.records() {
            registry
                .apply(record)
                .map_err(|error| OrderError::Disagreement { tenant: tenant.clone(), error })?;
        }
        count_bytes(&self.store, tenant, registry);
        self.admissions.update(tenant, registry.standing());
        Ok(events)
    }
}

/// The first count of a tenant's bytes reads all of them: it is made here, before the doors know of
/// a limit to hold it against, so that no door waits for it.
fn count_bytes(store: &Store, tenant: &TenantId, registry: &Registry) {
    if registry.standing().quotas().sealed_bytes.is_some()
        && let Err(error) = store.log.sealed_bytes(tenant)
    {
        tracing::error!(%tenant, %error, "the count of a tenant's bytes failed");
    }
}

/// Folds one tenant's own stream.
pub fn fold(store: &Store, tenant: &TenantId) -> Result<Registry, OrderError> {
    let read = |error| OrderError::Read { tenant: tenant.clone(), error };
    let mut registry = Registry::default();
    let stream = StreamId::of_tenant(tenant);
    for record in store.log.read(&stream, Seq::FIRST).map_err(read)? {
        registry
            .apply(&record.map_err(read)?)
            .map_err(|error| OrderError::Disagreement { tenant: tenant.clone(), error })?;
    }
    Ok(registry)
}

fn now() -> Timestamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp(u64::try_from(since.as_micros()).unwrap_or(u64::MAX))
}
