use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::cache;
use super::cache::{Cache, Place};
use super::origin::{CacheCounter, CacheCounts, Found, Origin};
use crate::events::Head;
use crate::ids::{Digest, StreamId};
use crate::store::sealing::keys::Keys;

/// What the names of shelves with snapshots begin with; the tenant follows.
pub(in crate::store) const SHELVES: &str = "states/";

/// The latest state of each stream at some head, sealed for its person. A cache that is never
/// migrated: whatever does not fit exactly is not used, and the log is folded again.
pub struct SnapshotStore {
    cache: Arc<dyn Cache>,
    keys: Arc<Keys>,
    counter: CacheCounter,
}

impl SnapshotStore {
    pub(in crate::store) fn new(cache: Arc<dyn Cache>, keys: Arc<Keys>) -> SnapshotStore {
        SnapshotStore { cache, keys, counter: CacheCounter::default() }
    }

    /// Keeps `state`, the fold up to and with `head`, in place of any earlier one. Not durable on
    /// return, and need not be.
    ///
    /// - errors: a sentence for the log file; it costs time only.
    pub fn put(
        &self,
        stream: &StreamId,
        origin: &Origin,
        head: Head,
        state: &impl Serialize,
    ) -> Result<(), String> {
        let mut plain = Vec::new();
        plain.extend_from_slice(&head.seq.to_be_bytes());
        plain.extend_from_slice(&head.digest.0);
        let body = rmp_serde::to_vec_named(state).map_err(|error| error.to_string())?;
        plain.extend_from_slice(&body);
        cache::put(&*self.cache, &self.keys, stream, &place(stream), &origin.before(&plain))
    }

    /// What `resume` makes of the latest state that has this form and was folded by this code,
    /// given the head it was taken at, the recipe it was kept for and the state. `resume` says none
    /// when it does not fit the stream: a log restored from a backup may be shorter. Counted in
    /// [`SnapshotStore::counts`].
    pub fn latest<T: DeserializeOwned, U>(
        &self,
        stream: &StreamId,
        schema: Digest,
        code: Digest,
        resume: impl FnOnce(Head, Digest, T) -> Option<U>,
    ) -> Option<U> {
        let found = self.look(stream, schema, code, resume);
        let found = match found {
            Found::Fits(None) => Found::Stale(None),
            found => found,
        };
        self.counter.note(&found);
        match found {
            Found::Fits(resumed) => resumed,
            Found::Damaged => {
                tracing::warn!(%stream, "a snapshot is damaged and is not used");
                None
            }
            Found::Stale(_) => {
                tracing::info!(%stream, "a snapshot is of another version or log and is not used");
                None
            }
            Found::Absent => None,
        }
    }

    fn look<T: DeserializeOwned, U>(
        &self,
        stream: &StreamId,
        schema: Digest,
        code: Digest,
        resume: impl FnOnce(Head, Digest, T) -> Option<U>,
    ) -> Found<Option<U>> {
        let (blob, ignored) = cache::get(&*self.cache, &self.keys, stream, &place(stream));
        let Some(blob) = blob else {
            return if ignored { Found::Damaged } else { Found::Absent };
        };
        match Origin::split(&blob) {
            None => Found::Damaged,
            // Another form: this code can read nothing behind it.
            Some((origin, _)) if (origin.schema, origin.code) != (schema, code) => {
                Found::Stale(None)
            }
            Some((origin, plain)) => match read(plain) {
                Some((head, state)) => Found::Fits(resume(head, origin.recipe, state)),
                None => Found::Damaged,
            },
        }
    }

    /// Forgets the snapshot of a stream.
    pub fn forget(&self, stream: &StreamId) -> Result<(), String> {
        self.cache.replace(&shelf(stream), &stream.key.0, Vec::new())
    }

    /// How often snapshots were looked for, and what was found.
    pub fn counts(&self) -> CacheCounts {
        self.counter.now()
    }

    /// The counter behind [`SnapshotStore::counts`].
    pub fn counter(&self) -> CacheCounter {
        self.counter.clone()
    }
}

pub(in crate::store) fn read<T: DeserializeOwned>(plain: &[u8]) -> Option<(Head, T)> {
    let (seq, rest) = plain.split_first_chunk()?;
    let (digest, body) = rest.split_first_chunk()?;
    let head = Head { seq: u64::from_be_bytes(*seq), digest: Digest(*digest) };
    Some((head, rmp_serde::from_slice(body).ok()?))
}

fn shelf(stream: &StreamId) -> String {
    format!("{SHELVES}{}", stream.tenant)
}

fn place(stream: &StreamId) -> Place<'static> {
    Place {
        purpose: "apprentice 2: snapshot",
        shelf: shelf(stream),
        key: stream.key.0.to_vec(),
        bound: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::directory::open::open;
    use crate::store::directory::store::{Store, open_memory};
    use crate::store::testing::conformance::{batch, stream};

    fn on_both(check: impl Fn(&Store, &StreamId, Head)) {
        let dir = tempfile::tempdir().unwrap();
        for store in [open_memory(), open(dir.path()).unwrap()] {
            let ada = stream(&store.keys, "local", "ada");
            let head = store.log.append(&ada, Head::EMPTY, batch(["a"])).wait().unwrap().head();
            check(&store, &ada, head);
        }
    }

    fn origin() -> Origin {
        let [schema, code, recipe] = ["state 1", "code", "recipe"].map(digest);
        Origin { schema, code, recipe }
    }

    fn digest(text: &str) -> Digest {
        Digest::of(text.as_bytes())
    }

    fn latest<T: DeserializeOwned>(store: &Store, who: &StreamId) -> Option<(Head, Digest, T)> {
        let Origin { schema, code, .. } = origin();
        store.snapshots.latest(who, schema, code, |head, recipe, state| Some((head, recipe, state)))
    }

    #[test]
    fn the_latest_snapshot_is_found_with_its_head_and_recipe() {
        on_both(|store, ada, head| {
            let (origin, recipe) = (origin(), origin().recipe);
            assert_eq!(latest::<Vec<String>>(store, ada), None);
            let long = vec!["word".to_owned(); 20_000];
            store.snapshots.put(ada, &origin, Head::EMPTY, &long).unwrap();
            assert_eq!(latest(store, ada), Some((Head::EMPTY, recipe, long)));
            let short = vec!["later".to_owned()];
            store.snapshots.put(ada, &origin, head, &short).unwrap();
            assert_eq!(latest(store, ada), Some((head, recipe, short)));
            store.snapshots.forget(ada).unwrap();
            assert_eq!(latest::<Vec<String>>(store, ada), None);
            let counts = CacheCounts { used: 2, absent: 2, ..CacheCounts::default() };
            assert_eq!(store.snapshots.counts(), counts);
        });
    }

    #[test]
    fn a_snapshot_of_another_origin_or_shape_or_log_is_not_used_and_counted() {
        on_both(|store, ada, head| {
            let state = vec![1_u32, 2];
            for other in [
                Origin { schema: digest("state 2"), ..origin() },
                Origin { code: digest("other code"), ..origin() },
                Origin::UNKNOWN,
            ] {
                store.snapshots.put(ada, &other, head, &state).unwrap();
                assert_eq!(latest::<Vec<u32>>(store, ada), None);
            }
            store.snapshots.put(ada, &origin(), head, &state).unwrap();
            assert_eq!(latest::<String>(store, ada), None, "another shape under the same name");
            let Origin { schema, code, .. } = origin();
            let refuse = |_, _, _: Vec<u32>| None::<u8>;
            assert_eq!(store.snapshots.latest(ada, schema, code, refuse), None);
            assert_eq!(latest(store, ada), Some((head, origin().recipe, state)));
            let counts = CacheCounts { used: 1, absent: 0, stale: 4, damaged: 1 };
            assert_eq!(store.snapshots.counts(), counts);
        });
    }

    #[test]
    fn a_snapshot_with_a_flipped_bit_is_not_used_and_counted() {
        on_both(|store, ada, head| {
            store.snapshots.put(ada, &origin(), head, &vec![1_u32, 2]).unwrap();
            let mut entries = store.snapshots.cache.scan(&shelf(ada), &ada.key.0).unwrap();
            entries[0].1[40] ^= 1;
            store.snapshots.cache.replace(&shelf(ada), &ada.key.0, entries).unwrap();
            assert_eq!(latest::<Vec<u32>>(store, ada), None);
            let counts = CacheCounts { damaged: 1, ..CacheCounts::default() };
            assert_eq!(store.snapshots.counts(), counts);
        });
    }
}
