use std::path::Path;
use std::sync::Arc;

use super::checkpoints::CheckpointFeed;
use crate::ids::{StreamId, TenantId};
use crate::store::caches::cache::{Cache, MemoryCache};
use crate::store::caches::models::ModelStore;
use crate::store::caches::snapshots::SnapshotStore;
use crate::store::disk::files::{overwrite_and_remove, sync_dir};
use crate::store::log::EventLog;
use crate::store::memory::MemoryLog;
use crate::store::sealing::entropy::OsEntropy;
use crate::store::sealing::keys::{KeyError, Keys};

/// Everything durable that a service needs.
#[derive(Clone)]
pub struct Store {
    pub log: Arc<dyn EventLog>,
    pub models: Arc<ModelStore>,
    pub snapshots: Arc<SnapshotStore>,
    pub keys: Arc<Keys>,
    pub checkpoints: Arc<CheckpointFeed>,
    /// Where it is kept; none in memory.
    pub(super) directory: Option<Arc<Path>>,
}

/// The file in a data directory that remembers what the person at its terminal typed.
pub const HISTORY_FILE: &str = "history.txt";

/// A store that ends with the process, for tests and for embedding without a disk.
pub fn open_memory() -> Store {
    let keys = Arc::new(Keys::in_memory(Arc::new(OsEntropy)));
    let log = Arc::new(MemoryLog::new(keys.clone()));
    Store::of(log, Arc::new(MemoryCache::default()), keys)
}

impl Store {
    pub(in crate::store) fn of(
        log: Arc<dyn EventLog>,
        cache: Arc<dyn Cache>,
        keys: Arc<Keys>,
    ) -> Store {
        let models = Arc::new(ModelStore::new(cache.clone(), keys.clone()));
        let snapshots = Arc::new(SnapshotStore::new(cache, keys.clone()));
        let checkpoints = Arc::default();
        Store { log, models, snapshots, keys, checkpoints, directory: None }
    }

    /// The same store with another log in front.
    pub fn with_log(self, log: Arc<dyn EventLog>) -> Store {
        Store { log, ..self }
    }

    /// Destroys a person's key, and drops their minds, their snapshots and, in the tenant of the
    /// single-user default, what was typed at the terminal. The chains still verify. Repeating it
    /// is harmless.
    ///
    /// - errors: why the key or the typed words could not be destroyed. What is left in a cache is
    ///   noise without the key.
    pub fn erase(&self, stream: &StreamId) -> Result<(), KeyError> {
        self.keys.erase_user_key(stream)?;
        for dropped in [self.models.keep_only(stream, &[]), self.snapshots.forget(stream)] {
            if let Err(reason) = dropped {
                tracing::warn!(%stream, %reason, "the cache of an erased user, which nothing can decrypt, could not be removed");
            }
        }
        let typed = self.directory.as_ref().filter(|_| stream.tenant == TenantId::local());
        if let Some(dir) = typed {
            let path = dir.join(HISTORY_FILE);
            overwrite_and_remove(&path).and_then(|()| sync_dir(dir)).map_err(|error| {
                KeyError::Io { path: path.display().to_string(), reason: error.to_string() }
            })?;
        }
        Ok(())
    }
}
