//! A closed directory with one flipped bit, or a truncated file. Either what is read afterwards is
//! what was recorded, or the damage is reported. `APPRENTICE_FLIPS` gives another number, and
//! `APPRENTICE_SEED` repeats a run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use apprentice::events::{Head, Record};
use apprentice::ids::{Digest, Seq, StreamId, TenantId, UserId};
use apprentice::store::conformance::{batch, stream};
use apprentice::store::{Found, OpenError, Origin, SeededEntropy, open};
use apprentice_testkit::chance::{below, number, seed};

const BINARY: &str = env!("CARGO_BIN_EXE_apprentice");
const FLIPS: u64 = 2_000;
const TRUNCATIONS: usize = 200;
const PEOPLE: usize = 5;
/// One flip in this number is also given to the program itself, and to its salvage.
const SAMPLE: usize = 25;
/// The longest time for an answer about a few megabytes.
const PATIENCE: Duration = Duration::from_secs(120);
const MEMORY_KB_MAX: u64 = 2 * 1024 * 1024;

type Everything = BTreeMap<StreamId, Vec<Record>>;

struct Original {
    dir: tempfile::TempDir,
    files: Vec<PathBuf>,
    records: Everything,
    people: Vec<(UserId, StreamId)>,
    shown: Vec<u8>,
}

/// One way to damage a directory.
#[derive(Debug, Clone)]
struct Wound {
    file: PathBuf,
    kind: Kind,
    /// As after a crash: without the marks of an orderly end.
    crashed: bool,
}

#[derive(Debug, Clone, Copy)]
enum Kind {
    Bit { at: usize, bit: usize },
    Cut { length: usize },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    Harmless,
    Reported,
}

/// In memory if possible: thousands of copies are made, and each is synced many times.
fn room() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    match memory.is_dir() {
        true => tempfile::tempdir_in(memory).or_else(|_| tempfile::tempdir()).unwrap(),
        false => tempfile::tempdir().unwrap(),
    }
}

fn original() -> Original {
    let dir = room();
    let store = open(dir.path()).unwrap();
    let mut people = Vec::new();
    let mut heads = [Head::EMPTY; PEOPLE];
    for person in 0..PEOPLE {
        people.push((
            UserId::new(&format!("person {person}")).unwrap(),
            stream(&store.keys, "local", &format!("person {person}")),
        ));
    }
    // All people together, as in a real service: pages contain records of many.
    for record in 0..40 {
        for (person, (_, who)) in people.iter().enumerate() {
            let text = format!("{person} {record} ").repeat(if record == 20 { 2_000 } else { 20 });
            let appended = store.log.append(who, heads[person], batch([text.as_str()])).wait();
            heads[person] = appended.unwrap().head();
        }
    }
    for (_, who) in &people {
        store.models.put(who, &Origin::UNKNOWN, Digest::of(b"a mind"), b"a mind").unwrap();
    }
    drop(store);
    for mark in ["CLOSED-log", "CLOSED-cache"] {
        assert!(dir.path().join(mark).exists(), "{mark} was not left at the end");
    }
    let copy = room();
    copy_tree(dir.path(), copy.path());
    let records = read_everything(copy.path(), &people).unwrap();
    assert_eq!(records.values().map(Vec::len).sum::<usize>(), 40 * PEOPLE);
    let files = files_below(dir.path());
    let shown = show(dir.path()).stdout;
    assert!(!shown.is_empty());
    Original { dir, files, records, people, shown }
}

/// What a service would find: the records of all people, by name. Errors are sentences.
fn read_everything(
    dir: &Path,
    people: &[(UserId, StreamId)],
) -> Result<Everything, (String, Option<OpenError>)> {
    let store = open(dir).map_err(|error| (error.to_string(), Some(error)))?;
    let mut found = BTreeMap::new();
    for (name, _) in people {
        let say = |error: &dyn std::fmt::Display| (error.to_string(), None);
        let who = store.keys.stream_id(&TenantId::local(), name).map_err(|e| say(&e))?;
        let records = store.log.read(&who, Seq::FIRST).map_err(|e| say(&e))?;
        let records: Result<Vec<_>, _> = records.collect();
        let read = |bytes: &[u8]| Some(bytes.to_vec());
        let mind = store.models.load(&who, &Origin::UNKNOWN, Digest::of(b"a mind"), read);
        if let Found::Fits(mind) | Found::Stale(mind) = mind {
            assert!(mind == b"a mind", "another mind was served");
        }
        found.insert(who, records.map_err(|e| say(&e))?);
    }
    Ok(found)
}

fn show(dir: &Path) -> std::process::Output {
    let arguments = ["log", "show", "--json", "--user", "person 1", "--data"];
    Command::new(BINARY).args(arguments).arg(dir).output().unwrap()
}

impl Original {
    /// Half of the damage is in the log's database, the other half in any file, also small ones.
    fn wound(&self, dice: &SeededEntropy, cut: bool) -> Wound {
        loop {
            let file = match below(dice, 2) {
                0 => PathBuf::from("log/db"),
                _ => self.files[below(dice, self.files.len())].clone(),
            };
            let bytes = fs::read(self.dir.path().join(&file)).unwrap();
            // Zeros are mostly space that was allocated in advance.
            let used: Vec<usize> = (0..bytes.len()).filter(|&at| bytes[at] != 0).collect();
            let Some(&at) = used.get(below(dice, used.len())) else { continue };
            let kind = match cut {
                true => Kind::Cut { length: below(dice, used.last().unwrap() + 1) },
                false => Kind::Bit { at, bit: below(dice, 8) },
            };
            return Wound { file, kind, crashed: below(dice, 2) == 0 };
        }
    }

    fn hurt(&self, wound: &Wound) -> tempfile::TempDir {
        let copy = room();
        copy_tree(self.dir.path(), copy.path());
        let path = copy.path().join(&wound.file);
        let mut bytes = fs::read(&path).unwrap();
        match wound.kind {
            Kind::Bit { at, bit } => bytes[at] ^= 1 << bit,
            Kind::Cut { length } => bytes.truncate(length),
        }
        fs::write(path, bytes).unwrap();
        if wound.crashed {
            for mark in ["CLOSED-log", "CLOSED-cache"] {
                fs::remove_file(copy.path().join(mark)).unwrap();
            }
        }
        copy
    }

    fn judge(&self, wound: &Wound, sampled: bool) -> (Outcome, Option<u64>) {
        let copy = self.hurt(wound);
        let kept = sampled.then(|| {
            self.the_program_says_it_in_a_sentence(wound, copy.path());
            self.salvage_keeps_only_the_truth(wound, copy.path())
        });
        let database = copy.path().join("log");
        let before = contents(&database);
        let outcome = match read_everything(copy.path(), &self.people) {
            Ok(found) => {
                assert!(found == self.records, "{wound:?}: something else was read without a word");
                Outcome::Harmless
            }
            Err((sentence, error)) => {
                assert!(is_a_sentence(&sentence), "{wound:?}: {sentence:?}");
                if matches!(error, Some(OpenError::Database { .. } | OpenError::Damaged { .. })) {
                    assert!(sentence.contains("apprentice salvage"), "{wound:?}: {sentence}");
                    assert!(contents(&database) == before, "{wound:?}: refusing changed the log");
                }
                Outcome::Reported
            }
        };
        (outcome, kept)
    }

    fn the_program_says_it_in_a_sentence(&self, wound: &Wound, dir: &Path) {
        let output = show(dir);
        let stderr = String::from_utf8_lossy(&output.stderr);
        match output.status.code() {
            Some(0) => assert!(output.stdout == self.shown, "{wound:?}: other records are shown"),
            Some(1 | 2) => {
                assert!(stderr.starts_with("apprentice: "), "{wound:?}: {stderr}");
                assert!(is_a_sentence(stderr.trim_end()), "{wound:?}: {stderr}");
            }
            other => panic!("{wound:?}: the program ended with {other:?}: {stderr}"),
        }
    }

    /// Returns how many records were rescued.
    fn salvage_keeps_only_the_truth(&self, wound: &Wound, dir: &Path) -> u64 {
        let parent = room();
        let (out, before) = (parent.path().join("rescued"), contents(dir));
        let output = Command::new(BINARY)
            .args(["salvage", "--json", "--data"])
            .arg(dir)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        assert!(contents(dir) == before, "{wound:?}: salvage changed the directory");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(!stderr.contains("panicked"), "{wound:?}: {stderr}");
        let code = output.status.code().unwrap();
        if code == 2 {
            assert!(is_a_sentence(stderr.trim_end()), "{wound:?}: {stderr}");
            assert!(!out.exists());
            return 0;
        }
        let all: u64 = self.records.values().map(|records| records.len() as u64).sum();
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let kept = said["kept"].as_u64().unwrap();
        let nothing_lost = said["lost"].as_array().unwrap().is_empty();
        assert_eq!(nothing_lost, code == 0, "{wound:?}: {said}");
        assert!(kept == all || code == 1, "{wound:?}: {kept} of {all} and nothing lost");
        // What was salvaged is opened in the normal way, unless the keys themselves are damaged.
        match read_everything(&out, &self.people) {
            Ok(found) => {
                for (who, records) in &self.records {
                    let saved = &found[who];
                    assert!(records.starts_with(saved), "{wound:?}: {who} has another past");
                }
                assert_eq!(found.values().map(Vec::len).sum::<usize>() as u64, kept);
            }
            Err((sentence, _)) => {
                assert!(wound.file.starts_with("keys"), "{wound:?}: {sentence}");
            }
        }
        kept
    }
}

fn is_a_sentence(text: &str) -> bool {
    const INNARDS: [&str; 6] = ["panicked", "backtrace", "unwrap", "assertion", "called `", "src/"];
    !text.is_empty() && !text.contains('\n') && !INNARDS.iter().any(|word| text.contains(word))
}

/// Tests each damaged directory, on all cores. One without an answer hangs, and ends the test.
fn judge_all(original: Original, wounds: Vec<Wound>) -> BTreeMap<Outcome, usize> {
    apprentice::store::check_with(BINARY.into());
    let (original, wounds) = (Arc::new(original), Arc::new(wounds));
    let (next, started) = (Arc::new(AtomicUsize::new(0)), Instant::now());
    let (sender, receiver) = channel();
    let workers = std::thread::available_parallelism().map_or(2, usize::from);
    for _ in 0..workers {
        let (original, wounds) = (original.clone(), wounds.clone());
        let (next, sender) = (next.clone(), sender.clone());
        std::thread::spawn(move || {
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                let Some(wound) = wounds.get(number) else { return };
                let judged = original.judge(wound, number.is_multiple_of(SAMPLE));
                sender.send((number, judged)).unwrap();
            }
        });
    }
    drop(sender);
    let mut counts = BTreeMap::from([(Outcome::Harmless, 0), (Outcome::Reported, 0)]);
    let (mut answered, mut kept, mut sampled) = (vec![false; wounds.len()], 0, 0);
    for _ in 0..wounds.len() {
        let Ok((number, (outcome, rescued))) = receiver.recv_timeout(PATIENCE) else {
            let open: Vec<_> =
                answered.iter().zip(wounds.iter()).filter(|(done, _)| !**done).take(4).collect();
            panic!("no answer, or a wrong one, for one of {open:?}");
        };
        answered[number] = true;
        *counts.get_mut(&outcome).unwrap() += 1;
        if let Some(rescued) = rescued {
            kept += rescued;
            sampled += 1;
        }
    }
    let all: usize = original.records.values().map(Vec::len).sum();
    println!(
        "{} wounds in {:.1} s: {counts:?}; salvage of {sampled} kept {kept} of {} records",
        wounds.len(),
        started.elapsed().as_secs_f64(),
        sampled * all,
    );
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    if let Some(peak) = peak.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok()) {
        assert!(peak < MEMORY_KB_MAX, "{peak} kB of memory were used");
    }
    counts
}

#[test]
fn a_flipped_bit_is_harmless_or_reported_and_never_served_as_truth() {
    let flips = number("APPRENTICE_FLIPS", FLIPS) as usize;
    let dice = SeededEntropy::new(seed());
    let original = original();
    let wounds = (0..flips).map(|_| original.wound(&dice, false)).collect();
    let counts = judge_all(original, wounds);
    assert!(counts[&Outcome::Reported] > flips / 5, "hardly any flip hit anything: {counts:?}");
    assert!(counts[&Outcome::Harmless] > flips / 20, "nothing is harmless: {counts:?}");
}

#[test]
fn a_file_cut_short_is_harmless_or_reported_and_never_served_as_truth() {
    let dice = SeededEntropy::new(seed());
    let original = original();
    let wounds = (0..TRUNCATIONS).map(|_| original.wound(&dice, true)).collect();
    let counts = judge_all(original, wounds);
    assert!(counts[&Outcome::Reported] > TRUNCATIONS / 5, "{counts:?}");
}

fn contents(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    files_below(dir)
        .into_iter()
        .map(|file| (file.clone(), fs::read(dir.join(file)).unwrap()))
        .collect()
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
