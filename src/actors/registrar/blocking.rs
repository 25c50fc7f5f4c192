use std::collections::{BTreeMap, VecDeque};

use super::{Done, Moment, OrderError, TenantWork, TenantWriter, WriterEffect, WriterInput};
use crate::actors::shared::fresh_request;
use crate::actors::{CommitNotifications, Failure, wall_clock};
use crate::events::{Event, PersonErased};
use crate::ids::{Seq, StreamId, TenantId, UserId};
use crate::replay::{self, Through};
use crate::store::{KeyError, Store};
use crate::tenancy::{Admissions, Clock, Order, Registry};

/// The tenants of a store and their own streams: carries out what the [`TenantWriter`] says, and
/// waits for each end. A running service has one, behind its registrar; so has a command about a
/// closed directory.
pub struct TenantRegistry {
    store: Store,
    writer: TenantWriter<()>,
    admissions: Admissions,
    notifications: CommitNotifications,
    failure: Failure,
}

/// What came of a work.
type Outcome = Result<Done, OrderError>;

impl TenantRegistry {
    /// Folds every tenant's own stream.
    pub fn open(store: Store) -> Result<TenantRegistry, OrderError> {
        TenantRegistry::open_by(store, wall_clock())
    }

    /// As [`TenantRegistry::open`], by another clock than the machine's.
    pub fn open_by(store: Store, clock: Clock) -> Result<TenantRegistry, OrderError> {
        let admissions = Admissions::new(clock);
        let registries = fold_all(&store)?;
        for (tenant, registry) in &registries {
            tell_doors(&store, &admissions, tenant, registry);
        }
        let mut tenant_registry = TenantRegistry {
            store,
            writer: TenantWriter::new(registries),
            admissions,
            notifications: CommitNotifications::default(),
            failure: Failure::default(),
        };
        tenant_registry.finish_erasures()?;
        Ok(tenant_registry)
    }

    /// Where to say that the log takes nothing more.
    pub(in crate::actors) fn report_to(&mut self, failure: Failure) {
        self.failure = failure;
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
        self.writer.registry(tenant).cloned().unwrap_or_default()
    }

    /// The tenants with a stream of their own or of people.
    pub fn tenants(&self) -> Vec<TenantId> {
        self.writer.tenants()
    }

    /// Decides, appends durably, applies, and lets the doors know. Blocks.
    ///
    /// - returns: what was recorded; nothing when it was so already.
    pub fn obey(&mut self, tenant: &TenantId, order: &Order) -> Result<Vec<Event>, OrderError> {
        let gone = order.key().is_some_and(|key| self.admissions.is_gone(tenant, key));
        let work = TenantWork::Obey { tenant: tenant.clone(), order: order.clone(), gone };
        match self.work(work)? {
            Done::Obeyed(events) => Ok(events),
            other => unreachable!("an order came to {other:?}"),
        }
    }

    /// Closes the segments of a person's stream that are due. A function of the records; repeating
    /// it closes nothing more. Blocks.
    ///
    /// - returns: how many were closed.
    pub fn close(&mut self, stream: &StreamId, through: Through) -> Result<usize, OrderError> {
        match self.work(TenantWork::Close { stream: stream.clone(), through })? {
            Done::Closed(count) => Ok(count),
            other => unreachable!("closing came to {other:?}"),
        }
    }

    /// Signs the tenant's tree as it is, unless the newest checkpoint says the same, and keeps the
    /// checkpoint with the others. Blocks.
    ///
    /// - returns: the signed note.
    /// - errors: the tree does not continue the newest checkpoint, too: such a log is not signed.
    pub fn checkpoint(&mut self, tenant: &TenantId) -> Result<String, OrderError> {
        self.signed(TenantWork::Checkpoint { tenant: tenant.clone() })
    }

    /// Closes what is due of each stream of the tenant, and signs.
    pub fn sign(&mut self, tenant: &TenantId, through: Through) -> Result<String, OrderError> {
        self.signed(TenantWork::Sign { tenant: tenant.clone(), through })
    }

    /// Erases a person: destroys their key, drops their minds and snapshots, and says so in the
    /// tenant's stream, signed. Blocks. Repeating it is harmless.
    ///
    /// The caller has seen to it that nobody speaks for the person meanwhile.
    ///
    /// - errors: the person never was, or what could not be destroyed or recorded; when only the
    ///   recording is missing, the next start makes up for it.
    pub fn erase(&mut self, stream: &StreamId) -> Result<PersonErased, OrderError> {
        match self.work(TenantWork::Erase { stream: stream.clone() })? {
            Done::Erased(noted) => Ok(noted),
            other => unreachable!("an erasure came to {other:?}"),
        }
    }

    fn signed(&mut self, work: TenantWork) -> Result<String, OrderError> {
        match self.work(work)? {
            Done::Signed(note) => Ok(note),
            other => unreachable!("signing came to {other:?}"),
        }
    }

    /// Finishes the erasures that a crash cut short after the key was gone.
    fn finish_erasures(&mut self) -> Result<(), OrderError> {
        for tenant in self.tenants() {
            let destroyed = self.store.keys.erased(&tenant);
            let destroyed = destroyed.map_err(|error| OrderError::Key { tenant, error })?;
            for stream in self.writer.unfinished(destroyed) {
                match self.erase(&stream) {
                    // A key that never sealed anything.
                    Ok(_) | Err(OrderError::NobodyThere { .. }) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(())
    }

    /// Does work, up to its answer.
    fn work(&mut self, work: TenantWork) -> Outcome {
        // A panic has cut the last work short. What it left is read at the next start.
        if !self.writer.is_ready() {
            return Err(OrderError::Gone);
        }
        let mut answer = Err(OrderError::Gone);
        let mut inputs = VecDeque::from([WriterInput::Asked { work, caller: () }]);
        while let Some(input) = inputs.pop_front() {
            let moment = Moment { at: self.admissions.clock().read(), fresh: fresh_request() };
            for effect in self.writer.step(input, moment) {
                inputs.extend(self.carry_out(effect, &mut answer));
            }
        }
        answer
    }

    /// - returns: how it ended, where the writer must know.
    fn carry_out(&self, effect: WriterEffect<()>, answer: &mut Outcome) -> Option<WriterInput<()>> {
        let Store { log, keys, .. } = &self.store;
        Some(match effect {
            WriterEffect::Append { stream, after, batch } => {
                WriterInput::Appended(log.append(&stream, after, batch).wait())
            }
            WriterEffect::Fold { tenant } => WriterInput::Folded(fold(&self.store, &tenant)),
            WriterEffect::MakeSecret { tenant } => {
                WriterInput::SecretMade(keys.make_tenant(&tenant).map(|_| ()))
            }
            WriterEffect::ListStreams { tenant } => WriterInput::Streams(log.streams(&tenant)),
            WriterEffect::FindDue { stream, from, through } => {
                WriterInput::Due(replay::due_segments(&**log, &stream, from, through))
            }
            WriterEffect::FindEnd { stream } => WriterInput::End(log.walk(&stream)),
            WriterEffect::DestroyKey { stream } => {
                WriterInput::KeyDestroyed(self.store.erase(&stream))
            }
            WriterEffect::SignStatement { tenant, statement } => {
                WriterInput::StatementSigned(replay::sign_statement(keys, &tenant, &statement))
            }
            WriterEffect::KeepCheckpoint { tenant } => {
                let registry = self.registry(&tenant);
                let kept = replay::keep_checkpoint(&self.store, &tenant, &registry);
                WriterInput::CheckpointKept(kept)
            }
            WriterEffect::TellDoors { tenant } => {
                let registry = self.writer.registry(&tenant)?;
                tell_doors(&self.store, &self.admissions, &tenant, registry);
                return None;
            }
            WriterEffect::Publish { stream, durable } => {
                self.notifications.note(&stream, &durable);
                return None;
            }
            WriterEffect::Answer { outcome, .. } => {
                *answer = outcome;
                return None;
            }
            WriterEffect::Fatal(reason) => {
                self.failure.report(reason);
                return None;
            }
        })
    }
}

/// Lets the doors know of a tenant as it is.
///
/// The first count of a tenant's bytes reads all of them: it is made here, before the doors know of
/// a limit to hold it against, so that no door waits for it.
fn tell_doors(store: &Store, doors: &Admissions, tenant: &TenantId, registry: &Registry) {
    if registry.standing().quotas().sealed_bytes.is_some()
        && let Err(error) = store.log.sealed_bytes(tenant)
    {
        tracing::error!(%tenant, %error, "the count of a tenant's bytes failed");
    }
    doors.update(tenant, registry.standing());
}

/// Folds every tenant's own stream, and compares each with its newest checkpoint: going on with a
/// log that is not the one that was signed could never be mended.
pub fn fold_all(store: &Store) -> Result<BTreeMap<TenantId, Registry>, OrderError> {
    let tenants = store.log.tenants();
    let tenants = tenants.map_err(|error| OrderError::Read { tenant: TenantId::local(), error })?;
    let checked = tenants.into_iter().map(|tenant| {
        let registry = fold(store, &tenant)?;
        replay::newest_checkpoint(store, &tenant, &registry)
            .map_err(|error| OrderError::Evidence { tenant: tenant.clone(), error })?;
        Ok((tenant, registry))
    });
    checked.collect()
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
