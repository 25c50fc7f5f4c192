use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::check;
use super::checkpoints::CheckpointFeed;
use super::error::{Fail, OpenError};
use super::layout::{LAYOUT, LAYOUT_FILE, Standing, standing};
use super::open::{lock_existing, open_log};
use super::store::Store;
use super::upgrade::{Former, bring_up};
use crate::store::disk::files::{copy_tree, make_dir};
use crate::store::disk::lock::{DirLock, LOCK_FILE};
use crate::store::sealing::entropy::{Entropy, OsEntropy};
use crate::store::sealing::keys::Keys;
use crate::store::sled::SledCache;

/// A copy of a data directory's log and caches, for tools that only look: they never open the
/// directory itself, which opening would write to. Removed when dropped.
///
/// Secrets are not copied: keys are read where they are.
#[derive(Debug)]
pub struct PrivateCopy {
    dir: PathBuf,
    /// The directory that was copied.
    of: PathBuf,
}

/// Copies the closed data directory `dir` to a new directory of the system's temporary space.
///
/// - errors: it is in use, is no data directory, or cannot be read or copied.
pub fn copy_private(dir: &Path) -> Result<PrivateCopy, OpenError> {
    check_there(dir)?;
    // Held until the copy is complete: a log that is being written would be copied torn.
    let _lock = lock_existing(dir)?;
    let mut name = [0; 8];
    OsEntropy.fill(&mut name);
    let name = format!("apprentice-{:016x}", u64::from_be_bytes(name));
    let target = std::env::temp_dir().join(name);
    let copy = PrivateCopy { dir: target, of: dir.to_owned() };
    let copied = make_dir(&copy.dir)
        .and_then(|()| fs::copy(dir.join(LAYOUT_FILE), copy.dir.join(LAYOUT_FILE)).map(|_| ()))
        .and_then(|()| copy_tree(&dir.join("log"), &copy.dir.join("log")))
        .and_then(|_| match dir.join("cache").is_dir() {
            true => copy_tree(&dir.join("cache"), &copy.dir.join("cache")),
            false => Ok(0),
        })
        .and_then(|_| {
            ["HEADS", "CLOSED-log", "CLOSED-cache"].iter().try_for_each(|name| {
                match fs::copy(dir.join(name), copy.dir.join(name)) {
                    // That is for the opening to report.
                    Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
                    copied => copied.map(|_| ()),
                }
            })
        });
    copied.map_err(|error| Fail(dir).io(&copy.dir, format!("it cannot be copied: {error}")))?;
    Ok(copy)
}

/// - errors: there is nothing that was ever used as a data directory.
fn check_there(dir: &Path) -> Result<(), OpenError> {
    let absent = |found| Err(OpenError::Absent { dir: dir.display().to_string(), found });
    match fs::read_dir(dir).map(|mut entries| entries.next().is_none()) {
        Ok(true) => absent("the directory is empty"),
        // A log without its other files is one to be restored, which locking says.
        Ok(false) if !["LAYOUT", "CREATING", "log"].iter().any(|name| dir.join(name).exists()) => {
            absent("it holds other files")
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => absent("it does not exist"),
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => absent("it is a file"),
        // What else is wrong shows when it is locked.
        _ => Ok(()),
    }
}

impl PrivateCopy {
    /// Where the copy is.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// The store of the copy, its cached minds included; new people cannot be added to it. A copy of
    /// a former layout is brought up; its original is not.
    ///
    /// Errors name the directory that was copied: the copy is gone when they are read.
    pub fn open(&self) -> Result<Store, OpenError> {
        self.open_copy().map_err(|error| error.about(&self.of))
    }

    fn open_copy(&self) -> Result<Store, OpenError> {
        check::log_before_opening(&self.dir)?;
        check::cache_before_opening(&self.dir);
        let fail = Fail(&self.dir);
        let path = self.dir.join(LOCK_FILE);
        let lock = fs::File::create(&path).map_err(|error| fail.io(&path, error))?;
        let lock = Arc::new(DirLock::of(lock).map_err(|error| fail.lock(error))?);
        let keys = Keys::open_read_only(&self.of.join("keys"), Arc::new(OsEntropy));
        let keys = Arc::new(keys);
        let from = standing(&self.dir)?;
        let log = open_log(&self.dir, keys.clone(), false, lock.clone(), false)?;
        let cache = SledCache::open(&self.dir.join("cache"), lock);
        let cache = cache.map_err(|reason| fail.database(reason))?;
        if let Standing::At(from @ 1..LAYOUT) = from {
            let former = Former { dir: &self.dir, log: &log, keys: &keys, cache: &cache };
            bring_up(&former, from, |_| Ok(()))?;
        }
        // Read where they are, like the keys.
        let mut store = Store::of(Arc::new(log), Arc::new(cache), keys);
        store.checkpoints = Arc::new(CheckpointFeed::of(&self.of, false));
        Ok(store)
    }
}

impl Drop for PrivateCopy {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.dir) {
            tracing::warn!(dir = %self.dir.display(), %error, "the private copy could not be removed");
        }
    }
}
