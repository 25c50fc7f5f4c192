//! Saving people's records: salvage from a damaged directory, and moving a tenant to another
//! directory.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::sync::Arc;
use std::time::{Duration, Instant};

use apprentice::client::{OnClash, Told};
use apprentice::events::{Head, Record};
use apprentice::ids::{Seq, StreamId, TenantId, UserId};
use apprentice::language::Outcome;
use apprentice::replay::{Minds, rebuild};
use apprentice::service::{Data, Service};
use apprentice::store::conformance::{batch, read_all, stream};
use apprentice::store::{self, AppendError, ImportError, SeededEntropy, Store, open};
use apprentice::world::Stage;
use apprentice_testkit::chance::{below, seed};
use apprentice_testkit::toy::{self, Bells};
use apprentice_testkit::tree::copy_tree;

fn dice() -> SeededEntropy {
    SeededEntropy::new(seed())
}

fn program<'a>(arguments: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(arguments).env_remove("APPRENTICE_LOG");
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// The records of all people in every named tenant.
fn everything(store: &Store, tenants: &[&str]) -> BTreeMap<StreamId, Vec<Record>> {
    let tenants = tenants.iter().map(|name| TenantId::new(name).unwrap());
    let streams = tenants.flat_map(|tenant| store.log.streams(&tenant).unwrap());
    streams.map(|who| (who.clone(), read_all(&*store.log, &who))).collect()
}

/// Appends to random people. Some records are much larger than a page.
fn live(store: &Store, dice: &SeededEntropy, appends: usize) {
    for _ in 0..appends {
        let tenant = ["local", "lab"][below(dice, 2)];
        let who = stream(&store.keys, tenant, &format!("person {}", below(dice, 40)));
        let bytes = match below(dice, 60) {
            0 => 200_000 + below(dice, 300_000),
            1..5 => 3_000 + below(dice, 30_000),
            _ => below(dice, 600),
        };
        let long = "x".repeat(bytes);
        let head = store.log.head(&who).unwrap();
        match store.log.append(&who, head, batch(["a", &long, "b"])).wait() {
            Err(AppendError::Erased) => {}
            appended => drop(appended.unwrap()),
        }
    }
}

#[test]
fn salvage_finds_every_record_that_the_database_finds() {
    let (dice, parent) = (dice(), tempfile::tempdir().unwrap());
    let dir = parent.path().join("data");
    drop(open(&dir).unwrap());
    let beside = ["keys/server.curve", "checkpoints/ORIGIN", "checkpoints/lab"];
    beside.iter().for_each(|name| fs::write(dir.join(name), name).unwrap());
    // Old pages, half-filled segments, many openings: the file as it is after some time.
    for round in 0..6 {
        live(&open(&dir).unwrap(), &dice, 120);
        let out = parent.path().join(format!("rescued {round}"));
        let salvaged = store::salvage(&dir, &out).unwrap();
        assert!(salvaged.is_complete(), "{:?}", salvaged.streams);
        let expected = everything(&open(&dir).unwrap(), &["local", "lab"]);
        assert_eq!(everything(&open(&out).unwrap(), &["local", "lab"]), expected);
        for name in beside {
            assert_eq!(fs::read_to_string(out.join(name)).unwrap(), name);
        }
    }
}

#[test]
fn salvage_of_a_directory_whose_process_died_has_all_that_was_acknowledged() {
    let (dice, parent) = (dice(), tempfile::tempdir().unwrap());
    let (dir, dead) = (parent.path().join("data"), parent.path().join("dead"));
    let store = open(&dir).unwrap();
    live(&store, &dice, 200);
    let expected = everything(&store, &["local", "lab"]);
    // The files as a kill would leave them.
    copy_tree(&dir, &dead);
    drop(store);
    let salvaged = store::salvage(&dead, &parent.path().join("rescued")).unwrap();
    assert!(salvaged.is_complete(), "{:?}", salvaged.streams);
    let rescued = open(&parent.path().join("rescued")).unwrap();
    assert_eq!(everything(&rescued, &["local", "lab"]), expected);
}

#[test]
fn salvage_lists_what_was_lost_and_keeps_each_prefix() {
    let parent = tempfile::tempdir().unwrap();
    let (dir, out) = (parent.path().join("data"), parent.path().join("rescued"));
    let store = open(&dir).unwrap();
    live(&store, &SeededEntropy::new(3), 300);
    let erased = store.log.streams(&TenantId::local()).unwrap()[0].clone();
    let expected = everything(&store, &["local", "lab"]);
    store.erase(&erased).unwrap();
    drop(store);
    let beside = ["keys/server.curve", "checkpoints/lab"];
    beside.iter().for_each(|name| fs::write(dir.join(name), name).unwrap());
    let database = dir.join("log/db");
    let bytes = fs::read(&database).unwrap();
    fs::write(&database, &bytes[..bytes.len() / 2]).unwrap();
    let before = fs::read(&database).unwrap();
    let run = program(["salvage", "--data", text(&dir), "--out", text(&out)]).output().unwrap();
    assert_eq!(run.status.code(), Some(1), "{}", stderr(&run));
    let said = String::from_utf8(run.stdout).unwrap();
    assert!(said.contains("lost: stream local/") && said.contains("kept: "), "{said}");
    assert!(fs::read(&database).unwrap() == before && !dir.join("checking").exists());
    assert_eq!(beside.map(|name| out.join(name).exists()), [true, false], "held to no checkpoint");
    let rescued = open(&out).unwrap();
    let mut kept = 0;
    for (who, records) in &expected {
        if *who == erased {
            let refused = rescued.log.read(who, Seq::FIRST).err();
            assert!(refused.is_none_or(|error| error == store::ReadError::Erased));
            continue;
        }
        let found = read_all(&*rescued.log, who);
        assert!(records.starts_with(&found), "{who}");
        let lost =
            format!("lost: stream {who}: {} of {}", records.len() - found.len(), records.len());
        assert_eq!(said.contains(&lost), found.len() < records.len(), "{lost:?} in\n{said}");
        kept += found.len();
    }
    assert!(kept > 0 && kept < expected.values().map(Vec::len).sum());
    // The salvaged directory is complete and can be used.
    live(&rescued, &SeededEntropy::new(4), 20);
    drop(rescued);
    let again = program(["salvage", "--data", text(&dir), "--out", text(&out)]).output().unwrap();
    assert_eq!(again.status.code(), Some(2));
    assert!(stderr(&again).contains("not empty"), "{}", stderr(&again));
    let nothing = program(["salvage", "--data", text(&dir.join("keys")), "--out", "x"]).output();
    let nothing = nothing.unwrap();
    assert_eq!(nothing.status.code(), Some(2));
    assert!(stderr(&nothing).contains("cannot be read"), "{}", stderr(&nothing));
}

/// Kills `child` as soon as `there` exists, unless it ends before.
fn kill_once(child: &mut Child, there: &Path) {
    let started = Instant::now();
    while !there.exists() && child.try_wait().unwrap().is_none() {
        assert!(started.elapsed() < Duration::from_secs(60), "it neither begins nor ends");
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn salvage_that_was_killed_leaves_nothing_that_looks_whole_and_can_be_repeated() {
    let parent = tempfile::tempdir().unwrap();
    let (dir, out) = (parent.path().join("data"), parent.path().join("rescued"));
    let store = open(&dir).unwrap();
    live(&store, &SeededEntropy::new(5), 300);
    let expected = everything(&store, &["local", "lab"]);
    drop(store);
    let unfinished = parent.path().join("rescued.unfinished");
    let salvage = || program(["salvage", "--data", text(&dir), "--out", text(&out)]);
    for place in ["", "log/db", "LAYOUT", "keys/lab.key", "CLOSED-log"] {
        let mut child = salvage().spawn().unwrap();
        kill_once(&mut child, &unfinished.join(place));
        if out.exists() {
            // The process ended before the kill. Then the result is complete.
            assert_eq!(everything(&open(&out).unwrap(), &["local", "lab"]), expected);
            fs::remove_dir_all(&out).unwrap();
        }
    }
    let run = salvage().output().unwrap();
    assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
    assert!(!unfinished.exists());
    assert_eq!(everything(&open(&out).unwrap(), &["local", "lab"]), expected);
}

#[test]
fn a_person_who_moves_with_the_tenant_is_rebuilt_with_the_same_state_and_mind() {
    let parent = tempfile::tempdir().unwrap();
    let at = |name: &str| parent.path().join(name);
    let service = Service::start(toy::config(Data::Directory(at("data")))).unwrap();
    let robot = service.connect(UserId::new("ada").unwrap()).unwrap();
    robot.start(Stage::Task { task: "Brass".to_owned(), seed: 1 }).unwrap();
    let asked = robot.say("polish the brass bell").unwrap();
    robot.say("ring the brass bell").unwrap();
    let Some(&Told::Answered { seq, .. }) = asked.told.last() else { panic!("{asked:?}") };
    robot.teach(seq, vec![1], OnClash::Ask).unwrap();
    robot.finish_teaching().unwrap();
    robot.wait_until_learned(Duration::from_secs(60)).unwrap();
    service.stop().unwrap();

    let (data, file) = (at("data"), at("lab.apx"));
    let local = TenantId::local();
    let exported = store::export(&data, &local, &file).unwrap();
    assert_eq!(exported.people, 1);
    let key = store::key_file_of(&file);
    store::import(&at("fresh"), &file, &key).unwrap();
    // A directory that already contains another lab.
    let other = open(&at("other")).unwrap();
    let eve = stream(&other.keys, "lab", "eve");
    other.log.append(&eve, Head::EMPTY, batch(["here first"])).wait().unwrap();
    drop(other);
    store::import(&at("other"), &file, &key).unwrap();

    let rebuilt = |dir: &Path| {
        let store = open(dir).unwrap();
        let ada = store.keys.stream_id(&local, &UserId::new("ada").unwrap()).unwrap();
        let session = rebuild(&Arc::new(Bells::new()), &store, &ada, &Minds::default()).unwrap();
        let mind = session.mind().unwrap().digest();
        (session.head(), session.state().clone(), mind)
    };
    let before = rebuilt(&data);
    assert_eq!(before.1.lessons.len(), 1, "something was taught");
    assert_eq!(rebuilt(&at("fresh")), before);
    assert_eq!(rebuilt(&at("other")), before);
    assert_eq!(read_all(&*open(&at("other")).unwrap().log, &eve).len(), 1);

    // What was taught is known in the new directory.
    let service = Service::start(toy::config(Data::Directory(at("fresh")))).unwrap();
    let robot = service.connect(UserId::new("ada").unwrap()).unwrap();
    robot.start(Stage::Task { task: "Glass".to_owned(), seed: 1 }).unwrap();
    let reply = robot.say("polish the glass bell").unwrap();
    let Some(Told::Answered { answer, .. }) = reply.told.first() else { panic!("{reply:?}") };
    assert!(matches!(answer.outcome, Outcome::Understood { .. }), "{answer:?}");
    drop(robot);
    service.stop().unwrap();

    let twice = store::import(&at("fresh"), &file, &key).unwrap_err();
    assert!(matches!(twice, ImportError::Taken { .. }), "{twice}");
}

/// A data directory with two tenants, and an export of one.
fn exported(parent: &Path) -> (PathBuf, PathBuf) {
    let (dir, file) = (parent.join("data"), parent.join("lab.apx"));
    let store = open(&dir).unwrap();
    live(&store, &SeededEntropy::new(6), 150);
    let lab = TenantId::new("lab").unwrap();
    let erased = store.log.streams(&lab).unwrap()[0].clone();
    store.erase(&erased).unwrap();
    drop(store);
    store::export(&dir, &lab, &file).unwrap();
    (dir, file)
}

#[test]
fn an_export_shows_no_word_and_is_readable_by_its_owner_only() {
    use std::os::unix::fs::PermissionsExt;
    let parent = tempfile::tempdir().unwrap();
    let (dir, file) = exported(parent.path());
    let sealed = fs::read(&file).unwrap();
    assert!(!sealed.windows(9).any(|window| window == b"xxxxxxxxx"));
    for path in [&file, &store::key_file_of(&file)] {
        assert_eq!(fs::metadata(path).unwrap().permissions().mode() & 0o777, 0o600);
    }
    let opened = parent.path().join("lab.ndjson");
    let export = |out: &Path| {
        let arguments = ["export", "--ndjson", "--tenant", "lab", "--data", text(&dir), "--out"];
        program(arguments).arg(out).output().unwrap()
    };
    let run = export(&opened);
    assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
    assert!(stderr(&run).contains("left out because erased: 1 user"), "{}", stderr(&run));
    let lines = fs::read_to_string(&opened).unwrap();
    let streams = open(&dir).unwrap();
    let mut expected = 0;
    for who in streams.log.streams(&TenantId::new("lab").unwrap()).unwrap() {
        expected += streams.log.read(&who, Seq::FIRST).map_or(0, Iterator::count);
    }
    assert_eq!(lines.lines().count(), expected);
    for line in lines.lines() {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(value["stream"].as_str().unwrap().starts_with("lab/"), "{line}");
    }
    drop(streams);
    assert_eq!(export(&opened).status.code(), Some(2), "a file that is there is not replaced");
}

#[test]
fn a_damaged_export_is_refused_by_frame_number_and_nothing_is_imported() {
    let (dice, parent) = (dice(), tempfile::tempdir().unwrap());
    let (_, file) = exported(parent.path());
    let (whole, key) = (fs::read(&file).unwrap(), store::key_file_of(&file));
    let (hurt, target) = (parent.path().join("hurt.apx"), parent.path().join("target"));
    for round in 0..300 {
        let mut bytes = whole.clone();
        match round % 5 {
            0 => bytes.truncate(below(&dice, whole.len())),
            1 => bytes.push(0),
            _ => bytes[below(&dice, whole.len())] ^= 1 << below(&dice, 8),
        }
        fs::write(&hurt, bytes).unwrap();
        let error = store::import(&target, &hurt, &key).unwrap_err();
        assert!(matches!(error, ImportError::Damaged { .. }), "{error}");
        assert!(error.to_string().contains(", frame "), "{error}");
        assert!(!target.exists(), "something was made for a damaged export");
    }
    // The secret of another tenant opens nothing.
    let other = open(&parent.path().join("elsewhere")).unwrap();
    drop(other);
    let wrong = parent.path().join("elsewhere/keys/local.key");
    let error = store::import(&target, &file, &wrong).unwrap_err();
    assert!(matches!(error, ImportError::Key { .. }) && !target.exists(), "{error}");
}

#[test]
fn an_import_that_was_killed_happened_whole_or_not_at_all() {
    let parent = tempfile::tempdir().unwrap();
    let (dir, file) = exported(parent.path());
    let lab = TenantId::new("lab").unwrap();
    let target = parent.path().join("target");
    let expected: Vec<_> = {
        let store = open(&dir).unwrap();
        let streams = store.log.streams(&lab).unwrap();
        streams.iter().map(|who| (who.clone(), store.log.head(who).unwrap())).collect()
    };
    let heads = || -> Vec<_> {
        let store = open(&target).unwrap();
        let streams = store.log.streams(&lab).unwrap();
        streams.iter().map(|who| (who.clone(), store.log.head(who).unwrap())).collect()
    };
    let mut undone = 0;
    for place in ["IMPORTING", "keys/lab.key", "keys/users/lab"] {
        drop(open(&target).unwrap());
        let arguments = ["import", "--data", text(&target), "--in", text(&file)];
        let mut child = program(arguments).spawn().unwrap();
        kill_once(&mut child, &target.join(place));
        let found = heads();
        assert!(found.is_empty() || found == expected, "killed at {place}: half of it is there");
        assert!(!target.join("IMPORTING").exists());
        assert_eq!(target.join("keys/lab.key").exists(), !found.is_empty());
        undone += usize::from(found.is_empty());
        if !found.is_empty() {
            fs::remove_dir_all(&target).unwrap();
        }
    }
    println!("{undone} of 3 imports were taken back");
    if target.exists() {
        store::import(&target, &file, &store::key_file_of(&file)).unwrap();
        assert_eq!(heads(), expected);
    }
}

#[test]
fn a_check_that_may_not_take_memory_says_nothing_that_could_be_believed() {
    let parent = tempfile::tempdir().unwrap();
    let (dir, copy) = (parent.path().join("data"), parent.path().join("copy"));
    live(&open(&dir).unwrap(), &SeededEntropy::new(7), 50);
    copy_tree(&dir, &copy);
    let check = |memory: &str| {
        let parent = std::process::id().to_string();
        let arguments = ["check-copy", "--part", "log", "--memory", memory, "--parent", &parent];
        program(arguments).arg(&copy).output().unwrap()
    };
    let starved = check("30000000");
    assert!(!String::from_utf8_lossy(&starved.stdout).ends_with("end\n"), "{starved:?}");
    let fed = check("2000000000");
    assert_eq!(String::from_utf8_lossy(&fed.stdout), "end\n");
}
