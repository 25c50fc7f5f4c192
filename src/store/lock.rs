use std::fs::{File, TryLockError};
use std::path::Path;

use super::OpenError;
use super::open::LOCK_FILE;

/// Holds a data directory for this process, until it is dropped.
///
/// It is unlocked by name and not only closed: a child that was started a moment ago has the same open
/// file until it runs its own program, and would keep the lock for as long.
#[derive(Debug)]
pub(super) struct DirLock(File);

impl DirLock {
    /// Locks an opened lock file.
    ///
    /// - errors: another process, or another store of this one, has the directory.
    pub fn of(dir: &Path, file: File) -> Result<DirLock, OpenError> {
        match file.try_lock() {
            Ok(()) => Ok(DirLock(file)),
            Err(TryLockError::WouldBlock) => {
                Err(OpenError::InUse { dir: dir.display().to_string() })
            }
            Err(TryLockError::Error(error)) => {
                let path = dir.join(LOCK_FILE).display().to_string();
                let dir = dir.display().to_string();
                Err(OpenError::Io { dir, path, reason: error.to_string() })
            }
        }
    }
}

impl Drop for DirLock {
    fn drop(&mut self) {
        // Closing the file is what is left if this fails.
        let _ = self.0.unlock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_ends_with_its_holder_though_a_child_still_has_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(LOCK_FILE);
        let open = || File::create(&path).unwrap();
        let file = open();
        // As a child has it between its fork and its exec.
        let _inherited = file.try_clone().unwrap();
        let lock = DirLock::of(dir.path(), file).unwrap();
        let second = DirLock::of(dir.path(), open()).map(drop);
        assert!(matches!(second, Err(OpenError::InUse { .. })), "{second:?}");
        drop(lock);
        DirLock::of(dir.path(), open()).unwrap();
    }
}
