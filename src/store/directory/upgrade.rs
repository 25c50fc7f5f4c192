//! How a directory of a former layout is brought up: each step copies what changes into its new place
//! beside the old one, then one rename of the file `LAYOUT` flips the number, and only then is the
//! old place cleared. A crash at any moment leaves the old layout whole or the new one whole.

use std::path::Path;

use apprentice_migrations::layouts::layout_1;

use super::error::OpenError;
use super::layout::{LAYOUT, write_layout};
use crate::ids::{Digest, StreamId};
use crate::store::caches::origin::Origin;
use crate::store::caches::{cache, models};
use crate::store::log::EventLog;
use crate::store::sealing::keys::Keys;
use crate::store::sled::{SledCache, SledLog};

/// A directory of a former layout whose log was opened and found whole.
pub(super) struct Former<'a> {
    pub dir: &'a Path,
    pub log: &'a SledLog,
    pub keys: &'a Keys,
    pub cache: &'a SledCache,
}

/// Where a crash may fall between two things that a step does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Point {
    Copied,
    Flipped,
}

/// Brings a directory up from the layout `from`, one step for each number. `crash` is asked after
/// each part of a step; only tests let it fail.
pub(super) fn bring_up(
    former: &Former<'_>,
    from: u32,
    mut crash: impl FnMut(Point) -> Result<(), OpenError>,
) -> Result<(), OpenError> {
    for number in from..LAYOUT {
        tracing::info!(
            dir = %former.dir.display(),
            from = number,
            to = number + 1,
            "the data directory is upgraded to a newer layout"
        );
        match number {
            1 => former.copy_minds(),
            _ => unreachable!("every layout from 1 on has a step above"),
        }
        crash(Point::Copied)?;
        write_layout(former.dir, number + 1)?;
        crash(Point::Flipped)?;
    }
    clear_former(former.cache);
    Ok(())
}

impl Former<'_> {
    /// 1 → 2: kept minds now say what made them. Layout 1 did not know, so they are copied as of
    /// unknown origin: trained again when asked for, and still there should this code train them
    /// differently. Snapshots fit no other version and are not copied.
    ///
    /// A cache may be lost at any time, so what cannot be copied is left behind with a word.
    fn copy_minds(&self) {
        let (mut copied, mut left) = (0, 0);
        for tenant in self.log.tenants() {
            let shelf = format!("{}{tenant}", layout_1::MINDS);
            // Person by person, so that not all minds of a lab are in memory at once.
            for stream in self.log.streams(&tenant).unwrap_or_default() {
                let entries =
                    cache::Cache::scan(self.cache, &shelf, &stream.key.0).unwrap_or_default();
                for mind in layout_1::minds(entries) {
                    match self.copy_mind(&stream, &mind) {
                        Some(()) => copied += 1,
                        None => left += 1,
                    }
                }
            }
        }
        if let Err(reason) = self.cache.flush() {
            tracing::warn!(%reason, "the copied minds may be lost; they are then trained again");
        }
        tracing::info!(copied, left, "kept minds were copied");
    }

    fn copy_mind(&self, stream: &StreamId, mind: &layout_1::SealedMind) -> Option<()> {
        let key = self.keys.user_key(stream).ok()?;
        let bytes = key.open(&mind.bound(), &mind.sealed)?;
        let digest = Digest(mind.digest);
        let (place, blob) = (models::place(stream, digest), Origin::UNKNOWN.before(&bytes));
        cache::put(self.cache, self.keys, stream, &place, &blob).ok()
    }
}

/// Drops what former layouts kept. A crash may have come before it, so every opening asks.
pub(super) fn clear_former(cache: &SledCache) {
    for begin in [layout_1::MINDS, layout_1::SNAPSHOTS] {
        if let Err(reason) = cache.drop_shelves(begin) {
            tracing::warn!(%reason, "the files of the older layout could not be removed");
        }
    }
}

#[cfg(test)]
mod tests;
