use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::check;
use super::files::make_dir;
use super::layout::{Former, LAYOUT, LAYOUT_FILE, Standing, bring_up, standing};
use super::lock::DirLock;
use super::open::{lock_existing, open_log};
use super::sled::SledCache;
use super::{CheckpointFeed, Entropy, Keys, OpenError, OsEntropy, Store};

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
    copied.map_err(|error| OpenError::Io {
        dir: dir.display().to_string(),
        path: copy.dir.display().to_string(),
        reason: format!("it cannot be copied: {error}"),
    })?;
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
        let lock = self.dir.join("LOCK");
        let lock = fs::File::create(&lock).map_err(|error| OpenError::Io {
            dir: self.dir.display().to_string(),
            path: lock.display().to_string(),
            reason: error.to_string(),
        })?;
        let lock = DirLock::of(&self.dir, lock)?;
        let keys = Keys::open_read_only(&self.of.join("keys"), Arc::new(OsEntropy));
        let keys = Arc::new(keys);
        let lock = Arc::new(lock);
        let from = standing(&self.dir)?;
        let log = open_log(&self.dir, keys.clone(), false, lock.clone(), false)?;
        let cache = SledCache::open(&self.dir.join("cache"), lock).map_err(|reason| {
            OpenError::Database { dir: self.dir.display().to_string(), reason }
        })?;
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

/// Copies a directory with all that is in it.
///
/// - returns: the bytes copied.
pub(super) fn copy_tree(from: &Path, to: &Path) -> io::Result<u64> {
    let mut bytes = 0;
    make_dir(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        bytes += match entry.file_type()?.is_dir() {
            true => copy_tree(&source, &target)?,
            false => fs::copy(&source, &target)?,
        };
    }
    Ok(bytes)
}
