//! The log after the worst: a process killed while it appends, and flipped bits on the disk.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use apprentice::events::{Head, Record};
use apprentice::ids::{Digest, Seq, StreamId, TenantId};
use apprentice::store::conformance::{batch, read_all, stream};
use apprentice::store::{Entropy, Origin, OsEntropy, SeededEntropy, Store, open};

/// Where the child process of the kill test keeps its data.
const CHILD_DIR: &str = "APPRENTICE_TEST_CHILD_DIR";
const KILLS: usize = 8;
const WRITERS: usize = 4;

/// Numbers from a seed that is printed, so that a failure can be repeated.
struct Dice(SeededEntropy);

impl Dice {
    fn new() -> Dice {
        let seed = std::env::var("APPRENTICE_TEST_SEED").ok().map(|seed| seed.parse().unwrap());
        let seed = seed.unwrap_or_else(|| {
            let mut bytes = [0; 8];
            OsEntropy.fill(&mut bytes);
            u64::from_be_bytes(bytes)
        });
        println!("seed: APPRENTICE_TEST_SEED={seed}");
        Dice(SeededEntropy::new(seed))
    }

    fn below(&self, bound: usize) -> usize {
        let mut bytes = [0; 8];
        self.0.fill(&mut bytes);
        usize::try_from(u64::from_be_bytes(bytes) % bound as u64).unwrap()
    }
}

/// The child of the kill test: appends for ever, and prints what was acknowledged.
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
    let dice = Dice::new();
    let dir = tempfile::tempdir().unwrap();
    let mut acknowledged: BTreeMap<(String, u64), String> = BTreeMap::new();
    for round in 0..KILLS {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "child_that_appends_until_it_is_killed"])
            .args(["--ignored", "--nocapture", "--test-threads=1"])
            .env(CHILD_DIR, dir.path())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut wanted = 1 + dice.below(200);
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
                // The lines that were on their way are still read: they were promises too.
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

/// What a reader finds in a store; panics if anything does not read.
fn everything(store: &Store) -> BTreeMap<StreamId, Vec<Record>> {
    let streams = store.log.streams(&TenantId::local()).unwrap();
    streams.into_iter().map(|who| (who.clone(), read_all(&*store.log, &who))).collect()
}

/// Opens a store and reads all of it. Errors are the sentences an operator would see.
fn try_everything(dir: &Path) -> Result<BTreeMap<StreamId, Vec<Record>>, String> {
    let store = open(dir).map_err(|error| error.to_string())?;
    let streams = store.log.streams(&TenantId::local()).map_err(|error| error.to_string())?;
    let mut found = BTreeMap::new();
    for who in streams {
        let records = store.log.read(&who, Seq::FIRST).map_err(|error| error.to_string())?;
        let records = records.collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())?;
        found.insert(who, records);
    }
    Ok(found)
}

#[test]
fn a_flipped_bit_is_harmless_or_reported_and_never_a_panic() {
    let dice = Dice::new();
    let flips: usize =
        std::env::var("APPRENTICE_TEST_FLIPS").map_or(48, |flips| flips.parse().unwrap());
    let original = tempfile::tempdir().unwrap();
    let store = open(original.path()).unwrap();
    for person in 0..5 {
        let who = stream(&store.keys, "local", &format!("person {person}"));
        let mut head = Head::EMPTY;
        for record in 0..60 {
            let text = format!("{person} {record} ").repeat(if record == 30 { 2_000 } else { 20 });
            head = store.log.append(&who, head, batch([text.as_str()])).wait().unwrap().head();
        }
        let digest = Digest::of(b"a mind");
        store.models.put(&who, &Origin::UNKNOWN, digest, b"a mind").unwrap();
    }
    let expected = everything(&store);
    drop(store);

    let files: Vec<PathBuf> = files_below(original.path());
    let mut counts = BTreeMap::from([("harmless", 0), ("reported", 0)]);
    for flip in 0..flips {
        let copy = tempfile::tempdir().unwrap();
        copy_tree(original.path(), copy.path());
        // Three of four hit the database, the others any file, small ones included.
        let database = PathBuf::from("log/db");
        let file = match dice.below(4) {
            0 => &files[dice.below(files.len())],
            _ => &database,
        };
        let mut bytes = fs::read(copy.path().join(file)).unwrap();
        // Zeros are mostly space that was made in advance.
        let used: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at] != 0).collect();
        let Some(&at) = used.get(dice.below(used.len().max(1))) else { continue };
        let bit = dice.below(8);
        bytes[at] ^= 1 << bit;
        fs::write(copy.path().join(file), bytes).unwrap();
        let place = format!("flip {flip}: {}, byte {at}, bit {bit}", file.display());
        let found = catch_unwind(AssertUnwindSafe(|| try_everything(copy.path())));
        let found = found.unwrap_or_else(|_| panic!("{place}: a panic reached the caller"));
        let outcome = match found {
            Ok(found) => {
                assert!(found == expected, "{place}: something else was read without a word");
                "harmless"
            }
            Err(sentence) => {
                println!("{place}: {sentence}");
                assert!(!sentence.contains('\n'), "{place}: {sentence}");
                "reported"
            }
        };
        *counts.get_mut(outcome).unwrap() += 1;
    }
    println!("{counts:?}");
    assert!(counts["reported"] > flips / 4, "hardly any flip hit anything: {counts:?}");
}

fn files_below(dir: &Path) -> Vec<PathBuf> {
    let (mut files, mut waiting) = (Vec::new(), vec![dir.to_owned()]);
    while let Some(next) = waiting.pop() {
        match next.is_dir() {
            true => waiting.extend(fs::read_dir(&next).unwrap().map(|e| e.unwrap().path())),
            false => files.push(next.strip_prefix(dir).unwrap().to_owned()),
        }
    }
    files.sort();
    files
}

fn copy_tree(from: &Path, to: &Path) {
    for file in files_below(from) {
        let target = to.join(&file);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(from.join(&file), target).unwrap();
    }
}
