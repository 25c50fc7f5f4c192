//! Who writes the tenants' own streams, without actix: no clock, no thread, no file, no entropy.
//! [`TenantWriter::step`] takes what happened and says what is to be done about it. The
//! [`TenantRegistry`] does it and waits for each end, behind the service's [`Registrar`] and for
//! commands; the simulator does it in an order that a seed decides (`tests/simulation/`).

mod actor;
mod blocking;
mod effect;
mod error;
mod plan;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

pub use actor::{Erased, Obeyed, Registrar, Signed};
pub use blocking::{TenantRegistry, fold, fold_all};
pub use effect::{Done, Moment, TenantWork, WriterEffect, WriterInput};
pub use error::OrderError;

use self::plan::Job;
use crate::ids::{PublicKey, StreamId, TenantId};
use crate::invariants::Invariant;
use crate::tenancy::Registry;

/// The only writer of the tenants' own streams. `C` is how a caller is answered.
///
/// It does one work at a time, and at most one part of it is under way. Until that ends, it takes
/// no other: what two orders ask for is never decided on the same state.
pub struct TenantWriter<C> {
    /// Each tenant's stream, folded.
    registries: BTreeMap<TenantId, Registry>,
    /// Tenants whose streams may hold more than was folded, and could not be read so far.
    unread: BTreeSet<TenantId>,
    job: Option<Job<C>>,
    effects: Vec<WriterEffect<C>>,
}

impl<C> TenantWriter<C> {
    /// - `registries`: every tenant's own stream, folded.
    pub fn new(registries: BTreeMap<TenantId, Registry>) -> TenantWriter<C> {
        TenantWriter { registries, unread: BTreeSet::new(), job: None, effects: Vec::new() }
    }

    /// A tenant's stream, folded; none for one without records.
    pub fn registry(&self, tenant: &TenantId) -> Option<&Registry> {
        self.registries.get(tenant)
    }

    /// The tenants with a stream of their own or of people.
    pub fn tenants(&self) -> Vec<TenantId> {
        self.registries.keys().cloned().collect()
    }

    /// Whether the writer takes new work now, rather than the end of what is under way.
    pub fn is_ready(&self) -> bool {
        self.job.is_none()
    }

    /// The erasures that a crash cut short after the key was gone.
    ///
    /// - `destroyed`: everybody whose key was destroyed.
    pub fn unfinished(&self, destroyed: Vec<StreamId>) -> Vec<StreamId> {
        destroyed.into_iter().filter(|stream| !self.has_noted(stream)).collect()
    }

    /// Takes what happened.
    ///
    /// - returns: what is to be done, in this order.
    /// - panics: when new work comes while something is under way ([`TenantWriter::is_ready`]), or
    ///   an end of nothing: its driver has two writers (invariant `SingleWriter`).
    pub fn step(&mut self, input: WriterInput<C>, moment: Moment) -> Vec<WriterEffect<C>> {
        let is_new = matches!(input, WriterInput::Asked { .. });
        assert_eq!(
            is_new,
            self.is_ready(),
            "{}: the tenants' writer is given two at once",
            Invariant::SingleWriter
        );
        match (input, self.job.take()) {
            (WriterInput::Asked { work, caller }, _) => {
                let mut job = Job::new(work, caller);
                if self.unread.contains(&job.tenant) {
                    job.read_first();
                }
                self.go_on(job, moment);
            }
            (end, Some(mut job)) => match self.end(&mut job, end) {
                Ok(()) => self.go_on(job, moment),
                Err(error) => self.answer(job.caller, Err(error)),
            },
            (_, None) => unreachable!("`step` looks whether the writer is ready"),
        }
        std::mem::take(&mut self.effects)
    }

    fn is_open(&self, tenant: &TenantId) -> bool {
        self.registry(tenant).is_some_and(Registry::is_open)
    }

    /// Whether the tenant's stream says that this person was erased.
    fn has_noted(&self, stream: &StreamId) -> bool {
        let registry = self.registry(&stream.tenant);
        registry.is_some_and(|registry| registry.erased().contains_key(&stream.key))
    }

    /// Whether another tenant ever admitted `key`.
    fn is_anothers(&self, tenant: &TenantId, key: &PublicKey) -> bool {
        let mut others = self.registries.iter().filter(|(other, _)| *other != tenant);
        others.any(|(_, registry)| registry.standing().keys().contains_key(key))
    }

    fn answer(&mut self, caller: C, outcome: Result<Done, OrderError>) {
        self.effects.push(WriterEffect::Answer { caller, outcome });
    }
}
