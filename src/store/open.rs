use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::Path;
use std::sync::Arc;

use super::cache::{Cache, MemoryCache};
use super::check;
use super::closed::Part;
use super::files::{make_dir, overwrite_and_remove, sync_dir, write_whole};
use super::import;
use super::layout::{self, CREATING_FILE, Former, LAYOUT, Standing, standing, write_layout};
use super::lock::DirLock;
use super::sled::{LogError, SledCache};
use super::{
    CheckpointFeed, Damage, EventLog, KeyError, Keys, MemoryLog, ModelStore, OsEntropy, SledLog,
    SnapshotStore,
};
use crate::ids::{StreamId, TenantId};

pub(super) const LOCK_FILE: &str = "LOCK";

/// Everything durable that a service needs.
#[derive(Clone)]
pub struct Store {
    pub log: Arc<dyn EventLog>,
    pub models: Arc<ModelStore>,
    pub snapshots: Arc<SnapshotStore>,
    pub keys: Arc<Keys>,
    pub checkpoints: Arc<CheckpointFeed>,
    /// Where it is kept; none in memory.
    directory: Option<Arc<Path>>,
}

/// The file in a data directory that remembers what the person at its terminal typed.
pub const HISTORY_FILE: &str = "history.txt";

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
         up to {LAYOUT}; use the version that wrote it or a newer one, or an older backup"
    )]
    Newer { dir: String, found: u32 },
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

/// Opens the data directory `dir`, and makes it if it does not exist or is empty; one of a former
/// layout is brought up. One process may have it open at a time.
pub fn open(dir: &Path) -> Result<Store, OpenError> {
    let fail = Fail(dir);
    make_dir(dir).map_err(|error| fail.io(dir, &error))?;
    // Before anything is written: what belongs to somebody else is left as it is.
    standing(dir)?;
    let lock = Arc::new(take_lock(dir)?);
    let standing = standing(dir)?;
    let fresh = standing == Standing::Fresh;
    if fresh {
        write_durably(&dir.join(CREATING_FILE), "").map_err(|e| fail.io(dir, &e))?;
    }
    let keys = Keys::open(&dir.join("keys"), Arc::new(OsEntropy)).map_err(|e| fail.key(e))?;
    let keys = Arc::new(keys);
    if !fresh {
        check::log_before_opening(dir)?;
        import::settle_before_opening(dir)?;
        check::cache_before_opening(dir);
    }
    for part in [Part::Log, Part::Cache] {
        part.lift_mark(dir).map_err(|e| fail.io(dir, &e))?;
    }
    let log = open_log(dir, keys.clone(), fresh, lock.clone(), true)?;
    let local = TenantId::local();
    let local_is_empty = log.streams(&local).is_ok_and(|streams| streams.is_empty());
    if local_is_empty {
        keys.make_tenant(&local).map_err(|error| fail.key(error))?;
    }
    log.tenants()
        .iter()
        .try_for_each(|tenant| {
            keys.check_tenant(tenant)?;
            keys.check_opens(tenant, &log.streams(tenant).unwrap_or_default())
        })
        .map_err(|e| fail.key(e))?;
    let cache =
        SledCache::open(&dir.join("cache"), lock).map_err(|reason| fail.database(reason))?;
    match standing {
        Standing::Fresh => {
            write_layout(dir, LAYOUT)?;
            let creating = dir.join(CREATING_FILE);
            fs::remove_file(&creating)
                .and_then(|()| sync_dir(dir))
                .map_err(|error| fail.io(&creating, &error))?;
        }
        Standing::At(LAYOUT) => layout::clear_former(&cache),
        Standing::At(from) => {
            let former = Former { dir, log: &log, keys: &keys, cache: &cache };
            layout::bring_up(&former, from, |_| Ok(()))?;
        }
    }
    let store = Store::of(Arc::new(log), Arc::new(cache), keys);
    let checkpoints = CheckpointFeed::make(dir).map_err(|error| fail.io(dir, &error))?;
    let checkpoints = Arc::new(checkpoints);
    Ok(Store { checkpoints, directory: Some(Arc::from(dir)), ..store })
}

/// A store that ends with the process, for tests and for embedding without a disk.
pub fn open_memory() -> Store {
    let keys = Arc::new(Keys::in_memory(Arc::new(OsEntropy)));
    let log = Arc::new(MemoryLog::new(keys.clone()));
    Store::of(log, Arc::new(MemoryCache::default()), keys)
}

impl Store {
    pub(super) fn of(log: Arc<dyn EventLog>, cache: Arc<dyn Cache>, keys: Arc<Keys>) -> Store {
        let models = Arc::new(ModelStore::new(cache.clone(), keys.clone()));
        let snapshots = Arc::new(SnapshotStore::new(cache, keys.clone()));
        let checkpoints = Arc::default();
        Store { log, models, snapshots, keys, checkpoints, directory: None }
    }

    /// The same store with another log in front.
    pub fn with_log(self, log: Arc<dyn EventLog>) -> Store {
        Store { log, ..self }
    }

    /// In memory, around another log (a [`super::FaultyLog`], a seeded one).
    pub fn around(log: Arc<dyn EventLog>, keys: Arc<Keys>) -> Store {
        Store::of(log, Arc::new(MemoryCache::default()), keys)
    }

    /// Destroys a person's key, and drops their minds, their snapshots and, in the tenant of the
    /// single-user default, what was typed at the terminal. The chains still verify. Repeating it
    /// is harmless.
    ///
    /// - errors: why the key or the typed words could not be destroyed. What is left in a cache is
    ///   noise without the key.
    pub fn erase(&self, stream: &StreamId) -> Result<(), KeyError> {
        self.keys.erase_user_key(stream)?;
        for dropped in [self.models.keep_only(stream, &[]), self.snapshots.forget(stream)] {
            if let Err(reason) = dropped {
                tracing::warn!(%stream, %reason, "the cache of an erased user, which nothing can decrypt, could not be removed");
            }
        }
        let typed = self.directory.as_ref().filter(|_| stream.tenant == TenantId::local());
        if let Some(dir) = typed {
            let path = dir.join(HISTORY_FILE);
            overwrite_and_remove(&path).and_then(|()| sync_dir(dir)).map_err(|error| {
                KeyError::Io { path: path.display().to_string(), reason: error.to_string() }
            })?;
        }
        Ok(())
    }
}

/// Opens the log of `dir` and translates its errors.
pub(super) fn open_log(
    dir: &Path,
    keys: Arc<Keys>,
    fresh: bool,
    lock: Arc<DirLock>,
    leave_mark: bool,
) -> Result<SledLog, OpenError> {
    let fail = Fail(dir);
    SledLog::open(dir, keys, fresh, lock, leave_mark).map_err(|error| match error {
        LogError::Io(error) => fail.io(&dir.join("log"), &error),
        LogError::Database(reason) => fail.database(reason),
        LogError::Damaged(damage) => OpenError::Damaged { dir: fail.dir(), damage },
    })
}

fn take_lock(dir: &Path) -> Result<DirLock, OpenError> {
    let path = dir.join(LOCK_FILE);
    let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| Fail(dir).io(&path, &error))?;
    DirLock::of(dir, file)
}

/// For tools that never make a directory: locks an existing one and checks its layout.
pub(super) fn lock_existing(dir: &Path) -> Result<DirLock, OpenError> {
    let path = dir.join(LOCK_FILE);
    let file = File::open(&path).map_err(|error| Fail(dir).io(&path, &error))?;
    let lock = DirLock::of(dir, file)?;
    match standing(dir)? {
        Standing::At(_) => Ok(lock),
        Standing::Fresh => {
            let found = "nothing that was ever used".to_owned();
            Err(OpenError::NotOurs { dir: Fail(dir).dir(), found })
        }
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

#[cfg(test)]
mod tests {
    use super::super::conformance::{batch, read_all, stream};
    use super::*;
    use crate::events::Head;

    fn refusal(dir: &Path) -> String {
        match open(dir) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{} was opened", dir.display()),
        }
    }

    /// A directory with one record of one person of tenant `local`.
    fn used() -> (tempfile::TempDir, StreamId) {
        let dir = tempfile::tempdir().unwrap();
        let store = open(dir.path()).unwrap();
        let ada = stream(&store.keys, "local", "ada");
        store.log.append(&ada, Head::EMPTY, batch(["a"])).wait().unwrap();
        (dir, ada)
    }

    #[test]
    fn a_directory_is_made_and_opened_again() {
        let parent = tempfile::tempdir().unwrap();
        let dir = parent.path().join("deep/er");
        for _ in 0..2 {
            open(&dir).unwrap();
        }
        let layout = fs::read_to_string(dir.join("LAYOUT")).unwrap();
        assert_eq!(layout, "apprentice data directory, layout 2\n");
        assert!(!dir.join("CREATING").exists());
        assert!(dir.join("keys/local.key").exists());
    }

    #[test]
    fn a_directory_in_use_is_refused_until_the_last_handle_is_gone() {
        let (dir, _) = used();
        let store = open(dir.path()).unwrap();
        let error = refusal(dir.path());
        assert!(error.contains("in use by another process"), "{error}");
        assert!(error.contains(&dir.path().display().to_string()), "{error}");
        assert!(copy_refused(dir.path()).contains("in use"));
        let log = store.log.clone();
        drop(store);
        assert!(refusal(dir.path()).contains("in use"), "the log is still open");
        drop(log);
        open(dir.path()).unwrap();
    }

    fn copy_refused(dir: &Path) -> String {
        super::super::copy_private(dir).unwrap_err().to_string()
    }

    #[test]
    fn what_is_no_data_directory_is_left_alone() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("thesis.tex"), "...").unwrap();
        assert!(refusal(dir.path()).contains("thesis.tex"));
        let file = dir.path().join("thesis.tex");
        assert!(refusal(&file).contains("cannot be used"));
        assert!(copy_refused(&file).contains("it is a file"));
        let empty = tempfile::tempdir().unwrap();
        assert!(copy_refused(dir.path()).contains("it holds other files"));
        assert!(copy_refused(&dir.path().join("no")).contains("it does not exist"));
        assert!(copy_refused(empty.path()).contains("the directory is empty"));
        assert_eq!(fs::read_dir(empty.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_layout_that_is_newer_or_damaged_is_refused() {
        let (dir, _) = used();
        for (text, part) in [
            ("apprentice data directory, layout 3\n", "the version that wrote it or a newer one"),
            ("apprentice data directory, layout 1", "is damaged"),
            ("apprentice data directory, layout 0\n", "is damaged"),
            ("\u{0}", "is damaged"),
        ] {
            fs::write(dir.path().join("LAYOUT"), text).unwrap();
            let error = refusal(dir.path());
            assert!(error.contains(part), "{error}");
        }
        fs::remove_file(dir.path().join("LAYOUT")).unwrap();
        assert!(refusal(dir.path()).contains("no file LAYOUT"));
    }

    #[test]
    fn a_directory_whose_making_was_cut_short_is_made_again() {
        let dir = tempfile::tempdir().unwrap();
        drop(open(dir.path()).unwrap());
        fs::remove_file(dir.path().join("LAYOUT")).unwrap();
        fs::write(dir.path().join("CREATING"), "").unwrap();
        drop(open(dir.path()).unwrap());
        assert!(dir.path().join("LAYOUT").exists() && !dir.path().join("CREATING").exists());
    }

    #[test]
    fn a_lost_tenant_key_is_never_replaced_by_a_new_one() {
        let (dir, _) = used();
        let path = dir.path().join("keys/local.key");
        let key = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        let error = refusal(dir.path());
        assert!(error.contains("local.key") && error.contains("backup"), "{error}");
        assert!(!path.exists());
        write_whole(&path, &key).unwrap();
        open(dir.path()).unwrap();
    }

    #[test]
    fn a_damaged_cache_is_thrown_away() {
        let (dir, ada) = used();
        fs::write(dir.path().join("cache/db"), "this is no database").unwrap();
        let store = open(dir.path()).unwrap();
        assert_eq!(read_all(&*store.log, &ada).len(), 1);
    }

    #[test]
    fn a_private_copy_shows_the_same_records_and_leaves_no_trace() {
        let (dir, ada) = used();
        let before = read_all(&*open(dir.path()).unwrap().log, &ada);
        let listing = || {
            let mut all = Vec::new();
            let mut waiting = vec![dir.path().to_owned()];
            while let Some(path) = waiting.pop() {
                match path.is_dir() {
                    true => waiting
                        .extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path())),
                    false => all.push((path.clone(), fs::read(&path).unwrap())),
                }
            }
            all.sort();
            all
        };
        let untouched = listing();
        let copy = super::super::copy_private(dir.path()).unwrap();
        let store = copy.open().unwrap();
        assert_eq!(read_all(&*store.log, &ada), before);
        let eve = StreamId { key: crate::ids::StreamKey([3; 16]), ..ada.clone() };
        let refused = store.log.append(&eve, Head::EMPTY, batch(["new here"])).wait();
        assert!(refused.is_err());
        assert_eq!(listing(), untouched);
        // The copy is no lock on the original.
        open(dir.path()).unwrap();
    }
}
