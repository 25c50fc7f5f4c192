//! An erased person is gone from the data directory, and the records of all others stay.

use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::time::Duration;

use apprentice::actors::{OrderError, TenantRegistry};
use apprentice::client::{Client, OnClash, Told};
use apprentice::ids::{StreamId, TenantId, UserId};
use apprentice::language::Outcome;
use apprentice::replay::{self, AuditReport, Scrutiny};
use apprentice::service::{Config, Data, Service};
use apprentice::store;
use apprentice::world::Stage;
use apprentice::world::household::Household;
use data_encoding::HEXLOWER;

/// Words that nobody else says and that no file of ours contains.
const CANARIES: [&str; 3] = ["zyxomma petiolatum", "quetzalwobble", "ada-of-the-erased"];

fn user(name: &str) -> UserId {
    UserId::new(name).unwrap()
}

fn serve(dir: &Path) -> Service {
    let config = Config::new(Arc::new(Household::new()), Data::Directory(dir.to_owned()));
    Service::start(config).unwrap()
}

/// An episode with the lesson that `words` means going to the sink.
fn live(client: &Client, words: &str) {
    client.start(Stage::Task { task: "place Mug SinkBasin".to_owned(), seed: 7 }).unwrap();
    client.say(words).unwrap();
    client.say("go to the sink").unwrap();
    client.done().unwrap();
    let lesson = client.status().unwrap().to_teach.remove(0);
    client.teach(lesson.seq, vec![1], OnClash::Ask).unwrap();
    client.finish_teaching().unwrap();
    client.wait_until_learned(Duration::from_secs(60)).unwrap();
    assert!(understands(client, words));
    client.done().unwrap();
}

fn understands(client: &Client, words: &str) -> bool {
    client.start(Stage::Task { task: "place Mug SinkBasin".to_owned(), seed: 8 }).unwrap();
    let told = client.say(words).unwrap().told;
    let Some(Told::Answered { answer, .. }) = told.into_iter().next() else { panic!("no answer") };
    matches!(answer.outcome, Outcome::Understood { .. })
}

fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push(path),
        }
    }
    found
}

/// The files that contain one of `needles`, byte for byte.
fn holding(dir: &Path, needles: &[Vec<u8>]) -> Vec<PathBuf> {
    let holds = |path: &PathBuf| {
        let bytes = fs::read(path).unwrap();
        needles.iter().any(|needle| bytes.windows(needle.len()).any(|part| part == needle))
    };
    files(dir).into_iter().filter(holds).collect()
}

fn audit(dir: &Path) -> AuditReport {
    let copy = store::copy_private(dir).unwrap();
    let store = copy.open().unwrap();
    let streams = replay::streams_of(&store, None).unwrap();
    let scrutiny = Scrutiny { repropose: true, retrain: true };
    replay::audit(&Arc::new(Household::new()), &store, &streams, scrutiny, 2, &())
}

fn stream_of(dir: &Path, name: &str) -> StreamId {
    let store = store::open(dir).unwrap();
    store.keys.stream_id(&TenantId::local(), &user(name)).unwrap()
}

fn key_file(dir: &Path, stream: &StreamId) -> PathBuf {
    dir.join(format!("keys/users/local/{}.key", stream.key))
}

#[test]
fn nothing_of_an_erased_person_is_left_and_everybody_else_stays() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let service = serve(dir);
    live(&service.connect(user("eve")).unwrap(), "twiddle");
    let ada = service.connect(user(CANARIES[2])).unwrap();
    live(&ada, CANARIES[0]);
    live(&ada, CANARIES[1]);
    drop(ada);
    service.stop().unwrap();
    fs::write(dir.join(store::HISTORY_FILE), CANARIES[0]).unwrap();

    let stream = stream_of(dir, CANARIES[2]);
    let wrapped = fs::read_to_string(key_file(dir, &stream)).unwrap();
    let wrapped = wrapped.lines().nth(1).unwrap().to_owned();
    let bytes = HEXLOWER.decode(wrapped.as_bytes()).unwrap();
    let mut needles: Vec<Vec<u8>> = CANARIES.iter().map(|text| text.as_bytes().to_vec()).collect();
    // The whole wrapped key, and any 16 bytes of it.
    needles.push(wrapped.clone().into_bytes());
    needles.extend(bytes.chunks_exact(16).map(<[u8]>::to_vec));
    let before = holding(dir, &needles);
    assert_eq!(before.len(), 2, "the search finds the key and the history: {before:?}");

    let service = serve(dir);
    let ada = service.connect(user(CANARIES[2])).unwrap();
    assert!(understands(&ada, CANARIES[1]), "she is awake when she is erased");
    let erased = service.erase(TenantId::local(), user(CANARIES[2])).unwrap();
    assert_eq!(erased.stream, stream.key);
    assert_eq!(holding(dir, &needles), Vec::<PathBuf>::new(), "while the service still runs");
    // The name is used again, by a new person without lessons.
    assert!(!understands(&ada, CANARIES[1]));
    ada.done().unwrap();
    let eve = service.connect(user("eve")).unwrap();
    assert!(understands(&eve, "twiddle"));
    drop((ada, eve));
    service.stop().unwrap();
    assert_eq!(holding(dir, &needles), Vec::<PathBuf>::new());

    let report = audit(dir);
    let gone = report.streams.iter().find(|found| found.stream == stream.key).unwrap();
    assert!(gone.erased && gone.user.is_none() && gone.difference.is_none(), "{gone:?}");
    assert_eq!((gone.head, gone.head_digest), (erased.last.get(), erased.head));
    let differences: Vec<_> =
        report.streams.iter().filter_map(|it| it.difference.clone()).collect();
    assert_eq!(differences, []);
    assert_eq!(report.counts.erased_streams, 1);
    assert_ne!(stream_of(dir, CANARIES[2]), stream);
}

#[test]
fn the_command_erases_in_a_closed_directory_and_says_what_it_cannot_reach() {
    let dir = tempfile::tempdir().unwrap();
    let service = serve(dir.path());
    live(&service.connect(user("ada")).unwrap(), CANARIES[0]);
    service.stop().unwrap();
    let stream = stream_of(dir.path(), "ada");
    let erase = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
        command.args(["erase", "--user", name, "--data"]).arg(dir.path()).output().unwrap()
    };
    let output = erase("ada");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && said.contains("backups"), "{said}");
    assert!(!key_file(dir.path(), &stream).exists());
    let output = erase("nobody");
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("nothing was erased"), "{said}");
    assert!(audit(dir.path()).streams.iter().all(|found| found.difference.is_none()));
}

#[test]
fn an_erasure_that_a_crash_cut_short_is_finished_at_the_next_start() {
    let dir = tempfile::tempdir().unwrap();
    let service = serve(dir.path());
    live(&service.connect(user("ada")).unwrap(), "twiddle");
    service.stop().unwrap();
    let store = store::open(dir.path()).unwrap();
    let stream = store.keys.stream_id(&TenantId::local(), &user("ada")).unwrap();
    store.keys.erase_user_key(&stream).unwrap();
    fs::write(dir.path().join(store::HISTORY_FILE), CANARIES[0]).unwrap();
    let tenant_registry = TenantRegistry::open(store).unwrap();
    assert!(!dir.path().join(store::HISTORY_FILE).exists(), "what was typed goes too");
    let registry = tenant_registry.registry(&TenantId::local());
    assert!(registry.erased().contains_key(&stream.key));
    drop(tenant_registry);
    assert!(audit(dir.path()).streams.iter().all(|found| found.difference.is_none()));
}

#[test]
fn an_erasure_that_nobody_signed_and_a_key_that_came_back_are_seen_by_an_audit() {
    let dir = tempfile::tempdir().unwrap();
    let service = serve(dir.path());
    live(&service.connect(user("ada")).unwrap(), "twiddle");
    service.stop().unwrap();
    let stream = stream_of(dir.path(), "ada");
    let key = fs::read(key_file(dir.path(), &stream)).unwrap();
    let mut tenant_registry = TenantRegistry::open(store::open(dir.path()).unwrap()).unwrap();
    let erased = tenant_registry.erase(&stream).unwrap();
    assert_eq!(tenant_registry.erase(&stream), Ok(erased), "doing it again is harmless");
    let nobody = StreamId { key: apprentice::ids::StreamKey([1; 16]), ..stream.clone() };
    assert!(matches!(tenant_registry.erase(&nobody), Err(OrderError::NobodyThere { .. })));
    drop(tenant_registry);
    // From a backup.
    fs::write(key_file(dir.path(), &stream), key).unwrap();
    fs::remove_file(key_file(dir.path(), &stream).with_extension("erased")).unwrap();
    let report = audit(dir.path());
    let found = report.streams.iter().find_map(|it| it.difference.clone()).unwrap();
    assert_eq!(found.field, "key", "{found:?}");
}

/// The program, with or without a tenant's secret in its environment.
fn program(dir: &Path, secret: Option<&str>, arguments: &[&str], typed: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_apprentice"));
    command.args(arguments).arg("--data").arg(dir);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    secret.map(|secret| command.env("APPRENTICE_TENANT_KEY_LOCAL", secret));
    let mut child = command.spawn().unwrap();
    child.stdin.take().unwrap().write_all(typed.as_bytes()).unwrap();
    child.wait_with_output().unwrap()
}

#[test]
fn with_the_secret_in_the_environment_the_directory_alone_opens_nothing() {
    let room = tempfile::tempdir().unwrap();
    let dir = room.path().join("data");
    let (secret, other) = ("5a".repeat(32), "6b".repeat(32));
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let talked = program(&dir, Some(&secret), &["--seed", "7"], "go to the sink\n");
    assert!(talked.status.success(), "{}", said(&talked));
    assert!(!dir.join("keys/local.key").exists(), "no file is made for it");
    let show = ["log", "show", "--user", "you"];
    let shown = program(&dir, Some(&secret), &show, "");
    assert!(String::from_utf8_lossy(&shown.stdout).contains("go to the sink"), "{}", said(&shown));
    for wrong in [None, Some(&*other)] {
        let refused = program(&dir, wrong, &show, "");
        assert!(!refused.status.success() && refused.stdout.is_empty(), "{wrong:?}");
        let what = match wrong {
            None => "has no key file",
            Some(_) => "APPRENTICE_TENANT_KEY_LOCAL opens no user's key",
        };
        assert!(said(&refused).contains(what), "{}", said(&refused));
    }
    fs::write(dir.join("keys/local.key"), format!("{other}\n")).unwrap();
    fs::set_permissions(dir.join("keys/local.key"), fs::Permissions::from_mode(0o600)).unwrap();
    let refused = program(&dir, Some(&secret), &show, "");
    assert!(
        said(&refused).contains("APPRENTICE_TENANT_KEY_LOCAL and another"),
        "{}",
        said(&refused)
    );
}
