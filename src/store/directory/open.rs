use std::fs::{File, OpenOptions};
use std::path::Path;
use std::sync::Arc;

use super::checkpoints::CheckpointFeed;
use super::error::{Fail, OpenError};
use super::layout::{LAYOUT, Standing, begin, complete, standing};
use super::store::Store;
use super::upgrade::{Former, bring_up, clear_former};
use super::{check, unfinished};
use crate::ids::TenantId;
use crate::store::disk::closed::Part;
use crate::store::disk::files::make_dir;
use crate::store::disk::lock::{DirLock, LOCK_FILE};
use crate::store::log::EventLog;
use crate::store::sealing::entropy::OsEntropy;
use crate::store::sealing::keys::{KeyError, Keys};
use crate::store::sled::{SledCache, SledLog};

/// Opens the data directory `dir`, and makes it if it does not exist or is empty; one of a former
/// layout is brought up. One process may have it open at a time.
pub fn open(dir: &Path) -> Result<Store, OpenError> {
    let fail = Fail(dir);
    make_dir(dir).map_err(|error| fail.io(dir, error))?;
    // Before anything is written: what belongs to somebody else is left as it is.
    standing(dir)?;
    let lock = Arc::new(take_lock(dir)?);
    let standing = standing(dir)?;
    let fresh = standing == Standing::Fresh;
    if fresh {
        begin(dir)?;
    }
    let keys = Keys::open(&dir.join("keys"), Arc::new(OsEntropy)).map_err(|e| fail.key(e))?;
    let keys = Arc::new(keys);
    if !fresh {
        check::log_before_opening(dir)?;
        unfinished::settle_before_opening(dir)?;
        check::cache_before_opening(dir);
    }
    for part in [Part::Log, Part::Cache] {
        part.lift_mark(dir).map_err(|error| fail.io(dir, error))?;
    }
    let log = open_log(dir, keys.clone(), fresh, lock.clone(), true)?;
    check_keys(&keys, &log).map_err(|error| fail.key(error))?;
    let cache = SledCache::open(&dir.join("cache"), lock).map_err(|e| fail.database(e))?;
    match standing {
        Standing::Fresh => complete(dir)?,
        Standing::At(LAYOUT) => clear_former(&cache),
        Standing::At(from) => {
            let former = Former { dir, log: &log, keys: &keys, cache: &cache };
            bring_up(&former, from, |_| Ok(()))?;
        }
    }
    let checkpoints = CheckpointFeed::make(dir).map_err(|error| fail.io(dir, error))?;
    let checkpoints = Arc::new(checkpoints);
    let store = Store::of(Arc::new(log), Arc::new(cache), keys);
    Ok(Store { checkpoints, directory: Some(Arc::from(dir)), ..store })
}

/// Opens the log of `dir` and translates its errors.
pub(super) fn open_log(
    dir: &Path,
    keys: Arc<Keys>,
    fresh: bool,
    lock: Arc<DirLock>,
    leave_mark: bool,
) -> Result<SledLog, OpenError> {
    SledLog::open(dir, keys, fresh, lock, leave_mark).map_err(|error| Fail(dir).log(error))
}

/// Checks that every tenant with records has the secret that sealed them. The tenant of the
/// single-user default gets one before its first record.
fn check_keys(keys: &Keys, log: &SledLog) -> Result<(), KeyError> {
    let local = TenantId::local();
    let local_is_empty = log.streams(&local).is_ok_and(|streams| streams.is_empty());
    if local_is_empty {
        keys.make_tenant(&local)?;
    }
    log.tenants().iter().try_for_each(|tenant| {
        keys.check_tenant(tenant)?;
        keys.check_opens(tenant, &log.streams(tenant).unwrap_or_default())
    })
}

fn take_lock(dir: &Path) -> Result<DirLock, OpenError> {
    let path = dir.join(LOCK_FILE);
    let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
    let file = opened.map_err(|error| Fail(dir).io(&path, error))?;
    DirLock::of(file).map_err(|error| Fail(dir).lock(error))
}

/// For tools that never make a directory: locks an existing one and checks its layout.
pub(in crate::store) fn lock_existing(dir: &Path) -> Result<DirLock, OpenError> {
    let fail = Fail(dir);
    let path = dir.join(LOCK_FILE);
    let file = File::open(&path).map_err(|error| fail.io(&path, error))?;
    let lock = DirLock::of(file).map_err(|error| fail.lock(error))?;
    match standing(dir)? {
        Standing::At(_) => Ok(lock),
        Standing::Fresh => {
            let found = "nothing that was ever used".to_owned();
            Err(OpenError::NotOurs { dir: fail.dir(), found })
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::events::Head;
    use crate::ids::StreamId;
    use crate::store::directory::copy::copy_private;
    use crate::store::disk::files::write_whole;
    use crate::store::testing::conformance::{batch, read_all, stream};

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
        copy_private(dir).unwrap_err().to_string()
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
        let copy = copy_private(dir.path()).unwrap();
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
