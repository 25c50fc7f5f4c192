use std::sync::Arc;

use super::cache;
use super::cache::{Cache, Place};
use super::origin::{CacheCounter, CacheCounts, Found, Origin};
use crate::ids::{Digest, StreamId};
use crate::store::sealing::keys::Keys;

/// What the names of shelves with minds begin with; the tenant follows.
pub(in crate::store) const SHELVES: &str = "minds/";

/// The bytes of minds by their digest, each sealed for the person who taught it (a mind holds
/// people's words). A cache: what is missing, damaged or of another origin is trained again.
pub struct ModelStore {
    cache: Arc<dyn Cache>,
    keys: Arc<Keys>,
    counter: CacheCounter,
}

impl ModelStore {
    pub(in crate::store) fn new(cache: Arc<dyn Cache>, keys: Arc<Keys>) -> ModelStore {
        ModelStore { cache, keys, counter: CacheCounter::default() }
    }

    /// Keeps `bytes` for the person of `stream`. Not durable on return, and need not be.
    ///
    /// The person must have a record already: the key that seals minds is made with the first.
    ///
    /// - errors: a sentence for the log file; it costs time only.
    pub fn put(
        &self,
        stream: &StreamId,
        origin: &Origin,
        digest: Digest,
        bytes: &[u8],
    ) -> Result<(), String> {
        let blob = origin.before(bytes);
        cache::put(&*self.cache, &self.keys, stream, &place(stream, digest), &blob)
    }

    /// The mind with that digest as `read` makes it of its bytes; damaged when the bytes are not
    /// what the digest says (invariant `ModelAgrees`) or `read` makes nothing of them, stale when
    /// they have another origin than `origin`. Counted in [`ModelStore::counts`].
    pub fn load<T>(
        &self,
        stream: &StreamId,
        origin: &Origin,
        digest: Digest,
        read: impl FnOnce(&[u8]) -> Option<T>,
    ) -> Found<T> {
        let found = self.look(stream, origin, digest, read);
        self.counter.note(&found);
        match &found {
            Found::Damaged => {
                tracing::warn!(%stream, %digest, "a kept mind is damaged and is trained again");
            }
            Found::Stale(_) => {
                tracing::info!(%stream, %digest, "a kept mind is of another version and is trained again");
            }
            Found::Absent | Found::Fits(_) => {}
        }
        found
    }

    fn look<T>(
        &self,
        stream: &StreamId,
        origin: &Origin,
        digest: Digest,
        read: impl FnOnce(&[u8]) -> Option<T>,
    ) -> Found<T> {
        let (blob, ignored) = cache::get(&*self.cache, &self.keys, stream, &place(stream, digest));
        let Some(blob) = blob else {
            return if ignored { Found::Damaged } else { Found::Absent };
        };
        let Some((from, bytes)) = Origin::split(&blob) else { return Found::Damaged };
        let mind = if Digest::of(bytes) == digest { read(bytes) } else { None };
        match mind {
            None => Found::Damaged,
            Some(mind) if from == *origin => Found::Fits(mind),
            Some(mind) => Found::Stale(mind),
        }
    }

    /// Forgets the minds of a stream but those named: a person needs the current one, and the one
    /// before it until the next is durable.
    pub fn keep_only(&self, stream: &StreamId, digests: &[Digest]) -> Result<(), String> {
        let all = self.cache.scan(&shelf(stream), &stream.key.0)?;
        let keep = |key: &[u8]| digests.iter().any(|digest| key[16..].starts_with(&digest.0));
        let kept = all.into_iter().filter(|(key, _)| keep(key)).collect();
        self.cache.replace(&shelf(stream), &stream.key.0, kept)
    }

    /// How often minds were looked for, and what was found.
    pub fn counts(&self) -> CacheCounts {
        self.counter.now()
    }

    /// The counter behind [`ModelStore::counts`].
    pub fn counter(&self) -> CacheCounter {
        self.counter.clone()
    }
}

fn shelf(stream: &StreamId) -> String {
    format!("{SHELVES}{}", stream.tenant)
}

pub(in crate::store) fn place(stream: &StreamId, digest: Digest) -> Place<'static> {
    let key = [&stream.key.0[..], &digest.0].concat();
    Place { purpose: "apprentice 2: mind", shelf: shelf(stream), key, bound: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::events::Head;
    use crate::limits::STORE_VALUE_BYTES_MAX;
    use crate::store::directory::open::open;
    use crate::store::directory::store::{Store, open_memory};
    use crate::store::testing::conformance::{batch, stream};

    fn origin(code: &str) -> Origin {
        Origin { schema: Digest::of(b"1"), code: Digest::of(code.as_bytes()), recipe: Digest::ZERO }
    }

    fn put(store: &Store, who: &StreamId, digest: Digest, bytes: &[u8]) -> Result<(), String> {
        store.models.put(who, &origin("this"), digest, bytes)
    }

    fn load(store: &Store, who: &StreamId, digest: Digest) -> Found<Vec<u8>> {
        store.models.load(who, &origin("this"), digest, |bytes| Some(bytes.to_vec()))
    }

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
                assert_eq!(load(store, ada, digest), Found::Absent);
                put(store, ada, digest, &bytes).unwrap();
                put(store, ada, digest, &bytes).unwrap();
                assert_eq!(load(store, ada, digest), Found::Fits(bytes));
            }
            let CacheCounts { used, absent, stale, damaged } = store.models.counts();
            assert_eq!((used, absent, stale, damaged), (5, 5, 0, 0));
        });
    }

    #[test]
    fn bytes_that_are_not_what_the_digest_says_are_absent_and_counted() {
        on_both(|store, ada| {
            let digest = Digest::of(b"a good mind");
            put(store, ada, digest, b"another mind").unwrap();
            assert_eq!(load(store, ada, digest), Found::Damaged);
            // Bytes damaged on their way do not open.
            let shelf = shelf(ada);
            put(store, ada, digest, b"a good mind").unwrap();
            let mut entries = store.models.cache.scan(&shelf, &ada.key.0).unwrap();
            entries[0].1[30] ^= 1;
            store.models.cache.replace(&shelf, &ada.key.0, entries).unwrap();
            assert_eq!(load(store, ada, digest), Found::Damaged);
            // Nor do bytes that their reader makes nothing of.
            put(store, ada, digest, b"a good mind").unwrap();
            let nothing = store.models.load(ada, &origin("this"), digest, |_| None::<u8>);
            assert_eq!(nothing, Found::Damaged);
            assert_eq!(store.models.counts(), CacheCounts { damaged: 3, ..CacheCounts::default() });
        });
    }

    #[test]
    fn a_mind_of_another_origin_is_stale_until_it_is_put_again() {
        on_both(|store, ada| {
            let digest = Digest::of(b"a mind");
            store.models.put(ada, &origin("that"), digest, b"a mind").unwrap();
            assert_eq!(load(store, ada, digest), Found::Stale(b"a mind".to_vec()));
            store.models.put(ada, &Origin::UNKNOWN, digest, b"a mind").unwrap();
            assert_eq!(load(store, ada, digest), Found::Stale(b"a mind".to_vec()));
            put(store, ada, digest, b"a mind").unwrap();
            assert_eq!(load(store, ada, digest), Found::Fits(b"a mind".to_vec()));
            let counts = CacheCounts { used: 1, stale: 2, ..CacheCounts::default() };
            assert_eq!(store.models.counts(), counts);
        });
    }

    #[test]
    fn minds_are_sealed_and_belong_to_one_person() {
        on_both(|store, ada| {
            let words = b"chill the apple means open the fridge";
            let digest = Digest::of(words);
            put(store, ada, digest, words).unwrap();
            for (_, value) in store.models.cache.scan(&shelf(ada), &[]).unwrap() {
                assert!(!value.windows(5).any(|window| window == b"apple"));
            }
            let grace = stream(&store.keys, "local", "grace");
            assert_eq!(load(store, &grace, digest), Found::Absent);
            assert!(put(store, &grace, digest, words).is_err(), "she has no key yet");
            store.erase(ada).unwrap();
            assert_eq!(load(store, ada, digest), Found::Absent);
            assert_eq!(store.models.cache.scan(&shelf(ada), &ada.key.0).unwrap(), []);
        });
    }

    #[test]
    fn old_minds_can_be_forgotten() {
        on_both(|store, ada| {
            let minds = [b"first".to_vec(), b"second".repeat(5_000), b"third".to_vec()];
            let digests = minds.each_ref().map(|mind| Digest::of(mind));
            for (mind, digest) in minds.iter().zip(digests) {
                put(store, ada, digest, mind).unwrap();
            }
            store.models.keep_only(ada, &digests[1..]).unwrap();
            let found = digests.map(|digest| load(store, ada, digest) != Found::Absent);
            assert_eq!(found, [false, true, true]);
        });
    }
}
