use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use serde::Serialize;

use crate::ids::{Digest, TenantId};
use crate::learning::Mind;
use crate::limits::MINDS_IN_MEMORY_MAX;

/// Minds in memory, by content, so that equal lesson lists cost one training. Never shared between
/// tenants, except base minds, which hold no user's words: keep those yourself and `put` them for
/// each tenant. Also counts what rebuilding cost.
#[derive(Debug, Default)]
pub struct Minds {
    held: Mutex<VecDeque<(TenantId, Arc<Mind>)>>,
    rebuilds: AtomicU64,
    events_folded: AtomicU64,
    trainings: AtomicU64,
    not_reproduced: AtomicU64,
}

/// What rebuilding sessions has cost so far: with its caches a session costs the records after its
/// snapshot and no training, without them all its records and one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Work {
    pub rebuilds: u64,
    pub events_folded: u64,
    /// Minds that had to be trained again.
    pub trainings: u64,
    /// Minds that this code trains differently; their kept bytes were used.
    pub not_reproduced: u64,
}

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
        self.held.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// What rebuilding with this memory has cost.
    pub fn work(&self) -> Work {
        let read = |number: &AtomicU64| number.load(Ordering::Relaxed);
        Work {
            rebuilds: read(&self.rebuilds),
            events_folded: read(&self.events_folded),
            trainings: read(&self.trainings),
            not_reproduced: read(&self.not_reproduced),
        }
    }

    pub(super) fn note_rebuild(&self, events_folded: u64) {
        self.rebuilds.fetch_add(1, Ordering::Relaxed);
        self.events_folded.fetch_add(events_folded, Ordering::Relaxed);
    }

    pub(super) fn note_training(&self) {
        self.trainings.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn note_not_reproduced(&self) {
        self.not_reproduced.fetch_add(1, Ordering::Relaxed);
    }
}
