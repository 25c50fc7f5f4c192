//! Every later release opens this data directory, which release 0.2 wrote. It has two labs and the
//! single user's tenant, people with every recipe that shipped, lessons, a forgotten lesson, an
//! erased person, retired and replaced keys, and closed segments. `tools/keep_directory.py`
//! recorded it with the binary of that release. `golden/released-0.2/digests.txt` has the digests
//! to which that binary replayed it.

use std::fs;
use std::sync::Arc;

use apprentice::ids::{Digest, StreamId, TenantId, UserId};
use apprentice::replay::{Minds, rebuild};
use apprentice::store::{Store, open};
use apprentice::world::household::Household;
use apprentice_testkit::ran::run;
use apprentice_testkit::released::{golden, released};

const RELEASE: &str = "released-0.2";

/// A person, and the digests to which release 0.2 replayed them.
struct Kept {
    tenant: TenantId,
    user: UserId,
    state: Digest,
    mind: Digest,
}

fn kept() -> Vec<Kept> {
    let text = fs::read_to_string(golden(RELEASE, "digests.txt")).unwrap();
    let person = |line: &str| {
        let [tenant, user, state, mind] = line.split(' ').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        Kept {
            tenant: TenantId::new(tenant).unwrap(),
            user: UserId::new(user).unwrap(),
            state: state.parse().unwrap(),
            mind: mind.parse().unwrap(),
        }
    };
    text.lines().filter(|line| !line.starts_with('#')).map(person).collect()
}

fn stream(store: &Store, kept: &Kept) -> StreamId {
    store.keys.stream_id(&kept.tenant, &kept.user).unwrap()
}

#[test]
fn every_person_of_release_0_2_wakes_as_they_were() {
    let dir = released(RELEASE, "data");
    let store = open(dir.path()).unwrap();
    let (household, minds) = (Arc::new(Household::new()), Minds::default());
    let people = kept();
    assert_eq!(people.len(), 17);
    for kept in &people {
        let session = rebuild(&household, &store, &stream(&store, kept), &minds).unwrap();
        let found = (session.state_digest(), session.mind().unwrap().digest());
        assert_eq!(found, (kept.state, kept.mind), "{} of {}", kept.user, kept.tenant);
    }
}

#[test]
fn an_audit_of_it_that_decides_and_trains_again_finds_no_differences() {
    let dir = released(RELEASE, "data");
    let path = dir.path().to_str().unwrap();
    let audit = run(&["audit", "--data", path, "--repropose", "--retrain"], "");
    assert_eq!(audit.code, Some(0), "{}{}", audit.out, audit.err);
    assert!(audit.out.ends_with("no differences\n"), "{}", audit.out);
    assert!(audit.out.contains("audited 21 streams: 604 records"), "{}", audit.out);
    assert!(audit.out.contains("(258 of them utterances): 0 differ;"), "{}", audit.out);
    assert!(audit.out.contains("s: 0 differ\n"), "{}", audit.out);
    assert!(
        audit.out.contains("1 stream of erased users: only the chain was checked"),
        "{}",
        audit.out
    );
}
