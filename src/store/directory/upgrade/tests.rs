use std::fs;
use std::sync::Arc;

use super::super::layout::{Standing, standing};
use super::super::open::open_log;
use super::*;
use crate::events::{Head, Record};
use crate::limits::STORE_VALUE_BYTES_MAX;
use crate::store::caches::cache::Cache;
use crate::store::caches::origin::{CacheCounts, Found};
use crate::store::directory::copy::copy_private;
use crate::store::directory::open::open;
use crate::store::directory::store::Store;
use crate::store::disk::lock::DirLock;
use crate::store::sealing::entropy::OsEntropy;
use crate::store::testing::conformance::{batch, read_all, stream};

const MIND: &[u8] = &[7; 10_000];

/// A directory of layout 1 with two records and a kept mind of ada's, and her records.
fn former_dir() -> (tempfile::TempDir, StreamId, Vec<Record>) {
    let dir = tempfile::tempdir().unwrap();
    let store = open(dir.path()).unwrap();
    let ada = stream(&store.keys, "local", "ada");
    store.log.append(&ada, Head::EMPTY, batch(["a", "b"])).wait().unwrap();
    let records = read_all(&*store.log, &ada);
    // As 0.1 put a mind there.
    let mind =
        layout_1::SealedMind { stream: ada.key.0, digest: Digest::of(MIND).0, sealed: Vec::new() };
    let key = store.keys.user_key(&ada).unwrap();
    let sealed = key.seal(&OsEntropy, &mind.bound(), MIND);
    let prefix = [&mind.stream[..], &mind.digest].concat();
    let pieces = (0_u32..).zip(sealed.chunks(STORE_VALUE_BYTES_MAX));
    let pieces =
        pieces.map(|(number, piece)| ([&prefix[..], &number.to_be_bytes()].concat(), piece.into()));
    let pieces: Vec<(Vec<u8>, Vec<u8>)> = pieces.collect();
    assert!(pieces.len() > 1, "a mind in several pieces");
    drop(store);
    let cache = cache_of(dir.path());
    cache.replace("models/local", &prefix, pieces).unwrap();
    cache.replace("snapshots/local", b"", vec![(b"key".to_vec(), b"state".to_vec())]).unwrap();
    drop(cache);
    write_layout(dir.path(), 1).unwrap();
    (dir, ada, records)
}

fn cache_of(dir: &Path) -> SledCache {
    let lock = DirLock::of(fs::File::open(dir.join("LOCK")).unwrap()).unwrap();
    SledCache::open(&dir.join("cache"), Arc::new(lock)).unwrap()
}

fn layout_of(dir: &Path) -> String {
    fs::read_to_string(dir.join("LAYOUT")).unwrap()
}

/// What layout 1 reads of its minds.
fn former_minds(dir: &Path) -> Vec<layout_1::SealedMind> {
    layout_1::minds(cache_of(dir).scan("models/local", &[]).unwrap())
}

fn mind_of(store: &Store, ada: &StreamId) -> Found<Vec<u8>> {
    let origin = Origin { schema: Digest::of(b"minds of today"), ..Origin::UNKNOWN };
    store.models.load(ada, &origin, Digest::of(MIND), |bytes| Some(bytes.to_vec()))
}

#[test]
fn a_directory_of_layout_1_is_brought_up_with_its_records_and_minds() {
    let (dir, ada, records) = former_dir();
    for _ in 0..2 {
        let store = open(dir.path()).unwrap();
        assert_eq!(layout_of(dir.path()), "apprentice data directory, layout 2\n");
        assert_eq!(read_all(&*store.log, &ada), records);
        assert_eq!(mind_of(&store, &ada), Found::Stale(MIND.to_vec()), "nobody knows its origin");
        assert_eq!(store.models.counts(), CacheCounts { stale: 1, ..CacheCounts::default() });
    }
    assert_eq!(former_minds(dir.path()), [], "the former place is cleared");
    assert_eq!(cache_of(dir.path()).scan("snapshots/local", &[]).unwrap(), []);
}

#[test]
fn a_crash_between_copy_and_flip_leaves_the_old_layout_and_after_it_the_new() {
    for point in [Point::Copied, Point::Flipped] {
        let (dir, ada, records) = former_dir();
        let before = former_minds(dir.path());
        // A crash is everything dropped where it stands: nothing is undone and nothing finished.
        {
            let lock = fs::File::open(dir.path().join("LOCK")).unwrap();
            let lock = Arc::new(DirLock::of(lock).unwrap());
            let keys = Keys::open(&dir.path().join("keys"), Arc::new(OsEntropy)).unwrap();
            let keys = Arc::new(keys);
            let log = open_log(dir.path(), keys.clone(), false, lock.clone(), false).unwrap();
            let cache = SledCache::open(&dir.path().join("cache"), lock).unwrap();
            let former = Former { dir: dir.path(), log: &log, keys: &keys, cache: &cache };
            let crashed = bring_up(&former, 1, |reached| match reached == point {
                true => Err(OpenError::Layout { dir: "crashed".to_owned() }),
                false => Ok(()),
            });
            assert!(crashed.unwrap_err().to_string().contains("crashed"));
        }
        let number = if point == Point::Copied { 1 } else { 2 };
        assert_eq!(standing(dir.path()).unwrap(), Standing::At(number), "{point:?}");
        // What layout 1 reads is untouched, whether or not it is still what counts.
        assert_eq!(former_minds(dir.path()), before, "{point:?}");
        let store = open(dir.path()).unwrap();
        assert_eq!(read_all(&*store.log, &ada), records, "{point:?}");
        assert_eq!(mind_of(&store, &ada), Found::Stale(MIND.to_vec()), "{point:?}");
        drop(store);
        assert_eq!(standing(dir.path()).unwrap(), Standing::At(LAYOUT));
        assert_eq!(former_minds(dir.path()), [], "{point:?}: cleared by the next opening");
    }
}

#[test]
fn a_mind_that_cannot_be_copied_is_left_behind_and_nobody_is_hurt() {
    let (dir, ada, records) = former_dir();
    let cache = cache_of(dir.path());
    let mut pieces = cache.scan("models/local", &[]).unwrap();
    pieces[0].1[40] ^= 1;
    cache.replace("models/local", &[], pieces).unwrap();
    drop(cache);
    let store = open(dir.path()).unwrap();
    assert_eq!(read_all(&*store.log, &ada), records);
    assert_eq!(mind_of(&store, &ada), Found::Absent);
}

#[test]
fn a_private_copy_is_brought_up_and_its_original_is_not_touched() {
    let (dir, ada, records) = former_dir();
    let minds = former_minds(dir.path());
    let copy = copy_private(dir.path()).unwrap();
    let store = copy.open().unwrap();
    assert_eq!(read_all(&*store.log, &ada), records);
    drop(store);
    assert_eq!(layout_of(copy.dir()), "apprentice data directory, layout 2\n");
    assert_eq!(layout_of(dir.path()), "apprentice data directory, layout 1\n");
    assert_eq!(former_minds(dir.path()), minds);
}

#[test]
fn a_layout_from_the_future_is_refused_with_what_to_do_and_nothing_is_changed() {
    let (dir, ..) = former_dir();
    write_layout(dir.path(), LAYOUT + 1).unwrap();
    let refused = [open(dir.path()).err(), copy_private(dir.path()).err()];
    for error in refused {
        let error = error.unwrap().to_string();
        for part in ["has layout 3", "up to 2", "the version that wrote it", "backup"] {
            assert!(error.contains(part), "{part} is not in: {error}");
        }
    }
    assert_eq!(layout_of(dir.path()), "apprentice data directory, layout 3\n");
    assert_eq!(former_minds(dir.path()).len(), 1);
}
