use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::Keys;
use super::cache::{self, Cache, Place};
use crate::events::Head;
use crate::ids::{Digest, StreamId};

/// The latest state of each stream at some head, sealed for its person. A cache that is never
/// migrated: whatever does not fit exactly is absent, and the log is folded again.
pub struct SnapshotStore {
    cache: Arc<dyn Cache>,
    keys: Arc<Keys>,
}

impl SnapshotStore {
    pub(super) fn new(cache: Arc<dyn Cache>, keys: Arc<Keys>) -> SnapshotStore {
        SnapshotStore { cache, keys }
    }

    /// Keeps `state`, the fold up to and with `head`, in place of any earlier one. `version` names
    /// the shape and meaning of `state`. Not durable on return, and need not be.
    ///
    /// - errors: a sentence for the log file; nobody is hurt.
    pub fn put(
        &self,
        stream: &StreamId,
        head: Head,
        version: Digest,
        state: &impl Serialize,
    ) -> Result<(), String> {
        let mut plain = Vec::new();
        plain.extend_from_slice(&head.seq.to_be_bytes());
        plain.extend_from_slice(&head.digest.0);
        let body = rmp_serde::to_vec_named(state).map_err(|error| error.to_string())?;
        plain.extend_from_slice(&body);
        cache::put(&*self.cache, &self.keys, stream, &place(stream, version), &plain)
    }

    /// The latest state of that version and the head it was taken at. The caller compares the head
    /// with the log before trusting it: a log restored from a backup may be shorter.
    pub fn latest<T: DeserializeOwned>(
        &self,
        stream: &StreamId,
        version: Digest,
    ) -> Option<(Head, T)> {
        let (plain, ignored) =
            cache::get(&*self.cache, &self.keys, stream, &place(stream, version));
        let found = plain.as_deref().and_then(read);
        if ignored || (plain.is_some() && found.is_none()) {
            tracing::info!(%stream, "a snapshot does not fit this version and is not used");
        }
        found
    }

    /// Forgets the snapshot of a stream.
    pub fn forget(&self, stream: &StreamId) -> Result<(), String> {
        self.cache.replace(&shelf(stream), &stream.key.0, Vec::new())
    }
}

fn read<T: DeserializeOwned>(plain: &[u8]) -> Option<(Head, T)> {
    let (seq, rest) = plain.split_first_chunk()?;
    let (digest, body) = rest.split_first_chunk()?;
    let head = Head { seq: u64::from_be_bytes(*seq), digest: Digest(*digest) };
    Some((head, rmp_serde::from_slice(body).ok()?))
}

fn shelf(stream: &StreamId) -> String {
    format!("snapshots/{}", stream.tenant)
}

/// The version is bound, not part of the key: a snapshot of another version is replaced, and does
/// not open as one of this.
fn place(stream: &StreamId, version: Digest) -> Place<'static> {
    Place {
        purpose: "apprentice 1: snapshot",
        shelf: shelf(stream),
        key: stream.key.0.to_vec(),
        bound: version.0.to_vec(),
    }
}
