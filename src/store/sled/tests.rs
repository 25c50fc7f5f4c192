use std::fs;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::*;
use crate::store::directory::error::OpenError;
use crate::store::directory::open::open;
use crate::store::directory::store::Store;
use crate::store::sealing::entropy::OsEntropy;
use crate::store::testing::conformance::{batch, read_all, stream};

/// Longer than any group takes that does not hang.
const PATIENCE: Duration = Duration::from_secs(60);

/// A log in `dir` whose `fdatasync` is `sync`.
fn log_with(
    dir: &Path,
    fresh: bool,
    sync: impl FnMut() -> io::Result<()> + Send + 'static,
) -> (SledLog, Arc<Keys>) {
    let keys = Arc::new(Keys::open(&dir.join("keys"), Arc::new(OsEntropy)).unwrap());
    let log = SledLog::open_with(dir, keys.clone(), fresh, PATIENCE, |_| Ok(Box::new(sync)));
    (log.unwrap_or_else(|error| panic!("{error:?}")), keys)
}

fn ada(store: &Store) -> StreamId {
    stream(&store.keys, "local", "ada")
}

/// Appends one record after another.
fn fill(store: &Store, stream: &StreamId, count: usize) {
    for _ in 0..count {
        let head = store.log.head(stream).unwrap();
        store.log.append(stream, head, batch(["x"])).wait().unwrap();
    }
}

fn damage(dir: &Path) -> Vec<Damage> {
    match open(dir) {
        Err(OpenError::Damaged { damage, .. }) => damage,
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the damage went unnoticed"),
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::copy(from, to).unwrap();
    }
}

#[test]
fn after_a_failed_sync_nothing_is_acknowledged_until_a_restart() {
    let dir = tempfile::tempdir().unwrap();
    let fails = Arc::new(AtomicBool::new(false));
    let sync = {
        let fails = fails.clone();
        move || match fails.load(Ordering::SeqCst) {
            true => Err(io::Error::other("no space left on device")),
            false => Ok(()),
        }
    };
    let (log, keys) = log_with(dir.path(), true, sync);
    let ada = stream(&keys, "local", "ada");
    let kept = log.append(&ada, Head::EMPTY, batch(["kept"])).wait().unwrap();
    fails.store(true, Ordering::SeqCst);
    let lost = log.append(&ada, kept.head(), batch(["in doubt"])).wait().unwrap_err();
    assert!(matches!(lost, AppendError::Poisoned { .. }), "{lost}");
    assert!(lost.to_string().contains("no space left"), "{lost}");
    // The disk works again, and still nothing is acknowledged.
    fails.store(false, Ordering::SeqCst);
    for head in [kept.head(), Head::EMPTY] {
        let refused = log.append(&ada, head, batch(["later"])).wait().unwrap_err();
        assert!(matches!(refused, AppendError::Poisoned { .. }), "{refused}");
    }
    assert_eq!(read_all(&log, &ada), kept.records());
    assert!(log.poisoned().is_some());
    drop(log);
    let (log, _) = log_with(dir.path(), false, || Ok(()));
    let found = read_all(&log, &ada);
    assert_eq!(found[..1], *kept.records());
    log.append(&ada, log.head(&ada).unwrap(), batch(["later"])).wait().unwrap();
}

#[test]
fn a_commit_that_hangs_poisons_the_log_and_keeps_nobody_waiting() {
    let dir = tempfile::tempdir().unwrap();
    let keys = Arc::new(Keys::open(&dir.path().join("keys"), Arc::new(OsEntropy)).unwrap());
    let (release, gate) = channel::<()>();
    let mut opening = true;
    let sync = move || {
        if !std::mem::take(&mut opening) {
            let _ = gate.recv();
        }
        Ok(())
    };
    let patience = Duration::from_millis(200);
    let log = SledLog::open_with(dir.path(), keys.clone(), true, patience, |_| Ok(Box::new(sync)));
    let log = log.unwrap_or_else(|error| panic!("{error:?}"));
    let ada = stream(&keys, "local", "ada");
    let hanging = log.append(&ada, Head::EMPTY, batch(["a"])).wait();
    assert!(
        matches!(&hanging, Err(AppendError::Poisoned { reason }) if reason.contains("200ms")),
        "{hanging:?}"
    );
    let later = log.append(&ada, Head::EMPTY, batch(["b"])).wait();
    assert!(matches!(later, Err(AppendError::Poisoned { .. })), "{later:?}");
    // Neither is whoever closes it.
    drop(log);
    drop(release);
}

#[test]
fn a_directory_whose_making_was_cut_short_is_made_anew() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("CREATING"), "").unwrap();
    fs::create_dir(dir.path().join("log")).unwrap();
    fs::write(dir.path().join("log/conf"), "").unwrap();
    let store = open(dir.path()).unwrap();
    fill(&store, &ada(&store), 3);
    drop(store);
    // It is not made again when the heads know of records.
    fs::write(dir.path().join("CREATING"), "").unwrap();
    let store = open(dir.path()).unwrap();
    assert_eq!(store.log.head(&ada(&store)).unwrap().seq, 3);
}

#[test]
fn a_full_queue_is_an_honest_busy() {
    let dir = tempfile::tempdir().unwrap();
    let (arrived, arrivals) = channel();
    let (release, gate) = channel::<()>();
    let mut opening = true;
    let sync = move || {
        if !std::mem::take(&mut opening) {
            arrived.send(()).unwrap();
            // Ends with the other side: then every sync goes through.
            let _ = gate.recv();
        }
        Ok(())
    };
    let (log, keys) = log_with(dir.path(), true, sync);
    let ada = stream(&keys, "local", "ada");
    let first = log.append(&ada, Head::EMPTY, batch(["first"]));
    arrivals.recv().unwrap();
    // The committer waits for the disk. Readers do not.
    assert_eq!(read_all(&log, &ada).len(), 0);
    let waiting: Vec<Pending> =
        (0..COMMIT_QUEUE_MAX).map(|_| log.append(&ada, Head::EMPTY, batch(["too late"]))).collect();
    let refused = log.append(&ada, Head::EMPTY, batch(["one too many"])).wait();
    assert_eq!(refused, Err(AppendError::Busy { waiting: COMMIT_QUEUE_MAX }));
    drop(release);
    assert_eq!(first.wait().unwrap().head().seq, 1);
    for pending in waiting {
        assert!(matches!(pending.wait(), Err(AppendError::Conflict { found: 1, .. })));
    }
}

#[test]
fn promises_are_answered_when_the_log_is_dropped() {
    let dir = tempfile::tempdir().unwrap();
    let (log, keys) = log_with(dir.path(), true, || Ok(()));
    let people: Vec<StreamId> =
        (0..50).map(|n| stream(&keys, "local", &format!("person {n}"))).collect();
    let pending: Vec<Pending> =
        people.iter().map(|who| log.append(who, Head::EMPTY, batch(["a"]))).collect();
    drop(log);
    for pending in pending {
        assert_eq!(pending.wait().unwrap().head().seq, 1);
    }
}

#[test]
fn a_group_shares_one_sync() {
    let dir = tempfile::tempdir().unwrap();
    let syncs = Arc::new(Mutex::new(0));
    let (arrived, arrivals) = channel();
    let (release, gate) = channel::<()>();
    let sync = {
        let syncs = syncs.clone();
        move || {
            *syncs.lock().unwrap() += 1;
            if *syncs.lock().unwrap() == 2 {
                arrived.send(()).unwrap();
                let _ = gate.recv();
            }
            Ok(())
        }
    };
    let (log, keys) = log_with(dir.path(), true, sync);
    let append = |n: usize| {
        let who = stream(&keys, "local", &format!("person {n}"));
        log.append(&who, Head::EMPTY, batch(["a"]))
    };
    let mut pending = vec![append(0)];
    arrivals.recv().unwrap();
    pending.extend((1..=100).map(append));
    drop(release);
    for pending in pending {
        pending.wait().unwrap();
    }
    assert_eq!(*syncs.lock().unwrap(), 3, "one at the opening, one alone, one for a hundred");
}

#[test]
fn no_value_becomes_a_file_that_sled_never_syncs() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let ada = ada(&store);
    let mut head = Head::EMPTY;
    for length in [9_000, 40_000, 300_000, 3_000_000] {
        let text = "z".repeat(length);
        for _ in 0..5 {
            let batch = batch([text.as_str(), "small"]);
            head = store.log.append(&ada, head, batch).wait().unwrap().head();
        }
    }
    let blobs = fs::read_dir(dir.path().join("log/blobs")).unwrap().count();
    assert_eq!(blobs, 0, "large values went to blob files");
}

#[test]
fn a_lost_tail_is_reported_with_stream_and_counts() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let (ada, grace) = (ada(&store), stream(&store.keys, "local", "grace"));
    fill(&store, &ada, 3);
    drop(store);
    let old = tempfile::tempdir().unwrap();
    copy(&dir.path().join("log"), old.path());
    let store = open(dir.path()).unwrap();
    fill(&store, &ada, 4);
    fill(&store, &grace, 2);
    drop(store);
    fs::remove_dir_all(dir.path().join("log")).unwrap();
    copy(old.path(), &dir.path().join("log"));
    let lost = |stream, acknowledged, found| Damage::LostTail { stream, acknowledged, found };
    assert_eq!(damage(dir.path()), [lost(ada.clone(), 7, 3), lost(grace, 2, 0)]);
    let Err(error) = open(dir.path()) else { panic!("a lost tail went unnoticed") };
    let error = error.to_string();
    for part in [&ada.to_string(), "7 records were acknowledged, but only 3", "restore it"] {
        assert!(error.contains(part), "{part:?} is not in {error:?}");
    }
}

#[test]
fn another_history_of_the_same_length_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let ada = ada(&store);
    fill(&store, &ada, 1);
    drop(store);
    let old = tempfile::tempdir().unwrap();
    copy(dir.path(), old.path());
    for path in [dir.path(), old.path()] {
        let store = open(path).unwrap();
        fill(&store, &ada, 1);
        drop(store);
    }
    copy(&old.path().join("HEADS"), &dir.path().join("HEADS"));
    let found = damage(dir.path());
    assert!(matches!(&found[..], [Damage::Record { stream, .. }] if *stream == ada), "{found:?}");
}

#[test]
fn records_beyond_the_recorded_heads_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let ada = ada(&store);
    fill(&store, &ada, 2);
    let heads = fs::read(dir.path().join("HEADS")).unwrap();
    fill(&store, &ada, 3);
    drop(store);
    // As after a crash between the sync of the log and that of the heads.
    fs::write(dir.path().join("HEADS"), heads).unwrap();
    let store = open(dir.path()).unwrap();
    assert_eq!(read_all(&*store.log, &ada).len(), 5);
    fill(&store, &ada, 1);
}

#[test]
fn a_file_that_is_let_go_a_moment_later_is_waited_for() {
    let dir = tempfile::tempdir().unwrap();
    drop(open(dir.path()).unwrap());
    let held = fs::File::open(dir.path().join("log/db")).unwrap();
    held.lock().unwrap();
    let holder = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(300));
        drop(held);
    });
    let opened = open(dir.path()).map(drop);
    holder.join().unwrap();
    opened.unwrap();
}

#[test]
fn a_missing_heads_file_or_database_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    fill(&store, &ada(&store), 1);
    drop(store);
    let (heads, aside) = (dir.path().join("HEADS"), dir.path().join("aside"));
    fs::rename(&heads, &aside).unwrap();
    assert!(matches!(&damage(dir.path())[..], [Damage::Heads { .. }]));
    fs::rename(&aside, &heads).unwrap();
    fs::remove_dir_all(dir.path().join("log")).unwrap();
    let Err(error) = open(dir.path()) else { panic!("a missing database went unnoticed") };
    assert!(error.to_string().contains("restore the directory from a backup"), "{error}");
}

#[test]
fn what_a_kill_left_of_an_unfinished_snapshot_of_the_database_keeps_nothing_shut() {
    let dir = tempfile::tempdir().unwrap();
    let made = open(dir.path()).unwrap();
    let ada = ada(&made);
    fill(&made, &ada, 3);
    drop(made);
    for (left, part) in [(&b""[..], "log"), (b"half of it", "log"), (b"half of it", "cache")] {
        let killed = tempfile::tempdir().unwrap();
        copy(dir.path(), killed.path());
        fs::remove_file(killed.path().join(format!("CLOSED-{part}"))).unwrap();
        let file = killed.path().join(part).join("snap.000000000000FFFF.generating");
        fs::write(&file, left).unwrap();
        let alone = tempfile::tempdir().unwrap();
        copy(&killed.path().join(part), alone.path());
        let by_itself = ::sled::Config::new().path(alone.path()).open();
        assert!(by_itself.is_err(), "the database has learnt it: this can go");
        let store = open(killed.path()).unwrap_or_else(|error| panic!("{part}: {error}"));
        assert_eq!(store.log.head(&ada).unwrap().seq, 3);
        assert!(!file.exists());
    }
}
