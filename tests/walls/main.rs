//! No lab can reach another. The attempts use every verb, every name that could lead to the other
//! lab, every role and every trick that we know, through real sockets. Each lab has words that
//! nobody else says. They must not appear in replies, exports and errors of the other lab, nor in
//! any log line.

mod attempts;
mod labs;
mod lines;

use std::collections::BTreeMap;
use std::process::Command;

use apprentice::ids::TenantId;
use apprentice::store;

use attempts::{Attempt, attempts};
use labs::{Lab, Service, Wire};
use lines::Lines;

/// At least this many attempts, so that a list that became empty is noticed.
const ATTEMPTS_MIN: usize = 5_000;

#[test]
fn no_attempt_to_cross_brings_out_or_changes_anything_of_another_lab() {
    let lines = Lines::record();
    let dir = tempfile::tempdir().unwrap();
    let service = Service::start(dir.path());
    let mut attacker = Lab::found(&service, "atoll");
    let mut victim = Lab::found(&service, "borough");
    attacker.live(&service);
    victim.live(&service);
    let before = victim.facts(&service);

    let attempts = attempts(&attacker, &victim);
    assert!(attempts.len() >= ATTEMPTS_MIN, "{} attempts", attempts.len());
    let mut wires: BTreeMap<&str, Wire> =
        attacker.keys().map(|(name, key)| (name, service.wire(key))).collect();
    service.make_stale(&attacker, "stale", wires.get_mut("stale").unwrap());
    let (mut answered, mut denied, mut kinds) = (0, 0, BTreeMap::<String, usize>::new());
    for chunk in attempts.chunks(16) {
        for Attempt { key, frames, .. } in chunk {
            wires.get_mut(key).unwrap().send(frames);
        }
        for attempt in chunk.iter().filter(|attempt| attempt.is_answered()) {
            let reply = wires.get_mut(attempt.key).unwrap().reply_to(attempt.id.unwrap());
            assert!(!victim.is_in(&reply), "{attempt:?} brought out the other lab's words");
            answered += 1;
            denied += usize::from(contains(&reply, b"denied"));
            *kinds.entry(attempt.trick.to_owned()).or_default() += 1;
        }
    }
    println!("{} attempts, {answered} answered, {denied} denied: {kinds:?}", attempts.len());
    assert!(denied > attempts.len() / 20, "roles are asked for: {denied}");

    assert_eq!(victim.facts(&service), before, "nothing of the other lab's was changed");
    victim.still_lives();
    let counts = format!("{:?}", service.counts());
    assert!(!victim.is_in(counts.as_bytes()) && !attacker.is_in(counts.as_bytes()), "{counts}");
    drop(wires);
    service.stop();

    // Other ways by which words could leave the service.
    for (lab, other) in [(&attacker, &victim), (&victim, &attacker)] {
        let text = exported(dir.path(), &lab.name);
        assert!(lab.is_in(&text), "the search finds a lab's own words");
        assert!(!other.is_in(&text), "the export of {} holds the other's", lab.name);
    }
    let said = lines.all();
    assert!(said.contains("listening"), "the log was recorded");
    for lab in [&attacker, &victim] {
        let leaked = said.lines().find(|line| lab.is_in(line.as_bytes()));
        assert_eq!(leaked, None, "people's words in a log line");
    }
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

/// The decrypted records of one tenant, as the command writes them, and what it prints.
fn exported(dir: &std::path::Path, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("people.ndjson");
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(["export", "--ndjson", "--tenant", name, "--data"]).arg(dir);
    let output = command.arg("--out").arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read(out).unwrap();
    [text, output.stdout, output.stderr].concat()
}

#[test]
fn a_store_gives_no_tenant_the_streams_of_another() {
    let store = store::open_memory();
    let [a, b] = ["atoll", "borough"].map(|name| TenantId::new(name).unwrap());
    let user = apprentice::ids::UserId::new("ada").unwrap();
    let of = |tenant: &TenantId| store.keys.stream_id(tenant, &user).unwrap();
    assert_ne!(of(&a).key, of(&b).key, "not even under a hash");
    let moved = apprentice::ids::StreamId { tenant: a.clone(), key: of(&b).key };
    assert_eq!(store.log.head(&moved).unwrap().seq, 0);
}
