use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;
use std::sync::Arc;

use super::cache::{Cache, MemoryCache};
use super::files::{make_dir, sync_dir, write_whole};
use super::sled::{LogError, SledCache};
use super::{
    Damage, EventLog, KeyError, Keys, MemoryLog, ModelStore, OsEntropy, SledLog, SnapshotStore,
};
use crate::ids::{StreamId, TenantId};

/// The layout of data directories that this binary makes and reads.
pub const LAYOUT: u32 = 1;

const LAYOUT_FILE: &str = "LAYOUT";
const LAYOUT_TEXT: &str = "apprentice data directory, layout ";
const LOCK_FILE: &str = "LOCK";
/// Stands while a directory is being made; nothing was acknowledged yet.
const CREATING_FILE: &str = "CREATING";

/// Everything durable that a service needs.
#[derive(Clone)]
pub struct Store {
    pub log: Arc<dyn EventLog>,
    pub models: Arc<ModelStore>,
    pub snapshots: Arc<SnapshotStore>,
    pub keys: Arc<Keys>,
}

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
        "the data directory {dir} has layout {found}, this version of apprentice knows {LAYOUT}; \
         use a newer version"
    )]
    Newer { dir: String, found: u32 },
    #[error("the file LAYOUT of the data directory {dir} is damaged; restore it from a backup")]
    Layout { dir: String },
    #[error("the data directory {dir}: {error}")]
    Key { dir: String, error: KeyError },
    #[error(
        "the database in the data directory {dir} is damaged and does not open ({reason}); \
         restore the directory from a backup"
    )]
    Database { dir: String, reason: String },
    #[error(
        "the data directory {dir} has lost records: {}; restore it from a backup",
        list(damage)
    )]
    Damaged { dir: String, damage: Vec<Damage> },
}

fn list(damage: &[Damage]) -> String {
    let mut shown: Vec<String> = damage.iter().take(3).map(Damage::to_string).collect();
    if damage.len() > shown.len() {
        shown.push(format!("and {} more", damage.len() - shown.len()));
    }
    shown.join("; ")
}

/// Opens the data directory `dir`, and makes it if it does not exist or is empty. One process may
/// have it open at a time.
pub fn open(dir: &Path) -> Result<Store, OpenError> {
    let fail = Fail(dir);
    make_dir(dir).map_err(|error| fail.io(dir, &error))?;
    let lock = Arc::new(take_lock(dir)?);
    let fresh = is_fresh(dir)?;
    if fresh {
        write_durably(&dir.join(CREATING_FILE), "").map_err(|e| fail.io(dir, &e))?;
    }
    let keys = Keys::open(&dir.join("keys"), Arc::new(OsEntropy)).map_err(|e| fail.key(e))?;
    let keys = Arc::new(keys);
    let log = open_log(dir, keys.clone(), fresh, lock.clone())?;
    let local = TenantId::local();
    let local_is_empty = log.streams(&local).is_ok_and(|streams| streams.is_empty());
    if local_is_empty {
        keys.make_tenant(&local).map_err(|error| fail.key(error))?;
    }
    log.tenants()
        .iter()
        .try_for_each(|tenant| keys.check_tenant(tenant))
        .map_err(|e| fail.key(e))?;
    let cache =
        SledCache::open(&dir.join("cache"), lock).map_err(|reason| fail.database(reason))?;
    if fresh {
        let layout = dir.join(LAYOUT_FILE);
        write_durably(&layout, &format!("{LAYOUT_TEXT}{LAYOUT}\n"))
            .and_then(|()| fs::remove_file(dir.join(CREATING_FILE)))
            .and_then(|()| sync_dir(dir))
            .map_err(|error| fail.io(&layout, &error))?;
    }
    Ok(Store::of(Arc::new(log), Arc::new(cache), keys))
}

/// A store that ends with the process, for tests and for embedding without a disk.
pub fn open_memory() -> Store {
    let keys = Arc::new(Keys::in_memory(Arc::new(OsEntropy)));
    let log = Arc::new(MemoryLog::new(keys.clone()));
    Store::of(log, Arc::new(MemoryCache::default()), keys)
}

impl Store {
    fn of(log: Arc<dyn EventLog>, cache: Arc<dyn Cache>, keys: Arc<Keys>) -> Store {
        let models = Arc::new(ModelStore::new(cache.clone(), keys.clone()));
        let snapshots = Arc::new(SnapshotStore::new(cache, keys.clone()));
        Store { log, models, snapshots, keys }
    }

    /// In memory, around another log (a [`super::FaultyLog`], a seeded one).
    pub fn around(log: Arc<dyn EventLog>, keys: Arc<Keys>) -> Store {
        Store::of(log, Arc::new(MemoryCache::default()), keys)
    }

    /// Destroys a person's key and drops their minds and snapshots. The chains still verify.
    ///
    /// - errors: why the key could not be destroyed. What is left in a cache is noise without it.
    pub fn erase(&self, stream: &StreamId) -> Result<(), KeyError> {
        self.keys.erase_user_key(stream)?;
        for dropped in [self.models.keep_only(stream, &[]), self.snapshots.forget(stream)] {
            if let Err(reason) = dropped {
                tracing::warn!(%stream, %reason, "an erased person's cache is left as noise");
            }
        }
        Ok(())
    }
}

/// Opens the log of `dir` and translates its errors.
pub(super) fn open_log(
    dir: &Path,
    keys: Arc<Keys>,
    fresh: bool,
    lock: Arc<File>,
) -> Result<SledLog, OpenError> {
    let fail = Fail(dir);
    SledLog::open(dir, keys, fresh, lock).map_err(|error| match error {
        LogError::Io(error) => fail.io(&dir.join("log"), &error),
        LogError::Database(reason) => fail.database(reason),
        LogError::Damaged(damage) => OpenError::Damaged { dir: fail.dir(), damage },
    })
}

fn take_lock(dir: &Path) -> Result<File, OpenError> {
    let path = dir.join(LOCK_FILE);
    let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| Fail(dir).io(&path, &error))?;
    lock(dir, file)
}

/// Locks an opened lock file, or says who is in the way.
pub(super) fn lock(dir: &Path, file: File) -> Result<File, OpenError> {
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(OpenError::InUse { dir: dir.display().to_string() }),
        Err(TryLockError::Error(error)) => Err(Fail(dir).io(&dir.join(LOCK_FILE), &error)),
    }
}

/// For tools that never make a directory: locks an existing one and checks its layout.
pub(super) fn lock_existing(dir: &Path) -> Result<File, OpenError> {
    let path = dir.join(LOCK_FILE);
    let file = File::open(&path).map_err(|error| Fail(dir).io(&path, &error))?;
    let file = lock(dir, file)?;
    match is_fresh(dir)? {
        false => Ok(file),
        true => {
            let found = "nothing that was ever used".to_owned();
            Err(OpenError::NotOurs { dir: Fail(dir).dir(), found })
        }
    }
}

/// Whether the directory is still to be made.
///
/// - errors: it belongs to somebody else, or to a newer version.
fn is_fresh(dir: &Path) -> Result<bool, OpenError> {
    let fail = Fail(dir);
    if dir.join(CREATING_FILE).exists() {
        return Ok(true);
    }
    let path = dir.join(LAYOUT_FILE);
    match fs::read(&path) {
        Ok(bytes) => {
            let text = std::str::from_utf8(&bytes).ok().and_then(|text| text.strip_suffix('\n'));
            let number = text.and_then(|text| text.strip_prefix(LAYOUT_TEXT)?.parse().ok());
            match number {
                Some(LAYOUT) => Ok(false),
                Some(found) if found > LAYOUT => Err(OpenError::Newer { dir: fail.dir(), found }),
                _ => Err(OpenError::Layout { dir: fail.dir() }),
            }
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            let entries = fs::read_dir(dir).map_err(|error| fail.io(dir, &error))?;
            for entry in entries {
                let name = entry.map_err(|error| fail.io(dir, &error))?.file_name();
                // A crash right at the start leaves these two.
                if name != LOCK_FILE && name != "CREATING.new" {
                    let found = format!("{:?}", name.to_string_lossy());
                    return Err(OpenError::NotOurs { dir: fail.dir(), found });
                }
            }
            Ok(true)
        }
        Err(error) => Err(fail.io(&path, &error)),
    }
}

fn write_durably(path: &Path, text: &str) -> io::Result<()> {
    write_whole(path, text.as_bytes())?;
    sync_dir(path.parent().expect("a file of the data directory stands in it"))
}

struct Fail<'a>(&'a Path);

impl Fail<'_> {
    fn dir(&self) -> String {
        self.0.display().to_string()
    }

    fn io(&self, path: &Path, error: &io::Error) -> OpenError {
        let (path, reason) = (path.display().to_string(), error.to_string());
        OpenError::Io { dir: self.dir(), path, reason }
    }

    fn key(&self, error: KeyError) -> OpenError {
        OpenError::Key { dir: self.dir(), error }
    }

    fn database(&self, reason: String) -> OpenError {
        OpenError::Database { dir: self.dir(), reason }
    }
}
