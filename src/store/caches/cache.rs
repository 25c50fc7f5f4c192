//! Blobs that may vanish at any moment without anybody losing more than time (the third law):
//! sealed for one person, cut into small values, and checked when they are read.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::{PoisonError, RwLock};

use crate::ids::StreamId;
use crate::limits::STORE_VALUE_BYTES_MAX;
use crate::store::sealing::keys::Keys;

/// Ordered bytes under a shelf and a key. Errors are told apart from absence only in the log file:
/// a cache that cannot be read is an empty cache.
pub(in crate::store) trait Cache: Send + Sync {
    /// Replaces everything on `shelf` whose key starts with `prefix` by `entries`, in one step.
    fn replace(&self, shelf: &str, prefix: &[u8], entries: Vec<(Vec<u8>, Vec<u8>)>) -> Cached<()>;
    /// All entries whose key starts with `prefix`, in the order of their keys.
    fn scan(&self, shelf: &str, prefix: &[u8]) -> Cached<Vec<(Vec<u8>, Vec<u8>)>>;
}

pub(in crate::store) type Cached<T> = Result<T, String>;

type Shelf = BTreeMap<Vec<u8>, Vec<u8>>;

/// A cache that ends with the process.
#[derive(Default)]
pub(in crate::store) struct MemoryCache(RwLock<BTreeMap<String, Shelf>>);

impl Cache for MemoryCache {
    fn replace(&self, shelf: &str, prefix: &[u8], entries: Vec<(Vec<u8>, Vec<u8>)>) -> Cached<()> {
        let mut shelves = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let shelf = shelves.entry(shelf.to_owned()).or_default();
        let old: Vec<Vec<u8>> = with_prefix(shelf, prefix).map(|(key, _)| key.clone()).collect();
        old.iter().for_each(|key| drop(shelf.remove(key)));
        shelf.extend(entries);
        Ok(())
    }

    fn scan(&self, shelf: &str, prefix: &[u8]) -> Cached<Vec<(Vec<u8>, Vec<u8>)>> {
        let shelves = self.0.read().unwrap_or_else(PoisonError::into_inner);
        let entries = shelves.get(shelf).into_iter().flat_map(|shelf| with_prefix(shelf, prefix));
        Ok(entries.map(|(key, value)| (key.clone(), value.clone())).collect())
    }
}

fn with_prefix<'s>(
    shelf: &'s Shelf,
    prefix: &'s [u8],
) -> impl Iterator<Item = (&'s Vec<u8>, &'s Vec<u8>)> {
    shelf
        .range::<[u8], _>((Bound::Included(prefix), Bound::Unbounded))
        .take_while(move |(key, _)| key.starts_with(prefix))
}

/// Seals `plain` for the stream's person and puts it under `key`, in values of at most
/// [`STORE_VALUE_BYTES_MAX`] bytes.
pub(in crate::store) fn put(
    cache: &dyn Cache,
    keys: &Keys,
    stream: &StreamId,
    place: &Place<'_>,
    plain: &[u8],
) -> Cached<()> {
    let person = keys.user_key(stream).map_err(|error| error.to_string())?;
    let sealed = person.seal(keys.entropy(), &place.bound(), plain);
    let entries = (0u32..).zip(sealed.chunks(STORE_VALUE_BYTES_MAX)).map(|(number, value)| {
        let key = [&place.key, &number.to_be_bytes()[..]].concat();
        (key, value.to_vec())
    });
    cache.replace(&place.shelf, &place.key, entries.collect())
}

/// What [`put`] put there; none when there is nothing, or nothing that can be trusted. The second
/// part is whether something was there that had to be ignored.
pub(in crate::store) fn get(
    cache: &dyn Cache,
    keys: &Keys,
    stream: &StreamId,
    place: &Place<'_>,
) -> (Option<Vec<u8>>, bool) {
    let entries = match cache.scan(&place.shelf, &place.key) {
        Ok(entries) => entries,
        Err(reason) => {
            tracing::warn!(%stream, %reason, "a cache entry cannot be read and is ignored");
            return (None, true);
        }
    };
    if entries.is_empty() {
        return (None, false);
    }
    let sealed: Vec<u8> = entries.into_iter().flat_map(|(_, value)| value).collect();
    let opened = keys.user_key(stream).ok().and_then(|key| key.open(&place.bound(), &sealed));
    let ignored = opened.is_none();
    (opened, ignored)
}

/// Where a blob stands, and what its seal binds it to.
pub(in crate::store) struct Place<'a> {
    pub purpose: &'a str,
    pub shelf: String,
    pub key: Vec<u8>,
    pub bound: Vec<u8>,
}

impl Place<'_> {
    fn bound(&self) -> Vec<u8> {
        [self.purpose.as_bytes(), b"\0", &self.key, &self.bound].concat()
    }
}
