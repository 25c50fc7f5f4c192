use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;

use crate::ids::Digest;

/// What a cached blob was made from. A difference in any part makes it stale: it is made again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// The form of what is kept.
    pub schema: Digest,
    /// The code that made it.
    pub code: Digest,
    /// The recipe of the person it belongs to.
    pub recipe: Digest,
}

const DIGEST: usize = 32;
/// Bytes in front of a blob.
const ORIGIN: usize = 3 * DIGEST;

impl Origin {
    /// For what a former layout kept without saying.
    pub const UNKNOWN: Origin =
        Origin { schema: Digest::ZERO, code: Digest::ZERO, recipe: Digest::ZERO };

    /// The blob as it is sealed: origin, then content.
    pub(in crate::store) fn before(&self, content: &[u8]) -> Vec<u8> {
        [&self.schema.0[..], &self.code.0, &self.recipe.0, content].concat()
    }

    /// Undoes [`Origin::before`]; none for fewer bytes than an origin has.
    pub(in crate::store) fn split(blob: &[u8]) -> Option<(Origin, &[u8])> {
        let (origin, content) = blob.split_first_chunk::<ORIGIN>()?;
        let part = |number: usize| {
            let bytes = &origin[number * DIGEST..][..DIGEST];
            Digest(bytes.try_into().expect("it was cut to this length"))
        };
        Some((Origin { schema: part(0), code: part(1), recipe: part(2) }, content))
    }
}

/// What a look into a cache gave.
#[derive(Debug, Clone, PartialEq)]
pub enum Found<T> {
    Absent,
    /// Something that cannot be trusted: it does not open, or is not what it says.
    Damaged,
    /// Whole, but of another origin.
    Stale(T),
    Fits(T),
}

/// How often a cache was asked, by what it gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct CacheCounts {
    pub used: u64,
    pub absent: u64,
    pub stale: u64,
    pub damaged: u64,
}

/// Counts the looks into one cache; clones count together, and outlive the store.
#[derive(Debug, Clone, Default)]
pub struct CacheCounter(Arc<Numbers>);

#[derive(Debug, Default)]
struct Numbers {
    used: AtomicU64,
    absent: AtomicU64,
    stale: AtomicU64,
    damaged: AtomicU64,
}

impl CacheCounter {
    pub fn now(&self) -> CacheCounts {
        let read = |number: &AtomicU64| number.load(Ordering::Relaxed);
        let Numbers { used, absent, stale, damaged } = &*self.0;
        CacheCounts {
            used: read(used),
            absent: read(absent),
            stale: read(stale),
            damaged: read(damaged),
        }
    }

    pub(in crate::store) fn note<T>(&self, found: &Found<T>) {
        let number = match found {
            Found::Absent => &self.0.absent,
            Found::Damaged => &self.0.damaged,
            Found::Stale(_) => &self.0.stale,
            Found::Fits(_) => &self.0.used,
        };
        number.fetch_add(1, Ordering::Relaxed);
    }
}
