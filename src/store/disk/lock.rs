use std::fs::{File, TryLockError};
use std::io;

/// The file of a data directory that a process locks while it has the directory open.
pub(in crate::store) const LOCK_FILE: &str = "LOCK";

/// Holds a data directory for this process, until it is dropped.
///
/// It is unlocked by name and not only closed: a child that was started a moment ago has the same open
/// file until it runs its own program, and would keep the lock for as long.
#[derive(Debug)]
pub(in crate::store) struct DirLock(File);

/// Why a directory cannot be locked.
#[derive(Debug)]
pub(in crate::store) enum LockError {
    /// Another process, or another store of this one, has it open.
    InUse,
    Io(io::Error),
}

impl DirLock {
    /// Locks an opened lock file.
    pub fn of(file: File) -> Result<DirLock, LockError> {
        match file.try_lock() {
            Ok(()) => Ok(DirLock(file)),
            Err(TryLockError::WouldBlock) => Err(LockError::InUse),
            Err(TryLockError::Error(error)) => Err(LockError::Io(error)),
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
        let lock = DirLock::of(file).unwrap();
        let second = DirLock::of(open()).map(drop);
        assert!(matches!(second, Err(LockError::InUse)), "{second:?}");
        drop(lock);
        DirLock::of(open()).unwrap();
    }
}
