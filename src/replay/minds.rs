use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};

use crate::ids::{Digest, TenantId};
use crate::learning::Mind;
use crate::limits::MINDS_IN_MEMORY_MAX;

/// Minds in memory, by content, so that equal lesson lists cost one training. Never shared between
/// tenants, except base minds, which hold nobody's words: keep those yourself and `put` them for
/// each tenant.
#[derive(Debug, Default)]
pub struct Minds(Mutex<VecDeque<(TenantId, Arc<Mind>)>>);

impl Minds {
    pub fn get(&self, tenant: &TenantId, digest: Digest) -> Option<Arc<Mind>> {
        let mut held = self.held();
        let place = held.iter().position(|(t, mind)| t == tenant && mind.digest() == digest)?;
        let found = held.remove(place).expect("the position was just found");
        let mind = found.1.clone();
        held.push_back(found);
        Some(mind)
    }

    /// The least recently used minds make room.
    pub fn put(&self, tenant: &TenantId, mind: Arc<Mind>) {
        let mut held = self.held();
        held.retain(|(t, old)| !(t == tenant && old.digest() == mind.digest()));
        if held.len() == MINDS_IN_MEMORY_MAX {
            held.pop_front();
        }
        held.push_back((tenant.clone(), mind));
    }

    fn held(&self) -> MutexGuard<'_, VecDeque<(TenantId, Arc<Mind>)>> {
        // Nothing panics while holding it, and a list of minds is whole between two statements.
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
