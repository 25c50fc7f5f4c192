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

#[cfg(test)]
mod tests {
    use super::super::conformance::{batch, stream};
    use super::super::{Store, open, open_memory};
    use super::*;

    fn on_both(check: impl Fn(&Store, &StreamId, Head)) {
        let dir = tempfile::tempdir().unwrap();
        for store in [open_memory(), open(dir.path()).unwrap()] {
            let ada = stream(&store.keys, "local", "ada");
            let head = store.log.append(&ada, Head::EMPTY, batch(["a"])).wait().unwrap().head();
            check(&store, &ada, head);
        }
    }

    #[test]
    fn the_latest_snapshot_is_found_with_its_head() {
        on_both(|store, ada, head| {
            let version = Digest::of(b"state 1");
            assert_eq!(store.snapshots.latest::<Vec<String>>(ada, version), None);
            let long = vec!["word".to_owned(); 20_000];
            store.snapshots.put(ada, Head::EMPTY, version, &long).unwrap();
            assert_eq!(store.snapshots.latest(ada, version), Some((Head::EMPTY, long)));
            let short = vec!["later".to_owned()];
            store.snapshots.put(ada, head, version, &short).unwrap();
            assert_eq!(store.snapshots.latest(ada, version), Some((head, short)));
            store.snapshots.forget(ada).unwrap();
            assert_eq!(store.snapshots.latest::<Vec<String>>(ada, version), None);
        });
    }

    #[test]
    fn a_snapshot_of_another_version_or_shape_is_none() {
        on_both(|store, ada, head| {
            let version = Digest::of(b"state 1");
            store.snapshots.put(ada, head, version, &vec![1_u32, 2]).unwrap();
            assert_eq!(store.snapshots.latest::<Vec<u32>>(ada, Digest::of(b"state 2")), None);
            assert_eq!(store.snapshots.latest::<String>(ada, version), None);
            assert_eq!(store.snapshots.latest(ada, version), Some((head, vec![1_u32, 2])));
        });
    }
}
