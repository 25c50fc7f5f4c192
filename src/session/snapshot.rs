//! A state as bytes, for snapshots and digests. A cache: never migrated, folded again instead.

use std::sync::Arc;

use super::state::State;
use super::{Session, parse_recipe};
use crate::ids::Digest;
use crate::world::Domain;

/// Why bytes are no state that this binary can go on from.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the snapshot cannot be used: {reason}")]
pub struct SnapshotError {
    pub reason: String,
}

impl<D: Domain> Session<D> {
    /// The state as MessagePack with field names.
    pub fn snapshot(&self) -> Vec<u8> {
        rmp_serde::to_vec_named(&self.state).expect("a state is plain data and encodes into memory")
    }

    /// Goes on from a snapshot; the mind is to be [installed](Session::install) afterwards.
    ///
    /// - errors: [`SnapshotError`]; fold the log from the start then.
    pub fn restore(domain: Arc<D>, bytes: &[u8]) -> Result<Session<D>, SnapshotError> {
        let state: State<D::Scene, D::Task> = rmp_serde::from_slice(bytes)
            .map_err(|error| SnapshotError { reason: error.to_string() })?;
        let recipe = parse_recipe(&state);
        Ok(Session { domain, state, recipe, mind: None })
    }

    /// BLAKE3 over [`Session::snapshot`]: equal states have equal digests.
    pub fn state_digest(&self) -> Digest {
        Digest::of(&self.snapshot())
    }
}
