//! A data directory that the previous release wrote opens, means the same as before, and can be
//! used. The binary of 0.1 made `golden/released-0.1/data.tar.gz`: ada talked in three episodes,
//! taught twice and took one lesson back; bob, with the recipe `paper`, has something to teach. The
//! folder also has the output of that binary's `apprentice log show`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use apprentice::client::{OnClash, Phase};
use apprentice::events::{Event, Record};
use apprentice::ids::{Seq, StreamId, TenantId, UserId};
use apprentice::learning::pinned;
use apprentice::replay::{Minds, rebuild};
use apprentice::service::{Config, Data, Service};
use apprentice::store::{CacheCounts, Store, copy_private, open};
use apprentice::world::household::Household;
use apprentice_testkit::released::{golden, released};

const RELEASE: &str = "released-0.1";

fn stream(store: &Store, user: &str) -> StreamId {
    store.keys.stream_id(&TenantId::local(), &UserId::new(user).unwrap()).unwrap()
}

fn records(store: &Store, user: &str) -> Vec<Record> {
    let records = store.log.read(&stream(store, user), Seq::FIRST).unwrap();
    records.collect::<Result<_, _>>().unwrap()
}

/// Compares the rebuilt state of a directory with the pins.
fn check_sessions(store: &Store, minds: &Minds) {
    for (user, phase) in [("ada", Phase::Interacting), ("bob", Phase::Teaching)] {
        let household = Arc::new(Household::new());
        let session = rebuild(&household, store, &stream(store, user), minds).unwrap();
        let state = pinned("state", RELEASE, user);
        assert_eq!(Some(session.state_digest()), state, "the state of {user}");
        let mind = session.mind().unwrap().digest();
        assert_eq!(Some(mind), pinned("mind", RELEASE, user), "the mind of {user}");
        assert_eq!(session.phase(), phase, "{user}");
    }
}

#[test]
fn a_directory_of_the_previous_release_opens_and_rebuilds_to_what_it_was() {
    let dir = released(RELEASE, "data");
    assert_eq!(layout(dir.path()), "apprentice data directory, layout 1\n");
    let store = open(dir.path()).unwrap();
    assert_eq!(layout(dir.path()), "apprentice data directory, layout 2\n");
    let minds = Minds::default();
    check_sessions(&store, &minds);
    // Her kept mind was copied; it is not known which code made it. Bob's base mind was never kept.
    let counts = store.models.counts();
    assert_eq!(counts, CacheCounts { stale: 1, absent: 1, ..CacheCounts::default() });
    let work = minds.work();
    assert_eq!((work.trainings, work.not_reproduced, work.events_folded), (2, 0, 38 + 13));
    for record in records(&store, "ada") {
        if let Event::RetrainCompleted(event) = record.event {
            assert_eq!(event.code, None, "record {} is of version 1", record.seq);
        }
    }
    // It is upgraded once. After that everything fits.
    drop(store);
    let store = open(dir.path()).unwrap();
    let minds = Minds::default();
    check_sessions(&store, &minds);
    assert_eq!(minds.work().trainings, 0);
}

fn layout(dir: &Path) -> String {
    fs::read_to_string(dir.join("LAYOUT")).unwrap()
}

#[test]
fn its_log_reads_as_the_previous_release_read_it() {
    let dir = released(RELEASE, "data");
    for user in ["ada", "bob"] {
        let shown = Command::new(env!("CARGO_BIN_EXE_apprentice"))
            .args(["log", "show", "--user", user, "--data"])
            .arg(dir.path())
            .output()
            .unwrap();
        let expected = fs::read_to_string(golden(RELEASE, &format!("{user}.txt"))).unwrap();
        assert_eq!(String::from_utf8(shown.stdout).unwrap(), expected);
    }
    assert_eq!(
        layout(dir.path()),
        "apprentice data directory, layout 1\n",
        "reading is no upgrade"
    );
}

#[test]
fn a_private_copy_of_it_rebuilds_alike_and_leaves_it_as_it_was() {
    let dir = released(RELEASE, "data");
    let before = everything(dir.path());
    let copy = copy_private(dir.path()).unwrap();
    check_sessions(&copy.open().unwrap(), &Minds::default());
    assert_eq!(layout(copy.dir()), "apprentice data directory, layout 2\n");
    drop(copy);
    assert!(everything(dir.path()) == before, "the original was changed");
}

/// Every file below `dir` with its bytes.
fn everything(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let (mut found, mut waiting) = (Vec::new(), vec![dir.to_owned()]);
    while let Some(path) = waiting.pop() {
        match path.is_dir() {
            true => waiting.extend(fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path())),
            false => found.push((path.clone(), fs::read(&path).unwrap())),
        }
    }
    found.sort();
    found
}

#[test]
fn people_go_on_where_they_were_and_old_and_new_records_make_one_chain() {
    let dir = released(RELEASE, "data");
    let store = open(dir.path()).unwrap();
    let then = records(&store, "bob");
    drop(store);
    let data = Data::Directory(dir.path().to_owned());
    let service = Service::start(Config::new(Arc::new(Household::new()), data)).unwrap();
    let bob = service.connect(UserId::new("bob").unwrap()).unwrap();
    let wash = bob.status().unwrap().to_teach.remove(0);
    bob.teach(wash.seq, (3..=7).collect(), OnClash::Ask).unwrap();
    bob.finish_teaching().unwrap();
    bob.wait_until_learned(Duration::from_secs(120)).unwrap();
    let wakings = service.wakings();
    assert_eq!((wakings.work.rebuilds, wakings.work.events_folded), (1, then.len() as u64));
    // He uses `paper` and the service `default`, so his base mind was trained for him.
    assert_eq!((wakings.work.trainings, wakings.snapshots.absent), (1, 1));
    service.stop().unwrap();

    let store = open(dir.path()).unwrap();
    let now = records(&store, "bob");
    assert_eq!(now[..then.len()], then[..], "what was recorded is as it was");
    let Some(Event::RetrainCompleted(learned)) = now.last().map(|record| &record.event) else {
        panic!("{:?}", now.last());
    };
    assert!(learned.code.is_some());
    check_ada(&store);
}

/// A person who did not come back since has the same state.
fn check_ada(store: &Store) {
    let household = Arc::new(Household::new());
    let session = rebuild(&household, store, &stream(store, "ada"), &Minds::default()).unwrap();
    assert_eq!(Some(session.state_digest()), pinned("state", RELEASE, "ada"));
}
