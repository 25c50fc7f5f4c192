use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use super::quiet::guarded;
use super::read::parse_key;
use super::{sentence, store_error};
use crate::ids::TenantId;
use crate::limits::KEY_FILE_BYTES;
use crate::store::log::ReadError;
use crate::store::log::heads::Heads;

/// How much each tenant has in the log. What was there at opening is counted when somebody asks
/// for the first time; what comes after that is added as it comes.
pub(super) struct Sizes {
    /// Where the streams ended at opening.
    at_opening: Heads,
    found: Mutex<BTreeMap<TenantId, u64>>,
    added: Mutex<BTreeMap<TenantId, u64>>,
}

impl Sizes {
    pub(super) fn new(at_opening: Heads) -> Sizes {
        Sizes { at_opening, found: Mutex::default(), added: Mutex::default() }
    }

    pub(super) fn add(&self, tenant: &TenantId, bytes: u64) {
        let mut added = self.added.lock().unwrap_or_else(PoisonError::into_inner);
        *added.entry(tenant.clone()).or_default() += bytes;
    }

    pub(super) fn of(
        &self,
        tenant: &TenantId,
        tree: impl FnOnce() -> Result<::sled::Tree, ReadError>,
    ) -> Result<u64, ReadError> {
        let lock = || self.found.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().get(tenant).copied();
        let found = match known {
            Some(bytes) => bytes,
            None => {
                // Counted without the lock: nobody waits for another tenant's count.
                let bytes = match self.at_opening.contains_key(tenant) {
                    true => self.count(tenant, &tree()?)?,
                    false => 0,
                };
                lock().insert(tenant.clone(), bytes);
                bytes
            }
        };
        let added = self.added.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(found + added.get(tenant).copied().unwrap_or(0))
    }

    /// Others may be appending: records that came after opening are in `added`.
    fn count(&self, tenant: &TenantId, tree: &::sled::Tree) -> Result<u64, ReadError> {
        let heads = self.at_opening.get(tenant);
        let counted = guarded(|| {
            tree.iter().try_fold(0, |bytes, entry| {
                let (key, value) = entry.map_err(|error| sentence(&error))?;
                let old = parse_key(&key).is_some_and(|(stream, seq, _)| {
                    heads.and_then(|heads| heads.get(&stream)).is_some_and(|head| seq <= head.seq)
                });
                Ok(bytes + if old { value.len() as u64 } else { 0 })
            })
        });
        let frames = counted.and_then(|counted| counted).map_err(store_error)?;
        let streams = heads.map_or(0, |heads| heads.len() as u64);
        Ok(frames + streams * KEY_FILE_BYTES)
    }
}
