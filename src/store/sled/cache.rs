use std::fs;
use std::path::Path;
use std::sync::Arc;

use super::open_database;
use super::quiet::guarded;
use crate::store::caches::cache::{Cache, Cached};
use crate::store::disk::closed::{ClosedMark, Part};
use crate::store::disk::lock::DirLock;

/// Bytes of pages kept in memory.
const CACHE_BYTES: u64 = 16 * 1024 * 1024;

/// The caches on disk: a database of their own, so that a damaged cache is thrown away whole and
/// the log's database holds nothing but the log. Never synced by us.
pub(in crate::store) struct SledCache {
    db: ::sled::Db,
    /// Left when the database is closed: fields are dropped in this order.
    _mark: ClosedMark,
    /// Held until the database is closed.
    _lock: Arc<DirLock>,
}

impl SledCache {
    /// Opens the cache in `dir`; one that does not open is replaced by an empty one.
    pub(in crate::store) fn open(dir: &Path, lock: Arc<DirLock>) -> Result<SledCache, String> {
        let db = open_database(dir, CACHE_BYTES).or_else(|reason| {
            tracing::warn!(%reason, "the cache of minds and snapshots is damaged and is emptied");
            if dir.exists() {
                fs::remove_dir_all(dir).map_err(|error| error.to_string())?;
            }
            open_database(dir, CACHE_BYTES)
        })?;
        let home = dir.parent().expect("the cache stands in a data directory");
        Ok(SledCache { db, _mark: ClosedMark::new(home, Part::Cache), _lock: lock })
    }
}

impl SledCache {
    /// Forgets every shelf whose name begins with `begin`.
    pub(in crate::store) fn drop_shelves(&self, begin: &str) -> Cached<()> {
        let dropped = guarded(|| {
            let names = self.db.tree_names();
            for name in names.iter().filter(|name| name.starts_with(begin.as_bytes())) {
                self.db.drop_tree(name)?;
            }
            Ok(())
        })?;
        dropped.map_err(|error: ::sled::Error| error.to_string())
    }

    pub(in crate::store) fn flush(&self) -> Cached<()> {
        let flushed = guarded(|| self.db.flush())?;
        flushed.map(|_| ()).map_err(|error| error.to_string())
    }
}

impl Cache for SledCache {
    fn replace(&self, shelf: &str, prefix: &[u8], entries: Vec<(Vec<u8>, Vec<u8>)>) -> Cached<()> {
        let replaced = guarded(|| {
            let tree = self.db.open_tree(shelf)?;
            let mut batch = ::sled::Batch::default();
            for key in tree.scan_prefix(prefix).keys() {
                batch.remove(key?);
            }
            for (key, value) in entries {
                batch.insert(key, value);
            }
            tree.apply_batch(batch)
        })?;
        replaced.map_err(|error: ::sled::Error| error.to_string())
    }

    fn scan(&self, shelf: &str, prefix: &[u8]) -> Cached<Vec<(Vec<u8>, Vec<u8>)>> {
        let found: Result<Vec<_>, ::sled::Error> = guarded(|| {
            let tree = self.db.open_tree(shelf)?;
            let entries = tree.scan_prefix(prefix);
            entries.map(|entry| entry.map(|(key, value)| (key.to_vec(), value.to_vec()))).collect()
        })?;
        found.map_err(|error| error.to_string())
    }
}
