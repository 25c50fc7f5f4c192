use std::fmt::Display;
use std::path::Path;

use crate::store::disk::lock::{LOCK_FILE, LockError};
use crate::store::sealing::keys::KeyError;
use crate::store::sled::{Damage, LogError};

/// Why a data directory cannot be opened: a sentence that names it and says what to do.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    #[error(
        "the data directory {dir} is in use by another process; \
         stop that one, or choose another directory"
    )]
    InUse { dir: String },
    #[error("the data directory {dir} cannot be used: {path}: {reason}")]
    Io { dir: String, path: String, reason: String },
    #[error(
        "{dir} is not a data directory of apprentice: it holds {found} and no file LAYOUT; \
         choose a new or empty directory, or restore the file from a backup"
    )]
    NotOurs { dir: String, found: String },
    #[error(
        "there is no data directory of apprentice at {dir}: {found}; \
         name the right one"
    )]
    Absent { dir: String, found: &'static str },
    #[error(
        "the data directory {dir} has layout {found}, but this version of apprentice knows layouts \
         up to {known}; use the version that wrote it or a newer one, or an older backup"
    )]
    Newer { dir: String, found: u32, known: u32 },
    #[error("the file LAYOUT of the data directory {dir} is damaged; restore it from a backup")]
    Layout { dir: String },
    #[error("the data directory {dir}: {error}")]
    Key { dir: String, error: KeyError },
    #[error(
        "the database in the data directory {dir} is damaged and does not open ({reason}); \
         restore the directory from a backup, or rescue what can be read with \
         `apprentice salvage --data {dir} --out NEW`"
    )]
    Database { dir: String, reason: String },
    #[error(
        "the data directory {dir} has lost records: {}; restore it from a backup, or rescue what is \
         left with `apprentice salvage --data {dir} --out NEW`",
        list(damage)
    )]
    Damaged { dir: String, damage: Vec<Damage> },
}

impl OpenError {
    /// The same error about the directory of which another one is a copy.
    pub(super) fn about(self, original: &Path) -> OpenError {
        let dir = original.display().to_string();
        match self {
            OpenError::Database { reason, .. } => OpenError::Database { dir, reason },
            OpenError::Damaged { damage, .. } => OpenError::Damaged { dir, damage },
            OpenError::Key { error, .. } => OpenError::Key { dir, error },
            other => other,
        }
    }
}

fn list(damage: &[Damage]) -> String {
    let mut shown: Vec<String> = damage.iter().take(3).map(Damage::to_string).collect();
    if damage.len() > shown.len() {
        shown.push(format!("and {} more", damage.len() - shown.len()));
    }
    shown.join("; ")
}

/// Makes errors about the data directory it names.
#[derive(Clone, Copy)]
pub(in crate::store) struct Fail<'a>(pub &'a Path);

impl Fail<'_> {
    pub(in crate::store) fn dir(self) -> String {
        self.0.display().to_string()
    }

    pub(in crate::store) fn io(self, path: &Path, reason: impl Display) -> OpenError {
        let (path, reason) = (path.display().to_string(), reason.to_string());
        OpenError::Io { dir: self.dir(), path, reason }
    }

    pub(in crate::store) fn key(self, error: KeyError) -> OpenError {
        OpenError::Key { dir: self.dir(), error }
    }

    pub(in crate::store) fn database(self, reason: String) -> OpenError {
        OpenError::Database { dir: self.dir(), reason }
    }

    pub(in crate::store) fn lock(self, error: LockError) -> OpenError {
        match error {
            LockError::InUse => OpenError::InUse { dir: self.dir() },
            LockError::Io(error) => self.io(&self.0.join(LOCK_FILE), error),
        }
    }

    pub(in crate::store) fn log(self, error: LogError) -> OpenError {
        match error {
            LogError::Io(error) => self.io(&self.0.join("log"), error),
            LogError::Database(reason) => self.database(reason),
            LogError::Damaged(damage) => OpenError::Damaged { dir: self.dir(), damage },
        }
    }
}
