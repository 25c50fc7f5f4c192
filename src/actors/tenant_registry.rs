use std::collections::BTreeMap;

use super::shared::fresh_request;
use super::{CommitNotifications, wall_clock};
use crate::events::{Batch, Event, Head, PersonErased};
use crate::evidence::{self, Checkpoint, Tree};
use crate::ids::{IdError, Seq, StreamId, TenantId, UserId};
use crate::replay::{self, CheckpointsError, Through};
use crate::store::{AppendError, KeyError, ReadError, Store};
use crate::tenancy::{self, Admissions, Clock, Disagreement, Order, Refusal, Registry};

/// The tenants of a store and their own streams, of which this is the only writer. A running
/// service has one, behind its registrar; so has a command about a closed directory.
pub struct TenantRegistry {
    store: Store,
    registries: BTreeMap<TenantId, Registry>,
    admissions: Admissions,
    notifications: CommitNotifications,
}

/// Why an order was not carried out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrderError {
    #[error("tenant {tenant}: {refusal}")]
    Refused { tenant: TenantId, refusal: Refusal },
    #[error("no new tenant can be called {tenant}: {error}")]
    Name { tenant: TenantId, error: IdError },
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
    #[error("tenant {tenant}: {error}")]
    Evidence { tenant: TenantId, error: CheckpointsError },
    #[error("tenant {tenant} has no records of such a person: nothing was erased")]
    NobodyThere { tenant: TenantId },
    #[error("they are still busy; nothing was erased; ask again in a moment")]
    StillBusy,
    /// The service is ending.
    #[error("the registrar is gone; ask again when the service is back")]
    Gone,
    #[error("the registrar has too many orders in hand; ask again in a moment")]
    Busy,
}

impl TenantRegistry {
    /// Folds every tenant's own stream.
    pub fn open(store: Store) -> Result<TenantRegistry, OrderError> {
        TenantRegistry::open_by(store, wall_clock())
    }

    /// As [`TenantRegistry::open`], by another clock than the machine's.
    pub fn open_by(store: Store, clock: Clock) -> Result<TenantRegistry, OrderError> {
        let mut tenant_registry = TenantRegistry {
            store,
            registries: BTreeMap::new(),
            admissions: Admissions::new(clock),
            notifications: CommitNotifications::default(),
        };
        let local = TenantId::local();
        let tenants = tenant_registry.store.log.tenants();
        let tenants = tenants.map_err(|error| OrderError::Read { tenant: local, error })?;
        for tenant in tenants {
            let registry = fold(&tenant_registry.store, &tenant)?;
            // Going on with a log that is not the one that was signed could never be mended.
            replay::newest_checkpoint(&tenant_registry.store, &tenant, &registry)
                .map_err(|error| OrderError::Evidence { tenant: tenant.clone(), error })?;
            count_bytes(&tenant_registry.store, &tenant, &registry);
            tenant_registry.admissions.update(&tenant, registry.standing());
            tenant_registry.registries.insert(tenant, registry);
        }
        tenant_registry.finish_erasures()?;
        Ok(tenant_registry)
    }

    pub fn admissions(&self) -> &Admissions {
        &self.admissions
    }

    /// Who is told of what became durable.
    pub fn notifications(&self) -> &CommitNotifications {
        &self.notifications
    }

    /// The stream of a person.
    pub fn stream_id(&self, tenant: &TenantId, user: &UserId) -> Result<StreamId, KeyError> {
        self.store.keys.stream_id(tenant, user)
    }

    /// A tenant's stream, folded; the default for one without records.
    pub fn registry(&self, tenant: &TenantId) -> Registry {
        self.registries.get(tenant).cloned().unwrap_or_default()
    }

    fn is_open(&self, tenant: &TenantId) -> bool {
        self.registry_of(tenant).is_some_and(Registry::is_open)
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
        // The doors may have seen its overlap end when no record says so yet.
        let now = match order {
            Order::Admit { key, .. } | Order::Rotate { new: key, .. }
                if self.admissions.is_gone(tenant, key) =>
            {
                let refusal = Refusal::Retired { key: *key };
                return Err(OrderError::Refused { tenant: tenant.clone(), refusal });
            }
            Order::Retire { key, .. } if self.admissions.is_gone(tenant, key) => {
                Some(Order::Retire { key: *key, overlap_seconds: 0 })
            }
            _ => None,
        };
        let order = now.as_ref().unwrap_or(order);
        // The tenant of the single-user default is there without having been added.
        if *tenant == TenantId::local() && *order != Order::Open && !self.is_open(tenant) {
            self.obey(tenant, &Order::Open)?;
        }
        let key_error = |error| OrderError::Key { tenant: tenant.clone(), error };
        // A tenant that is there keeps the name that it has.
        if *order == Order::Open && !self.registries.contains_key(tenant) {
            let name = |error| OrderError::Name { tenant: tenant.clone(), error };
            tenant.check_new().map_err(name)?;
        }
        // The only order that may make a secret: records behind a lost one would be lost too.
        if *order == Order::Open && !self.registries.contains_key(tenant) {
            self.store.keys.make_tenant(tenant).map_err(key_error)?;
        }
        let unknown = !self.registries.contains_key(tenant);
        let registry = self.registries.entry(tenant.clone()).or_default();
        let wall = self.admissions.clock().read();
        let events = match tenancy::decide(registry, order, wall) {
            Ok(events) if events.is_empty() => return Ok(events),
            Ok(events) => events,
            Err(refusal) => {
                // A name in an order does not make a tenant.
                if unknown {
                    self.registries.remove(tenant);
                }
                return Err(OrderError::Refused { tenant: tenant.clone(), refusal });
            }
        };
        let at = registry.next_at(wall);
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
        // After the doors know: whoever's key was taken back with this gets no record any more.
        self.notifications.note(&stream, &durable);
        Ok(events)
    }

    /// Closes the segments of a person's stream that are due. A function of the records; repeating
    /// it closes nothing more. Blocks.
    ///
    /// - returns: how many were closed.
    pub fn close(&mut self, stream: &StreamId, through: Through) -> Result<usize, OrderError> {
        let tenant = &stream.tenant;
        if stream.is_tenants() {
            return Ok(0);
        }
        let next = self.registry_of(tenant).map_or(Seq::FIRST, |r| r.uncovered(stream.key));
        let due = replay::due_segments(&*self.store.log, stream, next, through)
            .map_err(|error| OrderError::Read { tenant: tenant.clone(), error })?;
        let count = due.len();
        for segment in due {
            self.obey(tenant, &Order::CloseSegment(segment))?;
        }
        Ok(count)
    }

    /// Signs the tenant's tree as it is, unless the newest checkpoint says the same, and keeps the
    /// checkpoint with the others. Blocks.
    ///
    /// - returns: the signed note.
    /// - errors: the tree does not continue the newest checkpoint, too: such a log is not signed.
    pub fn checkpoint(&mut self, tenant: &TenantId) -> Result<String, OrderError> {
        let fail = |error: CheckpointsError| OrderError::Evidence { tenant: tenant.clone(), error };
        let none = Registry::default();
        let registry = self.registries.get(tenant).unwrap_or(&none);
        let newest = replay::newest_checkpoint(&self.store, tenant, registry).map_err(fail)?;
        let leaves = replay::leaves_of(registry);
        if let Some((note, checkpoint)) = newest
            && checkpoint.size == leaves.len() as u64
        {
            return Ok(note);
        }
        let signer = replay::signer_of(&self.store, tenant).map_err(fail)?;
        let (origin, size) = (signer.name().to_owned(), leaves.len() as u64);
        let note = Checkpoint { origin, size, root: Tree(&leaves).root() }.sign(&signer);
        let kept = self.store.checkpoints.append(tenant, &note);
        kept.map_err(|error| fail(error.into()))?;
        Ok(note)
    }

    /// Closes what is due of each stream of the tenant, and signs.
    pub fn sign(&mut self, tenant: &TenantId, through: Through) -> Result<String, OrderError> {
        let streams = self.store.log.streams(tenant);
        let streams =
            streams.map_err(|error| OrderError::Read { tenant: tenant.clone(), error })?;
        for stream in streams {
            self.close(&stream, through)?;
        }
        self.checkpoint(tenant)
    }

    /// The tenants with a stream of their own or of people.
    pub fn tenants(&self) -> Vec<TenantId> {
        self.registries.keys().cloned().collect()
    }

    /// Erases a person: destroys their key, drops their minds and snapshots, and says so in the
    /// tenant's stream, signed. Blocks. Repeating it is harmless.
    ///
    /// The caller has seen to it that nobody speaks for the person meanwhile.
    ///
    /// - errors: the person never was, or what could not be destroyed or recorded; when only the
    ///   recording is missing, the next start makes up for it.
    pub fn erase(&mut self, stream: &StreamId) -> Result<PersonErased, OrderError> {
        let tenant = stream.tenant.clone();
        let read = |error| OrderError::Read { tenant: tenant.clone(), error };
        if self.store.log.walk(stream).map_err(read)? == Head::EMPTY {
            return Err(OrderError::NobodyThere { tenant });
        }
        self.store
            .erase(stream)
            .map_err(|error| OrderError::Key { tenant: tenant.clone(), error })?;
        let noted = self.note_erasure(stream)?;
        // Nobody will wake there again: what is left is covered now, sealed as it is.
        self.close(stream, Through::Head)?;
        Ok(noted)
    }

    fn note_erasure(&mut self, stream: &StreamId) -> Result<PersonErased, OrderError> {
        let tenant = &stream.tenant;
        if let Some(noted) = self.registry_of(tenant).and_then(|it| it.erased().get(&stream.key)) {
            return Ok(noted.clone());
        }
        let read = |error| OrderError::Read { tenant: tenant.clone(), error };
        let Head { seq, digest: head } = self.store.log.walk(stream).map_err(read)?;
        let Some(last) = Seq::new(seq) else {
            return Err(OrderError::NobodyThere { tenant: tenant.clone() });
        };
        let secret = self.store.keys.signing_secret(tenant);
        let secret = secret.map_err(|error| OrderError::Key { tenant: tenant.clone(), error })?;
        let statement = tenancy::erasure_statement(tenant, stream.key, last, head);
        let signature = evidence::sign(&secret, &statement);
        let order = Order::NoteErasure { stream: stream.key, last, head, signature };
        self.obey(tenant, &order)?;
        tracing::info!(%stream, records = seq, "a person was erased");
        Ok(PersonErased { stream: stream.key, last, head, signature })
    }

    /// Finishes the erasures that a crash cut short after the key was gone.
    fn finish_erasures(&mut self) -> Result<(), OrderError> {
        for tenant in self.tenants() {
            let erased = self.store.keys.erased(&tenant);
            let erased =
                erased.map_err(|error| OrderError::Key { tenant: tenant.clone(), error })?;
            for stream in erased {
                if self.registry_of(&tenant).is_some_and(|it| it.erased().contains_key(&stream.key))
                {
                    continue;
                }
                match self.erase(&stream) {
                    // A key that never sealed anything.
                    Ok(_) | Err(OrderError::NobodyThere { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(())
    }

    fn registry_of(&self, tenant: &TenantId) -> Option<&Registry> {
        self.registries.get(tenant)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::{Quotas, Role};
    use crate::ids::PublicKey;
    use crate::store;

    fn lab() -> TenantId {
        TenantId::new("lab").unwrap()
    }

    fn admit(key: PublicKey) -> Order {
        Order::Admit { key, role: Role::Gateway, label: "door".to_owned() }
    }

    const KEY: PublicKey = PublicKey([5; 32]);

    #[test]
    fn what_was_ordered_stands_after_a_restart() {
        let dir = tempfile::tempdir().unwrap();
        let quotas = Quotas { awake_users: Some(2), ..Quotas::default() };
        let mut tenant_registry = TenantRegistry::open(store::open(dir.path()).unwrap()).unwrap();
        for order in [Order::Open, admit(KEY), Order::SetQuotas(quotas)] {
            assert_eq!(tenant_registry.obey(&lab(), &order).unwrap().len(), 1);
            assert_eq!(tenant_registry.obey(&lab(), &order), Ok(vec![]));
        }
        let before = tenant_registry.registry(&lab());
        drop(tenant_registry);
        let tenant_registry = TenantRegistry::open(store::open(dir.path()).unwrap()).unwrap();
        assert_eq!(tenant_registry.registry(&lab()), before);
        let admitted = tenant_registry.admissions().admit(&KEY).unwrap();
        assert_eq!((admitted.tenant, admitted.role), (lab(), Role::Gateway));
    }

    #[test]
    fn nothing_is_done_to_a_tenant_that_does_not_exist_and_no_secret_is_made_for_it() {
        let dir = tempfile::tempdir().unwrap();
        let mut tenant_registry = TenantRegistry::open(store::open(dir.path()).unwrap()).unwrap();
        let refusal = tenant_registry.obey(&lab(), &admit(KEY)).unwrap_err().to_string();
        assert!(refusal.contains("add it first"), "{refusal}");
        assert!(!dir.path().join("keys/lab.key").exists());
        // Being named once too early is no obstacle to being added.
        tenant_registry.obey(&lab(), &Order::Open).unwrap();
        assert!(dir.path().join("keys/lab.key").exists());
        tenant_registry.obey(&lab(), &admit(KEY)).unwrap();
    }

    #[test]
    fn the_tenant_of_this_machine_need_not_be_added() {
        let mut tenant_registry = TenantRegistry::open(store::open_memory()).unwrap();
        assert_eq!(tenant_registry.obey(&TenantId::local(), &admit(KEY)).unwrap().len(), 1);
        assert!(tenant_registry.registry(&TenantId::local()).is_open());
    }

    #[test]
    fn one_key_is_one_labs() {
        let mut tenant_registry = TenantRegistry::open(store::open_memory()).unwrap();
        let other = TenantId::new("other").unwrap();
        for tenant in [lab(), other.clone()] {
            tenant_registry.obey(&tenant, &Order::Open).unwrap();
        }
        tenant_registry.obey(&lab(), &admit(KEY)).unwrap();
        assert_eq!(tenant_registry.obey(&other, &admit(KEY)), Err(OrderError::KeyOfOther));
        // Not even after its first owner is done with it: old messages may still be on their way.
        tenant_registry.obey(&lab(), &Order::Retire { key: KEY, overlap_seconds: 0 }).unwrap();
        assert_eq!(tenant_registry.obey(&other, &admit(KEY)), Err(OrderError::KeyOfOther));
    }
}
