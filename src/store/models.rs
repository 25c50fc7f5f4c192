use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::Keys;
use super::cache::{self, Cache, Place};
use crate::ids::{Digest, StreamId};

/// The bytes of minds by their digest, each sealed for the person who taught it (a mind holds
/// people's words). A cache: what is missing is trained again.
pub struct ModelStore {
    cache: Arc<dyn Cache>,
    keys: Arc<Keys>,
    ignored: AtomicU64,
}

impl ModelStore {
    pub(super) fn new(cache: Arc<dyn Cache>, keys: Arc<Keys>) -> ModelStore {
        ModelStore { cache, keys, ignored: AtomicU64::new(0) }
    }

    /// Keeps `bytes` for the person of `stream`. Not durable on return, and need not be.
    ///
    /// The person must have a record already: the key that seals minds is made with the first.
    ///
    /// - errors: a sentence for the log file; nobody is hurt.
    pub fn put(&self, stream: &StreamId, digest: Digest, bytes: &[u8]) -> Result<(), String> {
        cache::put(&*self.cache, &self.keys, stream, &place(stream, digest), bytes)
    }

    /// The bytes with that digest; none when they are absent or are not what the digest says
    /// (counted in [`ModelStore::ignored`]). (Invariant `ModelAgrees`.)
    pub fn load(&self, stream: &StreamId, digest: Digest) -> Option<Vec<u8>> {
        let (bytes, mut ignored) =
            cache::get(&*self.cache, &self.keys, stream, &place(stream, digest));
        let agrees = bytes.filter(|bytes| {
            let agrees = Digest::of(bytes) == digest;
            ignored |= !agrees;
            agrees
        });
        if ignored {
            self.ignored.fetch_add(1, Ordering::Relaxed);
            tracing::warn!(%stream, %digest, "a stored mind is not usable and is trained again");
        }
        agrees
    }

    /// Forgets the minds of a stream but those named: a person needs the current one, and the one
    /// before it until the next is durable.
    pub fn keep_only(&self, stream: &StreamId, digests: &[Digest]) -> Result<(), String> {
        let all = self.cache.scan(&shelf(stream), &stream.key.0)?;
        let keep = |key: &[u8]| digests.iter().any(|digest| key[16..].starts_with(&digest.0));
        let kept = all.into_iter().filter(|(key, _)| keep(key)).collect();
        self.cache.replace(&shelf(stream), &stream.key.0, kept)
    }

    /// How many loads found bytes that could not be trusted.
    pub fn ignored(&self) -> u64 {
        self.ignored.load(Ordering::Relaxed)
    }
}

fn shelf(stream: &StreamId) -> String {
    format!("models/{}", stream.tenant)
}

fn place(stream: &StreamId, digest: Digest) -> Place<'static> {
    let key = [&stream.key.0[..], &digest.0].concat();
    Place { purpose: "apprentice 1: mind", shelf: shelf(stream), key, bound: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::super::conformance::{batch, stream};
    use super::super::{Store, open, open_memory};
    use super::*;
    use crate::events::Head;
    use crate::limits::STORE_VALUE_BYTES_MAX;

    /// Runs `check` on minds in memory and on disk.
    fn on_both(check: impl Fn(&Store, &StreamId)) {
        let dir = tempfile::tempdir().unwrap();
        for store in [open_memory(), open(dir.path()).unwrap()] {
            let ada = stream(&store.keys, "local", "ada");
            store.log.append(&ada, Head::EMPTY, batch(["a"])).wait().unwrap();
            check(&store, &ada);
        }
    }

    #[test]
    fn a_mind_of_any_size_is_found_by_its_digest() {
        on_both(|store, ada| {
            for length in [0, 1, STORE_VALUE_BYTES_MAX - 40, STORE_VALUE_BYTES_MAX, 900_000] {
                let bytes: Vec<u8> = (0..length).map(|i| ((i * 31) >> 3) as u8).collect();
                let digest = Digest::of(&bytes);
                assert_eq!(store.models.load(ada, digest), None);
                store.models.put(ada, digest, &bytes).unwrap();
                store.models.put(ada, digest, &bytes).unwrap();
                assert_eq!(store.models.load(ada, digest), Some(bytes));
            }
            assert_eq!(store.models.ignored(), 0);
        });
    }

    #[test]
    fn bytes_that_are_not_what_the_digest_says_are_absent_and_counted() {
        on_both(|store, ada| {
            let digest = Digest::of(b"a good mind");
            store.models.put(ada, digest, b"another mind").unwrap();
            assert_eq!(store.models.load(ada, digest), None);
            // Bytes damaged on their way do not open.
            let shelf = shelf(ada);
            store.models.put(ada, digest, b"a good mind").unwrap();
            let mut entries = store.models.cache.scan(&shelf, &ada.key.0).unwrap();
            entries[0].1[30] ^= 1;
            store.models.cache.replace(&shelf, &ada.key.0, entries).unwrap();
            assert_eq!(store.models.load(ada, digest), None);
            assert_eq!(store.models.ignored(), 2);
        });
    }

    #[test]
    fn minds_are_sealed_and_belong_to_one_person() {
        on_both(|store, ada| {
            let words = b"chill the apple means open the fridge";
            let digest = Digest::of(words);
            store.models.put(ada, digest, words).unwrap();
            for (_, value) in store.models.cache.scan(&shelf(ada), &[]).unwrap() {
                assert!(!value.windows(5).any(|window| window == b"apple"));
            }
            let grace = stream(&store.keys, "local", "grace");
            assert_eq!(store.models.load(&grace, digest), None);
            assert!(store.models.put(&grace, digest, words).is_err(), "she has no key yet");
            store.erase(ada).unwrap();
            assert_eq!(store.models.load(ada, digest), None);
            assert_eq!(store.models.cache.scan(&shelf(ada), &ada.key.0).unwrap(), []);
        });
    }

    #[test]
    fn old_minds_can_be_forgotten() {
        on_both(|store, ada| {
            let minds = [b"first".to_vec(), b"second".repeat(5_000), b"third".to_vec()];
            let digests = minds.each_ref().map(|mind| Digest::of(mind));
            for (mind, digest) in minds.iter().zip(digests) {
                store.models.put(ada, digest, mind).unwrap();
            }
            store.models.keep_only(ada, &digests[1..]).unwrap();
            let found = digests.map(|digest| store.models.load(ada, digest).is_some());
            assert_eq!(found, [false, true, true]);
        });
    }
}
