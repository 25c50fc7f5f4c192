//! The log after a process was killed while it appended. `tests/damage.rs` tests damage on the
//! disk.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use apprentice::events::Record;
use apprentice::ids::{StreamId, TenantId};
use apprentice::store::conformance::{batch, read_all, stream};
use apprentice::store::{SeededEntropy, Store, open};
use apprentice_testkit::chance::{below, seed};

/// Where the child process of the kill test keeps its data.
const CHILD_DIR: &str = "APPRENTICE_TEST_CHILD_DIR";
const KILLS: usize = 8;
const WRITERS: usize = 4;

/// The child of the kill test: appends without end, and prints what was acknowledged.
#[test]
#[ignore = "only run by nothing_acknowledged_is_lost_when_the_process_is_killed"]
fn child_that_appends_until_it_is_killed() {
    let dir = std::env::var(CHILD_DIR).expect("the kill test names the directory");
    let store = open(Path::new(&dir)).unwrap();
    std::thread::scope(|scope| {
        for writer in 0..WRITERS {
            let store = &store;
            scope.spawn(move || {
                let who = stream(&store.keys, "local", &format!("person {writer}"));
                let long = "z".repeat(30_000);
                loop {
                    let head = store.log.head(&who).unwrap();
                    let second = if head.seq.is_multiple_of(5) { long.as_str() } else { "b" };
                    let durable = store.log.append(&who, head, batch(["a", second])).wait();
                    let mut out = std::io::stdout().lock();
                    for record in durable.unwrap().records() {
                        writeln!(out, "ack {} {} {}", who.key, record.seq, record.digest).unwrap();
                    }
                    out.flush().unwrap();
                }
            });
        }
    });
}

#[test]
fn nothing_acknowledged_is_lost_when_the_process_is_killed() {
    let dice = SeededEntropy::new(seed());
    let dir = tempfile::tempdir().unwrap();
    let mut acknowledged: BTreeMap<(String, u64), String> = BTreeMap::new();
    for round in 0..KILLS {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "recovery::child_that_appends_until_it_is_killed"])
            .args(["--ignored", "--nocapture", "--test-threads=1"])
            .env(CHILD_DIR, dir.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut wanted = 1 + below(&dice, 200);
        let before = acknowledged.len();
        for line in BufReader::new(child.stdout.take().unwrap()).lines() {
            let line = line.unwrap();
            let words: Vec<&str> = line.split(' ').collect();
            if let ["ack", key, seq, digest] = words[..]
                && digest.len() == 64
            {
                acknowledged.insert((key.to_owned(), seq.parse().unwrap()), digest.to_owned());
                wanted = wanted.saturating_sub(1);
            }
            if wanted == 0 {
                // The lines that were on their way are read too: they are acknowledgements.
                child.kill().unwrap();
            }
        }
        child.wait().unwrap();
        assert!(acknowledged.len() > before, "round {round}: the child appended nothing");
        let found = everything(&open(dir.path()).unwrap());
        for ((key, seq), digest) in &acknowledged {
            let (_, records) = found.iter().find(|(who, _)| who.key.to_string() == *key).unwrap();
            let record = &records[usize::try_from(*seq).unwrap() - 1];
            assert_eq!(record.digest.to_string(), *digest, "round {round}: {key} {seq}");
        }
        let kept: usize = found.values().map(Vec::len).sum();
        println!("round {round}: {} acknowledged, {kept} found", acknowledged.len());
    }
}

/// What a reader finds in a store. Panics if anything cannot be read.
fn everything(store: &Store) -> BTreeMap<StreamId, Vec<Record>> {
    let streams = store.log.streams(&TenantId::local()).unwrap();
    streams.into_iter().map(|who| (who.clone(), read_all(&*store.log, &who))).collect()
}
