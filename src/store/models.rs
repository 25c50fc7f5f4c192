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
